"""The board as seen by several cameras at the same moments: the input of the stereo calibration."""

from __future__ import annotations

from dataclasses import dataclass

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView


@dataclass(frozen=True, slots=True)
class BoardShot:
    """One moment: `name` for messages, and per camera the board as it saw it, None where it did not."""

    name: str
    views: tuple[BoardView | None, ...]

    @property
    def seen_by(self) -> tuple[int, ...]:
        """Indices of the cameras that see the board."""
        return tuple(camera for camera, view in enumerate(self.views) if view is not None)


@dataclass(frozen=True, slots=True)
class SharedViews:
    """All shots of a calibration; every shot has one entry per camera, in the order of `cameras`."""

    cameras: tuple[str, ...]
    board: Board
    shots: tuple[BoardShot, ...]

    def of_camera(self, camera: int) -> list[BoardView]:
        """All views of one camera."""
        return [view for shot in self.shots if (view := shot.views[camera]) is not None]

    def shared(self, first: int, second: int) -> int:
        """How many shots both cameras have seen."""
        return sum(shot.views[first] is not None and shot.views[second] is not None for shot in self.shots)


@dataclass(frozen=True, slots=True)
class Dropped:
    """A shot or picture that was not used, and why in words.

    `code` says the kind for programs: "file" (unreadable, another size), "no_board", "no_partner", "order", "apart"
    (the cameras disagree), "residual" (fits badly).
    """

    name: str
    reason: str
    code: str
