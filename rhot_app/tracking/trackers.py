"""The trackers that a rig can have."""

from __future__ import annotations

import numpy as np

from rhot_app.errors import RigError
from rhot_app.project import Rig, estimator_obstacle, observation_obstacle
from rhot_app.tracking.classic import ClassicTracker
from rhot_app.tracking.contours.tracker import ContourEstimator
from rhot_app.tracking.contours.two_hands import TwoBareHands
from rhot_app.tracking.markers.estimator import Estimator
from rhot_app.tracking.rig_arrays import without_objects
from rhot_app.tracking.rig_objects import WithObjects
from rhot_app.tracking.smoothing import SmoothedTracker
from rhot_app.tracking.tracker import Tracker
from rhot_app.tracking.two_hands import TwoHands


def make_tracker(rig: Rig, *, smooth: bool = False) -> Tracker:
    """A new tracker for `rig` and its objects. `smooth`: one for recordings, whose states use all frames; the rig's
    tracker must be one that smooths. Raises RigError when the estimator cannot work with its markers, cameras or nodes,
    or the mesh of an object cannot be used."""
    if smooth:
        require_estimator(rig)
        return SmoothedTracker(rig)
    if rig.tracker.kind == "classic":
        own = np.arange(len(rig.markers.markers))  # it locates markers wherever they are
        tracker: Tracker = ClassicTracker(rig)
    else:
        require_estimator(rig)
        hand, own = without_objects(rig)
        if rig.tracker.contours:
            tracker = ContourEstimator(hand) if rig.other_hand is None else TwoBareHands(hand)
        else:
            tracker = Estimator(hand) if rig.other_hand is None else TwoHands(hand, Estimator)
    return WithObjects(rig, tracker, own) if rig.objects else tracker


def require_estimator(rig: Rig) -> None:
    """Raises RigError when the estimator cannot work with the rig's cameras or nodes, or lacks landmarks."""
    obstacle = estimator_obstacle(rig) or observation_obstacle(rig)
    if obstacle is not None:
        raise RigError(f"rig {rig.name!r}: {obstacle.why} {obstacle.remedy}")
