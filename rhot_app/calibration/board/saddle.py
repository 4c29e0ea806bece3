"""One corner of a chessboard to a hundredth of a pixel: the image around it is two blurred edges that cross.

The model ``level + contrast * E(d1 / s1) * E(d2 / s2)``, with d the distances to the two edges, s their blurs and E the
error function, is fitted to the pixels of a disc by Levenberg-Marquardt. It is symmetric about the crossing, as every
blurred picture of it is, whatever the camera's tone curve; and it uses all edge pixels of the disc, where the usual
gradient method (cornerSubPix) weights few and is drawn to what stands at the window's rim.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import CharucoBoard

Array = NDArray[np.float64]
Gray = NDArray[np.uint8]

UNKNOWNS = 8  # x, y, the directions of both edges, their blurs, contrast, level
FIELDS = 6  # of what is said about a corner
SHARPEST_PX, BLURRIEST_PX = 0.3, 8.0
_FAINTEST = 1.0  # grey levels
_STEPS = 20
_STILL_PX = 1e-3


@njit(cache=True)
def _normal_equations(gray: Gray, about: Array, radius: float, p: Array, normal: Array, side: Array) -> float:
    """Fill `normal` (8, 8) and `side` (8,) at the parameters `p`; returns the sum of squares over the disc."""
    normal[:] = 0.0
    side[:] = 0.0
    row = np.empty(UNKNOWNS)
    s1, c1, s2, c2 = math.sin(p[2]), math.cos(p[2]), math.sin(p[3]), math.cos(p[3])
    cost = 0.0
    reach = math.ceil(radius)
    u0, v0 = round(about[0]), round(about[1])
    for v in range(max(v0 - reach, 0), min(v0 + reach, gray.shape[0] - 1) + 1):
        for u in range(max(u0 - reach, 0), min(u0 + reach, gray.shape[1] - 1) + 1):
            if (u - about[0]) ** 2 + (v - about[1]) ** 2 > radius * radius:
                continue
            dx, dy = u - p[0], v - p[1]
            a1, a2 = (c1 * dy - s1 * dx) / p[4], (c2 * dy - s2 * dx) / p[5]  # distances in units of the blurs
            e1, e2 = math.erf(a1 * math.sqrt(0.5)), math.erf(a2 * math.sqrt(0.5))
            g1 = p[6] * e2 * math.sqrt(2.0 / math.pi) * math.exp(-0.5 * a1 * a1) / p[4]
            g2 = p[6] * e1 * math.sqrt(2.0 / math.pi) * math.exp(-0.5 * a2 * a2) / p[5]
            off = gray[v, u] - p[7] - p[6] * e1 * e2
            row[0], row[1] = g1 * s1 + g2 * s2, -g1 * c1 - g2 * c2
            row[2], row[3] = -g1 * (c1 * dx + s1 * dy), -g2 * (c2 * dx + s2 * dy)
            row[4], row[5] = -g1 * a1, -g2 * a2
            row[6], row[7] = e1 * e2, 1.0
            cost += off * off
            for i in range(UNKNOWNS):
                side[i] += row[i] * off
                for j in range(i + 1):
                    normal[i, j] += row[i] * row[j]
    for i in range(UNKNOWNS):
        for j in range(i):
            normal[j, i] = normal[i, j]
    return cost


@njit(cache=True)
def _start(gray: Gray, about: Array, radius: float, p: Array) -> None:
    """Level and contrast of the disc, with the sign that the edges' directions give, into `p`."""
    reach = math.ceil(radius)
    u0, v0 = round(about[0]), round(about[1])
    darkest, brightest, sign = 255.0, 0.0, 0.0
    for v in range(max(v0 - reach, 0), min(v0 + reach, gray.shape[0] - 1) + 1):
        for u in range(max(u0 - reach, 0), min(u0 + reach, gray.shape[1] - 1) + 1):
            darkest, brightest = min(darkest, gray[v, u]), max(brightest, gray[v, u])
    level = (darkest + brightest) / 2.0
    for v in range(max(v0 - reach, 0), min(v0 + reach, gray.shape[0] - 1) + 1):
        for u in range(max(u0 - reach, 0), min(u0 + reach, gray.shape[1] - 1) + 1):
            dx, dy = u - p[0], v - p[1]
            a1 = math.cos(p[2]) * dy - math.sin(p[2]) * dx
            a2 = math.cos(p[3]) * dy - math.sin(p[3]) * dx
            sign += (gray[v, u] - level) * np.sign(a1 * a2)
    p[6] = math.copysign((brightest - darkest) / 2.0, sign)
    p[7] = level


@njit(cache=True)
def _fit(gray: Gray, about: Array, radius: float, along: float, down: float) -> tuple[Array, float]:
    """The parameters (8,) of the crossing near `about`, and the rms misfit; NaN where the pixels do not show one."""
    p = np.array([about[0], about[1], along, down, 1.0, 1.0, 0.0, 0.0])
    _start(gray, about, radius, p)
    normal, trial_normal = np.empty((UNKNOWNS, UNKNOWNS)), np.empty((UNKNOWNS, UNKNOWNS))
    side, trial_side = np.empty(UNKNOWNS), np.empty(UNKNOWNS)
    cost = _normal_equations(gray, about, radius, p, normal, side)
    damping = 1e-3
    for _ in range(_STEPS):
        damped = normal.copy()
        for i in range(UNKNOWNS):
            damped[i, i] += damping * normal[i, i] + 1e-9
        step = np.linalg.solve(damped, side)
        trial = p + step
        trial[4] = min(max(trial[4], SHARPEST_PX), BLURRIEST_PX)
        trial[5] = min(max(trial[5], SHARPEST_PX), BLURRIEST_PX)
        trial_cost = _normal_equations(gray, about, radius, trial, trial_normal, trial_side)
        if trial_cost < cost:
            p, cost = trial, trial_cost
            normal[:], side[:] = trial_normal, trial_side
            damping *= 0.1
        else:
            damping *= 10.0
        if math.hypot(step[0], step[1]) < _STILL_PX or damping > 1e8:
            break
    near = math.hypot(p[0] - about[0], p[1] - about[1]) < 0.6 * radius
    crossing = abs(math.sin(p[2] - p[3])) > 0.1  # edges that fell together cross nowhere
    if not (near and crossing and abs(p[6]) > _FAINTEST):
        p[:] = math.nan
    return p, math.sqrt(cost / (math.pi * radius * radius))


@njit(cache=True)
def fit_saddles(gray: Gray, corners: Array, directions: Array, radii: Array) -> Array:
    """Corners near `corners` (N, 2) px: (N, 6) x, y px, blur of either edge (SD, px), contrast, misfit; NaN for none.

    The contrast, in grey levels, is positive where the quadrant between the first edge and the second is the lighter
    one; on a chessboard it changes sign from corner to corner. The misfit is the rms difference between picture and
    model, in parts of the contrast. `gray` (H, W); `directions` (N, 2) rad, of the edges along the board's x and y;
    `radii` (N,) px of the discs: what lies within must be the two edges alone.
    """
    found = np.full((len(corners), FIELDS), math.nan)
    for i in range(len(corners)):
        if corners[i, 0] >= 0 and corners[i, 1] >= 0 and radii[i] > 0:  # False for NaN
            p, misfit = _fit(gray, corners[i], radii[i], directions[i, 0], directions[i, 1])
            found[i, 0], found[i, 1], found[i, 2], found[i, 3], found[i, 4] = p[0], p[1], p[4], p[5], p[6]
            found[i, 5] = misfit / abs(p[6])
    return found


# -- ChArUco detection -------------------------------------------------------------------------------------------------
# Parts of the board suffice, and it may be printed in negative.

_SMALL_PX = 1000  # longest side: pictures below are read at twice their size, where a marker's bits have 3 px, not 1.5
_FEWEST = 4
_CELL_PX, _CELL_MARGIN = 8, 0.25  # px to which each bit of a marker is enlarged, and the rim of it that is left out


@dataclass(frozen=True, slots=True)
class MarkersSeen:
    """What one picture shows of a board: markers of its dictionary, `ids` (N,) with `corners` (N, 4, 2) px, and the
    board's own corners, `grid` (rows, cols, 2) px, NaN for those that are not visible."""

    ids: NDArray[np.int64]
    corners: Array
    grid: Array

    @property
    def placed(self) -> int:
        """How many of the board's corners are visible."""
        return int(np.count_nonzero(np.isfinite(self.grid[..., 0])))


def find_charuco(gray: Gray, board: CharucoBoard, *, thorough: bool = False) -> Array | None:
    """(rows, cols, 2) px, NaN for corners that are not visible; None when fewer than four are.

    `thorough` reads small markers in a picture of twice the size, too.
    """
    seen = read_markers(gray, board)
    negative = not len(seen.ids)
    if negative:
        seen = read_markers(negated(gray), board)
    if thorough and seen.placed < board.count // 2:
        larger = read_markers(negated(gray) if negative and len(seen.ids) else gray, board, 2.0)
        seen = max(seen, larger, key=lambda one: one.placed)
    return seen.grid if seen.placed >= _FEWEST else None


def read_markers(gray: Gray, board: CharucoBoard, enlarged: float = 1.0) -> MarkersSeen:
    """All markers of the board's dictionary, whatever their arrangement; `enlarged`: how many times more than usual."""
    scale = enlarged * (2.0 if max(gray.shape) < _SMALL_PX else 1.0)
    places, numbers, corners, ids = _detector(board).detectBoard(_scaled(gray, scale))
    flat = np.full((board.count, 2), np.nan)
    if places is not None and numbers is not None:
        flat[np.asarray(numbers).reshape(-1)] = (np.asarray(places).reshape(-1, 2) + 0.5) / scale - 0.5
    grid: Array = flat.reshape(board.rows, board.cols, 2)
    if ids is None or not len(ids):
        return MarkersSeen(np.zeros(0, np.int64), np.zeros((0, 4, 2)), grid)
    return MarkersSeen(np.asarray(ids, np.int64).reshape(-1),
                       (np.asarray(corners, float).reshape(-1, 4, 2) + 0.5) / scale - 0.5, grid)


def negated(gray: Gray) -> Gray:
    """The picture with black for white."""
    return np.asarray(cv2.bitwise_not(gray), np.uint8)


def _scaled(gray: Gray, scale: float) -> Gray:
    if scale == 1.0:
        return gray
    return np.asarray(cv2.resize(gray, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC), np.uint8)


@functools.lru_cache(maxsize=8)
def _detector(board: CharucoBoard) -> cv2.aruco.CharucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    parameters.perspectiveRemovePixelPerCell = _CELL_PX
    parameters.perspectiveRemoveIgnoredMarginPerCell = _CELL_MARGIN
    return cv2.aruco.CharucoDetector(board.opencv(), cv2.aruco.CharucoParameters(), parameters)
