"""A chessboard before the cameras of a rig, drawn by its homography: quick enough for a live picture."""

from __future__ import annotations

import cv2
import numpy as np

from rhot_app.calibration.board.boards import STANDARD_BOARD, Chessboard
from rhot_app.calibration.board.corners import BoardView, detect
from rhot_app.estimation.se3 import exp_so3, rotation_from_quaternion
from rhot_app.geometry.transforms import inverse, rigid
from rhot_app.project import Rig
from rhot_app.ui.backend.feed import Picture

_PX_PER_SQUARE = 40
_NEAR_PX = 12.0  # perspective moves the mean of the corners off the middle's picture
_SQUARES_BESIDE = 1.5  # white paper around the board


def board_texture(board: Chessboard) -> np.ndarray:
    """(H, W) uint8, the whole sheet seen from above."""
    margin = round(_SQUARES_BESIDE * _PX_PER_SQUARE)
    rows, cols = board.rows + 1, board.cols + 1
    squares = (np.add.outer(np.arange(rows), np.arange(cols)) % 2 * 180 + 30).astype(np.uint8)
    sheet = np.kron(squares, np.ones((_PX_PER_SQUARE, _PX_PER_SQUARE), np.uint8))
    return np.pad(sheet, margin, constant_values=215)


def compile_search() -> None:
    """The search for boards is compiled at its first use; tests that wait for it would wait too long."""
    board = STANDARD_BOARD
    detect(cv2.resize(board_texture(board), (320, 240), interpolation=cv2.INTER_AREA), board, thorough=False)


class BoardScene:
    """Pictures of one board in front of `rig`; `world_from_board` is set by the test, None takes the board away."""

    def __init__(self, rig: Rig, board: Chessboard) -> None:
        self.rig = rig
        self.board = board
        self.world_from_board: np.ndarray | None = None
        self._noise = np.random.default_rng(3).integers(0, 7, (480, 640), dtype=np.uint8)
        self._drawn: dict[int, tuple[object, np.ndarray]] = {}  # by node: where the board was, and that picture
        self._texture = board_texture(board)

    def place(self, rotation: tuple[float, float, float], centre_m: tuple[float, float, float]) -> None:
        """Turn the board by the rotation vector (rad), its middle at `centre_m` in the rig's frame."""
        middle = self.board.object_points().mean(axis=0)
        turn = exp_so3(np.array(rotation))
        self.world_from_board = rigid(turn, np.array(centre_m) - turn @ middle)

    def homography(self, node_id: int, world_from_board: np.ndarray) -> np.ndarray:
        """(3, 3) px of a camera from px of the texture."""
        node = next(node for node in self.rig.nodes if node.node_id == node_id)
        lens = node.intrinsics
        world_from_camera = rigid(rotation_from_quaternion(node.pose.rotation_wxyz), node.pose.translation_m)
        camera_from_board = inverse(world_from_camera) @ world_from_board
        matrix = np.array([[lens.fx, 0, lens.cx], [0, lens.fy, lens.cy], [0, 0, 1]])
        scale, first = self.board.square_m / _PX_PER_SQUARE, (_SQUARES_BESIDE + 1) * _PX_PER_SQUARE - 0.5
        board_from_texture = np.array([[scale, 0, -scale * first], [0, scale, -scale * first], [0, 0, 1]])
        return matrix @ camera_from_board[:3, [0, 1, 3]] @ board_from_texture

    def seen_in(self, views: dict[str, BoardView | None]) -> bool:
        """Whether every camera's view shows the board where it is now."""
        return all(self.near(node.node_id, views.get(node.name)) for node in self.rig.nodes)

    def near(self, node_id: int, view: BoardView | None) -> bool:
        """Whether a camera's view shows the board where it is now."""
        if view is None or self.world_from_board is None:
            return False
        middle = np.array(self._texture.shape[::-1]) / 2.0
        spot = self.homography(node_id, self.world_from_board) @ [*middle, 1.0]
        return bool(np.linalg.norm(view.pixels.mean(axis=0) - spot[:2] / spot[2]) < _NEAR_PX)

    def draw(self, node_id: int, t_s: float = 0.0) -> np.ndarray:
        """What the camera sees."""
        where = self.world_from_board
        before, picture = self._drawn.get(node_id, (self, self._noise))
        if where is not before:
            grey = np.full((480, 640), 110, np.uint8)
            if where is not None:
                cv2.warpPerspective(self._texture, self.homography(node_id, where), (640, 480), grey, cv2.INTER_AREA,
                                    cv2.BORDER_CONSTANT, 110)
            picture = cv2.cvtColor(cv2.add(cv2.GaussianBlur(grey, (0, 0), 0.7), self._noise), cv2.COLOR_GRAY2BGR)
            self._drawn[node_id] = where, picture
        return picture

    def pictures(self) -> dict[str, Picture]:
        """What all cameras see now."""
        return {node.name: Picture(node.name, self.draw(node.node_id), 1, 0, 0) for node in self.rig.nodes}
