"""Which tracker a rig gets."""

from __future__ import annotations

from rhot_app.project import Rig
from rhot_app.tracking.classic import ClassicTracker
from rhot_app.tracking.model_tracker import ModelTracker
from rhot_app.tracking.tracker import Tracker


def make_tracker(rig: Rig) -> Tracker:
    """A new tracker for `rig`. Raises RigError when the model tracker cannot work with its markers."""
    return ModelTracker(rig) if rig.tracker.kind == "model" else ClassicTracker(rig)
