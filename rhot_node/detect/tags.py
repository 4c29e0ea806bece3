"""Corners of fiducial tags (AprilTag, ArUco) in the luma plane, with a covariance for each corner.

Knows dictionaries and pixels; which tag belongs to which object only the master knows. cv2.aruco finds and reads the
tags. Its corners are not used: cornerSubPix puts those of a blurred tag of 20 to 40 px some 0.4 px inside of the true
ones, which a master takes for 1 % of distance (`tests/objects/test_tag_detector.py`). Here each corner is the
intersection of lines fitted to the edges of the black square.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.image import MAD_SD
from rhot_node.errors import SettingsError
from rhot_node.wire.messages import FAMILIES, Fiducial

Array = NDArray[np.float64]
Luma = NDArray[np.uint8]

FLOOR_PX = 0.02
"""px: standard deviation that no corner falls short of: the edges of a print, and of a lens that bends them."""

PATTERN_PX = 0.5
"""px, times the square of px over a cell's width: standard deviation of an edge's place by the cells beside it, whose
edges blur into it (`tests/objects/test_tag_detector.py`, a lens blur of 0.7 px)."""

UNREFINED_PX = 0.7
"""px: standard deviation of a corner as cv2.aruco finds it (`tests/objects/test_tag_detector.py`)."""

APART = 0.05
"""Of a quadrangle's perimeter: others whose corners are nearer are taken for the same one, and the largest is read.
OpenCV 4's later default of 0.125 takes the edge of the paper for the tag (`python benchmarks/tags.py`)."""

_ITERATIONS = 3  # of fitting the lines where the last ones lay; the first lie within 1.5 px
_NEAREST, _FARTHEST = 1.0, 3.0  # px from the edge: its blur, and noise beyond it
_END_PX = 2.0  # from a corner, where both edges blur
_LEAST = 4  # stations that a line needs
_OUTLIER = 3.0  # standard deviations from the line; a finger or a reflection


def family_number(name: str) -> int:
    """The index into FAMILIES of a dictionary by its cv2.aruco name, such as DICT_APRILTAG_36h11.

    Raises SettingsError when there is no such dictionary.
    """
    if name not in FAMILIES:
        raise SettingsError(f"there is no tag dictionary {name!r}; cv2.aruco has {', '.join(FAMILIES)}.")
    return FAMILIES.index(name)


def family_size(number: int) -> int:
    """How many tags a dictionary has."""
    return len(cv2.aruco.getPredefinedDictionary(number).bytesList)


def tag_code(number: int, tag: int) -> bytes:
    """The bits of a tag. Tags of equal bits, such as 3 of DICT_4X4_50 and of DICT_4X4_100, look the same."""
    dictionary = cv2.aruco.getPredefinedDictionary(number)
    return bytes([dictionary.markerSize]) + dictionary.bytesList[tag].tobytes()


class TagDetector:
    """Finds the tags of some dictionaries in luma planes. One thread at a time."""

    def __init__(self, families: Sequence[str]) -> None:
        """`families`: names of cv2.aruco dictionaries. Raises SettingsError when one is unknown."""
        self._detectors = []
        for number in dict.fromkeys(family_number(name) for name in families):
            parameters = cv2.aruco.DetectorParameters()
            parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
            parameters.minMarkerDistanceRate = APART
            dictionary = cv2.aruco.getPredefinedDictionary(number)
            self._detectors.append((number, dictionary.markerSize + 2, cv2.aruco.ArucoDetector(dictionary, parameters)))

    def detect(self, luma: Luma) -> list[Fiducial]:
        """The tags in a luma plane (H, W), the largest first."""
        found = []
        for number, cells, detector in self._detectors:
            corners, ids, _ = detector.detectMarkers(luma)
            numbers = [] if ids is None else [int(tag) for tag in ids.ravel()]
            for quad, tag in zip(corners, numbers, strict=True):
                places, covariances = refine_corners(luma, np.asarray(quad, np.float64).reshape(4, 2), cells)
                found.append((cv2.contourArea(quad), Fiducial(
                    number, tag, tuple(places.ravel().tolist()),
                    tuple(covariances[:, [0, 0, 1], [0, 1, 1]].ravel().tolist()))))
        return [one for _, one in sorted(found, key=lambda pair: -pair[0])]


def refine_corners(luma: Luma, corners: Array, cells: int) -> tuple[Array, Array]:
    """Sub-pixel corners (4, 2) px, and their covariances (4, 2, 2) px^2, of a tag of `cells` x `cells` with its border.

    `corners` (4, 2): within some 1.5 px, in the order around the tag. The scatter of the edge points about their lines
    gives the variance; lines whose edges are not visible leave both their corners as they were, with UNREFINED_PX.
    """
    places, covariances = np.empty((4, 2)), np.empty((4, 2, 2))
    _refine_corners(luma, corners, cells, places, covariances)
    return places, covariances


@njit(cache=True)
def _luma_at(luma: Luma, x: float, y: float) -> float:
    """Bilinear; NaN outside."""
    column, row = math.floor(x), math.floor(y)
    if column < 0 or row < 0 or column + 1 >= luma.shape[1] or row + 1 >= luma.shape[0]:
        return math.nan
    u, v = x - column, y - row
    return ((1.0 - v) * ((1.0 - u) * luma[row, column] + u * luma[row, column + 1])
            + v * ((1.0 - u) * luma[row + 1, column] + u * luma[row + 1, column + 1]))


@njit(cache=True)
def _edge_offset(luma: Luma, x: float, y: float, nx: float, ny: float, reach: float) -> tuple[float, float]:
    """Where an edge crosses the normal (nx, ny), dark to bright, px from (x, y), and its contrast: the centroid of the
    rise of luma within `reach`."""
    count = 2 * math.ceil(2.0 * reach) + 1
    step = 2.0 * reach / (count - 1)
    total = moment = 0.0
    for k in range(count):
        at = -reach + k * step
        rise = (_luma_at(luma, x + (at + 0.5) * nx, y + (at + 0.5) * ny)
                - _luma_at(luma, x + (at - 0.5) * nx, y + (at - 0.5) * ny))
        if math.isnan(rise):
            return math.nan, 0.0
        if rise > 0.0:
            total += rise
            moment += rise * at
    if total <= 0.0:
        return math.nan, 0.0
    return moment / total, total * step


@njit(cache=True)
def _fit_line(along: Array, offsets: Array, used: NDArray[np.bool_], line: Array) -> int:
    """Fill `line` (7,): intercept, slope, their covariance's (aa, ab, bb) per unit of variance, sum of squares, count.
    Returns the number of points."""
    n, sa, so, saa, sao = 0, 0.0, 0.0, 0.0, 0.0
    for k in range(along.shape[0]):
        if used[k]:
            n += 1
            sa += along[k]
            so += offsets[k]
            saa += along[k] * along[k]
            sao += along[k] * offsets[k]
    determinant = n * saa - sa * sa
    if n < _LEAST or not determinant > 0.0:
        return 0
    line[1] = (n * sao - sa * so) / determinant
    line[0] = (so - line[1] * sa) / n
    line[2], line[3], line[4] = saa / determinant, -sa / determinant, n / determinant
    line[5] = 0.0
    for k in range(along.shape[0]):
        if used[k]:
            line[5] += (offsets[k] - line[0] - line[1] * along[k]) ** 2
    line[6] = n
    return n


@njit(cache=True)
def _edge_line(luma: Luma, x0: float, y0: float, x1: float, y1: float, cells: int, line: Array) -> bool:
    """Fit a line to the edge from corner 0 to corner 1 of a dark square on bright paper, whose inside lies to the right
    of that way (y down); `line` as in `_fit_line`, offsets outward. False without an edge."""
    length = math.hypot(x1 - x0, y1 - y0)
    count = int(length - 2.0 * _END_PX) + 1
    if count < _LEAST:
        return False
    dx, dy = (x1 - x0) / length, (y1 - y0) / length
    nx, ny = dy, -dx
    reach = min(max(0.4 * length / cells, _NEAREST), _FARTHEST)
    along, offsets, contrasts = np.empty(count), np.empty(count), np.empty(count)
    for k in range(count):
        along[k] = _END_PX + (length - 2.0 * _END_PX) * k / (count - 1)
        offsets[k], contrasts[k] = _edge_offset(luma, x0 + along[k] * dx, y0 + along[k] * dy, nx, ny, reach)
    used = contrasts > 0.5 * np.median(contrasts)
    if np.count_nonzero(used) < _LEAST:
        return False
    middle = np.median(offsets[used])
    spread = max(MAD_SD * np.median(np.abs(offsets[used] - middle)), FLOOR_PX)
    for k in range(count):
        used[k] = used[k] and abs(offsets[k] - middle) < 2.0 * _OUTLIER * spread
    for _ in range(2):
        n = _fit_line(along, offsets, used, line)
        if n == 0:
            return False
        sd = math.sqrt(line[5] / (n - 2)) + 1e-9
        for k in range(count):
            used[k] = used[k] and abs(offsets[k] - line[0] - line[1] * along[k]) < _OUTLIER * sd
    return _fit_line(along, offsets, used, line) > 0


@njit(cache=True)
def _refine_corners(luma: Luma, corners: Array, cells: int, places: Array, covariances: Array) -> None:
    lines, found, moved = np.zeros((4, 7)), np.zeros(4, np.bool_), corners.copy()
    normals, anchors, ways = np.empty((4, 2)), np.empty((4, 2)), np.empty((4, 2))
    for _ in range(_ITERATIONS):
        places[:] = moved
        squares = freedom = 0.0
        for side in range(4):
            a, b = places[side], places[(side + 1) % 4]
            found[side] = _edge_line(luma, a[0], a[1], b[0], b[1], cells, lines[side])
            length = math.hypot(b[0] - a[0], b[1] - a[1])
            ways[side, 0], ways[side, 1] = (b[0] - a[0]) / length, (b[1] - a[1]) / length
            anchors[side] = a
            if found[side]:
                squares += lines[side, 5]
                freedom += lines[side, 6] - 2.0
        variance = squares / freedom if freedom > 0.0 else 0.0
        for corner in range(4):
            before = corner - 1
            covariances[corner] = 0.0
            covariances[corner, 0, 0] = covariances[corner, 1, 1] = UNREFINED_PX**2
            if not (found[corner] and found[before]):
                continue
            spans = np.zeros(2)
            for row, side in enumerate((before, corner)):
                slope, dx, dy = lines[side, 1], ways[side, 0], ways[side, 1]
                scale = 1.0 / math.hypot(1.0, slope)
                normals[row, 0], normals[row, 1] = (dy - slope * dx) * scale, (-dx - slope * dy) * scale
                spans[row] = (normals[row, 0] * (anchors[side, 0] + lines[side, 0] * dy)
                              + normals[row, 1] * (anchors[side, 1] - lines[side, 0] * dx))
            determinant = normals[0, 0] * normals[1, 1] - normals[0, 1] * normals[1, 0]
            if determinant == 0.0:
                continue
            x = (normals[1, 1] * spans[0] - normals[0, 1] * spans[1]) / determinant
            y = (normals[0, 0] * spans[1] - normals[1, 0] * spans[0]) / determinant
            if math.hypot(x - corners[corner, 0], y - corners[corner, 1]) > 2.0 * _FARTHEST:
                continue
            moved[corner, 0], moved[corner, 1] = x, y
            for row, side in enumerate((before, corner)):
                width = math.hypot(places[(side + 1) % 4, 0] - places[side, 0],
                                   places[(side + 1) % 4, 1] - places[side, 1]) / cells
                at = (x - anchors[side, 0]) * ways[side, 0] + (y - anchors[side, 1]) * ways[side, 1]
                spans[row] = (variance * (lines[side, 2] + 2.0 * at * lines[side, 3] + at * at * lines[side, 4])
                              + (PATTERN_PX / width**2) ** 2)
            ax, ay = normals[1, 1] / determinant, -normals[1, 0] / determinant  # change of (x, y) with the first line
            bx, by = -normals[0, 1] / determinant, normals[0, 0] / determinant
            covariances[corner, 0, 0] = ax * ax * spans[0] + bx * bx * spans[1] + FLOOR_PX**2
            covariances[corner, 0, 1] = ax * ay * spans[0] + bx * by * spans[1]
            covariances[corner, 1, 0] = covariances[corner, 0, 1]
            covariances[corner, 1, 1] = ay * ay * spans[0] + by * by * spans[1] + FLOOR_PX**2
    places[:] = moved
