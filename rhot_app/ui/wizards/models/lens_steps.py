"""The steps that find one camera's lens: which camera, views of a board all over its picture, the solve."""

from __future__ import annotations

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView, detect
from rhot_app.calibration.lens.capture_guide import CaptureGuide
from rhot_app.calibration.lens.coverage import Coverage
from rhot_app.ui.wizards.models.board_drawing import board_marks
from rhot_app.ui.wizards.models.board_form import BoardFields, BoardStep
from rhot_app.ui.wizards.models.drawing import Cells, Overlay
from rhot_app.ui.wizards.models.step import Bar, Pictures, Step, StepView

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


class LensShowStep(Step):
    """Views of the board, taken by themselves when it is still, sharp and somewhere new, or with Space."""

    title = "Show the board"
    watches = captures = True

    def __init__(self, board_step: LensBoardStep) -> None:
        self._board_step = board_step
        self._guide: CaptureGuide | None = None
        self._of: tuple[str, Board] | None = None
        self._seen: tuple[BoardView | None, float] = (None, 0.0)
        self._sentence = ""
        self._covered: tuple[int, Coverage, bool] | None = None  # by the number of views: it takes milliseconds

    def enter(self) -> None:
        """Another board or camera makes the views useless."""
        board, camera = self._board_step.board, self._board_step.camera
        assert board is not None, "the first step is not done without a board"
        self.cameras = (camera,)
        if self._of != (camera, board):
            self._of, self._guide = (camera, board), CaptureGuide(board)
            self._seen, self._sentence, self._covered = (None, 0.0), "", None

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
    def keeps(self) -> bool:
        """Whether anything was taken."""
        return bool(self.views)

    def see(self, pictures: Pictures) -> tuple[str, Board, BoardView | None, float]:
        """The board in the picture, and when that was taken, s of the node's clock."""
        camera, board = self.camera, self.board
        picture = pictures[camera]
        view = detect(picture.bgr, board, thorough=False, source=camera)
        return camera, board, view, 1e-9 * picture.t_node_ns

    def take(self, seen: tuple[str, Board, BoardView | None, float]) -> None:
        """Offer what is seen; the guide decides and says what to do."""
        camera, board, view, t_s = seen
        if self._guide is not None and (camera, board) == self._of:
            self._seen = view, t_s
            self._sentence = self._guide.offer(view, t_s).sentence

    def capture(self) -> bool:
        """Space: take what is seen now, unless it adds nothing or is blurred."""
        view, t_s = self._seen
        if self._guide is None or view is None:
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
        if self._guide is None:
            return StepView("Show the whole board to the camera.")
        count = len(self.views)
        if self._covered is None or count != self._covered[0]:
            self._covered = count, self._guide.coverage, self._guide.complete
        _, coverage, complete = self._covered
        bars = [Bar(_BARS[key][0], share, _BARS[key][1]) for key, share in coverage.bars.items()]
        bars.append(Bar("picture", min(coverage.share / 0.7, 1.0), "parts of the picture in which corners were seen"))
        overlay: Overlay = (Cells(coverage.cells / _CELL_FULL),)
        if self._seen[0] is not None:
            overlay = (*overlay, *board_marks(self._seen[0], self.board))
        sentence = "Enough: press Next." if complete else self._sentence or "Show the whole board to the camera."
        return StepView(sentence, done=complete, hint=f"{count} pictures taken." if count else "", bars=tuple(bars),
                        overlays={self.camera: overlay}, kept=count, passable=count >= FEWEST)
