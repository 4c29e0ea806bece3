"""Which tracker a rig gets."""

from __future__ import annotations

from rhot_app.errors import RigError
from rhot_app.project import Rig
from rhot_app.tracking.classic import ClassicTracker
from rhot_app.tracking.model_tracker import ModelTracker
from rhot_app.tracking.tracker import Tracker
from rhot_app.tracking.two_hands import TwoHands


def make_tracker(rig: Rig) -> Tracker:
    """A new tracker for `rig`. Raises RigError when the model tracker cannot work with its markers, cameras or
    nodes."""
    if rig.tracker.kind == "classic":
        return ClassicTracker(rig)
    if rig.depth.mode == "disparity":
        raise RigError(f"rig {rig.name!r}: the model tracker needs calibrated cameras, but depth.mode is "
                       "\"disparity\"; calibrate lenses and poses and set it to \"stereo\", or set tracker.kind to "
                       "\"classic\".")
    text = next((node.name for node in rig.nodes if node.text_datagrams), None)
    if text is not None:
        raise RigError(f"rig {rig.name!r}: the model tracker needs the time of every picture, but node {text!r} sends "
                       "text datagrams, which carry none; run rhot-node there and take text_datagrams out, or set "
                       "tracker.kind to \"classic\".")
    return ModelTracker(rig) if rig.other_hand is None else TwoHands(rig)
