"""Refines the rig beside a running pipeline, outside the frames' own thread, and says when its calibration is stale.

Costs 2 ms of processor time per second of 80 frames for what is kept of them, and 20 ms every ten seconds in a
thread of its own (`benchmarks/self_calibration.py`).
"""

from __future__ import annotations

import threading
from collections import deque
from typing import Any

import msgspec

from rhot_app.engine.status import Advice
from rhot_app.project import Rig
from rhot_app.tracking.refinement.refined_rig import (
    Refinement,
    figure_rows,
    refined_rig,
    stale_sentence,
    usable,
    verdict_of,
)
from rhot_app.tracking.refinement.rig_refinement import Gathered, RigRefiner
from rhot_app.tracking.tracker import CameraObservations

JUDGE_NS = 10_000_000_000

MENDER = "refined"
"""The wizard that shows and uses what was refined."""


class RigWatch:
    """One rig. `advice` is called with every status, `take` before it; both by one thread."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._refiner = RigRefiner(rig)
        self._newest: Refinement | None = None
        self._judged_ns = 0
        self._run = 0
        self._thread: threading.Thread | None = None

    def restart(self) -> None:
        """A new run begins; what is being judged is of the last one."""
        self._refiner.reset()
        self._run += 1
        self._newest = None

    def take(self, frames: deque[CameraObservations]) -> None:
        """Empty the queue that the pipeline fills."""
        while frames:
            self._refiner.take(frames.popleft())

    def advice(self, now_ns: int) -> list[Advice]:
        """Judge anew every ten seconds; mostly what was said before."""
        if now_ns - self._judged_ns >= JUDGE_NS and (self._thread is None or not self._thread.is_alive()):
            self._judged_ns = now_ns
            gathered, run = self._refiner.gather(), self._run
            self._thread = threading.Thread(target=self._judge, args=(gathered, run), name="refining the rig",
                                            daemon=True)
            self._thread.start()
        found = self._newest
        if found is None or found.holds:
            return []
        return [Advice("warning", stale_sentence(self._rig, found), MENDER if usable(found) else "stereo")]

    def wait(self, timeout_s: float | None = None) -> None:
        """Until what is being judged is judged."""
        if self._thread is not None:
            self._thread.join(timeout_s)

    def refined(self, rig: Rig) -> dict[str, Any]:
        """The answer to the command `refined`. `rig` is the one in force: its nodes may have moved meanwhile.

        `known`: whether there is anything yet; `stale`, `usable`; the verdict's fields; `rows` of (what, before,
        after); `document`, the refined rig.
        """
        found = self._newest
        if found is None:
            return {"known": False}
        verdict = verdict_of(found, self._rig.nodes[0].name)
        return {"known": True, "stale": not found.holds, "usable": usable(found), **verdict.to_json(),
                "rows": figure_rows(found), "document": msgspec.to_builtins(refined_rig(rig, found))}

    def _judge(self, gathered: Gathered, run: int) -> None:
        found = self._refiner.refine(gathered)
        if run == self._run:
            self._newest = found
