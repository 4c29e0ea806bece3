"""Pictures of calibration boards with known corners: rays through a distorted lens, averaged over each pixel."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board import Board, CharucoBoard, Chessboard

Array = NDArray[np.float64]

PAPER, INK, ROOM = 215.0, 35.0, 120.0
LENS = np.array([535.0, 535.0, 322.3, 238.1, -0.28, 0.09, 0.001, -0.0005, 0.0])


@dataclass(frozen=True)
class Photo:
    """How pictures are taken: size px, lens (9,), optical blur (SD, px), noise (SD, grey levels), sub-pixels a side."""

    width: int = 640
    height: int = 480
    lens: tuple[float, ...] = tuple(LENS)
    blur_px: float = 0.7
    noise: float = 2.0
    oversampling: int = 4


def pose(rotation: tuple[float, float, float], centre_m: tuple[float, float, float], board: Board) -> Array:
    """(4, 4) camera_from_board: turned by the rotation vector, its middle at `centre_m` in the camera's frame."""
    matrix = np.eye(4)
    matrix[:3, :3] = cv2.Rodrigues(np.array(rotation))[0]
    middle = board.object_points().mean(axis=0)
    matrix[:3, 3] = np.array(centre_m) - matrix[:3, :3] @ middle
    return matrix


def corners_px(board: Board, camera_from_board: Array, lens: Array | tuple[float, ...],
               board_errors: Array | None = None) -> Array:
    """(N, 2) px, where the board's corners truly are; `board_errors` (N, 3) m moves them on the board."""
    lens = np.asarray(lens)
    matrix = np.array([[lens[0], 0, lens[2]], [0, lens[1], lens[3]], [0, 0, 1]])
    points = board.object_points() if board_errors is None else board.object_points() + board_errors
    return cv2.projectPoints(points, cv2.Rodrigues(camera_from_board[:3, :3])[0],
                             camera_from_board[:3, 3], matrix, lens[4:])[0].reshape(-1, 2)


def take(board: Board, camera_from_board: Array, photo: Photo = Photo(), seed: int = 0) -> NDArray[np.uint8]:
    """(H, W) uint8, the board on a white sheet in a grey room."""
    n = photo.oversampling
    lens = np.array(photo.lens)
    matrix = np.array([[lens[0], 0, lens[2]], [0, lens[1], lens[3]], [0, 0, 1]])
    v, u = np.mgrid[:photo.height * n, :photo.width * n]
    rays = cv2.undistortPointsIter(np.stack([(u + 0.5) / n - 0.5, (v + 0.5) / n - 0.5], -1).reshape(-1, 1, 2), matrix,
                                   lens[4:], None, None, (cv2.TERM_CRITERIA_COUNT, 12, 0)).reshape(-1, 2)
    plane = np.linalg.inv(camera_from_board[:, [0, 1, 3]][:3])  # rays to (x, y, 1) on the board
    spot = np.column_stack([rays, np.ones(len(rays))]) @ plane.T
    ahead = spot[:, 2] > 0
    x, y = spot[:, 0] / spot[:, 2], spot[:, 1] / spot[:, 2]
    image = np.where(ahead, paint(board, x, y), ROOM).reshape(photo.height, n, photo.width, n).mean(axis=(1, 3))
    if photo.blur_px:
        image = cv2.GaussianBlur(image, (0, 0), photo.blur_px)
    image = image + np.random.default_rng(seed).normal(0, photo.noise, image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def paint(board: Board, x: Array, y: Array) -> Array:
    """Grey level of the printed sheet at (x, y) m of the board's frame; the room beyond the sheet's margin."""
    side = board.square_m
    col, row = np.floor(x / side) + 1, np.floor(y / side) + 1  # of the square, from the outermost one
    wide, high = board.cols + 1, board.rows + 1
    printed = (col >= 0) & (row >= 0) & (col < wide) & (row < high)
    sheet = (x > -2.2 * side) & (y > -2.2 * side) & (x < (wide + 0.2) * side) & (y < (high + 0.2) * side)
    if isinstance(board, Chessboard):
        black = (col + row) % 2 == 0
    else:
        black = ink_of_charuco(board, x + side, y + side)
    return np.where(printed & black, INK, np.where(sheet, PAPER, ROOM))


def ink_of_charuco(board: CharucoBoard, x: Array, y: Array) -> NDArray[np.bool_]:
    """Where OpenCV's own drawing of the board is black, at (x, y) m from its upper left corner."""
    per_square = 240
    drawn = board.opencv().generateImage((board.squares_x * per_square, board.squares_y * per_square))
    row = np.clip((y / board.square_m * per_square).astype(int), 0, drawn.shape[0] - 1)
    col = np.clip((x / board.square_m * per_square).astype(int), 0, drawn.shape[1] - 1)
    return drawn[row, col] < 128
