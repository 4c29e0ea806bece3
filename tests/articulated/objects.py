"""Articulated objects that ship, or are written for a test, compiled."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from bare_scenes import rig_of

from rhot_app.articulated.bodies import Bodies, bodies_of
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.articulated import load_articulated
from rhot_app.hand.articulated_model import ArticulatedModel, build_articulated
from rhot_app.tracking.kinds.templates import LayeredTrack, picture_frames
from rhot_app.tracking.scene import make_tracker
from rhot_node.files import resource_path


def object_of(what: str | dict[str, Any],
              folder: Path | None = None) -> tuple[ArticulatedModel, Bodies, tuple[str, ...]]:
    """The model, bodies and layer names of a shipped object, or of a document that is written to `folder`."""
    path = resource_path("articulated", f"{what}.json")
    if isinstance(what, dict):
        assert folder is not None
        path = folder / "object.json"
        path.write_text(json.dumps(what))
    model = build_articulated(load_articulated(path))
    return model, *bodies_of(model)


def box_on_hinge() -> tuple[ArticulatedModel, Bodies, tuple[str, ...]]:
    return object_of("hinged_box")


class Followed:
    """A scene with one articulated object, which pictures of all cameras are given."""

    def __init__(self, track: LayeredTrack, cameras: Sequence[CameraModel]) -> None:
        self.track, self.rig = track, rig_of(list(cameras))
        self.scene = make_tracker(self.rig, articulated=[track])

    def start(self, known: tuple[np.ndarray, np.ndarray], images: Sequence[np.ndarray]) -> None:
        """Begin in a state with its covariance at time 0."""
        self.track.start(*known, 0)
        self.see(images, 0)

    def see(self, images: Sequence[np.ndarray], t_ns: int) -> np.ndarray | None:
        """The object's state after pictures of one instant, None where it is lost."""
        for frame in picture_frames(self.rig, images, [t_ns] * len(images)):
            self.scene.ingest(frame)
        found = self.track.estimate()
        return None if found is None else found[1].state
