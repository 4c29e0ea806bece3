"""Which tracker a rig gets."""

from __future__ import annotations

from rhot_app.errors import RigError
from rhot_app.project import Rig, model_tracker_obstacle
from rhot_app.tracking.classic import ClassicTracker
from rhot_app.tracking.estimator import Estimator
from rhot_app.tracking.model_tracker import ModelTracker
from rhot_app.tracking.tracker import Tracker
from rhot_app.tracking.two_hands import TwoHands


def make_tracker(rig: Rig) -> Tracker:
    """A new tracker for `rig`. Raises RigError when the model tracker cannot work with its markers, cameras or
    nodes."""
    if rig.tracker.kind == "classic":
        return ClassicTracker(rig)
    require_estimator(rig)
    one_hand = ModelTracker if rig.tracker.kind == "model" else Estimator
    return one_hand(rig) if rig.other_hand is None else TwoHands(rig, one_hand)


def require_estimator(rig: Rig) -> None:
    """Raises RigError when neither the model tracker nor the estimator can work with the rig's cameras or nodes."""
    obstacle = model_tracker_obstacle(rig)
    if obstacle is not None:
        raise RigError(f"rig {rig.name!r}: {obstacle.why} {obstacle.remedy}")
