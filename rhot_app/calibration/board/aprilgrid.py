"""Detection of AprilGrids in pictures.

Black squares touch every corner of a tag and join all tags to one dark region, in which OpenCV's detector finds no tag.
A dilation of white separates them, as in OpenCV's findChessboardCorners. Quadrilaterals are found in the dilated
picture, and their bits are read in the picture itself.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import AprilGrid
from rhot_app.calibration.board.standard_board import TAG_BITS, TAG_BORDER_BITS

Array = NDArray[np.float64]
Gray = NDArray[np.uint8]

_SMALL_PX = 1000  # longest side: pictures below are read at twice their size
FEWEST_TAGS = 2
"""Fewest tags that locate the board."""

_DILATIONS_PX = (1, 2, 4)  # of white, on each side
_CELL_PX = 4  # side of a bit in the rectified tag
_WRONG_BITS = 3  # of 36, at most; codes differ in 11 and more (Olson 2011, 36h11)
_CLEAR = 0.8  # least share of the border's cells that are dark, and of the cells around that are light
_CONTRAST = 20.0  # grey levels
_INLIERS = 0.7  # least share of the tags that are read
_MISPLACED = 0.2  # of a tag's side: tags farther from their place belong to another board
_SPACING_OFF = 0.02  # of a tag's side: spacings that differ by more are another board's


@dataclass(frozen=True, slots=True)
class TagsSeen:
    """Tags of the family 36h11: `ids` (N,) and `corners` (N, 4, 2) px, clockwise from the upper left of the tag as it
    is printed."""

    ids: NDArray[np.int64]
    corners: Array


def find_aprilgrid(gray: Gray, board: AprilGrid, *, thorough: bool = False) -> Array | None:
    """(rows, cols, 2) px, NaN for corners that are not visible; None where no two tags stand as on the board.

    `thorough` reads small tags in a picture of twice the size, too.
    """
    every = board.count // 4
    seen = read_tags(gray, enough=every)
    if thorough and len(seen.ids) < every // 2:
        seen = max(seen, read_tags(gray, 2.0, enough=every), key=lambda one: len(one.ids))
    return place_tags(seen, board)


def measured_spacing(grid: Array) -> float:
    """The gap between tags as a part of their side, by the cross-ratio of four corners in a line, which no perspective
    changes; NaN where no two tags beside each other were seen. `grid` (rows, cols, 2) px."""
    ratios = [np.empty(0)]
    for lines in (grid, grid.transpose(1, 0, 2)):
        for first in range(0, lines.shape[1] - 3, 2):
            a, b, c, d = (lines[:, first + k] for k in range(4))
            ac, bd, bc, ad = (np.linalg.norm(q - p, axis=-1) for p, q in ((a, c), (b, d), (b, c), (a, d)))
            ratios.append(ac * bd / np.maximum(bc * ad, 1e-9))
    every = np.concatenate(ratios)
    every = every[np.isfinite(every) & (every > 1.0)]
    if not len(every):
        return float("nan")
    ratio = float(np.median(every))  # (1 + s)^2 / (s (2 + s))
    return float(np.sqrt(ratio / (ratio - 1.0)) - 1.0)


def has_spacing(grid: Array, board: AprilGrid) -> bool:
    """Whether the tags are as far apart as the board says, as far as that is seen."""
    return not abs(measured_spacing(grid) - board.spacing) > _SPACING_OFF


def read_tags(gray: Gray, enlarged: float = 1.0, *, border: int = TAG_BORDER_BITS, enough: int = 1000) -> TagsSeen:
    """Tags with a black border of `border` bits. The picture is enlarged `enlarged` times, small ones twice as much.
    Larger dilations are tried until `enough` tags are read."""
    scale = enlarged * (2.0 if max(gray.shape) < _SMALL_PX else 1.0)
    picture = gray if scale == 1.0 else np.asarray(cv2.resize(gray, None, fx=scale, fy=scale,
                                                              interpolation=cv2.INTER_CUBIC), np.uint8)
    best: dict[int, tuple[int, Array]] = {}
    doubled: set[int] = set()
    for dilation_px in _DILATIONS_PX:
        if len(best) >= enough:
            break
        for number, wrong, corners in _tags(picture, dilation_px, border):
            before = best.get(number)
            if before is not None and np.abs(before[1] - corners).max() > 0.5 * _side_px(corners):
                doubled.add(number)
            if before is None or wrong < before[0]:
                best[number] = wrong, corners
    ids = np.array(sorted(best.keys() - doubled), np.int64)
    corners = np.array([best[int(number)][1] for number in ids]).reshape(-1, 4, 2)
    return TagsSeen(ids, (corners + 0.5) / scale - 0.5)


def _tags(picture: Gray, dilation_px: int, border: int) -> list[tuple[int, int, Array]]:
    """(number, wrong bits, corners (4, 2) px) of the tags that a dilation of white by `dilation_px` separates."""
    cells = TAG_BITS + 2 * border
    around = cells + 2  # and what is beside the tag
    side, rim = cells * _CELL_PX, 1.0 * _CELL_PX
    kernel = np.ones(2 * (2 * dilation_px + 1,), np.uint8)
    found, _, rejected = _detector().detectMarkers(cv2.dilate(picture, kernel))
    target = (np.array([[0, 0], [side, 0], [side, side], [0, side]]) + rim - 0.5).astype(np.float32)
    tags = []
    for quad in (np.asarray(one, np.float64).reshape(4, 2) for one in (*found, *rejected)):
        length = _side_px(quad)
        if length < cells:  # less than a pixel a bit
            continue
        middle = quad.mean(axis=0)
        quad = middle + (quad - middle) * (1.0 + 2.0 * dilation_px / length)
        turned = cv2.getPerspectiveTransform(quad.astype(np.float32), target)
        patch = cv2.warpPerspective(picture, turned, (around * _CELL_PX, around * _CELL_PX),
                                    borderMode=cv2.BORDER_REPLICATE).reshape(around, _CELL_PX, around, _CELL_PX)
        read = _decoded(patch[:, 1:-1, :, 1:-1].mean(axis=(1, 3)), border)
        if read is not None:
            number, turn, wrong = read
            tags.append((number, wrong, np.roll(quad, turn, axis=0)))
    return tags


def _decoded(cells: Array, border: int) -> tuple[int, int, int] | None:
    """(number, quarter turns, wrong bits) of a tag, by the grey levels of its `cells` and of the ring around it.

    None for no tag: its border is dark, and the ring is light but for the corners."""
    light = cells > 0.5 * float(cells.min() + cells.max())
    beside = np.concatenate([light[0, 1:-1], light[-1, 1:-1], light[1:-1, 0], light[1:-1, -1]])
    tag = light[1:-1, 1:-1]
    inner = tag[border:-border, border:-border]
    dark = 1.0 - (tag.sum() - inner.sum()) / (tag.size - inner.size)
    if np.ptp(cells) < _CONTRAST or dark < _CLEAR or beside.mean() < _CLEAR:
        return None
    codes = _codes()
    wrong = (codes != inner.ravel()).sum(axis=1)
    best = int(np.argmin(wrong))
    number, turn = divmod(best, 4)
    return (number, turn, int(wrong[best])) if wrong[best] <= _WRONG_BITS else None


def place_tags(seen: TagsSeen, board: AprilGrid) -> Array | None:
    """(rows, cols, 2) px, the corners in the board's grid; None unless most of the tags stand to each other as on the
    board, or where the grid goes on beyond it."""
    row, col = np.divmod(seen.ids, board.tag_cols)
    steps = board.tag_m * (1.0 + board.spacing) * np.column_stack([col, board.tag_rows - 1 - row])
    places = steps[:, None] + board.tag_m * np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    if len(places) < FEWEST_TAGS:
        return None
    sides = float(np.median([_side_px(corners) for corners in seen.corners]))
    _, inlier = cv2.findHomography(places.reshape(-1, 2), seen.corners.reshape(-1, 2), cv2.RANSAC, _MISPLACED * sides)
    fits = np.zeros(len(places), bool) if inlier is None else np.asarray(
        np.asarray(inlier, bool).reshape(-1, 4).all(axis=1))
    if np.count_nonzero(fits) < max(FEWEST_TAGS, _INLIERS * len(fits)) or np.any(fits & (row >= board.tag_rows)):
        return None
    grid = np.full((board.rows, board.cols, 2), np.nan)
    top, left = 2 * (board.tag_rows - 1 - row[fits, None]), 2 * col[fits, None]
    grid[top + np.array([0, 0, 1, 1]), left + np.array([0, 1, 1, 0])] = seen.corners[fits]
    return grid


def _side_px(corners: Array) -> float:
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).mean())


@functools.lru_cache(maxsize=1)
def _codes() -> NDArray[np.bool_]:
    """(4 * 587, 36) bits, white is True, of every tag as Kalibr prints it and turned by one to three quarter turns.
    OpenCV's dictionary has the same numbers, each turned by 180 degrees."""
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    codes = []
    for number in range(family.bytesList.shape[0]):
        bits = np.rot90(cv2.aruco.Dictionary.getBitsFromByteList(family.bytesList[number:number + 1], TAG_BITS), 2)
        codes += [np.rot90(bits, turn).ravel() > 0 for turn in range(4)]
    return np.array(codes)


def tag_cells(number: int) -> NDArray[np.bool_]:
    """(10, 10) the cells of a tag as it is printed, its border included; black is True."""
    return np.pad(~_codes()[4 * number].reshape(TAG_BITS, TAG_BITS), TAG_BORDER_BITS, constant_values=True)


@functools.lru_cache(maxsize=1)
def _detector() -> cv2.aruco.ArucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = TAG_BORDER_BITS
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), parameters)
