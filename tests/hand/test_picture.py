"""The picture of an articulated object: every body can be seen, five fingers stand apart, nothing leaves the frame."""

from itertools import pairwise

import msgspec
import numpy as np

from rhot_app.hand.articulated import load_articulated
from rhot_app.hand.articulated_model import build_articulated
from rhot_app.hand.picture import BACKGROUND, SIZE_PX, draw
from rhot_node.files import resource_path

HAND = load_articulated(resource_path("hands", "digiteyes.json"))


def painted(image):
    return np.any(image != BACKGROUND, axis=-1)


def tops(seen):
    """How many parts begin as one goes down the picture: runs of a row with nothing above them."""
    count = 0
    for above, row in pairwise(seen):
        starts = np.flatnonzero(np.diff(row.astype(int), prepend=0) == 1)
        ends = np.flatnonzero(np.diff(row.astype(int), append=0) == -1)
        count += sum(not above[start:end + 1].any() for start, end in zip(starts, ends, strict=True))
    return count


def test_a_hand_has_five_fingers():
    seen = painted(draw(build_articulated(HAND)))[:, :SIZE_PX]
    assert not seen[[0, -1]].any()
    assert not seen[:, [0, -1]].any()
    assert tops(seen) == 5


def test_boxes_and_capsules_are_in_the_picture():
    whole = painted(draw(build_articulated(HAND))).sum()
    for name in ("palm", "little_distal"):
        frames = tuple(msgspec.structs.replace(frame, shape=None) if frame.name == name else frame
                       for frame in HAND.frames)
        root = msgspec.structs.replace(HAND.root, shape=None) if name == "palm" else HAND.root
        without = draw(build_articulated(msgspec.structs.replace(HAND, frames=frames, root=root)))
        assert painted(without).sum() < whole, name
