"""The steps that find one camera's lens: which camera, views of a board all over its picture, the solve."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from rhot_app.calibration.board.boards import Board, same_pattern
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.shared_views import BoardShot
from rhot_app.calibration.check.camera_calibration import with_lens
from rhot_app.calibration.lens.coverage import CaptureGuide, Coverage
from rhot_app.calibration.lens.intrinsics import IntrinsicsReport, solve
from rhot_app.calibration.lens.intrinsics_checks import WORKING_DISTANCE_M
from rhot_app.calibration.registry import LENS
from rhot_app.project import Intrinsics, Rig
from rhot_app.ui.backend.feed import Image, Picture
from rhot_app.ui.models.proposal import Proposal, RigChange, Row
from rhot_app.ui.models.rows import lens_figures
from rhot_app.ui.wizards.models.board_form import OTHER_BOARD, BoardFields, BoardObservation, BoardSearch, BoardStep
from rhot_app.ui.wizards.models.drawing import Cells, Dots, Line, Mark, Overlay, Tag
from rhot_app.ui.wizards.models.step import Bar, Pictures, Step, StepView, Task
from rhot_app.ui.wizards.steps.film_steps import FilmedStep, Films

FEWEST = 5  # views that a solve can do anything with
_VOUCHED_S = 0.03  # a person who presses Space says that the board has not moved since the last picture
_CELL_FULL = 12  # corners in a part of the picture that tint it wholly
_BARS = {"x": ("X", "from the left to the right edge"), "y": ("Y", "from the upper to the lower edge"),
         "size": ("size", "near enough to fill much of the picture"),
         "skew": ("skew", "tilted, which tells the focal length")}


class LensBoardStep(BoardStep):
    """Which camera, and which board."""

    title = "Camera and board"

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

    title = "Show the board"
    watches = captures = True

    def __init__(self, board_step: LensBoardStep) -> None:
        self._board_step = board_step
        self._guide: CaptureGuide | None = None
        self._of: tuple[str, Board] | None = None
        self._search = BoardSearch()
        self._seen: tuple[BoardView | None, float] = (None, 0.0)
        self._sentence = ""
        self.films = Films(())
        self._covered: tuple[int, Coverage, bool] | None = None  # by the number of views: it takes milliseconds

    def enter(self) -> None:
        """Another board or camera makes the views useless; a corrected size of the squares does not."""
        board, camera = self._board_step.board, self._board_step.camera
        assert board is not None, "the first step is not done without a board"
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
        assert board is not None, "the first step is not done without a board"
        self._of, self._guide = (camera, board), CaptureGuide(board)
        self._seen, self._sentence, self._covered = (None, 0.0), "", None
        self._search.forget()
        self.films.forget_read()

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

    def see(self, pictures: Pictures) -> tuple[str, BoardObservation, float]:
        """The board in the picture, and when that was taken, s of the node's clock."""
        camera = self.camera
        return (camera, self._search.look({camera: pictures[camera]}, self.board),
                1e-9 * pictures[camera].t_node_ns)

    def take(self, seen: tuple[str, BoardObservation, float]) -> None:
        """Offer what is seen; the guide decides and says what to do."""
        camera, look, t_s = seen
        if self._guide is not None and (camera, look.board) == self._of and not self.films.paths:
            self._search.take(look)
            view = look.views[camera]
            self._seen = view, t_s
            if self._search.size_finding(self.board) is None:
                self._sentence = self._guide.offer(view, t_s).sentence

    def capture(self) -> bool:
        """Space: take what is seen now, unless it adds nothing or is blurred."""
        view, t_s = self._seen
        if self._guide is None or view is None or self.films.paths or self._search.size_finding(self.board) is not None:
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

    def view(self) -> StepView:
        """What to do with the board, and what is covered."""
        shown = self._live_view()
        return self.films.view(shown) if self.films.paths else shown

    def _live_view(self) -> StepView:
        if self._guide is None:
            return StepView("Show the whole board to the camera.")
        count = len(self.views)
        if self._covered is None or count != self._covered[0]:
            self._covered = count, self._guide.coverage, self._guide.complete
        _, coverage, complete = self._covered
        bars = [Bar(_BARS[key][0], share, _BARS[key][1]) for key, share in coverage.bars.items()]
        bars.append(Bar("picture", min(coverage.share / 0.7, 1.0), "parts of the picture in which corners were seen"))
        overlay: Overlay = (Cells(coverage.cells / _CELL_FULL),)
        annotated = self._search.annotated(self.board)
        wrong = self._search.size_finding(self.board)
        if wrong is not None:
            return StepView(OTHER_BOARD, hint=f"{wrong.figure} {wrong.cause}", bars=tuple(bars),
                            annotated=annotated, overlays={self.camera: overlay}, kept=count)
        sentence = "Enough: press Next." if complete else self._sentence or "Show the whole board to the camera."
        taken = f"{count} pictures taken." if count else ""
        return StepView(sentence, done=complete, hint=self._search.missing or taken, bars=tuple(bars),
                        annotated=annotated, overlays={self.camera: overlay}, kept=count, passable=count >= FEWEST)


# -- Step: solve for the lens ------------------------------------------------------------------------------------------

ARROW_PX = 20.0
"""Residuals are hundredths or tenths of a pixel; the longest arrow should be about so long in the picture."""


class LensSolveStep(Step):
    """The solve; then the picture with the residuals, or straightened by the new lens."""

    title = "Result"
    watches = True

    def __init__(self, show: LensShowStep) -> None:
        self._show = show
        self._asked: tuple[Board | None, tuple[int, ...]] = None, ()
        self._straight: dict[str, Picture] = {}
        self.report: IntrinsicsReport | None = None
        self.problem = ""
        self.straighten = False
        self.square_pixels = False

    def set_square_pixels(self, on: bool) -> None:
        """Force fx = fy, and solve again."""
        if on != self.square_pixels:
            self.square_pixels, self.report = on, None

    def enter(self) -> None:
        """Other views, or another size of the squares, need another solve."""
        self.cameras = (self._show.camera,)
        asked = self._show.board, tuple(id(view) for view in self._show.views)
        if asked != self._asked:
            self._asked, self.report, self.problem, self._straight = asked, None, "", {}

    def task(self) -> Task | None:
        """The solve, as long as there is no answer."""
        if self.report is not None:
            return None
        views = tuple(replace(view, source=f"view {number}") for number, view in enumerate(self._show.views, 1))
        return Task("Estimating the intrinsics", solve, (views, self._show.board),
                    {"square_pixels": self.square_pixels})

    def take_result(self, result: Any) -> None:
        """The answer."""
        self.report, self.problem = result, ""

    def take_failure(self, sentence: str) -> None:
        """Why there is none."""
        self.problem = sentence

    def see(self, pictures: Pictures) -> dict[str, Picture]:
        """The pictures as the new lens straightens them, when that is asked for."""
        report = self.report
        if report is None or not self.straighten:
            return {}
        return {name: replace(picture, bgr=straightened(picture.bgr, report.intrinsics))
                for name, picture in pictures.items() if picture.bgr.shape[1::-1] == report.size}

    def take(self, seen: dict[str, Picture]) -> None:
        """The straightened pictures."""
        self._straight = seen

    def view(self) -> StepView:
        """The verdict, and the residuals over the picture."""
        if self.report is None:
            return StepView("One moment: the intrinsics are being estimated.", hint=self.problem)
        usable = self.report.verdict.acceptable
        sentence = "Read the verdict, then press Next." if usable else "Do what the verdict says, then come back."
        overlays = {} if self.straighten else {self._show.camera: residual_marks(self.report)}
        return StepView(sentence, done=usable, verdict=self.report.verdict, overlays=overlays,
                        pictures=self._straight if self.straighten else {})


def straightened(bgr: Image, lens: Intrinsics) -> Image:
    """The picture as a lens without distortion would show it: what is straight in the room becomes straight."""
    matrix = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
    return np.asarray(cv2.undistort(bgr, matrix, np.array(lens.distortion)), np.uint8)


def residual_marks(report: IntrinsicsReport) -> Overlay:
    """Where corners were, and the mean residual of each part of the picture as an arrow, exaggerated as stated."""
    field, (width, height) = report.field, report.size
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
    return (*marks, Tag(6.0, height - 24.0, f"arrows: residuals × {times:,.0f}"))


def lens_proposal(rig: Rig, path: Path | None, camera: str, report: IntrinsicsReport) -> Proposal:
    """The rig with the new lens, and its figures beside the old ones."""
    after = with_lens(rig, camera, report.intrinsics)
    reason = f"{LENS.reason} {camera}"
    return Proposal(reason, report.verdict, _rows(rig, after, camera, report), (RigChange(rig, after, path, reason),),
                    what_follows(rig, after))


def what_follows(before: Rig, after: Rig) -> str:
    """What a new lens leaves to be done, a sentence; "" for nothing."""
    missing = [node.name for node in after.nodes if node.intrinsics.nominal]
    if len(after.nodes) == 1:
        return ""
    if missing:
        return f"Next the intrinsics of {' and '.join(missing)}, then stereo."
    return ("Next stereo: the poses of the cameras were found with the old intrinsics." if all(before.tracked_with) else
            "Next stereo: how the cameras stand to each other is not known yet.")


def _rows(before: Rig, after: Rig, camera: str, report: IntrinsicsReport) -> tuple[Row, ...]:
    old, new = (next(lens_figures(node) for node in rig.nodes if node.name == camera) for rig in (before, after))
    std = report.std
    certain = {f"{camera}: focal length": f" ± {std[:2].max():.1f} px",
               f"{camera}: centre": f" ± {std[2:4].max():.1f} px"}
    rows = [Row(name, old[name], text.removesuffix(" px") + certain[name] if name in certain else text)
            for name, text in new.items()]
    rows.append(Row("corners, rms", "", f"{report.rms_px:.2f} px over {len(report.views)} views"))
    rows.append(Row(f"error expected at {WORKING_DISTANCE_M:g} m", "", str(report.errors)))
    return tuple(rows)
