"""Which tracker a rig gets."""

from __future__ import annotations

from rhot_app.errors import RigError
from rhot_app.project import Rig, estimator_obstacle
from rhot_app.tracking.classic import ClassicTracker
from rhot_app.tracking.estimator import Estimator
from rhot_app.tracking.tracker import Tracker
from rhot_app.tracking.two_hands import TwoHands


def make_tracker(rig: Rig) -> Tracker:
    """A new tracker for `rig`. Raises RigError when the estimator cannot work with its markers, cameras or
    nodes."""
    if rig.tracker.kind == "classic":
        return ClassicTracker(rig)
    require_estimator(rig)
    return Estimator(rig) if rig.other_hand is None else TwoHands(rig)


def require_estimator(rig: Rig) -> None:
    """Raises RigError when the estimator cannot work with the rig's cameras or nodes."""
    obstacle = estimator_obstacle(rig)
    if obstacle is not None:
        raise RigError(f"rig {rig.name!r}: {obstacle.why} {obstacle.remedy}")
