"""Sensors of Pi cameras: their modes by name, and when each image row was exposed. Pure.

Rate and row time are taken from the limits that the camera states when
it is open, because drivers have changed the pixel clock of the same mode (103 or 206 frames/s of the IMX219's 640x480).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import msgspec

from rhot_node.config import CameraSettings
from rhot_node.errors import CameraError
from rhot_node.files import read_document, resource_path


@dataclass(frozen=True, slots=True)
class Preset:
    """One mode of one sensor. `rate_hz` is the highest; `blank_rows` the fewest rows' time between two frames;
    `lens` (sensor px over the full width, horizontal view angle in degrees) of the module's own lens, None where the
    lens is bought separately."""

    name: str
    sensor: str
    size: tuple[int, int]
    rate_hz: float
    blank_rows: int
    rolling: bool
    lens: tuple[int, float] | None = None

    @property
    def title(self) -> str:
        """For messages."""
        return f"preset {self.name} ({self.sensor}, {self.size[0]} x {self.size[1]} px)"


class _Sensors(msgspec.Struct):
    """``resources/cameras/pi_sensors.json``."""

    presets: tuple[Preset, ...]


PRESETS = read_document(resource_path("cameras", "pi_sensors.json"), _Sensors, format_name="rhot-sensors", version=1,
                        error=CameraError).presets


@dataclass(frozen=True, slots=True)
class Box:
    """A part of the sensor, in its full-resolution pixels."""

    x: int
    y: int
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class Readout:
    """`row_time_ns` from image row to image row; `first_row_ns` from the sensor mode's first row to the image's;
    `view_angle_deg` of the image's width, None when the lens is unknown."""

    row_time_ns: int
    first_row_ns: int
    view_angle_deg: float | None


def choose_preset(sensor: str, wanted: str | None) -> Preset | None:
    """The preset of this name for this sensor; without a name the sensor's first, None for an unknown sensor.

    Raises CameraError when the sensor has no such preset.
    """
    own = [preset for preset in PRESETS if sensor.startswith(preset.sensor)]  # imx296_mono is an imx296
    if wanted is None:
        return own[0] if own else None
    for preset in own:
        if preset.name == wanted:
            return preset
    known = ", ".join(f'"{preset.name}"' for preset in own) or "none"
    raise CameraError(f"camera.preset is \"{wanted}\", but this camera's sensor is an {sensor}, which has: {known}. "
                      "Change preset in the node's settings, or set it to null.")


def read_out(preset: Preset | None, frame_min_us: float, limits: Box, crop: Box, size: tuple[int, int],
             row_time_ns: int) -> Readout:
    """When and where the sensor reads the rows of an image of `size` (width, height).

    `frame_min_us`: the mode's shortest frame, which has its rows and `blank_rows`; `limits`: what the mode can show;
    `crop`: what the image shows of it; `row_time_ns`: as set by hand, 0 for not.
    """
    if preset is None:
        return Readout(row_time_ns, 0, None)
    angle = None
    if preset.lens is not None:
        full_width, full_angle = preset.lens
        half = math.tan(math.radians(0.5 * full_angle)) * crop.width / full_width
        angle = 2.0 * math.degrees(math.atan(half))
    if not preset.rolling:
        return Readout(row_time_ns, 0, angle)
    mode_rows = preset.size[1]
    line_ns = 1000.0 * frame_min_us / (mode_rows + preset.blank_rows)
    scale = mode_rows / limits.height  # rows of the mode per row of the full resolution
    step = crop.height * scale / size[1]  # rows of the mode per row of the image, which is their mean
    first = (crop.y - limits.y) * scale + 0.5 * (step - 1.0)
    return Readout(row_time_ns or round(line_ns * step), round(line_ns * first), angle)


def mid_exposure_ns(timestamp_ns: int, exposure_ns: int, readout: Readout, marks: str, offset_ns: int) -> int:
    """Mid-exposure of image row 0 by a SensorTimestamp, on its clock.

    `marks` "readout": the stamp is taken when the sensor begins to send, which is when the mode's first row has been
    exposed; "exposure": when that row's exposure begins. `offset_ns` corrects what remains, as calibrated.
    """
    half = exposure_ns // 2
    return timestamp_ns + offset_ns + readout.first_row_ns + (half if marks == "exposure" else -half)


# -- libcamera controls ------------------------------------------------------------------------------------------------

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
