"""Videos as nodes write them, whose pictures say by their brightness which one they are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.image import from_i420
from rhot_node.video.avi import Stamp, append_picture, begin_video, encode_picture, finish_video

LEVELS = 40


def write_film(path: Path, node_ns: Sequence[int], width: int = 640, height: int = 480) -> None:
    """A video with a picture at each of the node's times."""
    with path.open("w+b") as file:
        begin_video(file, width, height)
        for number, t_ns in enumerate(node_ns):
            plane = np.full(width * height * 3 // 2, 128, np.uint8)
            plane[:width * height] = 30 + 5 * (number % LEVELS)
            append_picture(file, encode_picture(from_i420(plane, width, height), Stamp(number, t_ns, 4_000_000, 0)))
        finish_video(file)


def level_of(picture: NDArray[np.uint8] | None) -> int:
    """The number of a picture (H, W, 3), modulo `LEVELS`."""
    assert picture is not None
    return round((float(picture.mean()) - 30.0) / 5.0)
