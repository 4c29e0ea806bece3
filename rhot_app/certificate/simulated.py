"""The protocol on the simulated rig, unattended: recordings as an operator would make them, and their statements.

The operator is simulated too: a ruler is read to half a millimetre, a rod measured likewise. With pictures, the nodes'
own detector finds the markers; without (`sketched`) an ideal one does, a hundred times faster.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhot_app.certificate.latency import flash_edges
from rhot_app.certificate.recordings import (
    READING_SD_M,
    FlashStep,
    PlumbStep,
    ProtocolFile,
    RodStep,
    RulerStep,
    StaticStep,
    write_protocol,
)
from rhot_app.progress import Progress, silent
from rhot_app.simulator.film.film import for_each_camera
from rhot_app.simulator.film.node_log import T0_MASTER_NS, Sending, detected, write_node_log
from rhot_app.simulator.film.points import PointNoise, PointStream
from rhot_app.simulator.film.scene_objects import SceneObject
from rhot_app.simulator.film.shot import Shot, make_shot
from rhot_app.simulator.render.body import PALM_GROUP, POINT_M, SKIN
from rhot_app.simulator.render.painter import PoseSource
from rhot_app.simulator.scene.rigid_target import BALL_RADIUS_M, STICK_RGB, RigidTarget, capsules
from rhot_app.simulator.scene.scene import Scene, build_rig
from rhot_app.simulator.scene.scene_description import MarkerShow

Array = NDArray[np.float64]

_LONGEST_ROD_M = 0.3
_SWING = np.array([0.25, 0.15, 0.17])  # of the scene's half height right, down, and of its distance away

DISTANCES_M = (0.20, 0.25, 0.30, 0.35, 0.40, 0.45, 0.50, 0.55, 0.60, 0.65, 0.70, 0.75, 0.80, 0.85, 0.90, 0.95, 1.00)
"""Those of table 10.1."""


@dataclass(frozen=True, slots=True)
class Lengths:
    """How long each step is recorded, s, and how late the simulated screen is."""

    static_s: float = 10.0
    distance_s: float = 1.5
    rod_s: float = 20.0
    flash_s: float = 20.0
    plumb_s: float = 3.0
    screen_s: float = 0.012
    distances_m: tuple[float, ...] = DISTANCES_M


def record_protocol(scene: Scene, folder: Path, *, sketched: bool, lengths: Lengths | None = None,
                    progress: Progress = silent) -> ProtocolFile:
    """Make every recording of the protocol and ``protocol.json`` in `folder`, which exists. Raises SimulatorError."""
    lengths = lengths or Lengths()
    rng = np.random.default_rng([scene.seed, 0xCE47])
    ids = scene.markers.ids
    first, second = ids[0], ids[1]
    todo = 4 + len(lengths.distances_m)
    step = iter(range(todo))

    def film(name: str, shot: Shot) -> str:
        number = next(step)
        progress(f"recording {name} on the simulated rig", number / todo)
        _record(shot, folder / f"{name}.rhotlog", None, sketched=sketched)
        return f"{name}.rhotlog"

    static = StaticStep(film("static", make_shot(scene, "still", lengths.static_s)), facing=scene.settings.facing)
    ruler = []
    for k, distance in enumerate(lengths.distances_m):
        shot = make_shot(_reseeded(scene, k), MarkerShow(marker=first, distance_m=distance), lengths.distance_s)
        stated_mm = round(1e3 * (distance + rng.normal(0.0, READING_SD_M)), 1)
        ruler.append(RulerStep(film(f"ruler_{1e3 * distance:04.0f}mm", shot), stated_mm, first))
    rod = RodStep(film("rod", _rod_shot(scene, lengths.rod_s, still=False)),
                  round(1e3 * (rod_length(scene) + rng.normal(0.0, READING_SD_M)), 1), (first, second))
    edges = tuple((T0_MASTER_NS + round(1e9 * t), on) for t, on in flash_edges(lengths.flash_s, scene.seed))
    progress("recording flash on the simulated rig", next(step) / todo)
    record_flash(scene, folder / "flash.rhotlog", edges, lengths.screen_s, sketched=sketched)
    flash = FlashStep("flash.rhotlog", first, edges)
    plumb = PlumbStep(film("plumb", _rod_shot(scene, lengths.plumb_s, still=True)), first, second)
    protocol = ProtocolFile(static, tuple(ruler), rod, flash, plumb, simulated=True)
    write_protocol(folder, protocol)
    return protocol


def record_flash(scene: Scene, path: Path, edges: tuple[tuple[int, bool], ...], screen_s: float, *,
                 sketched: bool) -> None:
    """Record the patch of a screen that is told `edges` (master time, ns) and is `screen_s` late, until a second after
    the last of them, in the colour of the set's first marker."""
    screen = _Screen(tuple((1e-9 * (t_ns - T0_MASTER_NS) + screen_s, on) for t_ns, on in edges))
    shot = make_shot(scene, MarkerShow(marker=scene.markers.ids[0]), screen.edges[-1][0] + 1.0)
    _record(shot, path, screen, sketched=sketched)


def _reseeded(scene: Scene, number: int) -> Scene:
    """The same rig, with noise of its own at each distance."""
    return replace(scene, seed=scene.seed + 10_000 * (number + 1))


def half_height(scene: Scene) -> float:
    """m: from the middle of the picture to its border, at the nearest that the rod comes."""
    preset, nearest = scene.preset, (1.0 - float(_SWING[2])) * scene.settings.distance_m
    return nearest * math.tan(0.5 * math.radians(preset.horizontal_fov_deg)) * preset.height / preset.width


def rod_length(scene: Scene) -> float:
    """m: as long as both ends stay in both pictures."""
    return min(_LONGEST_ROD_M, 1.3 * half_height(scene))


def _rod_shot(scene: Scene, seconds: float, *, still: bool) -> Shot:
    """A rod whose ends wear the first two markers of the set."""
    half = np.array([0.5 * rod_length(scene), 0.0, 0.0])
    reach = _SWING * (half_height(scene), half_height(scene), scene.settings.distance_m)
    motion = RodMotion(scene.centre, reach, scene.seed, still)
    centres = np.full((len(scene.markers.markers), 3), np.nan)
    centres[0], centres[1] = -half, half
    inner = half * (1.0 - (BALL_RADIUS_M + 0.003) / half[0])
    point = np.array([0.0, POINT_M, 0.0])
    first, second = (marker.display_rgb for marker in scene.markers.markers[:2])
    rod = RigidTarget(
        capsules((0, 1, PALM_GROUP), (0, 1, SKIN), (BALL_RADIUS_M, BALL_RADIUS_M, 0.003), (first, second, STICK_RGB)),
        ends=np.array([[-half, -half + point], [half, half + point], [-inner, inner]]), centres=centres)
    return Shot(scene, MarkerShow(), SceneObject("rod", rod, motion), seconds)


@dataclass(frozen=True)
class RodMotion:
    """A `PoseSource`: a rod that is moved slowly by up to `reach` (3,) m about `centre` (3,) m and turned every way; or
    one that hangs `still` from a string, its first end above."""

    centre: Array
    reach: Array
    seed: int
    still: bool

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        """world_from_rod (T, 4, 4) at scene times (T,) s; no angles."""
        times_s = np.asarray(times_s, dtype=np.float64)
        out = np.tile(np.eye(4), (len(times_s), 1, 1))
        if self.still:
            out[:, :3, :3] = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
            out[:, :3, 3] = self.centre
            return out, np.zeros((len(times_s), 0))
        phases = np.random.default_rng([self.seed, 0x20D]).uniform(0.0, 2.0 * np.pi, 5)
        swing = [np.sin(2.0 * np.pi * hertz * times_s + phase)
                 for hertz, phase in zip((0.11, 0.083, 0.061, 0.047, 0.071), phases, strict=True)]
        out[:, :3, 3] = self.centre + self.reach * np.stack(swing[:3], axis=1)
        roll, pitch = np.pi * swing[3], 1.0 * swing[4]
        along = np.stack([np.cos(pitch) * np.cos(roll), np.cos(pitch) * np.sin(roll), np.sin(pitch)], axis=1)
        across = np.stack([-np.sin(roll), np.cos(roll), np.zeros_like(roll)], axis=1)
        out[:, :3, 0], out[:, :3, 1], out[:, :3, 2] = along, across, np.cross(along, across)
        return out, np.zeros((len(times_s), 0))


@dataclass(frozen=True)
class _Screen:
    """When the light of a patch changes, scene time s, and to what; dark before."""

    edges: tuple[tuple[float, bool], ...]

    def lit(self, t_s: float) -> bool:
        """Whether it shines at scene time `t_s`."""
        before = np.searchsorted([t for t, _ in self.edges], t_s, side="right")
        return bool(before) and self.edges[int(before) - 1][1]


@dataclass(frozen=True)
class _Flashing:
    """A `PoseSource` of a patch that is out of sight while its screen is dark, whole frames at a time."""

    patch: PoseSource
    screen: _Screen

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        """As `PoseSource.sample`; the times are those of one frame, whose middle row sees the patch."""
        poses, angles = self.patch.sample(times_s)
        if not self.screen.lit(float(np.mean(times_s))):
            poses[:, 0, 3] += 50.0
        return poses, angles


def _record(shot: Shot, path: Path, screen: _Screen | None, *, sketched: bool) -> None:
    rig = build_rig(shot.scene)
    if sketched:
        streams = [PointStream(shot, rig, index, PointNoise(loss=0.0)) for index in range(len(rig.nodes))]
        records = [record for stream in streams
                   for record in (stream.records() if screen is None else stream.records(screen.lit))]
    else:
        source = None if screen is None else _Flashing(shot.scene_object.source, screen)
        said = for_each_camera(shot, functools.partial(detected, Sending(rig, seed=0xCE48), source), None)
        records = [record for one, _ in said for record in one]
    write_node_log(path, rig, {"simulated": shot.scene_object.name}, records)
