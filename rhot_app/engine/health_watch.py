"""Feeds the health monitor from a running pipeline, outside the frames' own thread, and words what it finds."""

from __future__ import annotations

import numpy as np

from rhot_app.calibration.health import HealthMonitor, HealthSample
from rhot_app.calibration.verdict import Grade
from rhot_app.engine.status import Advice
from rhot_app.project import Rig
from rhot_app.tracking.state import HandState, Knowledge
from rhot_app.tracking.tracker import Tracker

LOOK_NS = 95_000_000  # the status comes every 100 ms
JUDGE_NS = 2_000_000_000


class HealthWatch:
    """One rig's health. `advice` is called with every status and mostly returns what it said before."""

    def __init__(self, rig: Rig) -> None:
        self._monitor = HealthMonitor(rig)
        self._advice: list[Advice] = []
        self._looked_ns = self._judged_ns = 0
        self._sequence = -1

    def restart(self) -> None:
        """A new run begins."""
        self._monitor.reset()
        self._advice = []
        self._sequence = -1

    def advice(self, state: HandState | None, tracker: Tracker, now_ns: int) -> list[Advice]:
        """Look at the newest state if a tenth of a second is over, judge every other second."""
        if state is not None and state.sequence != self._sequence and now_ns - self._looked_ns >= LOOK_NS:
            self._looked_ns, self._sequence = now_ns, state.sequence
            self._look(state, tracker)
        if now_ns - self._judged_ns >= JUDGE_NS:
            self._judged_ns = now_ns
            self._advice = [Advice("error" if found.finding.grade is Grade.POOR else "warning", found.finding.sentence,
                                   found.mender)
                            for found in self._monitor.findings()]
        return self._advice

    def _look(self, state: HandState, tracker: Tracker) -> None:
        frames = [frame for frame in tracker.newest_frames() if frame is not None]
        if len(frames) < len(state.camera_names):
            return
        self._monitor.feed(HealthSample(
            t_ns=state.t_master_ns, positions=state.marker_raw_positions,
            measured=state.marker_knowledge == Knowledge.MEASURED, errors_px=state.epipolar_error_px,
            qualities=np.array([frame.qualities for frame in frames]),
            flags=np.array([frame.flags for frame in frames])))
