"""Fakes of both hand networks, for pictures whose colours say where each pixel lies, and of the wheel."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from rhot_node.landmarks import install
from rhot_node.landmarks.install import WheelFile
from rhot_node.landmarks.networks import HAND_PX, PALM_LANDMARKS, PALM_PX

WIDTH, HEIGHT = 640, 480
ANCHORS = np.array([((column + 0.5) / n, (row + 0.5) / n) for n, count in ((24, 2), (12, 6))
                    for row in range(n) for column in range(n) for _ in range(count)])


def gradient(width: int = WIDTH, height: int = HEIGHT) -> np.ndarray:
    """A picture (H, W, 3) BGR: green grows with x, red with y, and blue is inside."""
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    return np.stack([np.full_like(x, 255), x * 255 // width, y * 255 // height], -1).astype(np.uint8)


def hand_at(centre: Sequence[float], size: float = 60.0, turn: float = 0.0) -> np.ndarray:
    """(21, 2) px: an open hand whose middle root lies at `centre`, `size` px from its wrist; `turn` rad clockwise."""
    points = [(0.0, 1.0)]
    for finger, angle in enumerate(np.deg2rad([-50.0, -20.0, 0.0, 18.0, 36.0])):
        root = 0.6 if finger == 0 else 1.0
        points += [(root_r * np.sin(angle), 1.0 - root_r * np.cos(angle)) for root_r in root + 0.25 * np.arange(4)]
    c, s = np.cos(turn), np.sin(turn)
    return size * np.array(points) @ np.array([[c, s], [-s, c]]) + np.asarray(centre, np.float64)


class FakeNetworks:
    """Both networks. `hands`: what the picture is taken to show; `right`, `presence`: of each."""

    def __init__(self, hands: Sequence[np.ndarray] = (), size: tuple[int, int] = (WIDTH, HEIGHT)) -> None:
        self.hands, self.size = list(hands), size
        self.right, self.presence = [0.9] * 9, [0.99] * 9
        self.palm_calls = self.hand_calls = 0
        self.ghost: np.ndarray | None = None  # px by which a second palm of each hand lies beside it
        self.spoilt = False

    def _from_crop(self, crop: np.ndarray) -> np.ndarray:
        """(2, 3): px of the crop to px of the picture, by its colours."""
        y, x = np.nonzero(crop[..., 2] > 0.999)
        known = np.column_stack([x, y, np.ones(len(x))])
        where = crop[y, x][:, [1, 0]] * self.size + 0.5 * np.array(self.size) / 255.0
        return np.linalg.lstsq(known, where, rcond=None)[0].T

    def _to_crop(self, crop: np.ndarray, points: np.ndarray) -> np.ndarray:
        into = self._from_crop(crop)
        return (points - into[:, 2]) @ np.linalg.inv(into[:, :2]).T

    def palm(self, crop: np.ndarray) -> list[np.ndarray]:
        self.palm_calls += 1
        boxes, logits = np.zeros((1, 2016, 18), np.float32), np.full((1, 2016, 1), -9.0, np.float32)
        for hand in self.hands:
            for shift in (np.zeros(2), self.ghost):
                if shift is not None:
                    own = self._to_crop(crop, hand[list(PALM_LANDMARKS)] + shift)
                    low, high = own.min(axis=0), own.max(axis=0)
                    rows = np.argsort(np.linalg.norm(PALM_PX * ANCHORS - 0.5 * (low + high), axis=1))[:3]
                    for k, row in enumerate(rows):
                        anchor = PALM_PX * ANCHORS[row]
                        boxes[0, row] = np.concatenate([0.5 * (low + high) - anchor, np.full(2, (high - low).max()),
                                                        (own - anchor).ravel()])
                        logits[0, row, 0] = 4.0 - k
        return [boxes, logits]

    def hand(self, crop: np.ndarray) -> list[np.ndarray]:
        self.hand_calls += 1
        own = [self._to_crop(crop, hand) for hand in self.hands]
        off = [np.linalg.norm(points[9] - 0.5 * HAND_PX) for points in own]
        nearest = int(np.argmin(off)) if off else 0
        shown = bool(off) and off[nearest] < 0.3 * HAND_PX
        points = own[nearest] if shown else np.zeros((21, 2))
        landmarks = np.column_stack([points, np.zeros(21)]).astype(np.float32).reshape(1, 63)
        world = np.column_stack([0.001 * (points - points[9]), np.arange(21)]).astype(np.float32)
        if self.spoilt:
            landmarks[:] = np.nan
        return [landmarks, np.float32([[self.presence[nearest] if shown else 0.1]]),
                np.float32([[self.right[nearest]]]), world.reshape(1, 63)]


# -- the wheel ---------------------------------------------------------------------------------------------------------

CONTENT = {"palm_detection_full.tflite": b"palm full", "palm_detection_lite.tflite": b"palm lite",
           "hand_landmark_full.tflite": b"hand full", "hand_landmark_lite.tflite": b"hand lite",
           "LICENSE": b"Apache License"}


def place_of(name: str) -> str:
    return f"pack/{name}"


def made_up_files(monkeypatch: pytest.MonkeyPatch) -> None:
    """From now on the networks are small texts."""
    for name, data in CONTENT.items():
        monkeypatch.setitem(install.FILES, name, WheelFile(place_of(name), hashlib.sha256(data).hexdigest()))


def write_wheel(path: Path, **changes: bytes | None) -> Path:
    """A wheel; `changes` replace the content of a file by its name without the suffix, None leaves it out."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in CONTENT.items():
            content = changes.get(name.split(".")[0], data)
            if content is not None:
                archive.writestr(place_of(name), content)
    return path
