"""A rig without images: a moving hand's marker centres as two cameras with rolling shutters would see them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import msgspec
import numpy as np
from scipy.interpolate import CubicSpline
from shipped_markers import RHOT6
from shipped_rig import RIGHT_HAND

from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.model import build_model
from rhot_app.project import CameraPose, FilterSettings, Intrinsics, Rig, RigNode
from rhot_app.simulator.render.body import build_body
from rhot_app.simulator.scene.motion_file import load_motion
from rhot_app.state import HandState, Knowledge
from rhot_app.tracking.tracker import CameraObservations, Tracker
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerFlag

Trajectory = Callable[[np.ndarray], np.ndarray]  # (N,) s -> (N, M, 3) m
EPOCH_NS = 5 * 10**14
LOST = int(MarkerFlag.LOST)


@dataclass(frozen=True)
class Preset:
    fps: float
    row_time_ns: int
    focal: float


WIDE = Preset(40.0, 48_000, float(320 / np.tan(np.radians(31.1))))
FAST = Preset(120.0, 10_000, float(320 / np.tan(np.radians(13.25))))


def make_rig(preset: Preset = WIDE, *, cameras: int = 2, filters: FilterSettings | None = None,
             bodies: bool = False) -> Rig:
    lens = Intrinsics(640, 480, preset.focal, preset.focal, 319.5, 239.5, (-0.05, 0.0, 0.0, 0.0, 0.0))
    markers = RHOT6
    if not bodies:
        markers = msgspec.structs.replace(markers, markers=tuple(
            msgspec.structs.replace(marker, radius_mm=None, shape="blob") for marker in markers.markers))
    nodes = tuple(RigNode(k + 1, f"camera {k + 1}", lens, CameraPose(translation_m=(0.075 * k, 0.0, 0.0)))
                  for k in range(cameras))
    return Rig("synthetic", nodes, markers, RIGHT_HAND,
               FilterSettings() if filters is None else filters)


def hand_trajectory(rig: Rig, motion: str, seconds: float, distance_m: float = 0.6, seed: int = 1) -> Trajectory:
    hand, markers = msgspec.json.encode(rig.hand), msgspec.json.encode(rig.markers)
    return _trajectory(hand, markers, motion, seconds, distance_m, seed)


@cache
def _trajectory(hand: bytes, markers: bytes, motion: str, seconds: float, distance_m: float, seed: int) -> Trajectory:
    model = build_model(msgspec.json.decode(hand, type=HandAnatomy))
    body = build_body(model, msgspec.json.decode(markers, type=MarkerSet))
    moving = load_motion(motion, model, np.array([0.0375, 0.0, distance_m]), seed)
    times = np.arange(-0.5, seconds + 0.5, 1e-3)
    return CubicSpline(times, body.marker_positions(*moving.sample(times)))


def still_trajectory(points: np.ndarray) -> Trajectory:
    return lambda times: np.broadcast_to(points, (len(times), *points.shape))


@dataclass(frozen=True)
class Viewing:
    """How the cameras see: phases in frame periods, pixel noise, parts of frames and markers lost, network delays."""

    phases: tuple[float, ...] = (0.0, 0.37)
    noise_px: float = 0.03
    frame_loss: float = 0.0
    marker_loss: float = 0.0
    delay_s: tuple[float, float] = (0.001, 0.002)
    seed: int = 7


def observe(rig: Rig, preset: Preset, trajectory: Trajectory, seconds: float,
            viewing: Viewing) -> list[CameraObservations]:
    """All frames of all cameras in the order of their arrival."""
    rng = np.random.default_rng(viewing.seed)
    frames: list[CameraObservations] = []
    for index, node in enumerate(rig.nodes):
        model = CameraModel.from_rig(node.intrinsics, node.pose)
        starts = (np.arange(int(seconds * preset.fps)) + viewing.phases[index]) / preset.fps
        for start, pixels in zip(starts, _see(model, trajectory, starts, preset.row_time_ns * 1e-9), strict=True):
            pixels += rng.normal(0.0, viewing.noise_px, pixels.shape)
            lost = rng.random(len(pixels)) < viewing.marker_loss
            arrival = start + 480 * preset.row_time_ns * 1e-9 + 0.004 + rng.uniform(*viewing.delay_s)
            if rng.random() >= viewing.frame_loss:
                frames.append(frame(index, start, pixels, np.where(lost, LOST, 0), arrival, preset.row_time_ns,
                                    max(viewing.noise_px, 1e-3)))
    return sorted(frames, key=lambda f: f.t_receive_ns)


def _see(model: CameraModel, trajectory: Trajectory, starts: np.ndarray, row_time_s: float) -> np.ndarray:
    """(N, M, 2) px in N frames, every marker at the time its own row is exposed."""
    count = trajectory(starts[:1]).shape[1]
    pixels = np.full((len(starts), count, 2), 240.0)
    for marker in range(count):
        for _ in range(4):  # a contraction: markers move far fewer rows per second than the shutter
            points = trajectory(starts + pixels[:, marker, 1] * row_time_s)[:, marker]
            pixels[:, marker] = model.project(points)
    return pixels


def frame(camera: int, t_row0_s: float, pixels: np.ndarray, flags: np.ndarray, arrival_s: float,
          row_time_ns: int = WIDE.row_time_ns, sigma_px: float = 0.03) -> CameraObservations:
    lost = (flags & LOST) != 0
    covariances = np.tile(np.eye(2) * sigma_px**2, (len(pixels), 1, 1))
    covariances[(flags & int(MarkerFlag.PARTIAL)) != 0] *= 10_000.0
    return CameraObservations(
        camera=camera, t_row0_master_ns=EPOCH_NS + round(1e9 * t_row0_s), row_time_ns=row_time_ns, clock_bound_s=1e-5,
        t_receive_ns=EPOCH_NS + round(1e9 * arrival_s), detect_s=0.002, network_s=0.001,
        pixels=np.where(lost[:, None], np.nan, pixels), covariances=covariances, diameters=np.full(len(pixels), 16.0),
        qualities=np.ones(len(pixels)), flags=flags.astype(np.uint16))


def altered(frames, change):
    """Frames whose pixels and flags `change(t_s, camera, pixels, flags)` has edited in place."""
    out = []
    for f in frames:
        pixels, flags = f.pixels.copy(), f.flags.copy()
        change((f.t_row0_master_ns - EPOCH_NS) * 1e-9, f.camera, pixels, flags)
        pixels[(flags & LOST) != 0] = np.nan
        out.append(replace(f, pixels=pixels, flags=flags))
    return out


def hidden(markers, begin, end=np.inf, camera=None):
    """Edits frames so that `markers` are out of sight of one camera, or of all, from `begin` to `end`, s."""
    def hide(t, eye, _pixels, flags):
        if begin < t < end and camera in (None, eye):
            flags[markers] = LOST

    return hide


def run(tracker: Tracker, frames: list[CameraObservations]) -> list[HandState]:
    states = []
    for observations in frames:
        tracker.ingest(observations)
        state = tracker.solve()
        if state is not None:
            states.append(state)
    return states


def seconds(state: HandState) -> float:
    """Since the trajectory's begin, s."""
    return (state.t_master_ns - EPOCH_NS) * 1e-9


@dataclass(frozen=True)
class Errors:
    """Against the truth at the states' own times, after the first second, where measured. mm."""

    marker_mm: float
    raw_mm: float
    fingertip_mm: float
    measured: float
    rate_hz: float


def compare(rig: Rig, states: list[HandState], trajectory: Trajectory) -> Errors:
    states = [s for s in states if s.t_master_ns >= EPOCH_NS + 10**9]
    times = np.array([seconds(s) for s in states])
    truth = trajectory(times)
    measured = np.array([s.marker_knowledge for s in states]) == Knowledge.MEASURED
    error = np.linalg.norm(np.array([s.marker_positions for s in states]) - truth, axis=2)[measured]
    raw = np.linalg.norm(np.array([s.marker_raw_positions for s in states]) - truth, axis=2)[measured]
    tips = np.linalg.norm(np.array([s.fingertip_positions for s in states]) - truth[:, :5], axis=2)[measured[:, :5]]
    return Errors(*(1e3 * float(np.sqrt(np.mean(e**2))) for e in (error, raw, tips)), float(measured.mean()),
                  (len(times) - 1) / (times[-1] - times[0]))
