"""The bones wizard without its widgets: a ruler or a minute of movement, the hand that follows, what is proposed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import msgspec
import numpy as np

from rhot_app.calibration.hand.bones import BONE_NAMES, enter_bones
from rhot_app.calibration.hand.marker_places import tracks_of
from rhot_app.calibration.registry import BONES as HAND_BONES
from rhot_app.errors import CalibrationError
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.skeleton import BONES, FINGERS
from rhot_app.progress import Progress
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.ui.models.proposal import Proposal, RigChange, Row
from rhot_app.ui.models.rows import rig_rows
from rhot_app.ui.wizards.models.movement import Guide, MovementStep, QuietGuide
from rhot_app.ui.wizards.models.step import Bar, SolveStep, Step, StepView, Task

if TYPE_CHECKING:
    from rhot_app.calibration.hand.bones_collector import BonesCollector
    from rhot_app.calibration.hand.bones_report import BoneLength, BonesReport

SECONDS = 60.0

_NAMES = {"movement": "measured by movement", "reach": "measured by movement", "entered": "measured with a ruler",
          "landmarks": "measured from landmarks"}

Side = Literal["right", "left"]


class EntryStep(Step):
    """The first page: which hand, and the bones that were measured with a ruler, in mm; none means: by movement."""

    title = "Your hand"

    def __init__(self, hand: HandAnatomy) -> None:
        self._hand = hand
        self._lengths: dict[str, float] = {}
        self._side: Side = hand.side
        self._undone: list[tuple[dict[str, float], Side]] = []
        self.report: BonesReport | None = None
        self.problem = ""

    @property
    def base(self) -> HandAnatomy:
        """The hand to begin from, of the side chosen."""
        return msgspec.structs.replace(self._hand, side=self._side)

    @property
    def lengths(self) -> dict[str, float]:
        """What was entered, by bone, mm."""
        return dict(self._lengths)

    @property
    def keeps(self) -> bool:
        """Measuring takes a person minutes."""
        return bool(self._lengths)

    @property
    def undoable(self) -> bool:
        """Whether something was entered."""
        return bool(self._undone)

    def usual(self, name: str) -> float:
        """A bone's length in the hand to begin from, mm."""
        finger, _, bone = name.partition(".")
        return float(self._hand.fingers[finger].bones_mm[BONES[FINGERS.index(finger)].index(bone)])

    def enter_length(self, name: str, length_mm: float | None) -> None:
        """A bone's length; None for one that was not measured."""
        lengths = {bone: value for bone, value in self._lengths.items() if bone != name}
        if length_mm is not None:
            lengths[name] = length_mm
        self._change(lengths, self._side)

    def choose_side(self, side: Side) -> None:
        """Left or right."""
        self._change(self._lengths, side)

    def undo(self) -> bool:
        """Back to what was entered before."""
        if not self._undone:
            return False
        self._lengths, self._side = self._undone.pop()
        self._judge()
        return True

    def _change(self, lengths: dict[str, float], side: Side) -> None:
        if (lengths, side) != (self._lengths, self._side):
            self._undone.append((self._lengths, self._side))
            self._lengths, self._side = lengths, side
            self._judge()

    def _judge(self) -> None:
        self.report, self.problem = None, ""
        if self._lengths:
            try:
                self.report = enter_bones(self.base, {name: self._lengths[name] for name in BONE_NAMES
                                                      if name in self._lengths})
            except CalibrationError as exc:
                self.problem = str(exc)

    def view(self) -> StepView:
        """Either way is right."""
        if self.problem:
            return StepView("Mend what was entered.", hint=self.problem)
        if self.report is None:
            return StepView("Press Next to measure by movement.", done=True,
                            hint="Or enter bones that you have measured with a ruler, joint to joint.")
        return StepView("Press Next: the bones are as entered.", done=True, verdict=self.report.verdict)


class SweepGuide:
    """Which fingers have bent and stretched enough, by the collector that the command uses."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._collector: BonesCollector | None = None
        self._columns: list[int] = []
        self._last = -1
        self._first_s = 0.0

    def watch(self, states: Sequence[HandState]) -> None:
        """Take every state once."""
        for state in states:
            if state.t_master_ns > self._last:
                self._last = state.t_master_ns
                if self._collector is None:
                    self._begin(state)
                if self._collector is not None:
                    self._collector.add(1e-9 * state.t_master_ns - self._first_s,
                                        state.marker_raw_positions[self._columns])

    def _begin(self, state: HandState) -> None:
        from rhot_app.calibration.hand.bones_collector import BonesCollector

        self._first_s = 1e-9 * state.t_master_ns
        positions, (roles, painted) = state.marker_raw_positions[None], _roles(self._rig)
        tracks = tracks_of(np.zeros(1), np.nan_to_num(positions), state.marker_ids, roles, painted=painted)
        self._columns = [state.marker_ids.index(place.name) for place in tracks.places]
        self._collector = BonesCollector(tracks.places)

    def bars(self) -> tuple[Bar, ...]:
        """One for each finger with a marker at its end."""
        if self._collector is None:
            return ()
        from rhot_app.calibration.hand.bones_collector import LEAST_S

        progress = self._collector.progress
        fingers = (Bar(finger.finger, finger.fraction, f"bent and stretched {finger.sweeps} times; how far shows when "
                       "the hand is fitted") for finger in progress.fingers if finger.seen)
        return (Bar("in sight", min(progress.seconds / LEAST_S, 1.0), f"of {LEAST_S:.0f} s in which the cameras see "
                    "the markers together"), *fingers)

    def sentence(self) -> str:
        """What to do next."""
        return self._collector.progress.sentence if self._collector is not None else "Show the hand to both cameras."

    def shortfall(self) -> str:
        """What has not moved enough."""
        return "" if self._collector is not None and self._collector.progress.done else self.sentence()


def make_guide(rig: Rig) -> Guide:
    """A guide for the markers of the rig; a quiet one when none of them names its place on the hand."""
    roles, painted = _roles(rig)
    try:
        tracks_of(np.zeros(1), np.zeros((1, len(rig.markers.ids), 3)), rig.markers.ids, roles, painted=painted)
    except CalibrationError:
        return QuietGuide("Bend and stretch every finger.")
    return SweepGuide(rig)


def solve_log(log: Path, rig: Rig, base: HandAnatomy, *, progress: Progress) -> BonesReport:
    """What ``rhot calibrate bones`` does with a log."""
    from rhot_app.calibration.hand.bones import solve_bones
    from rhot_app.calibration.recorded_observations import read_instants

    progress("reading the recording", 0.0)
    _, instants = read_instants(log, rig)
    roles, painted = _roles(rig)
    tracks = tracks_of(instants.times_s, instants.positions, rig.markers.ids, roles, painted=painted)
    return solve_bones(tracks, base, progress=progress)


class HandStep(SolveStep):
    """The hand: as entered, or solved from the movement."""

    def __init__(self, entry: EntryStep, movement: MovementStep, rig: Rig) -> None:
        self._entry = entry
        self._movement = movement
        self._rig = rig
        super().__init__(self._work, lambda report: report.verdict)

    def _work(self) -> Task | None:
        log = self._movement.log
        if self._entry.report is not None or log is None:
            return None
        return Task("Fitting the hand …", solve_log, (log, self._rig, self._entry.base))

    def enter(self) -> None:
        """What was entered needs no work."""
        if self._entry.report is not None:
            self._task = None
            self.take_result(self._entry.report)
        else:
            if self.report is not None and self.report.method == "entered":
                self.report = None
            super().enter()


def knowledge_of(bone: BoneLength) -> str:
    """``measured``, ``inferred`` or ``guessed``: shown solid, translucent and hatched, as everywhere."""
    return {"observed": "measured", "entered": "measured", "partly": "inferred"}.get(bone.known.value, "guessed")


def propose(report: Any, rig: Rig, path: Path | None) -> Proposal | None:
    """The rig with this hand."""
    if report is None:
        return None
    after = msgspec.structs.replace(rig, hand=msgspec.structs.replace(report.hand, name=_NAMES[report.method]))
    size = Row("size", "100 %", f"{100 * report.size:.1f} ± {100 * report.size_std:.1f} %")
    return Proposal(HAND_BONES.reason, report.verdict, (size, *rig_rows(rig, after)),
                    (RigChange(rig, after, path, HAND_BONES.reason),))


def _roles(rig: Rig) -> tuple[dict[str, str], frozenset[str]]:
    markers = rig.markers.markers
    return ({marker.id: marker.role for marker in markers if marker.role is not None},
            frozenset(marker.id for marker in markers if marker.shape in ("capsule", "band")))
