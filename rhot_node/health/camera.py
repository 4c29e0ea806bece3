"""Faults of a camera, by its pictures, their rate and its controls: black, too dark, slow, or on automatic modes.

A node's report, ``rhot-node doctor`` and the preview of a camera that is being chosen judge by the same rules.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rhot_node.capture.camera import FIRST_FRAME_S, READ_S, Camera, report_of
from rhot_node.errors import CameraError
from rhot_node.health.checks import BLACK_PICTURE, STEP_PX, Check, is_black

WINDOW_NS: Final = 2_000_000_000
"""ns over which the rate is measured."""

SHORT: Final = 0.75
"""Share of the requested rate below which a camera is reported as slow. A webcam in the dark halves its rate."""

DARK_LUMA: Final = 63.0
"""Grey level of a mean luma: two stops below 18 % grey, which automatic exposure aims at (sRGB: 118)."""

AUTOMATIC: Final = {"automatic exposure off": "exposure", "automatic white balance off": "white balance"}
"""Settings that a camera may refuse, and what it then goes on changing by itself."""

_SILENT_READS = round(FIRST_FRAME_S / READ_S)


class RateMeter:
    """The rate at which a camera delivers, by the numbers of its frames: a reader that is slow does not lower it."""

    def __init__(self) -> None:
        self._frames: deque[tuple[int, int]] = deque()

    def add(self, number: int, t_ns: int) -> None:
        """Take the `number` of a frame and its time, ns by any clock. A step back begins anew."""
        if self._frames and (number <= self._frames[-1][0] or t_ns < self._frames[-1][1]):
            self._frames.clear()
        self._frames.append((number, t_ns))
        while t_ns - self._frames[0][1] > WINDOW_NS:
            self._frames.popleft()

    @property
    def rate_hz(self) -> float | None:
        """Frames/s; None until half the window is seen."""
        frames = self._frames.copy()
        if len(frames) < 2 or frames[-1][1] - frames[0][1] < WINDOW_NS // 2:
            return None
        return 1e9 * (frames[-1][0] - frames[0][0]) / (frames[-1][1] - frames[0][1])


def brightness(luma: NDArray[np.uint8]) -> float:
    """Mean grey level of a picture (H, W)."""
    return float(np.mean(luma[::STEP_PX, ::STEP_PX]))


def check_rate(rate_hz: float | None, asked_hz: float | None, luma: float, *, exposure_us: float | None = None,
               automatic: bool | None = None) -> Check:
    """Whether a camera delivers the rate of its mode, and if not, whether the dark is why.

    The dark is why where the picture is dark, or where automatic exposure exposes longer than a frame lasts. `luma`:
    mean grey level. `exposure_us`, `automatic`: what the driver says of its exposure; None where it does not.
    """
    if rate_hz is None or not asked_hz:
        return Check("rate", "unknown", "The rate of its camera is not known.")
    if rate_hz >= SHORT * asked_hz:
        return Check("rate", "ok", f"{rate_hz:.0f} frames/s come from its camera.")
    longest_ms = 1e3 / asked_hz
    text = f"{rate_hz:.0f} frames/s come instead of {asked_hz:.0f}"
    long = exposure_us is not None and 1e-3 * exposure_us > longest_ms
    if long and automatic is False:
        return Check("slow", "warning", f"{text}: its exposure of {1e-3 * (exposure_us or 0.0):.0f} ms is longer than "
                     "a frame.", f"Set an exposure of {longest_ms:.0f} ms at most, and give more light.")
    if long or luma < DARK_LUMA:
        return Check("too_dark", "warning", f"{text}: it is too dark, and its camera exposes longer than a frame.",
                     f"Give more light, or set an exposure of {longest_ms:.0f} ms at most.")
    return Check("slow", "warning", f"{text}, although the picture is bright enough.", "Two cameras on one USB hub "
                 "halve each other's rate: give each a port of its own, or choose a smaller picture.")


def check_automatic(refused: Sequence[str]) -> Check | None:
    """A warning where automatic exposure or white balance cannot be turned off; None where both are off."""
    left = [what for setting, what in AUTOMATIC.items() if setting in refused]
    if not left:
        return None
    return Check("automatic", "warning", f"Its automatic {' and '.join(left)} cannot be turned off: times and colours "
                 "change with what is in the picture.", "Keep the light the same, and learn the colours in it; or use "
                 "a camera with manual controls.")


def camera_troubles(report: Mapping[str, Any], rate_hz: float | None, luma: float,
                    asked_hz: float | None = None) -> list[Check]:
    """What is wrong with a camera, the gravest first. `report`: what it says of itself (`Reporting`), whose `fps` is
    the rate of its mode; without one, `asked_hz`."""
    found = [check_rate(rate_hz, report.get("fps") or asked_hz, luma, exposure_us=report.get("exposure_us"),
                        automatic=report.get("automatic_exposure")), check_automatic(report.get("refused") or ())]
    return [check for check in found if check is not None and check.is_trouble]


def watch_camera(camera: Camera, asked_hz: float) -> list[Check]:
    """Read an open camera for as long as its rate takes to measure; what is wrong with it. Raises CameraError."""
    meter, first_ns, silent = RateMeter(), None, 0
    while True:
        frame = camera.read(READ_S)
        if frame is None:
            silent += 1
            if silent > _SILENT_READS:
                raise CameraError("the camera sends no pictures.")
            continue
        first_ns = frame.t_node_ns if first_ns is None else first_ns
        meter.add(frame.number, frame.t_node_ns)
        if frame.t_node_ns - first_ns >= WINDOW_NS:
            break
    black = [BLACK_PICTURE] if is_black(frame.image.y) else []
    return black or camera_troubles(report_of(camera), meter.rate_hz, brightness(frame.image.y), asked_hz)
