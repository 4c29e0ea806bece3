"""Stand-ins for what a daemon works with: a camera, a detector, a sender."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from shipped_markers import RHOT6

from rhot_node.capture.camera import EndOfRecording, Frame
from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings, save_settings
from rhot_node.detect.image import YuvImage
from rhot_node.errors import CameraError
from rhot_node.network.requests import SettingsStore
from rhot_node.network.session import Stream
from rhot_node.wire.messages import MarkerObservation, Observations

SIZE = (64, 48)
OF_ANY_PORT: dict[str, Any] = {"bind_address": "127.0.0.1", "udp_port": 0, "control_port": 0, "preview_port": 0,
                               "pairing_port": 0, "broadcast_port": None}
"""Settings of a node of this machine alone."""


def grey_image(level: int = 128) -> YuvImage:
    width, height = SIZE
    return YuvImage(np.full((height, width), level, np.uint8), np.full((height // 2, width // 2), 128, np.uint8),
                    np.full((height // 2, width // 2), 128, np.uint8))


class FakeCamera:
    """Delivers the frames of these numbers; None: nothing came; an error is raised."""

    def __init__(self, script: Iterable[int | Exception | None], clock: NodeClock, period_ns: int = 25_000_000) -> None:
        self.script: Iterator[int | Exception | None] = iter(script)
        self.clock = clock
        self.period_ns = period_ns
        self.began_ns = clock.now_ns()
        self.closed = False
        self.rewound = 0
        self.luma: np.ndarray | None = None  # of its pictures, unless they are grey

    @property
    def size(self) -> tuple[int, int]:
        return SIZE

    def read(self, timeout_s: float) -> Frame | None:
        item = next(self.script, EndOfRecording())
        if item is None:
            time.sleep(0.001)
            return None
        if isinstance(item, Exception):
            raise item
        t = self.began_ns + item * self.period_ns if self.period_ns else self.clock.now_ns()
        image = grey_image()
        if self.luma is not None:
            image = image._replace(y=self.luma)
        return Frame(image, item, min(t, self.clock.now_ns()), self.clock.now_ns(), 4_000_000, 48_000)

    def rewind(self) -> None:
        self.rewound += 1
        self.script = iter((100, 101))

    def close(self) -> None:
        self.closed = True


class FakeDetector:
    """Finds one marker in the middle."""

    def __init__(self, seconds: float = 0.0) -> None:
        self.resets = 0
        self.seconds = seconds

    def detect(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        time.sleep(self.seconds)
        width, height = image.size
        return (MarkerObservation(0, width / 2, height / 2, 10.0, 0.01, 0.0, 0.01, 1.0),)

    def reset(self) -> None:
        self.resets += 1


class FakeSender:
    """Keeps what is sent."""

    def __init__(self, works: bool = True) -> None:
        self.works = works
        self.sent: list[tuple[Observations, tuple[str, int]]] = []

    def send(self, observations: Observations, stream: Stream) -> bool:
        self.sent.append((observations, stream.address))
        return self.works


LOST_CAMERA = CameraError("the plug was pulled")


def node_settings(**changes: Any) -> NodeSettings:
    """Those of node 3, which looks for rhot6."""
    return NodeSettings(**{"node_id": 3, "name": "left", "markers": RHOT6, **changes})


def saved_settings(path: Path, **changes: Any) -> SettingsStore:
    """The settings of a running node, and their file."""
    settings = node_settings(**changes)
    save_settings(path, settings)
    return SettingsStore(path, settings)
