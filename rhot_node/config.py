"""A node's settings: one JSON file (``rhot-node``), described in docs/node.md."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import msgspec
from msgspec import Meta

from rhot_node.clock import NodeClock
from rhot_node.errors import SettingsError
from rhot_node.files import PRINTABLE, read_document, write_document
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import (
    BROADCAST_PORT,
    CONTROL_PORT,
    FAMILIES,
    PAIRING_PORT,
    PREVIEW_PORT,
    U32_MAX,
    UDP_PORT,
)

FORMAT: Final = "rhot-node"
VERSION: Final = 1

Port = Annotated[int, Meta(ge=0, le=65535)]
Pixels = Annotated[int, Meta(ge=16, le=16384, multiple_of=2)]
FPS = 0.1, 1000.0
"""frames/s that a camera or a film can have."""

Gain = Annotated[float, Meta(gt=0, le=1000)]


class CameraSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the camera is told, automatic modes off. None leaves a value as the camera has it (RHOT 7.1)."""

    width: Pixels = 640
    height: Pixels = 480
    fps: Annotated[float, Meta(ge=FPS[0], le=FPS[1])] = 30.0
    exposure_us: Annotated[float, Meta(gt=0, le=1_000_000)] = 4000.0
    gain: Gain | None = None
    saturation: float | None = None
    brightness: float | None = None
    contrast: float | None = None
    red_gain: Gain | None = None
    blue_gain: Gain | None = None
    row_time_us: Annotated[float, Meta(ge=0, le=1000)] = 0.0  # for cameras that cannot tell; 0: all rows at once
    preset: Literal["wide", "fast", "global"] | None = None  # of a Pi camera's sensor; None: the sensor's first
    timestamp_marks: Literal["readout", "exposure"] = "readout"  # what a Pi camera's SensorTimestamp is the start of
    timestamp_offset_us: Annotated[float, Meta(ge=-100_000, le=100_000)] = 0.0  # added to it, as calibrated
    sync: Literal["off", "server", "client"] = "off"  # frames of several Pis at the same time
    turned: bool = False  # by 180 degrees: the camera hangs upside down
    mirrored: bool = False  # left and right are exchanged before anything is looked for

    @property
    def exposure_ns(self) -> int:
        """Exposure time, ns."""
        return round(self.exposure_us * 1000)

    @property
    def row_time_ns(self) -> int:
        """Time from row to row, ns."""
        return round(self.row_time_us * 1000)


class TagSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Fiducial tags: whether they are sought, and those of which dictionaries of cv2.aruco.

    `rate_hz`: in at most so many frames a second; None: in as many as there is time for beside the markers.
    """

    enabled: bool = False
    dictionaries: Annotated[tuple[str, ...], Meta(min_length=1, max_length=8)] = ("DICT_APRILTAG_36h11",)
    rate_hz: Annotated[float, Meta(ge=0.1, le=1000)] | None = None

    def __post_init__(self) -> None:
        unknown = [name for name in self.dictionaries if name not in FAMILIES]
        if unknown:
            raise ValueError(f"tags.dictionaries names {unknown[0]!r}, which is no tag dictionary; there are "
                             f"{', '.join(FAMILIES)}")

    @property
    def sought(self) -> tuple[str, ...]:
        """The dictionaries whose tags are sought, none when they are not."""
        return tuple(dict.fromkeys(self.dictionaries)) if self.enabled else ()


class ClockSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How far the node's clock is off; for simulated nodes on one machine, whose clocks must disagree."""

    offset_s: Annotated[float, Meta(ge=-1e8, le=1e8)] = 0.0
    drift_ppm: Annotated[float, Meta(ge=-1000, le=1000)] = 0.0

    def clock(self, t_host_ns: int) -> NodeClock:
        """The clock whose drift begins at `t_host_ns`."""
        return NodeClock(round(self.offset_s * 1e9), self.drift_ppm, t_host_ns)


class NodeSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything a node is told. A port of 0 takes any free one."""

    node_id: Annotated[int, Meta(ge=1, le=U32_MAX)]
    name: Annotated[str, Meta(min_length=1, max_length=64, pattern=PRINTABLE)]
    markers: MarkerSet
    bind_address: str = "0.0.0.0"
    udp_port: Port = UDP_PORT
    control_port: Port = CONTROL_PORT
    preview_port: Port = PREVIEW_PORT
    broadcast_port: Annotated[int, Meta(ge=1, le=65535)] | None = BROADCAST_PORT
    detector: str = "fast"
    """Or "reference"; "landmarks" or "landmarks:lite": the hand networks beside "fast"; "keypoints:NAME", a model card;
    "plug:NAME", a detector plug-in."""
    camera: CameraSettings = CameraSettings()
    tags: TagSettings = TagSettings()
    preview_hz: Annotated[float, Meta(ge=0.01, le=30)] = 4.0
    late_frames: Literal["send", "drop"] = "send"  # frames whose processing took longer than the budget (RHOT 7.2)
    budget_ms: Annotated[float, Meta(gt=0, le=10_000)] | None = None  # None: as long as a frame lasts
    clock: ClockSettings = ClockSettings()
    pairing_port: Port = PAIRING_PORT
    trust: Literal["paired", "open"] = "paired"  # open: whoever reaches the node may do everything with it
    announce: bool = True  # by zeroconf, unless the node is bound to this machine
    format: Literal["rhot-node"] = FORMAT
    version: Literal[1] = VERSION

    def __post_init__(self) -> None:
        if not re.fullmatch(r"fast|reference|landmarks(:full|:lite)?|(plug|keypoints):[A-Za-z0-9][A-Za-z0-9_.-]{0,63}",
                            self.detector):
            raise ValueError(f"detector is {self.detector!r}; it may be \"fast\", \"reference\", \"landmarks\", "
                             "\"landmarks:lite\", \"keypoints:NAME\" with the name of a model card, or \"plug:NAME\" "
                             "with the name of a plug-in")
        used: dict[int, str] = {}
        for field in ("control_port", "preview_port", "pairing_port"):
            port = getattr(self, field)
            if port and used.setdefault(port, field) != field:
                raise ValueError(f"{used[port]} and {field} are both {port}; each needs its own")
        if self.udp_port and self.udp_port == self.broadcast_port:
            raise ValueError(f"udp_port and broadcast_port are both {self.udp_port}; each needs its own")


def network_model(detector: str) -> str | None:
    """Which hand networks a detector of the settings has beside the search for painted markers; None: none."""
    name, _, model = detector.partition(":")
    return (model or "full") if name == "landmarks" else None


RESTART_FIELDS = ("node_id", "bind_address", "udp_port", "control_port", "preview_port", "pairing_port",
                  "broadcast_port", "trust", "announce", "clock")
"""Settings that a running daemon cannot change."""


def load_settings(path: Path) -> NodeSettings:
    """Read a settings file; raises SettingsError naming file and field."""
    return read_document(path, NodeSettings, format_name=FORMAT, version=VERSION, error=SettingsError)


def save_settings(path: Path, settings: NodeSettings) -> None:
    """Write a settings file atomically; raises OSError, the old file then stays as it was."""
    write_document(path, settings)


def changed_settings(settings: NodeSettings, changes: dict[str, Any]) -> NodeSettings:
    """`settings` with `changes` laid over them: objects merge field by field, everything else is replaced.

    Raises SettingsError when the result is not valid as a whole.
    """
    merged = _merged(msgspec.to_builtins(settings), changes)
    try:
        return msgspec.convert(merged, NodeSettings)
    except msgspec.ValidationError as exc:
        raise SettingsError(f"new settings: {exc}") from exc


def needs_restart(old: NodeSettings, new: NodeSettings) -> list[str]:
    """Names of the changed settings that take effect only when the daemon starts again."""
    return [name for name in RESTART_FIELDS if getattr(old, name) != getattr(new, name)]


def _merged(old: Any, new: Any) -> Any:
    if isinstance(old, dict) and isinstance(new, dict):
        return {**old, **{key: _merged(old.get(key), value) for key, value in new.items()}}
    return new
