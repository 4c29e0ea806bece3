"""A frame's way through the engine: from the source into the tracker, and the state out to the clients."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.engine.codec import encode
from rhot_app.engine.meters import LatencyMeter, RateMeter
from rhot_app.sources.source import ObservationSource
from rhot_app.tracking.state import HandState
from rhot_app.tracking.tracker import CameraObservations, Tracker

PublishState = Callable[[bytes], None]
AfterState = Callable[[], None]

log = logging.getLogger(__name__)


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
        self.failure = ""
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
            self._changes = work.source.changes
            self.last_state = None

    def restart(self) -> None:
        """Forget the last run's figures and what the tracker knows."""
        with self._lock:
            self._work.tracker.reset()
            self._work.last_seen_ns[:] = time.monotonic_ns()
            self.latency.clear()
            self.last_state = None
            self.failure = ""
            self._previous = {}

    def take(self, source: ObservationSource, frames: list[CameraObservations]) -> None:
        """Take frames of one camera in and publish the state that is due, if any. Never raises: a tracker's fault must
        not end the stream for good. Frames of a source that has been replaced are ignored."""
        with self._lock:
            work = self._work
            if work.source is not source:
                return
            try:
                state = self._process(work, frames)
            except Exception as exc:
                log.exception("the tracker failed over a frame")
                self.failure = (f"The tracker failed over a frame ({type(exc).__name__}: {exc}) and began anew. "
                                "Record a log and report this.")
                work.tracker.reset()  # it may be in any state
                return
            if state is not None:
                self._after_state()

    def _process(self, work: Work, frames: list[CameraObservations]) -> HandState | None:
        if work.source.changes != self._changes:
            self._changes = work.source.changes
            work.tracker.reset()
        self.frame_count += len(frames)
        live = work.source.live
        now_ns = time.monotonic_ns()
        state = None
        markers = work.last_seen_ns.shape[1]
        frames = [frame for frame in frames if len(frame.pixels) == markers]  # some may be of the rig before
        for k, frame in enumerate(frames, start=1):
            work.tracker.ingest(frame)
            # Live, only the newest instant matters to anybody; a replay leaves none out.
            if not live or k == len(frames):
                solved = work.tracker.solve()
                if solved is not None:
                    self._send(solved, live)
                    state = solved
        for frame in frames:  # once the state is out: nobody waits for this
            work.last_seen_ns[frame.camera, ~np.isnan(frame.pixels[:, 0])] = now_ns
        return state

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
