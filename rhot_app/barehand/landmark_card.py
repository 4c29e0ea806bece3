"""The master's part of a model card: which joint each of a network's points shows (docs/landmarks.md)."""

from __future__ import annotations

from pathlib import Path

import msgspec

from rhot_app.errors import RigError
from rhot_app.hand.skeleton import JOINTS
from rhot_node.files import resource_path
from rhot_node.keypoints.card import load_card
from rhot_node.markers import MarkerSet, load_markers


def landmark_set(card: Path) -> MarkerSet:
    """The landmarks of a card's network as a marker set, in the order of its points.

    Raises KeypointError for what is no card, and RigError when its `anatomy` does not name a joint for each point.
    """
    read = load_card(card)
    joints = read.anatomy.get("joints")
    if not isinstance(joints, list) or len(joints) != read.points.count:
        raise RigError(f"{card}: anatomy.joints must name the joint of each of the {read.points.count} points.")
    for joint in joints:
        if joint not in JOINTS or joints.count(joint) > 1:
            what = "twice" if joint in JOINTS else "which is no joint"
            raise RigError(f"{card}: anatomy.joints names {joint!r}, {what}; joints are {', '.join(JOINTS)}.")
    shipped = load_markers(resource_path("markers", "landmarks21.json"))
    return msgspec.structs.replace(shipped, name=read.name,
                                   markers=tuple(shipped.markers[JOINTS.index(joint)] for joint in joints))
