"""A synthetic rig before a board: exact projections of its corners, with noise where it is asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board, Chessboard
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.shared_views import BoardShot, SharedViews
from rhot_app.calibration.lens.fit import LensStart
from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.camera import CameraModel, full_lens, intrinsics_row
from rhot_app.geometry.transforms import inverse, rigid

Array = NDArray[np.float64]

SIZE = (640, 480)
LENSES = np.array([full_lens([535.0, 536.0, 342.0, 235.0, -0.27, 0.08, 0.0007, -0.0003]),
                   full_lens([540.0, 539.0, 327.0, 249.0, -0.28, 0.10, 0.0003, 0.0001])])
RIGHT_FROM_LEFT = rigid(exp_so3([0.0067, 0.0045, -0.0035]), [-0.0998, 0.0011, 0.0001])
BOARD = Chessboard(9, 6, 0.030)


@dataclass(frozen=True)
class Twin:
    """The truth: `lenses` (C, 12), `camera_from_world` (C, 4, 4), one `world_from_board` (S, 4, 4) per shot."""

    names: tuple[str, ...]
    board: Board
    lenses: Array
    camera_from_world: Array
    world_from_board: Array
    board_errors_m: Array | float = 0.0  # (N, 3), how far the printed corners are from where they should be

    def starts(self, **fields: object) -> list[LensStart]:
        """The true lenses as given ones."""
        return [LensStart(lens.copy(), SIZE, **fields) for lens in self.lenses]  # type: ignore[arg-type]

    def views(self, rng: np.random.Generator | None = None, noise_px: float = 0.0) -> SharedViews:
        """What the cameras see; a board that is not wholly in a picture is not seen."""
        shots = []
        for number, world_from_board in enumerate(self.world_from_board):
            views = tuple(self._view(camera, world_from_board, rng, noise_px) for camera in range(len(self.names)))
            shots.append(BoardShot(f"{number + 1:02d}", views))
        return SharedViews(self.names, self.board, tuple(shots))

    def _view(self, camera: int, world_from_board: Array, rng: np.random.Generator | None,
              noise_px: float) -> BoardView | None:
        points = self.board.object_points() + self.board_errors_m
        world = points @ world_from_board[:3, :3].T + world_from_board[:3, 3]
        camera_from_world = self.camera_from_world[camera]
        facing = (camera_from_world @ world_from_board)[:3, 2] @ (camera_from_world @ world_from_board)[:3, 3]
        model = CameraModel(*SIZE, intrinsics_row(self.lenses[camera]), inverse(camera_from_world),
                            camera_from_world)
        pixels = model.project(world)
        inside = (pixels >= 0.0) & (pixels <= np.array(SIZE) - 1.0)
        if facing <= 0.0 or not inside.all():
            return None
        if rng is not None:
            pixels = pixels + rng.normal(0.0, noise_px, pixels.shape)
        grid = pixels.reshape(self.board.rows, self.board.cols, 2)
        side = min(float(np.linalg.norm(np.diff(grid, axis=axis), axis=2).min()) for axis in (0, 1))
        return BoardView(pixels, np.arange(len(pixels)), *SIZE, side, 2.0, self.names[camera])


def stereo_twin(seed: int = 0, shots: int = 14, board: Board = BOARD) -> Twin:
    """A left and a right camera like those of the real pictures, and boards as a person holds them before both."""
    rng = np.random.default_rng(seed)
    twin = Twin(("left", "right"), board, LENSES, np.array([np.eye(4), RIGHT_FROM_LEFT]), np.empty((0, 4, 4)))
    return with_boards(twin, rng, shots, np.array([0.05, 0.0, 0.5]))


def with_boards(twin: Twin, rng: np.random.Generator, shots: int, about: Array, seen_by: int = 2) -> Twin:
    """The twin with boards held near `about` (3,) m, facing the first camera, each seen by `seen_by` cameras."""
    boards: list[Array] = []
    middle = twin.board.object_points().mean(axis=0)
    while len(boards) < shots:
        rotation = exp_so3(rng.normal(0.0, 0.35, 3))
        place = about + rng.uniform([-0.12, -0.08, -0.15], [0.12, 0.08, 0.2])
        pose = rigid(rotation, place - rotation @ middle)
        trial = Twin(twin.names, twin.board, twin.lenses, twin.camera_from_world, pose[None])
        if len(trial.views().shots[0].seen_by) >= seen_by:
            boards.append(pose)
    return Twin(twin.names, twin.board, twin.lenses, twin.camera_from_world, np.array(boards))
