"""Films of drawn hands: black pictures, and stand-ins for the networks that find in them what a camera would see."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from rhot_app.export import landmark_track
from rhot_app.geometry.camera import CameraModel
from rhot_node.landmarks import networks
from rhot_node.landmarks.networks import DetectedHand, Region

RATE = 20.0


def video(path: Path, lens, count: int, lit_from: int | None = None) -> Path:
    """Black pictures of the lens's size; from a number on, a light is on."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), RATE, (lens.width, lens.height))
    for number in range(count):
        level = 0 if lit_from is None or number < lit_from else 120
        writer.write(np.full((lens.height, lens.width, 3), level, np.uint8))
    writer.release()
    return path


class StandIn:
    """Finds in the pictures of a camera, one after the other, what that camera would see of drawn hands (H, T, 21, 2)
    px, NaN where it sees none; `right` (H, T) or of each hand: what it says of their sides."""

    def __init__(self, hands, right, hidden: range = range(0)) -> None:
        self._hands, self._hidden, self._count = np.asarray(hands), hidden, -1
        self._right = np.broadcast_to(np.reshape(right, (len(self._hands), -1)), self._hands.shape[:2])

    def find(self, picture):
        self._count += 1
        if self._count in self._hidden:
            return ()
        return tuple(DetectedHand(landmarks, np.zeros((21, 3)), 0.9, float(right),
                                  Region(landmarks.mean(axis=0), 200.0, 0.0))
                     for landmarks, right in zip(self._hands[:, self._count], self._right[:, self._count], strict=True)
                     if np.isfinite(landmarks).all())


def seen_by(rig, joints):
    """(C, T, 21, 2) px of joints (T, 21, 3) m."""
    cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    return np.array([[camera.project(one) for one in joints] for camera in cameras])


def use_networks(monkeypatch, stand_ins) -> None:
    """From now on the networks of one film after the other are these; the command first asks whether there are any."""
    waiting = iter(stand_ins)
    monkeypatch.setattr(networks, "open_hand_networks", lambda: None)
    monkeypatch.setattr(landmark_track, "open_hand_networks", lambda: next(waiting))
