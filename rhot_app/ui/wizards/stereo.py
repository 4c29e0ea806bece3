"""The wizard that puts two or more cameras together: board, shared captures, a known length, solve, table."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from rhot_app.calibration.board.boards import Board, same_pattern
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.shared_views import BoardShot, SharedViews
from rhot_app.calibration.kinds.stereo import StereoViews
from rhot_app.calibration.stereo.calibrate import lens_of
from rhot_app.calibration.stereo.collector import Guidance, Offer, StereoCollector
from rhot_app.calibration.stereo.result import StereoResult
from rhot_app.calibration.stereo.start import WorldFrame, place_world
from rhot_app.errors import CalibrationError
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.wizards.framework.board import (
    MEMORY,
    BoardObservation,
    BoardPage,
    BoardSearch,
    BoardStep,
    fields_from,
)
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_result
from rhot_app.ui.wizards.framework.drawing import Dots, Overlay
from rhot_app.ui.wizards.framework.films import FilmedStep, Films, FilmsPage
from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.framework.step import AnnotatedPicture, Bar, Pictures, SolveStep, Step, StepView
from rhot_app.ui.wizards.known_length import LengthsPage, LengthsStep


def make_wizard(context: WizardContext) -> Definition:
    """The wizard's pages for the rig at hand."""
    nodes = [node for node in context.rig.nodes if not node.text_datagrams]
    cameras = tuple(node.name for node in nodes)
    lenses = tuple(None if node.intrinsics.nominal else lens_of(node) for node in nodes)
    board = BoardStep(fields_from(context.memory.remembered(MEMORY)), cameras)
    show = ShowStep(board, cameras)
    known = LengthsStep(cameras)
    solve = SolveStep(context.calibration, context.now, lambda: (StereoViews(show.views, known.known, lenses),),
                      tr("Calibrating the cameras"))
    table = TableStep(board, solve, cameras)
    accept = accept_result(context, solve, completed=lambda result: replace(result, table=table.world))
    pages = (BoardPage(board, context.memory), FilmsPage(show), LengthsPage(known), Page(solve), Page(table), accept)
    return Definition(pages)


# -- steps: captures, world frame --------------------------------------------------------------------------------------

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
        assert board is not None, tr("the first step is not done without a board")
        return board

    def observe(self, pictures: Pictures) -> BoardObservation:
        """The board in each picture."""
        return self.search.look(pictures, self.board)

    def accept_observation(self, seen: BoardObservation) -> None:
        """What the cameras see now; a camera without a picture sees nothing."""
        if seen.board == self.board:
            self.search.accept_observation(seen)
            self.seen = {name: seen.views.get(name) for name in self.cameras or ()}


class ShowStep(BoardFinder, FilmedStep):
    """Shared captures: kept by themselves when the board is still and somewhere new, or with Space."""

    title = tr_noop("Show the board")
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
        super().begin()

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

    def accept_observation(self, seen: BoardObservation) -> None:
        """Offer what is seen; the collector decides."""
        if not self.films.paths:
            super().accept_observation(seen)
            self._put(still=False)

    def capture(self) -> bool:
        """Space: the person vouches that the board is still."""
        return not self.films.paths and self._put(still=True)

    def _put(self, *, still: bool) -> bool:
        if self._collector is None or self.other_board is not None:
            return False
        self._offer = self._collector.offer([self.seen[name] for name in self.cameras or ()], still=still)
        return self._offer.taken

    def undo(self) -> bool:
        """Forget the shot kept last."""
        if self._collector is None or not self.keeps:
            return False
        self._collector.discard_last()
        return True

    def shown(self) -> StepView:
        """What to do with the board, and how far it is."""
        if self._collector is None:
            return StepView(tr("Show the board to both cameras."))
        shots = self.views.shots
        if self._guidance is None or len(shots) != self._guided:
            self._guidance, self._guided = self._collector.guidance(), len(shots)
        guidance = self._guidance
        bars = [Bar(f"{pair.first} + {pair.second}", pair.shared / (pair.shared + pair.missing),
                    tr("shots that both cameras share")) for pair in guidance.pairs]
        if not guidance.pairs:
            bars.append(Bar(tr("{shots} shots", shots=len(shots)), 1.0,
                            tr("every camera shares enough shots with another")))
        bars += [Bar(tr("{name} covered", name=name), share, tr("part of the picture where the board was")) for name,
                 share in zip(self.cameras or (), guidance.covered, strict=True)]
        bars += [Bar(tr("tilted"), float(guidance.tilted),
                     tr("the board was seen tilted: this tells the focal length")),
                 Bar(tr("near and far"), float(guidance.near_and_far), tr("the board was seen large and small"))]
        hint = self.search.missing or self._offer.why.removesuffix(guidance.advice).strip()
        return StepView(self._sentence(guidance.advice), done=guidance.complete, hint=hint,
                        bars=tuple(bars), annotated=self._annotated(), overlays=self._overlays(shots),
                        kept=len(shots), passable=len(shots) >= FEWEST)

    def _sentence(self, advice: str) -> str:
        if not advice:
            return tr("Enough: press Next.")
        if self._offer.why == tr("Hold still."):
            return tr("Hold the board still.")
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


class TableStep(BoardFinder):
    """Where the world is: at the first camera, or on the table under the board."""

    title = tr_noop("The table")
    captures = True

    def __init__(self, board_step: BoardStep, solve: SolveStep, cameras: tuple[str, ...]) -> None:
        super().__init__(board_step, cameras)
        self._solve = solve
        self._of: StereoResult | None = None
        self.world: WorldFrame | None = None
        self.problem = ""

    def enter(self) -> None:
        """A new solve makes an old table useless."""
        if self._solve.result is not self._of:
            self._of, self.world, self.problem = self._solve.result, None, ""

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
            sentence = tr("Lay the board flat on the table and press Space, or press Next.")
            hint = self.problem or self.search.missing or (
                tr("Without a table the world begins at camera {first}, and the scene is not level.", first=first))
        else:
            sentence = tr("Lay the board flat and press Space again.") if wrong else tr("The table is known: press "
                                                                                        "Next.")
            hint = ""
        return StepView(sentence, done=not wrong and self.world is not None, hint=hint,
                        annotated=self.search.annotated(self.board),
                        verdict=self.world.verdict if self.world is not None else None,
                        kept=int(self.world is not None), passable=not wrong)
