"""A hand for the wizards' tests: a listener that hears made-up states, and a client that writes made-up logs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from fake_engine import FakeEngine
from wizard_rig import FakeRigClient

from rhot_app.state import HandState


class HeldMarker:
    """States of one marker held still at `distance_m` (None: out of sight), 75 mm between parallel cameras."""

    def __init__(self, engine: FakeEngine, marker: int = 0, noise_px: float = 0.05) -> None:
        self.engine = engine
        self.marker = marker
        self.noise_px = noise_px
        self.distance_m: float | None = 0.3
        self._random = np.random.default_rng(11)

    def connect(self) -> HeldMarker:
        return self

    def close(self) -> None:
        """Nothing to close."""

    def poll(self) -> list[HandState]:
        state = self.engine.state(self.engine.clock())
        pixels = np.full_like(state.camera_pixels, np.nan)
        if self.distance_m is not None:
            lens = self.engine.rig.nodes[0].intrinsics
            half = 0.5 * 0.075 * lens.fx / self.distance_m
            noise = self.noise_px * self._random.standard_normal(2)
            pixels[:, self.marker, 0] = lens.cx + np.array([half, -half]) + noise
            pixels[:, self.marker, 1] = lens.cy
        return [replace(state, camera_pixels=pixels)]


class RecordingClient(FakeRigClient):
    """Also answers `record` and `record_stop`: `write(path)` makes the log."""

    def __init__(self, *args: object, write: Callable[[str], None], **options: object) -> None:
        super().__init__(*args, **options)  # type: ignore[arg-type]
        self.write = write
        self.recording = ""

    def command(self, name, *, timeout_s=3.0, **arguments):
        answer = super().command(name, timeout_s=timeout_s, **arguments)
        if name == "hello":
            return {"running": "start" in self.commands}
        if name == "record":
            self.recording = arguments["path"]
        elif name == "record_stop" and self.recording:
            self.write(self.recording)
            self.recording = ""
        return answer
