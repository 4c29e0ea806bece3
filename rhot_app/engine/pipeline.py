"""A frame's way through the engine: from the source into the tracker, and the state out to the clients."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.diagnostics import diagnostics_of
from rhot_app.engine.status import LatencySummary, encode
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.hand.model import build_model, neutral_pose
from rhot_app.hand.places import ROLES, place_of
from rhot_app.latency import p50_p99
from rhot_app.objects.object_file import ObjectModel
from rhot_app.objects.observations import FiducialFrame
from rhot_app.project import OTHER_HAND, Rig, RigNode
from rhot_app.sources.receiver import ObservationSource
from rhot_app.state import LATENCY_STAGES, HandState
from rhot_app.tracking.extrapolation import Extrapolator
from rhot_app.tracking.markers.marker_model import points_on
from rhot_app.tracking.tracker import (
    CameraFrame,
    CameraObservations,
    Tracker,
    frame_part,
    may_be_due,
)
from rhot_node.wire.codec import decode as decode_datagram
from rhot_node.wire.codec import encode as encode_datagram
from rhot_node.wire.messages import MarkerObservation, Observations
from rhot_node.wire.points import MarkerTable

RECENT = 256
"""Frames kept for whoever looks a few times a second: half a second of four cameras at 120 Hz."""

PublishState = Callable[[bytes], None]
AfterState = Callable[[], None]


@dataclass(frozen=True, slots=True)
class Work:
    """What a pipeline works with; replaced as a whole when the rig changes."""

    source: ObservationSource
    tracker: Tracker
    last_seen_ns: NDArray[np.int64]  # (C, M) master time at which a camera last saw a marker


class Pipeline:
    """Ingests frames, solves once, publishes. `take` may be called by any thread; the meters may be read."""

    def __init__(self, work: Work, publish: PublishState, after_state: AfterState = lambda: None) -> None:
        """`publish` takes a state's bytes and must not block; `after_state` is called when nobody waits for one."""
        self.states = RateMeter()
        self.latency = LatencyMeter()
        self.last_state: HandState | None = None
        self.frame_count = 0
        self.recent: deque[CameraObservations] = deque(maxlen=RECENT)
        self._last: deque[CameraObservations] = deque(maxlen=RECENT)
        self.diagnostics = diagnostics_of(work.tracker)
        self._work = work
        self._publish = publish
        self._after_state = after_state
        self._changes = work.source.changes
        self._previous: dict[str, float] = {}
        self._lock = threading.Lock()

    @property
    def work(self) -> Work:
        """What the next step works with."""
        return self._work

    def use(self, work: Work) -> None:
        """Go on with another source or tracker, from the next step on."""
        with self._lock:
            self._work = work
            self.diagnostics = diagnostics_of(work.tracker)
            self._changes = work.source.changes
            self.last_state = None

    def restart(self) -> None:
        """Forget the last run's figures and what the tracker knows."""
        with self._lock:
            self._work.tracker.reset()
            self._work.last_seen_ns[:] = time.monotonic_ns()
            self.latency.clear()
            self.last_state = None
            self.diagnostics.clear()
            self._previous = {}

    def take(self, source: ObservationSource, frames: list[CameraFrame]) -> None:
        """Take frames of one camera in and publish the state that is due, if any. Never raises: a tracker's fault loses
        the frame (`Diagnostics`). Frames of a source that has been replaced are ignored."""
        with self._lock:
            work = self._work
            if work.source is not source:
                return
            with self.diagnostics.part("frames on their way", work.tracker.reset):
                state = self._process(work, frames)
                for request in work.tracker.requests():
                    work.source.search(request)
                if state is not None:
                    self._after_state()

    def _process(self, work: Work, frames: list[CameraFrame]) -> HandState | None:
        if work.source.changes != self._changes:
            self._changes = work.source.changes
            work.tracker.reset()
        markers = work.last_seen_ns.shape[1]
        frames = [frame for frame in frames if not isinstance(frame, CameraObservations)
                  or len(frame.pixels) == markers]  # some may be of the rig before
        observations = [frame for frame in frames if isinstance(frame, CameraObservations)]
        self.frame_count += len(observations)
        live, tracker, cameras = work.source.live, work.tracker, [link.node.name for link in work.source.links]
        now_ns = time.monotonic_ns()
        state, last = None, next((frame for frame in reversed(frames) if may_be_due(frame)), None)
        for frame in frames:
            solved = None
            with frame_part(self.diagnostics, tracker, frame, cameras):
                tracker.ingest(frame)
                # Live, only the newest instant matters to anybody; a replay leaves none out.
                if may_be_due(frame) and (not live or frame is last):
                    if not live:
                        tracker.wait()
                    solved = next(tracker.states(), None)
            if solved is not None:
                self._send(solved, live)
                state = solved
        for frame in observations:  # once the state is out: nobody waits for this
            work.last_seen_ns[frame.camera, ~np.isnan(frame.pixels[:, 0])] = now_ns
        self.recent.extend(observations)
        self._last.extend(observations)
        return state

    def frame(self, camera: int, t_node_ns: int) -> CameraObservations | None:
        """What was observed in the frame that the camera's node stamped so, if that was not long ago."""
        return next((one for one in reversed(self._last.copy())
                     if one.camera == camera and one.t_row0_node_ns == t_node_ns != 0), None)

    def _send(self, state: HandState, live: bool) -> None:
        begun_ns = time.monotonic_ns()
        state.latency_s.update(self._previous)
        self._publish(encode(state))
        now_ns = time.monotonic_ns()
        self._previous = {"publish": 1e-9 * (now_ns - begun_ns)}
        if live:
            self._previous["receive_to_state"] = 1e-9 * (now_ns - state.t_receive_ns)
        self.latency.add(state.latency_s)
        self.states.tick(now_ns)
        self.last_state = state


WINDOW = 600
"""States over which latency is summarised: five seconds at 120 Hz."""

LEAST_S = 0.25
"""Events of a shorter time come in a burst, as after a start, and tell no rate."""


class RateMeter:
    """Events per second over the last second. One thread writes, another may read."""

    def __init__(self) -> None:
        self._times: deque[int] = deque(maxlen=4096)

    def tick(self, t_ns: int) -> None:
        """Note one event."""
        self._times.append(t_ns)

    def rate_hz(self, now_ns: int) -> float:
        """Events per second in the second that ends now."""
        recent = [t for t in self._times.copy() if now_ns - t <= 1_000_000_000]
        if len(recent) < 2 or recent[-1] == recent[0]:
            return 0.0
        # Intervals, not events: a window cut between two events would else flicker by one.
        since_last = now_ns - recent[-1]
        span = recent[-1] - recent[0]
        seconds = 1e-9 * (span + max(0, since_last - span // (len(recent) - 1)))
        return (len(recent) - 1) / max(seconds, LEAST_S)


class LatencyMeter:
    """The last latencies of every stage. One thread writes, another may read."""

    def __init__(self, window: int = WINDOW) -> None:
        self._values = np.full((window, len(LATENCY_STAGES)), np.nan)
        self._next = 0

    def add(self, latency_s: dict[str, float]) -> None:
        """Note one state's latencies by stage, s; a stage that is missing is not known."""
        self._values[self._next] = [latency_s.get(stage, math.nan) for stage in LATENCY_STAGES]
        self._next = (self._next + 1) % len(self._values)

    def summary(self) -> dict[str, LatencySummary]:
        """Median and 99th percentile of each stage that has any value."""
        return {stage: LatencySummary(float(p50), float(p99))
                for stage, p50, p99 in zip(LATENCY_STAGES, *p50_p99(self._values), strict=True) if np.isfinite(p50)}

    def clear(self) -> None:
        """Forget all values: a new run begins."""
        self._values[:] = np.nan


# -- compilation before the first frame --------------------------------------------------------------------------------
# With synthetic frames of the rig's own markers.

FRAMES = 24
_PERIOD_NS = 8_333_333
_CAMERA_FROM_PALM = np.array([[0.0, 1.0, 0.0, 0.04], [-1.0, 0.0, 0.0, 0.07], [0.0, 0.0, 1.0, 0.6],
                              [0.0, 0.0, 0.0, 1.0]])
"""Fingers up, 0.6 m away."""


def warm_up(tracker: Tracker, rig: Rig) -> None:
    """Let `tracker` solve a few frames of the rig's own hand, 0.6 m before the first camera, then forget them.

    Compiled code is read from numba's cache where it can be written, else it is compiled here: seconds, once.
    """
    tags = [fiducials for model in rig.models for fiducials in _tag_frames(model, rig)]
    for fiducials in tags:
        tracker.ingest(fiducials)
    points_m, extrapolator = _worn_points(rig), Extrapolator(rig) if rig.tracker.kind == "estimator" else None
    for frame in range(FRAMES):
        moved_m = points_m + np.array([0.002 * frame, 0.0, 0.0])
        for camera, node in enumerate(rig.nodes):
            tracker.ingest(_see(moved_m, camera, node, 10**9 + frame * _PERIOD_NS))
            state = tracker.solve()
            if state is not None:
                encode(state)
                if extrapolator is not None:
                    extrapolator.at(state, state.t_master_ns + _PERIOD_NS)  # windows find it compiled
    tracker.warm_up()
    tracker.reset()
    _read_one(rig)


def _tag_frames(model: ObjectModel, rig: Rig) -> list[FiducialFrame]:
    """Three exact frames of an object's largest tag, which faces the first camera."""
    if not model.fiducials:
        return []
    tag = max(model.fiducials, key=lambda one: one.size_mm)
    node = rig.nodes[0]
    camera = CameraModel.from_rig(node.intrinsics, node.pose)
    half = 0.5e-3 * tag.size_mm
    square = np.array([[-half, -half, 0.0], [half, -half, 0.1 * half], [half, half, 0.1 * half], [-half, half, 0.0]])
    world_from_camera = np.linalg.inv(camera.camera_from_world)
    places = (square + _CAMERA_FROM_PALM[:3, 3]) @ world_from_camera[:3, :3].T + world_from_camera[:3, 3]
    pixels = camera.project(places)[None]
    return [FiducialFrame(0, 10**9 + frame * _PERIOD_NS, 10_000, np.array([tag.key]), pixels,
                          np.tile(0.01 * np.eye(2), (1, 4, 1, 1))) for frame in range(3)]


def _worn_points(rig: Rig) -> np.ndarray:
    """(M, 3) m, world: the markers on relaxed hands before the first camera; side by side those that no hand wears."""
    markers, first = rig.markers.markers, rig.nodes[0]
    points = np.tile(_CAMERA_FROM_PALM[:3, 3], (len(markers), 1))
    points[:, 0] = np.linspace(-0.06, 0.06, len(markers))
    for hand, prefix, aside_m in ((rig.hand, "", 0.0), (rig.other_hand, OTHER_HAND, -0.15)):
        worn = [k for k, marker in enumerate(markers)
                if (marker.role or "").startswith(prefix) and (marker.role or "").removeprefix(prefix) in ROLES]
        if hand is None or not worn:
            continue
        model, pose = build_model(hand), neutral_pose(_CAMERA_FROM_PALM)
        dh = points_on(model.dh, tuple(place_of(msgspec.structs.replace(
            markers[k], role=(markers[k].role or "").removeprefix(prefix)), model) for k in worn))
        found = np.empty((len(worn), 3))
        forward_arrays(dh, pose.world_from_palm, pose.angles, empty_frames(dh), found)
        found[:, 0] += aside_m
        points[worn] = found
    world_from_camera = np.linalg.inv(CameraModel.from_rig(first.intrinsics, first.pose).camera_from_world)
    return np.asarray(points @ world_from_camera[:3, :3].T + world_from_camera[:3, 3])


def _read_one(rig: Rig) -> None:
    """A datagram's way through the wire's compiled code."""
    markers = [MarkerObservation(k, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0) for k in range(len(rig.markers.markers))]
    message = decode_datagram(encode_datagram(Observations(1, 1, 0, 0, 0, 0, 0, 0, 640, 480, 0, 0, markers)))
    assert isinstance(message, Observations)
    assert isinstance(message.markers, MarkerTable)
    message.markers.columns()


def _see(points_m: np.ndarray, camera: int, node: RigNode, t_ns: int) -> CameraObservations:
    """One exact frame of world points (M, 3) m."""
    pixels = CameraModel.from_rig(node.intrinsics, node.pose).project(points_m)
    count = len(points_m)
    return CameraObservations(
        camera=camera, t_row0_master_ns=t_ns, row_time_ns=10_000, clock_bound_s=1e-4, t_receive_ns=t_ns + 5_000_000,
        detect_s=1e-3, network_s=1e-3, pixels=pixels,
        covariances=np.tile(0.01 * np.eye(2), (count, 1, 1)), diameters=np.full(count, 16.0),
        qualities=np.ones(count), flags=np.zeros(count, np.uint16))
