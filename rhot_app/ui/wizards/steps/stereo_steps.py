"""The steps of the stereo calibration: shared captures, the solve, the world on the table. No mathematics here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rhot_app.calibration.board.boards import Board, same_pattern
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.shared_views import BoardShot, SharedViews
from rhot_app.calibration.check.camera_calibration import lengths_text
from rhot_app.calibration.lens.fit import LensStart, find_lens
from rhot_app.calibration.registry import STEREO
from rhot_app.calibration.stereo.calibrate import KnownLengths, calibrate, calibrated_rig, lens_of, rig_findings
from rhot_app.calibration.stereo.collector import Guidance, Offer, StereoCollector
from rhot_app.calibration.stereo.report import WORKING_DISTANCE_M, PairFigures, StereoFigures, StereoReport
from rhot_app.calibration.stereo.start import WorldFrame, place_world
from rhot_app.calibration.verdict import judge
from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress
from rhot_app.project import Rig, RigNode
from rhot_app.ui.models.proposal import Proposal, RigChange, Row
from rhot_app.ui.models.rows import place_figures
from rhot_app.ui.wizards.models.board_form import OTHER_BOARD, BoardObservation, BoardSearch, BoardStep
from rhot_app.ui.wizards.models.drawing import Dots, Overlay
from rhot_app.ui.wizards.models.step import AnnotatedPicture, Bar, Pictures, Step, StepView, Task
from rhot_app.ui.wizards.steps.film_steps import FilmedStep, Films

# -- The solve in its own process --------------------------------------------------------------------------------------

def put_together(views: SharedViews, lenses: Sequence[LensStart | None], *, known: KnownLengths,
                 progress: Progress) -> StereoReport:
    """`lenses` one per camera, None to find it from the views. Raises CalibrationError."""
    found = [lens if lens is not None else find_lens(views.of_camera(camera), views.board, views.cameras[camera])
             for camera, lens in enumerate(lenses)]
    return calibrate(views, found, known=known, remembered=lenses, progress=progress)


def known_lenses(nodes: Sequence[RigNode]) -> list[LensStart | None]:
    """The rig's lenses, None for those that only say what is written on the box."""
    return [None if node.intrinsics.nominal else lens_of(node) for node in nodes]


# -- Steps: captures, solve, world frame (no Qt) -----------------------------------------------------------------------

Views = dict[str, BoardView | None]
FEWEST = 4  # shots; with fewer the solve refuses


class BoardFinder(Step):
    """Base of the steps that look for the chosen board in all cameras."""

    watches = True

    def __init__(self, board_step: BoardStep, cameras: tuple[str, ...]) -> None:
        self.cameras = cameras
        self._board_step = board_step
        self.search = BoardSearch()
        self.seen: Views = dict.fromkeys(cameras)

    @property
    def board(self) -> Board:
        """The board that the person holds."""
        board = self._board_step.board
        assert board is not None, "the first step is not done without a board"
        return board

    def see(self, pictures: Pictures) -> BoardObservation:
        """The board in each picture."""
        return self.search.look(pictures, self.board)

    def take(self, seen: BoardObservation) -> None:
        """What the cameras see now; a camera without a picture sees nothing."""
        if seen.board == self.board:
            self.search.take(seen)
            self.seen = {name: seen.views.get(name) for name in self.cameras or ()}


class ShowStep(BoardFinder, FilmedStep):
    """Shared captures: kept by themselves when the board is still and somewhere new, or with Space."""

    title = "Show the board"
    captures = True

    def __init__(self, board_step: BoardStep, cameras: tuple[str, ...]) -> None:
        super().__init__(board_step, cameras)
        self._collector: StereoCollector | None = None
        self._of: Board | None = None
        self._offer = Offer(False, "")
        self.films = Films(cameras)
        self._guidance: Guidance | None = None  # of the first `_guided` shots: it takes milliseconds to find
        self._guided = 0

    def enter(self) -> None:
        """Another board makes what was kept useless; a corrected size of its squares does not."""
        if self._collector is None or self._of is None or not same_pattern(self._of, self.board):
            self.begin()
        elif self._of != self.board:
            self._of = self.board
            self._collector.resize(self.board)

    def begin(self) -> None:
        """Forget what was kept."""
        self._of, self._collector = self.board, StereoCollector(self.cameras or (), self.board)
        self._offer, self._guidance = Offer(False, ""), None
        self.search.forget()
        self.films.forget_read()

    def keep(self, shot: BoardShot) -> None:
        """Take what films show at one moment."""
        if self._collector is not None:
            self._collector.keep(shot)

    @property
    def views(self) -> SharedViews:
        """Everything kept."""
        assert self._collector is not None
        return self._collector.views()

    @property
    def keeps(self) -> bool:
        """Whether anything was kept."""
        return self._collector is not None and bool(self.views.shots)

    def take(self, seen: BoardObservation) -> None:
        """Offer what is seen; the collector decides."""
        if not self.films.paths:
            super().take(seen)
            self._put(still=False)

    def capture(self) -> bool:
        """Space: the person vouches that the board is still."""
        return not self.films.paths and self._put(still=True)

    def _put(self, *, still: bool) -> bool:
        if self._collector is None or self.search.size_finding(self.board) is not None:
            return False
        self._offer = self._collector.offer([self.seen[name] for name in self.cameras or ()], still=still)
        return self._offer.taken

    def undo(self) -> bool:
        """Forget the shot kept last."""
        if self._collector is None or not self.keeps:
            return False
        self._collector.discard_last()
        return True

    def view(self) -> StepView:
        """What to do with the board, and how far it is."""
        shown = self._live_view()
        return self.films.view(shown) if self.films.paths else shown

    def _live_view(self) -> StepView:
        if self._collector is None:
            return StepView("Show the board to both cameras.")
        shots = self.views.shots
        wrong = self.search.size_finding(self.board)
        if wrong is not None:
            return StepView(OTHER_BOARD, hint=f"{wrong.figure} {wrong.cause}", annotated=self._annotated(),
                            overlays=self._overlays(shots), kept=len(shots))
        if self._guidance is None or len(shots) != self._guided:
            self._guidance, self._guided = self._collector.guidance(), len(shots)
        guidance = self._guidance
        bars = [Bar(f"{pair.first} + {pair.second}", pair.shared / (pair.shared + pair.missing),
                    "shots that both cameras share") for pair in guidance.pairs]
        if not guidance.pairs:
            bars.append(Bar(f"{len(shots)} shots", 1.0, "every camera shares enough shots with another"))
        bars += [Bar(f"{name} covered", share, "part of the picture where the board was") for name, share
                 in zip(self.cameras or (), guidance.covered, strict=True)]
        bars += [Bar("tilted", float(guidance.tilted), "the board was seen tilted: this tells the focal length"),
                 Bar("near and far", float(guidance.near_and_far), "the board was seen large and small")]
        hint = self.search.missing or self._offer.why.removesuffix(guidance.advice).strip()
        return StepView(self._sentence(guidance.advice), done=guidance.complete, hint=hint,
                        bars=tuple(bars), annotated=self._annotated(), overlays=self._overlays(shots),
                        kept=len(shots), passable=len(shots) >= FEWEST)

    def _sentence(self, advice: str) -> str:
        if not advice:
            return "Enough: press Next."
        if self._offer.why == "Hold still.":
            return "Hold the board still."
        return advice

    def _annotated(self) -> dict[str, AnnotatedPicture]:
        return self.search.annotated(self.board, "good" if self._offer.taken else "accent")

    def _overlays(self, shots: tuple[Any, ...]) -> dict[str, Overlay]:
        """Where the board has been, dimly."""
        overlays: dict[str, Overlay] = {}
        for camera, name in enumerate(self.cameras or ()):
            been = [shot.views[camera].pixels[::3] for shot in shots if shot.views[camera] is not None]
            if been:
                overlays[name] = (Dots(np.concatenate(been), "good", radius=1.5, filled=True),)
        return overlays


class StereoSolveStep(Step):
    """Calibrates the cameras to each other and says what that is worth."""

    title = "Result"

    def __init__(self, show: ShowStep, lenses: Sequence[LensStart | None],
                 known: Callable[[], KnownLengths]) -> None:
        self.cameras = show.cameras
        self._show = show
        self._lenses = lenses
        self._known = known
        self._solved: tuple[SharedViews, KnownLengths] | None = None
        self._asked: tuple[SharedViews, KnownLengths] | None = None
        self.report: StereoReport | None = None
        self.problem = ""

    def enter(self) -> None:
        """Other shots need another solve."""
        question = (self._show.views, self._known())
        if self._solved is None or not _same_question(question, self._solved):
            self._asked, self.report, self.problem = question, None, ""

    def task(self) -> Task | None:
        """The solve, as long as there is no answer."""
        if self.report is not None or self._asked is None:
            return None
        views, known = self._asked
        return Task("Calibrating the cameras", put_together, (views, self._lenses), {"known": known})

    def take_result(self, result: StereoReport) -> None:
        """The answer."""
        self.report, self._solved, self.problem = result, self._asked, ""

    def take_failure(self, sentence: str) -> None:
        """Why there is none."""
        self.problem = sentence

    def view(self) -> StepView:
        """The verdict."""
        if self.report is None:
            return StepView("One moment: the cameras are being calibrated.", hint=self.problem)
        usable = self.report.figures is not None and self.report.verdict.acceptable
        sentence = "Read the verdict, then press Next." if usable else "Do what the verdict says, then come back."
        return StepView(sentence, done=usable, verdict=self.report.verdict)


def _same_question(first: tuple[SharedViews, KnownLengths], second: tuple[SharedViews, KnownLengths]) -> bool:
    """Shots and lengths are never changed, so the same ones are the same objects."""
    same_shots = len(first[0].shots) == len(second[0].shots) and all(
        a is b for a, b in zip(first[0].shots, second[0].shots, strict=True))
    return same_shots and first[0].board == second[0].board and first[1] is second[1]


class TableStep(BoardFinder):
    """Where the world is: at the first camera, or on the table under the board."""

    title = "The table"
    captures = True

    def __init__(self, board_step: BoardStep, solve: StereoSolveStep, cameras: tuple[str, ...]) -> None:
        super().__init__(board_step, cameras)
        self._solve = solve
        self._of: StereoReport | None = None
        self.world: WorldFrame | None = None
        self.problem = ""

    def enter(self) -> None:
        """A new solve makes an old table useless."""
        if self._solve.report is not self._of:
            self._of, self.world, self.problem = self._solve.report, None, ""

    def capture(self) -> bool:
        """Space: the board lies on the table now."""
        if self._of is None or self._of.figures is None:
            return False
        try:
            self.world = place_world([self.seen[name] for name in self.cameras or ()], self.board,
                                     self._of.figures.state, self._of.cameras)
        except CalibrationError as exc:
            self.world, self.problem = None, str(exc)
            return False
        self.problem = ""
        return True

    def undo(self) -> bool:
        """Leave the world at the first camera after all."""
        had, self.world = self.world is not None, None
        return had

    def view(self) -> StepView:
        """Optional, so Next is always possible but after a table that cannot be."""
        wrong = self.world is not None and not self.world.verdict.acceptable
        if self.world is None:
            first = (self.cameras or ("first",))[0]
            sentence = "Lay the board flat on the table and press Space, or press Next."
            hint = self.problem or self.search.missing or (
                f"Without a table the world begins at camera {first}, and the scene is not level.")
        else:
            sentence = "Lay the board flat and press Space again." if wrong else "The table is known: press Next."
            hint = ""
        return StepView(sentence, done=not wrong and self.world is not None, hint=hint,
                        annotated=self.search.annotated(self.board),
                        verdict=self.world.verdict if self.world is not None else None,
                        kept=int(self.world is not None), passable=not wrong)


# -- The proposed rig and its figures ----------------------------------------------------------------------------------



def stereo_proposal(rig: Rig, path: Path | None, report: StereoReport, world: WorldFrame | None) -> Proposal | None:
    """What the last page shows and uses; None while the cameras could not be put together."""
    figures = report.figures
    if figures is None:
        return None
    after = calibrated_rig(rig, figures, world)
    found = [*report.verdict.findings, *rig_findings(after, report.cameras)]
    found += world.verdict.findings if world is not None else ()
    unique = {finding.figure: finding for finding in found}
    return Proposal(STEREO.reason, judge(report.summary, list(unique.values())), _rows(rig, after, figures),
                    (RigChange(rig, after, path, STEREO.reason),))


def _rows(before: Rig, after: Rig, figures: StereoFigures) -> tuple[Row, ...]:
    rows = [Row(f"{pair.first} to {pair.second}: distance", _distance(before, pair),
                f"{1e3 * pair.baseline_m:.2f} ± {1e3 * _baseline_std(pair):.2f} mm") for pair in figures.pairs]
    old = {name: text for node in before.nodes for name, text in place_figures(node).items()}
    new = {name: text for node in after.nodes for name, text in place_figures(node).items()}
    rows += [Row(name, old[name], text) for name, text in new.items()]
    rows.append(Row("corners, rms", "", f"{figures.rms_px:.2f} px"))
    rows.append(Row("squares, measured", f"{1e3 * figures.board.square_m:.2f} mm by ruler",
                    f"{1e3 * figures.squares.mean_m:.2f} mm"))
    rows.append(Row("lengths", lengths_text(before), lengths_text(after)))
    by_calibration, by_noise = (1e3 * error for error in figures.error_m)
    rows.append(Row(f"error expected at {WORKING_DISTANCE_M:g} m", "", f"{by_calibration:.2f} mm by the calibration, "
                    f"{by_noise:.2f} mm by noise"))
    return tuple(rows)


def _distance(rig: Rig, pair: PairFigures) -> str:
    places = {node.name: np.array(node.pose.translation_m) for node in rig.nodes if node.pose_known}
    if not {pair.first, pair.second} <= places.keys():
        return "not known"
    return f"{1e3 * np.linalg.norm(places[pair.second] - places[pair.first]):.2f} mm"


def _baseline_std(pair: PairFigures) -> float:
    """Of the length of T, by the standard deviations of its parts."""
    return float(np.linalg.norm(pair.translation_m * pair.translation_std_m) / pair.baseline_m)


def chosen_nodes(rig: Rig) -> tuple[RigNode, ...]:
    """The cameras that have pictures."""
    return tuple(node for node in rig.nodes if not node.text_datagrams)
