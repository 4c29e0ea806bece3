"""A node's camera settings as libcamera's controls, with every automatic mode off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rhot_node.config import CameraSettings

Limits = Mapping[str, tuple[Any, Any, Any]]
"""Minimum, maximum and default of every control that the camera offers."""


@dataclass(frozen=True, slots=True)
class Controls:
    """`values` as picamera2's set_controls takes them; `refused`: one phrase per setting that cannot be had."""

    values: dict[str, Any]
    refused: tuple[str, ...]
    frame_ns: int


def make_controls(settings: CameraSettings, limits: Limits, libcamera: Any) -> Controls:
    """What to set on a camera with these `limits`; `libcamera` is the module, for its enumerations."""
    frame_us, refused = _frame_us(settings, limits)
    wanted: dict[str, tuple[str, Any]] = {
        "AeEnable": ("automatic exposure off", False),
        "AwbEnable": ("automatic white balance off", False),
        "NoiseReductionMode": ("noise reduction off", libcamera.controls.draft.NoiseReductionModeEnum.Off),
        "FrameDurationLimits": ("fps", (frame_us, frame_us)),
        "ExposureTime": ("exposure_us", round(settings.exposure_us)),
        "AnalogueGain": ("gain", settings.gain),
        "ColourGains": ("red_gain and blue_gain", _colour_gains(settings)),
        "Saturation": ("saturation", settings.saturation),
        "Brightness": ("brightness", settings.brightness),
        "Contrast": ("contrast", settings.contrast),
    }
    if (settings.red_gain is None) != (settings.blue_gain is None):
        refused.append("red_gain and blue_gain (a Pi camera takes both or none)")
    if settings.sync != "off":
        wanted["SyncMode"] = (f"sync {settings.sync} (this system's camera stack does not offer it)",
                              sync_mode(settings.sync, libcamera))
    values: dict[str, Any] = {}
    for control, (name, value) in wanted.items():
        if value is None:
            continue
        if control not in limits:
            refused.append(name)
            continue
        values[control] = _within(value, limits[control])
        if isinstance(value, int | float) and values[control] != value:
            refused.append(f"{name} {value:g} (set to {values[control]:g})")
    return Controls(values, tuple(refused), 1000 * frame_us)


def sync_mode(word: str, libcamera: Any) -> Any:
    """libcamera's SyncMode for "server" or "client"; its number where the binding has no names for it yet."""
    modes = getattr(getattr(libcamera.controls, "rpi", None), "SyncModeEnum", None)
    if modes is None:
        return {"server": 1, "client": 2}[word]
    return modes.Server if word == "server" else modes.Client


def _frame_us(settings: CameraSettings, limits: Limits) -> tuple[int, list[str]]:
    wanted = round(1e6 / settings.fps)
    if "FrameDurationLimits" not in limits:
        return wanted, []
    shortest, longest = limits["FrameDurationLimits"][:2]
    frame_us = int(min(max(wanted, shortest), longest))
    if frame_us == wanted:
        return frame_us, []
    return frame_us, [f"fps {settings.fps:g} (the sensor's mode gives {1e6 / frame_us:.1f})"]


def _colour_gains(settings: CameraSettings) -> tuple[float, float] | None:
    if settings.red_gain is None or settings.blue_gain is None:
        return None
    return settings.red_gain, settings.blue_gain


def _within(value: Any, limits: tuple[Any, Any, Any]) -> Any:
    """A number held within the control's limits; everything else as it is."""
    least, most, _ = limits
    if isinstance(value, bool) or not all(isinstance(item, int | float) for item in (value, least, most)):
        return value
    return min(max(value, least), most)
