"""Pictures of calibration boards with known corners: rays through a distorted lens, averaged over each pixel."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import AprilGrid, Board, Chessboard, CircleGrid
from rhot_app.geometry.camera import full_lens

Array = NDArray[np.float64]

PAPER, INK, ROOM = 215.0, 35.0, 120.0
MARGIN = 1.2  # of the sheet around the outermost squares, in squares
LENS = full_lens([535.0, 535.0, 322.3, 238.1, -0.28, 0.09, 0.001, -0.0005])


CIRCLE_RADIUS = 0.45  # of the spacing; nobody says it to the detector

KALIBR_CODES = (
    0xd5d628584, 0xd97f18b49, 0xdd280910e, 0xe479e9c98, 0xebcbca822, 0xf31dab3ac, 0x056a5d085, 0x10652e1d4,
    0x22b1dfead, 0x265ad0472, 0x34fe91b86, 0x3ff962cd5, 0x43a25329a, 0x474b4385f, 0x4e9d243e9, 0x5246149ae,
    0x5997f5538, 0x683bb6c4c, 0x6be4a7211, 0x7e3158eea, 0x81da494af, 0x858339a74, 0x8cd51a5fe, 0x9f21cc2d7,
    0xa2cabc89c, 0xadc58d9eb, 0xb16e7dfb0, 0xb8c05eb3a, 0xd25ef139d, 0xd607e1962)
"""The first codes of the family 36h11 as ethz-asl/kalibr's kalibr_create_target_pdf has them (BSD-3-Clause)."""


@dataclass(frozen=True)
class Photo:
    """How pictures are taken: size px, lens (12,), blur (SD, px), noise (SD, grey levels), sub-pixels a side.

    `equidistant`: by a lens whose pixels are `lens` (4,) f, f, cx, cy times the angle from its axis, within 90 degrees.
    """

    width: int = 640
    height: int = 480
    lens: tuple[float, ...] = tuple(LENS)
    blur_px: float = 0.7
    noise: float = 2.0
    oversampling: int = 4
    equidistant: bool = False


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
    rays = _rays(photo.width, photo.height, photo.lens, n, photo.equidistant)
    image = np.full((photo.height, photo.width), ROOM)
    v0, v1, u0, u1 = _sheet_px(board, camera_from_board, photo)
    part = rays[v0 * n:v1 * n, u0 * n:u1 * n]
    plane = np.linalg.inv(camera_from_board[:, [0, 1, 3]][:3])  # rays to (x, y, 1) on the board
    x, y, w = (part[..., 0] * row[0] + part[..., 1] * row[1] + row[2] for row in plane)
    level = np.where(w > 0, paint(board, x / w, y / w), ROOM)
    image[v0:v1, u0:u1] = cv2.resize(level, (u1 - u0, v1 - v0), interpolation=cv2.INTER_AREA)
    if photo.blur_px:
        image = cv2.GaussianBlur(image, (0, 0), photo.blur_px)
    image = image + np.random.default_rng(seed).normal(0, photo.noise, image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


@functools.lru_cache(maxsize=2)
def _rays(width: int, height: int, parameters: tuple[float, ...], n: int, equidistant: bool) -> Array:
    """(H n, W n, 2) normalised coordinates of all sub-pixels: between those of the pixels, as no lens bends more."""
    lens = np.array(parameters)
    if equidistant:
        v, u = ((np.arange(size * n) + 0.5) / n - 0.5 for size in (height, width))
        x, y = np.meshgrid((u - lens[2]) / lens[0], (v - lens[3]) / lens[1])
        angle = np.maximum(np.hypot(x, y), 1e-12)
        return np.stack([x, y], -1) * (np.tan(np.minimum(angle, 1.57)) / angle)[..., None]
    matrix = np.array([[lens[0], 0, lens[2]], [0, lens[1], lens[3]], [0, 0, 1]])
    v, u = np.mgrid[-1.0:height + 1, -1.0:width + 1]
    rays = cv2.undistortPointsIter(np.stack([u, v], -1).reshape(-1, 1, 2), matrix, lens[4:], None, None,
                                   (cv2.TERM_CRITERIA_COUNT, 12, 0))
    return cv2.resize(rays.reshape(*u.shape, 2), None, fx=n, fy=n)[n:-n, n:-n]


def _sheet_px(board: Board, camera_from_board: Array, photo: Photo) -> tuple[int, int, int, int]:
    """First and last row, first and last column of the part of the picture that the sheet may be in."""
    margin = 2.5 * board.square_m
    outline = board.outline() + margin * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    lens = np.array(photo.lens)
    local = outline @ camera_from_board[:3, :3].T + camera_from_board[:3, 3]
    if photo.equidistant or not (local[:, 2] > 0).all():
        return 0, photo.height, 0, photo.width
    places = lens[:2] * local[:, :2] / local[:, 2:] + lens[2:4]  # undistorted: barrel distortion only draws them in
    low, high = np.floor(places.min(axis=0)).astype(int), np.ceil(places.max(axis=0)).astype(int)
    return (max(low[1], 0), min(high[1], photo.height), max(low[0], 0), min(high[0], photo.width))


def paint(board: Board, x: Array, y: Array) -> Array:
    """Grey level of the printed sheet at (x, y) m of the board's frame; the room beyond the sheet's margin."""
    levels, per_square = _sheet(board)
    first = per_square * (board.margin_m / board.square_m + MARGIN) + 1.0  # what is before the first corner, the room
    column, row = (np.clip(one * (per_square / board.square_m) + first, 0, size - 1).astype(np.intp)
                   for one, size in zip((x, y), levels.shape[::-1], strict=True))
    return levels[row, column]


@functools.lru_cache(maxsize=8)
def _sheet(board: Board) -> tuple[Array, int]:
    """Grey levels of the sheet, a pixel of the room around it, and how many there are to a square, or what is measured
    in its place: as OpenCV draws a ChArUco board, and Kalibr an AprilGrid."""
    if isinstance(board, AprilGrid):
        per_square = 100
        black = april_grid(board.tag_cols, board.tag_rows, per_square, round(board.spacing * per_square))
    elif isinstance(board, CircleGrid):
        per_square = 120
        y, x = np.ogrid[:(board.rows + 1) * per_square, :(2 * board.cols + 1) * per_square]
        black = np.zeros((y.size, x.size), bool)
        for row in range(board.rows):
            for col in range(board.cols):
                u, v = (1 + 2 * col + row % 2) * per_square - 0.5, (1 + row) * per_square - 0.5
                rows = slice(row * per_square, (row + 2) * per_square)
                black[rows] |= np.hypot(x - u, y[rows] - v) < CIRCLE_RADIUS * per_square
    elif isinstance(board, Chessboard):
        per_square = 5
        black = np.add.outer(np.arange(board.rows + 1), np.arange(board.cols + 1)) % 2 == 0
        black = np.kron(black, np.ones((per_square, per_square), bool))
    else:
        per_square = 120
        black = board.opencv().generateImage((board.squares_x * per_square, board.squares_y * per_square)) < 128
    paper = np.pad(np.where(black, INK, PAPER), round(MARGIN * per_square), constant_values=PAPER)
    return np.pad(paper, 1, constant_values=ROOM), per_square


def april_grid(tag_cols: int, tag_rows: int, tag: int, gap: int) -> NDArray[np.bool_]:
    """Black is True: the grid as kalibr_create_target_pdf draws it, y upwards, with `tag` and `gap` in pixels."""
    black = np.zeros((tag_rows * (tag + gap) + gap, tag_cols * (tag + gap) + gap), bool)
    cell = tag // 10

    def fill(x: int, y: int, width: int, height: int) -> None:
        black[y + gap:y + gap + height, x + gap:x + gap + width] = True

    for y in range(tag_rows):
        for x in range(tag_cols):
            left, low = x * (tag + gap), y * (tag + gap)
            for right, up in ((-gap, -gap), (tag, -gap), (tag, tag), (-gap, tag)):
                fill(left + right, low + up, gap, gap)
            border = 2 * cell
            fill(left, low, tag, border)
            fill(left, low + tag - border, tag, border)
            fill(left + tag - border, low, border, tag)
            fill(left, low, border, tag)
            code = KALIBR_CODES[tag_cols * y + x]
            bits = np.rot90(np.array([[not code >> (6 * i + j) & 1 for j in range(6)] for i in range(6)]), 2)
            for i, j in zip(*np.nonzero(bits), strict=True):
                fill(left + (int(j) + 2) * cell, low + (7 - int(i)) * cell, cell, cell)
    return black[::-1]
