"""The wizard of a camera's intrinsics: camera and board, views all over its picture, solve, before and after."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from PySide6.QtWidgets import QCheckBox, QComboBox

from rhot_app.calibration.board.boards import Board, same_pattern
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.shared_views import BoardShot
from rhot_app.calibration.lens.coverage import CaptureGuide, Coverage
from rhot_app.calibration.lens.intrinsics import IntrinsicsResult
from rhot_app.project import Intrinsics
from rhot_app.ui.backend.feed import Image, Picture
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.wizards.framework.board import (
    MEMORY,
    BoardFields,
    BoardObservation,
    BoardPage,
    BoardStep,
    fields_from,
)
from rhot_app.ui.wizards.framework.definition import Definition, SettingsStore, WizardContext, accept_result
from rhot_app.ui.wizards.framework.drawing import Cells, Dots, Line, Mark, Overlay, Tag
from rhot_app.ui.wizards.framework.films import FilmedStep, Films, FilmsPage
from rhot_app.ui.wizards.framework.page import FigureTable, Page, shrinkable
from rhot_app.ui.wizards.framework.step import Bar, Pictures, SolveStep, StepView

LAST = "lens camera"


def make_wizard(context: WizardContext) -> Definition:
    """The wizard's pages for the rig at hand; it begins with the camera after the one that was done last."""
    cameras = tuple(node.name for node in context.rig.nodes if not node.text_datagrams)
    board = LensBoardStep(fields_from(context.memory.remembered(MEMORY)), cameras,
                          _next(cameras, context.memory.remembered(LAST)))
    show = LensShowStep(board)
    solve = LensSolveStep(context, show)

    def chosen(result: IntrinsicsResult) -> IntrinsicsResult:
        """The next run begins with the camera after it."""
        context.memory.remember(LAST, result.camera)
        return result

    pages = (LensBoardPage(board, context.memory), FilmsPage(show), LensResultPage(solve),
             accept_result(context, solve, completed=chosen))
    return Definition(pages)


def _next(cameras: tuple[str, ...], done: str) -> str:
    return cameras[(cameras.index(done) + 1) % len(cameras)] if done in cameras else cameras[0]


# -- steps -------------------------------------------------------------------------------------------------------------

FEWEST = 5  # views that a solve can do anything with
_VOUCHED_S = 0.03  # a person who presses Space says that the board has not moved since the last picture
_CELL_FULL = 12  # corners in a part of the picture that tint it wholly
_BARS = {"x": ("X", tr_noop("from the left to the right edge")),
         "y": ("Y", tr_noop("from the upper to the lower edge")),
         "size": (tr_noop("size"), tr_noop("near enough to fill much of the picture")),
         "skew": (tr_noop("skew"), tr_noop("tilted, which tells the focal length"))}


class LensBoardStep(BoardStep):
    """Which camera, and which board."""

    title = tr_noop("Camera and board")

    def __init__(self, fields: BoardFields, cameras: tuple[str, ...], first: str) -> None:
        """`first` is chosen to begin with, if there is such a camera."""
        self.choices = cameras
        self.camera = first if first in cameras else cameras[0]
        super().__init__(fields, (self.camera,))

    def choose(self, camera: str) -> None:
        """Another camera."""
        self.camera, self.cameras = camera, (camera,)
        self.forget_views()


class LensShowStep(FilmedStep):
    """Views of the board, taken by themselves when it is still, sharp and somewhere new, or with Space."""

    title = tr_noop("Show the board")
    watches = captures = True

    def __init__(self, board_step: LensBoardStep) -> None:
        super().__init__()
        self._board_step = board_step
        self._guide: CaptureGuide | None = None
        self._of: tuple[str, Board] | None = None
        self._seen: tuple[BoardView | None, float] = (None, 0.0)
        self._sentence = ""
        self.films = Films(())
        self._covered: tuple[int, Coverage, bool] | None = None  # by the number of views: it takes milliseconds

    def enter(self) -> None:
        """Another board or camera makes the views useless; a corrected size of the squares does not."""
        board, camera = self._board_step.board, self._board_step.camera
        assert board is not None, tr("the first step is not done without a board")
        self.cameras = (camera,)
        if self._of is None or self._guide is None or self._of[0] != camera or not same_pattern(self._of[1], board):
            if self.films.cameras != (camera,):
                self.films = Films((camera,))
            self.begin()
        elif self._of[1] != board:
            self._of = camera, board
            self._guide.resize(board)

    def begin(self) -> None:
        """Forget what was taken."""
        board, camera = self._board_step.board, self._board_step.camera
        assert board is not None, tr("the first step is not done without a board")
        self._of, self._guide = (camera, board), CaptureGuide(board)
        self._seen, self._sentence, self._covered = (None, 0.0), "", None
        super().begin()

    def keep(self, shot: BoardShot) -> None:
        """Take what a film shows at one moment."""
        if self._guide is not None:
            for view in (view for view in shot.views if view is not None):
                self._guide.keep(view)

    @property
    def camera(self) -> str:
        """Whose lens it is."""
        return self._board_step.camera

    @property
    def board(self) -> Board:
        """The board that is shown."""
        assert self._of is not None
        return self._of[1]

    @property
    def views(self) -> tuple[BoardView, ...]:
        """What was taken so far."""
        return self._guide.views if self._guide is not None else ()

    @property
    def seen(self) -> BoardView | None:
        """The board in the last picture."""
        return self._seen[0]

    @property
    def keeps(self) -> bool:
        """Whether anything was taken."""
        return bool(self.views)

    def observe(self, pictures: Pictures) -> tuple[str, BoardObservation, float]:
        """The board in the picture, and when that was taken, s of the node's clock."""
        camera = self.camera
        return (camera, self.search.look({camera: pictures[camera]}, self.board),
                1e-9 * pictures[camera].t_node_ns)

    def accept_observation(self, seen: tuple[str, BoardObservation, float]) -> None:
        """Offer what is seen; the guide decides and says what to do."""
        camera, look, t_s = seen
        if self._guide is not None and (camera, look.board) == self._of and not self.films.paths:
            self.search.accept_observation(look)
            view = look.views[camera]
            self._seen = view, t_s
            if self.other_board is None:
                self._sentence = self._guide.offer(view, t_s).sentence

    def capture(self) -> bool:
        """Space: take what is seen now, unless it adds nothing or is blurred."""
        view, t_s = self._seen
        if self._guide is None or view is None or self.films.paths or self.other_board is not None:
            return False
        decision = self._guide.offer(view, t_s + _VOUCHED_S)
        self._sentence = decision.sentence
        return decision.capture

    def undo(self) -> bool:
        """Forget the view taken last."""
        if self._guide is None or not self.views:
            return False
        self._guide.discard_last()
        return True

    def shown(self) -> StepView:
        """What to do with the board, and what is covered."""
        if self._guide is None:
            return StepView(tr("Show the whole board to the camera."))
        count = len(self.views)
        if self._covered is None or count != self._covered[0]:
            self._covered = count, self._guide.coverage, self._guide.complete
        _, coverage, complete = self._covered
        bars = [Bar(_BARS[key][0], share, _BARS[key][1]) for key, share in coverage.bars.items()]
        bars.append(Bar(tr("picture"), min(coverage.share / 0.7, 1.0),
                        tr("parts of the picture in which corners were seen")))
        overlay: Overlay = (Cells(coverage.cells / _CELL_FULL),)
        annotated = self.search.annotated(self.board)
        sentence = tr("Enough: press Next.") if complete else self._sentence or tr("Show the whole board to the "
                                                                                   "camera.")
        taken = tr("{count} pictures taken.", count=count) if count else ""
        return StepView(sentence, done=complete, hint=self.search.missing or taken, bars=tuple(bars),
                        annotated=annotated, overlays={self.camera: overlay}, kept=count, passable=count >= FEWEST)


ARROW_PX = 20.0
"""Residuals are hundredths or tenths of a pixel; the longest arrow should be about so long in the picture."""


class LensSolveStep(SolveStep):
    """The solve; then the picture with the residuals, or straightened by the new lens."""

    watches = True
    result: IntrinsicsResult | None

    def __init__(self, context: WizardContext, show: LensShowStep) -> None:
        super().__init__(context.calibration, context.now,
                         lambda: (show.views, show.board, show.camera, self.square_pixels),
                         tr("Estimating the intrinsics"))
        self._show = show
        self._straight: dict[str, Picture] = {}
        self.straighten = False
        self.square_pixels = False

    def set_square_pixels(self, on: bool) -> None:
        """Force fx = fy, and solve again."""
        self.square_pixels = on
        self.enter()

    def enter(self) -> None:
        """Of the camera whose views were taken."""
        self.cameras = (self._show.camera,)
        super().enter()

    def observe(self, pictures: Pictures) -> dict[str, Picture]:
        """The pictures as the new lens straightens them, when that is asked for."""
        result = self.result
        if result is None or not self.straighten:
            return {}
        return {name: replace(picture, bgr=straightened(picture.bgr, result.intrinsics))
                for name, picture in pictures.items() if picture.bgr.shape[1::-1] == result.size}

    def accept_observation(self, seen: dict[str, Picture]) -> None:
        """The straightened pictures."""
        self._straight = seen

    def view(self) -> StepView:
        """The verdict, and the residuals over the picture."""
        view = super().view()
        if self.result is None:
            return view
        if self.straighten:
            return replace(view, pictures=self._straight)
        return replace(view, overlays={self._show.camera: residual_marks(self.result)})


def straightened(bgr: Image, lens: Intrinsics) -> Image:
    """The picture as a lens without distortion would show it: what is straight in the room becomes straight."""
    matrix = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
    return np.asarray(cv2.undistort(bgr, matrix, np.array(lens.distortion)), np.uint8)


def residual_marks(result: IntrinsicsResult) -> Overlay:
    """Where corners were, and the mean residual of each part of the picture as an arrow, exaggerated as stated."""
    field, (width, height) = result.field, result.size
    rows, cols = field.count.shape
    longest = float(np.nanmax(np.linalg.norm(field.mean, axis=-1), initial=0.0))
    times = 10.0 ** np.floor(np.log10(ARROW_PX / longest)) if longest > 0.0 else 1.0
    marks: list[Mark] = [Dots(field.places, "accent", radius=1.2, filled=True)]
    for row in range(rows):
        for col in range(cols):
            mean = field.mean[row, col]
            if np.isfinite(mean).all():
                start = np.array([(col + 0.5) * width / cols, (row + 0.5) * height / rows])
                marks += [Line(np.array([start, start + times * mean]), "caution", width=2.5),
                          Dots(start[None], "caution", radius=2.5, filled=True)]
    return (*marks, Tag(6.0, height - 24.0, tr("arrows: residuals × {times:,.0f}", times=times)))


# -- the pages of the lens wizard --------------------------------------------------------------------------------------

class LensBoardPage(BoardPage):
    """The camera is chosen above the board's fields."""

    def __init__(self, step: LensBoardStep, memory: SettingsStore) -> None:
        super().__init__(step, memory)
        self.which = QComboBox()
        self.which.addItems(step.choices)
        self.which.setCurrentText(step.camera)
        self.which.setToolTip(tr("Whose intrinsics are calibrated. One camera at a time."))
        self.add_field(tr("Camera"), self.which)
        self.which.currentTextChanged.connect(self._choose)
        self.first_field = self.which
        self._lens_step = step

    def _choose(self, camera: str) -> None:
        self._lens_step.choose(camera)
        self.changed.emit()


class LensResultPage(Page):
    """Errors by view; the picture with residuals or straightened; pixels forced to be square."""

    def __init__(self, step: LensSolveStep) -> None:
        super().__init__(step)
        self._lens = step
        self.straighten = QCheckBox(tr("Straighten the picture"))
        self.straighten.setToolTip(tr("Shows the live picture without the lens's distortion: hold a ruler before the "
                                      "camera, it must be straight everywhere."))
        self.straighten.toggled.connect(self._straighten)
        self.square = QCheckBox(tr("Pixels are square"))
        self.square.setToolTip(tr("Forces one focal length for both directions, as nearly every sensor has it. Fewer "
                                  "numbers to find need fewer views."))
        self.square.toggled.connect(self._square)
        self.table = FigureTable(3)
        self.table.setToolTip(tr("How well each view fits. Arrows in the picture are the mean residual of each part: a "
                                 "pattern in them is something that the lens model does not explain."))
        self.column.addWidget(self.straighten)
        self.column.addWidget(self.square)
        self.column.addWidget(self.table, 1)
        shrinkable(self.table)

    def _straighten(self, on: bool) -> None:
        self._lens.straighten = on
        self.changed.emit()

    def _square(self, on: bool) -> None:
        self._lens.set_square_pixels(on)
        self.changed.emit()

    def show_view(self, view: StepView) -> None:
        """The errors of the newest solve."""
        self.table.show_table(None if self._lens.report is None else self._lens.report.tables[0])
