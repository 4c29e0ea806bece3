"""The twin's scene: cameras, hand, markers, light and clocks. Defaults in resources/twin/defaults.json (docs/twin.md).

Rig frame: the left camera. Scene time 0 is the start of a recording or of a live run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from rhot_app.errors import RigError, SimulatorError
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import HandAnatomy, load_hand
from rhot_app.project import CameraCalibration, CameraPose, Intrinsics, Rig, RigNode, RigObject
from rhot_app.simulator.render.camera_controls import Controls, Lamp
from rhot_app.sources.local_nodes import NodePorts
from rhot_node.config import CameraSettings, ClockSettings, NodeSettings
from rhot_node.errors import SettingsError
from rhot_node.files import read_document, resource_path
from rhot_node.markers import MarkerSet, load_markers

FORMAT: Final = "rhot-twin"
VERSION: Final = 1

Positive = Annotated[float, Meta(gt=0)]
NotNegative = Annotated[float, Meta(ge=0)]
Level = Annotated[int, Meta(ge=0, le=255)]
Background = Literal["cloth", "clutter", "skin"]


class Preset(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A way to run the camera: image size, field of view, rate and readout."""

    description: str
    width: Annotated[int, Meta(ge=16, le=4096, multiple_of=2)]
    height: Annotated[int, Meta(ge=16, le=4096, multiple_of=2)]
    horizontal_fov_deg: Annotated[float, Meta(gt=1, lt=170)]
    fps: Annotated[float, Meta(ge=0.1, le=1000)]
    row_time_us: NotNegative


class TwinSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything about the simulated rig that is not the motion. Noise: sigma of a colour channel, grey levels.

    `facing`: the side of the hand towards the cameras. `worn_paint`: share of the paint that has come off;
    `uneven_paint`: share by which its brightness varies. `glove_rgb`: colour of the hand's skin in a glove.
    """

    preset: str
    presets: dict[str, Preset]
    exposure_ms: Positive
    psf_sigma_px: Positive
    noise_mid_grey: NotNegative
    noise_read: NotNegative
    distortion: tuple[float, float, float, float, float]
    baseline_mm: Positive
    distance_m: Annotated[float, Meta(ge=0.15, le=5.0)]
    shading: Annotated[float, Meta(ge=0, le=1)]
    background: Background
    clock_offset_hours: NotNegative
    clock_drift_ppm: Annotated[float, Meta(ge=0, le=1000)]
    hand: str
    markers: str
    facing: Literal["palm", "back"] = "palm"
    worn_paint: Annotated[float, Meta(ge=0, le=0.9)] = 0.0
    uneven_paint: Annotated[float, Meta(ge=0, le=0.9)] = 0.0
    glove_rgb: tuple[Level, Level, Level] | None = None
    lamp: Lamp = Lamp()
    controls: Controls = Controls()
    format: Literal["rhot-twin"] = FORMAT
    version: Literal[1] = VERSION

    def __post_init__(self) -> None:
        if self.preset not in self.presets:
            raise ValueError(f"preset {self.preset!r} is none of {', '.join(sorted(self.presets))}")


def twin_defaults() -> TwinSettings:
    """The documented defaults."""
    return read_document(resource_path("twin", "defaults.json"), TwinSettings, format_name=FORMAT, version=VERSION,
                         error=RigError)


@dataclass(frozen=True, slots=True)
class TwinClock:
    """How one simulated node's clock disagrees with the master's. Ahead only: a monotonic clock is never negative."""

    offset_s: float
    drift_ppm: float


@dataclass(frozen=True)
class Scene:
    """One simulated rig, everything random in it drawn from `seed`.

    `phases_s` (C,): scene time of each camera's first mid-exposure of row 0; the cameras are not synchronised.
    """

    settings: TwinSettings
    hand: HandAnatomy
    markers: MarkerSet
    names: tuple[str, ...]
    intrinsics: Intrinsics
    poses: tuple[CameraPose, ...]
    phases_s: tuple[float, ...]
    clocks: tuple[TwinClock, ...]
    seed: int

    @property
    def preset(self) -> Preset:
        """How the cameras run."""
        return self.settings.presets[self.settings.preset]

    @property
    def exposure_ns(self) -> int:
        """Exposure of every frame, ns."""
        return round(1e6 * self.settings.exposure_ms)

    @property
    def row_time_ns(self) -> int:
        """Time from row to row, ns."""
        return round(1e3 * self.preset.row_time_us)

    @property
    def centre(self) -> NDArray[np.float64]:
        """(3,) m: before the middle of the cameras, at the wanted distance."""
        return np.array([0.5e-3 * self.settings.baseline_mm, 0.0, self.settings.distance_m])

    def camera(self, index: int) -> CameraModel:
        """The camera model of one camera."""
        return CameraModel.from_rig(self.intrinsics, self.poses[index])

    def frame_times_ns(self, index: int, seconds: float) -> list[int]:
        """Scene times of mid-exposure of row 0 of all frames of one camera that fall into `seconds`, ns."""
        count = max(1, math.ceil((seconds - self.phases_s[index]) * self.preset.fps))
        return [round(1e9 * (self.phases_s[index] + k / self.preset.fps)) for k in range(count)]


def shipped_or_own(room: str, name: str) -> Path:
    """The file of a hand or a marker set: by its name in ``resources/room``, or by its own path, which ends in .json.
    Raises SimulatorError when there is none."""
    path = Path(name) if name.endswith(".json") else resource_path(room, f"{name}.json")
    if not path.is_file():
        shipped = ", ".join(sorted(other.stem for other in resource_path(room).glob("*.json")))
        raise SimulatorError(f"{room}: there is no {name!r}; there are {shipped}, or give a file (NAME.json).")
    return path


def _worn(path: Path) -> MarkerSet:
    try:
        return load_markers(path)
    except SettingsError as exc:
        raise SimulatorError(str(exc)) from exc


def make_scene(settings: TwinSettings, seed: int) -> Scene:
    """A left and a right camera side by side, looking ahead in parallel. Raises SimulatorError for an unknown hand or
    marker set, RigError for a hand's file that is none."""
    hand, markers = shipped_or_own("hands", settings.hand), shipped_or_own("markers", settings.markers)
    preset = settings.presets[settings.preset]
    focal = 0.5 * preset.width / math.tan(0.5 * math.radians(preset.horizontal_fov_deg))
    intrinsics = Intrinsics(width=preset.width, height=preset.height, fx=focal, fy=focal, cx=0.5 * (preset.width - 1),
                            cy=0.5 * (preset.height - 1), distortion=settings.distortion)
    rng = np.random.default_rng([seed, 0xC10C])
    hours, ppm = settings.clock_offset_hours, settings.clock_drift_ppm
    return Scene(
        settings=settings,
        hand=load_hand(hand),
        markers=_worn(markers),
        names=("left", "right"),
        intrinsics=intrinsics,
        poses=(CameraPose(), CameraPose(translation_m=(1e-3 * settings.baseline_mm, 0.0, 0.0))),
        phases_s=tuple(float(phase) for phase in rng.uniform(0.0, 1.0 / preset.fps, 2)),
        clocks=tuple(TwinClock(float(offset), float(drift)) for offset, drift in zip(
            rng.uniform(0.0, 3600.0 * hours, 2), rng.uniform(-ppm, ppm, 2), strict=True)),
        seed=seed,
    )


def node_settings(scene: Scene, index: int, *, detector: Literal["fast", "reference"] = "fast",
                  ports: NodePorts | None = None,
                  trust: Literal["paired", "open"] = "paired") -> NodeSettings:
    """What the daemon of one camera is told; without `ports` it takes any free ones. Loopback only, no broadcast."""
    preset, controls = scene.preset, scene.settings.controls
    chosen = ports or NodePorts(0, 0, 0)
    return NodeSettings(
        node_id=index + 1, name=scene.names[index], markers=scene.markers, bind_address="127.0.0.1",
        udp_port=chosen.udp_port, control_port=chosen.control_port, preview_port=chosen.preview_port,
        pairing_port=chosen.pairing_port, broadcast_port=None, trust=trust, detector=detector,
        camera=CameraSettings(width=preset.width, height=preset.height, fps=preset.fps,
                              exposure_us=1e3 * scene.settings.exposure_ms, row_time_us=preset.row_time_us,
                              **msgspec.structs.asdict(controls)),
        clock=ClockSettings(offset_s=scene.clocks[index].offset_s, drift_ppm=scene.clocks[index].drift_ppm))


def build_rig(scene: Scene, ports: tuple[NodePorts, ...] = (), objects: tuple[RigObject, ...] = ()) -> Rig:
    """The rig file that a perfect calibration of this scene would give, with the daemons' real ports, if there are
    daemons."""
    ports = ports or (NodePorts(0, 0, 0),) * len(scene.names)
    nodes = tuple(
        RigNode(node_id=index + 1, name=name, intrinsics=scene.intrinsics, pose=scene.poses[index],
                udp_port=ports[index].udp_port, control_port=ports[index].control_port,
                preview_port=ports[index].preview_port, pairing_port=ports[index].pairing_port,
                public_key=ports[index].public_key)
        for index, name in enumerate(scene.names))
    return Rig(name="simulated", nodes=nodes, markers=scene.markers, hand=scene.hand,
               calibration=CameraCalibration("exact", error_m=0.0), objects=objects)
