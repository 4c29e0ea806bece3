"""Refines the rig, adapts the hand and measures its bones beside a running pipeline, outside the frames' own thread.

Costs 2 ms of processor time per second of 80 frames for what is kept of them, and 60 ms every ten seconds in a
thread of its own (`benchmarks/self_calibration.py`).
"""

from __future__ import annotations

import functools
import logging
from collections import deque
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.key_frames import KeyFrame
from rhot_app.calibration.hand.bones_result import BonesResult
from rhot_app.calibration.hand.landmark_bones import measure_bones, spreads_apart
from rhot_app.calibration.hand.marker_places import tracks_of
from rhot_app.calibration.verdict import Verdict
from rhot_app.engine.status import Advice, advise
from rhot_app.errors import CalibrationError
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.places import LANDMARK_ROLES
from rhot_app.handfit.adaptation import Adapted, adapt
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.tracking.refinement.refined_rig import (
    Refinement,
    figure_rows,
    refined_rig,
    stale_sentence,
    usable,
    verdict_of,
)
from rhot_app.tracking.refinement.rig_refinement import Gathered, RigRefiner
from rhot_app.tracking.tracker import CameraObservations, Tracker
from rhot_node.threads import OneShotThread

log = logging.getLogger(__name__)

Array = NDArray[np.float64]

JUDGE_NS = 10_000_000_000

MENDER = "refined"
"""The wizard that shows and uses what was refined."""

HAND_MENDER = "adapted"
"""The wizard that shows and uses the adapted hand."""

BONES_MENDER = "measured"
"""The wizard that shows and uses the bones that landmarks show."""

BONES_JUDGE_NS = 2_000_000_000

MAX_INSTANTS = 600
"""Instants of a hand by which its bones are measured: the last minute of them."""


class RigWatch:
    """One rig. `advice` is called with every status, `take` before it; both by one thread."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._refiner = RigRefiner(rig)
        self._newest: Refinement | None = None
        self._judged_ns = 0
        self._run = 0
        self._task: OneShotThread | None = None

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
        if now_ns - self._judged_ns >= JUDGE_NS and (self._task is None or not self._task.running):
            self._judged_ns = now_ns
            judge = functools.partial(self._judge, self._refiner.gather(), self._run)
            self._task = OneShotThread("refines the rig", judge)
        found = self._newest
        if found is None or found.holds:
            return []
        return [Advice("warning", stale_sentence(self._rig, found), MENDER if usable(found) else "stereo",
                       subject="calibration")]

    def wait(self, timeout_s: float | None = None) -> None:
        """Until what is being judged is judged."""
        if self._task is not None:
            self._task.join(timeout_s)

    def refined(self, rig: Rig) -> dict[str, Any]:
        """The answer to the command `refined`. `rig` is the one in force: its nodes may have moved meanwhile.

        `known`: whether there is anything yet; `stale`, `usable`; the verdict's fields; `rows` of (what, before,
        after); `document`, the refined rig.
        """
        found = self._newest
        if found is None:
            return {"known": False}
        verdict = verdict_of(found, self._rig.nodes[0].name)
        return {"stale": not found.holds, "usable": usable(found),
                **_proposal(verdict, figure_rows(found), refined_rig(rig, found))}

    def _judge(self, gathered: Gathered, run: int) -> None:
        found = self._refiner.refine(gathered)
        if run == self._run:
            self._newest = found


class HandWatch:
    """Says when a bare hand has shown enough of its shape, and adapts the hand's file to it on demand, in a thread: a
    second of processor time."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._newest: Adapted | None = None
        self._judged_ns = self._solved_ns = -JUDGE_NS
        self._enough, self._run = False, 0
        self._task: OneShotThread | None = None

    def restart(self) -> None:
        """A new run begins."""
        self._run += 1
        self._judged_ns = self._solved_ns = -JUDGE_NS
        self._newest, self._enough = None, False

    def advice(self, tracker: Tracker, now_ns: int) -> list[Advice]:
        """Judge anew every ten seconds. A hand file that states how well its radii are known is not offered again."""
        if now_ns - self._judged_ns >= JUDGE_NS:
            self._judged_ns = now_ns
            self._enough = _radii_sd(self._rig.hand) is None and bool(_kept(tracker))
        return [advise("The bare hand has shown how long and how thick its fingers are: its file can be adapted to it.",
                       level="info", mender=HAND_MENDER, subject="information")] if self._enough else []

    def wait(self, timeout_s: float | None = None) -> None:
        """Until what is being solved is solved."""
        if self._task is not None:
            self._task.join(timeout_s)

    def adapted(self, tracker: Tracker, now_ns: int) -> dict[str, Any]:
        """The answer to the command `adapted`: `known`, whether there is a solution yet; the verdict's fields; `rows`
        of (what, before, after); `document`, the rig with the adapted hand. Solved anew every ten seconds."""
        kept = _kept(tracker)
        if kept and now_ns - self._solved_ns >= JUDGE_NS and (self._task is None or not self._task.running):
            self._solved_ns = now_ns
            self._task = OneShotThread("adapts the hand", functools.partial(self._solve, kept, self._run))
        found = self._newest
        if found is None:
            return {"known": False}
        return _proposal(found.verdict, _hand_rows(self._rig.hand, found.hand),
                         msgspec.structs.replace(self._rig, hand=found.hand))

    def _solve(self, kept: list[KeyFrame], run: int) -> None:
        try:
            found = adapt(self._rig.hand, kept)
        except np.linalg.LinAlgError:  # more key frames may mend it
            log.exception("the hand was not adapted")
            return
        if run == self._run:
            self._newest = found


class BonesWatch:
    """Measures the bones of the rig's first hand by its landmarks, and offers them when they differ from the rig's, and
    from those that were shown last, by more than they spread. One thread."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        roles = [marker.role for marker in rig.markers.markers]
        self._columns = [roles.index(role) for role in LANDMARK_ROLES if role in roles]
        self._active = len(self._columns) == len(LANDMARK_ROLES) and len(rig.nodes) > 1
        self._seen: deque[tuple[float, Array]] = deque(maxlen=MAX_INSTANTS)
        self._newest: BonesResult | None = None
        self._offer: Advice | None = None
        self._shown: HandAnatomy | None = None
        self._sequence, self._judged_ns = -1, -BONES_JUDGE_NS

    def restart(self) -> None:
        """A new run begins, perhaps with another person's hand."""
        self._seen.clear()
        self._newest = self._offer = None
        self._sequence = -1

    def advice(self, state: HandState | None, now_ns: int) -> list[Advice]:
        """Look at the newest state, and measure anew every other second. What is offered stays, in the same words,
        until it is shown or can no longer be used."""
        if self._active and state is not None and state.sequence != self._sequence:
            self._sequence = state.sequence
            places = state.marker_raw_positions[self._columns]
            if np.isfinite(places).any():
                self._seen.append((1e-9 * state.t_master_ns, places))
        if self._seen and now_ns - self._judged_ns >= BONES_JUDGE_NS:
            self._judged_ns = now_ns
            self._measure()
        return [] if self._offer is None else [self._offer]

    def _measure(self) -> None:
        times_s, places = zip(*self._seen, strict=True)
        try:
            found = measure_bones(tracks_of(np.array(times_s), np.array(places), LANDMARK_ROLES), self._rig.hand)
        except CalibrationError:  # too little was seen by two cameras
            found = None
        self._newest = found
        if found is None or not found.verdict.acceptable:
            self._offer = None
        elif self._offer is None and all(spreads_apart(found, hand) > 1.0 for hand in (self._rig.hand, self._shown)
                                         if hand is not None):
            apart_mm = _apart_mm(found, self._rig.hand)
            self._offer = advise("The landmarks show bones that differ from the rig's hand by {apart:.0f} mm (rms). "
                                 "With them the joints are more accurate.", level="info", mender=BONES_MENDER,
                                 subject="information", apart=apart_mm)

    def measured(self) -> dict[str, Any]:
        """The answer to the command `measured`, and from now on shown: `known`, whether the bones could be measured;
        the verdict's fields; `rows` of (what, before, after); `document`, the rig with the measured hand."""
        found = self._newest
        if found is None:
            return {"known": False}
        self._shown, self._offer = found.hand, None
        hand = msgspec.structs.replace(found.hand, name="measured from landmarks")
        size = ("size", "100 %", f"{100.0 * found.size:.1f} ± {100.0 * found.size_std:.1f} %")
        return _proposal(found.verdict, [size, *_hand_rows(self._rig.hand, hand)],
                         msgspec.structs.replace(self._rig, hand=hand))


def _proposal(verdict: Verdict, rows: list[Any], rig: Rig) -> dict[str, Any]:
    """The answer with a rig to use: the verdict's fields, `rows` of (what, before, after), the rig's `document`."""
    return {"known": True, **verdict.to_json(), "rows": rows, "document": msgspec.to_builtins(rig)}


def _apart_mm(result: BonesResult, hand: HandAnatomy) -> float:
    others = np.array([one.bones_mm for one in hand.fingers.values()]).ravel()
    return float(np.sqrt(np.mean((np.array([one.length_mm for one in result.bones]) - others) ** 2)))


def _kept(tracker: Tracker) -> list[KeyFrame]:
    """The tracker's key frames, none while they tell too little."""
    found = tracker.key_frames
    return list(found.kept) if found is not None and found.sufficient else []


def _radii_sd(hand: HandAnatomy) -> tuple[float, float, float] | None:
    return next(iter(hand.fingers.values())).radii_sd_mm


def _hand_rows(before: HandAnatomy, after: HandAnatomy) -> list[tuple[str, str, str]]:
    """Lengths and radii of each finger that differ, mm, and how well they are known."""
    rows = []
    for name, new in after.fingers.items():
        old = before.fingers[name]
        for what, values, then, sd in (("bones", old.bones_mm, new.bones_mm, new.bones_sd_mm),
                                       ("radii", old.radii_mm, new.radii_mm, new.radii_sd_mm)):
            if values == then:
                continue
            shown = ", ".join(f"{value:.1f} ± {one:.1f}" for value, one in zip(then, sd or (), strict=True))
            rows.append((f"{name} {what}", ", ".join(f"{value:.1f}" for value in values) + " mm", f"{shown} mm"))
    return rows
