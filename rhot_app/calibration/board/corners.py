"""A board in one picture: its inner corners to a fraction of a pixel, in an order that the board alone decides."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.aprilgrid import find_aprilgrid, has_spacing
from rhot_app.calibration.board.boards import AprilGrid, Board, Chessboard, CircleGrid
from rhot_app.calibration.board.circles import find_circles
from rhot_app.calibration.board.saddle import FIELDS, find_charuco, fit_saddles

Array = NDArray[np.float64]
Gray = NDArray[np.uint8]

FEWEST_CORNERS = 6  # of a board that is seen in part
SMALLEST_PX = 48  # the shorter side of a picture; smaller ones hold no board, and OpenCV's searches fail on them


@dataclass(frozen=True, slots=True, eq=False)
class BoardView:
    """The corners of one board in one picture.

    `pixels` (N, 2) raw px and `ids` (N,) of the corners found, sorted by id (see `board`); `width`, `height` px of the
    picture; `square_px` the shortest side of a square in the picture; `blur_px` the SD of the blur across the edges,
    in the blurrier direction (1 is sharp, 2 and more is not), NaN when unknown; `source` the file or camera it came
    from, for messages.
    """

    pixels: Array
    ids: NDArray[np.int64]
    width: int
    height: int
    square_px: float
    blur_px: float
    source: str = ""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture, px."""
        return self.width, self.height

    def object_points(self, board: Board) -> Array:
        """(N, 3) m, the corners found in the board's frame."""
        return board.object_points()[self.ids]

    def grid(self, board: Board) -> Array:
        """(rows, cols, 2) raw px, NaN where a corner was not found."""
        return to_grid(self.pixels, self.ids, board)

    def turned(self, board: Board) -> BoardView:
        """The same corners counted from the other end; for boards that are not `one_way_up`."""
        ids = board.count - 1 - self.ids[::-1]
        return replace(self, pixels=self.pixels[::-1].copy(), ids=ids)


def to_gray(image: NDArray[np.uint8]) -> Gray:
    """A grey picture (H, W) uint8 of a grey (H, W) or BGR (H, W, 3) one."""
    gray = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return np.ascontiguousarray(gray, np.uint8)


def detect(image: NDArray[np.uint8], board: Board, *, thorough: bool = True, source: str = "") -> BoardView | None:
    """The board in `image`, (H, W) grey or (H, W, 3) BGR uint8; None when it is not there.

    Chessboards and grids of circles are found whole or not at all, ChArUco boards and AprilGrids in parts. `thorough`
    looks again, enlarged, where the quick search fails: for pictures from files; live pictures come again.
    """
    gray = to_gray(image)
    if min(gray.shape) < SMALLEST_PX:
        return None
    found = _located(gray, board, thorough=thorough)
    return None if found is None else _view(*found, gray.shape, source)


def _located(gray: Gray, board: Board, *, thorough: bool) -> tuple[Array, float] | None:
    """(rows, cols, 2) px, NaN for corners that are not visible, and the blur of the edges; None for another board."""
    match board:
        case CircleGrid():
            centres = find_circles(gray, board, thorough=thorough)
            return None if centres is None else (centres.grid, centres.blur_px)
        case Chessboard():
            rough = find_chessboard(gray, board, thorough=thorough)
        case AprilGrid():
            rough = find_aprilgrid(gray, board, thorough=thorough)
        case _:
            rough = find_charuco(gray, board, thorough=thorough)
    if rough is None:
        return None
    grid, blur = refine(gray, rough, board.lines(), free=board.free_space)
    match board:
        case Chessboard() if not _bordered(grid, gray.shape):
            return None
        case AprilGrid() if not has_spacing(grid, board):
            return None
        case _:
            return grid, blur


def _bordered(grid: Array, shape: tuple[int, ...]) -> bool:
    """Whether the picture shows most corners of each outer line of a plain board's grid (rows, cols, 2).

    A board whose last line is beyond the picture's rim is found as well, put one line too far to either side.
    """
    inside = np.all((grid >= 0.0) & (grid <= np.array(shape[::-1]) - 1.0), axis=-1)
    return min(line.mean() for line in (inside[0], inside[-1], inside[:, 0], inside[:, -1])) > 0.5


def to_grid(pixels: Array, ids: NDArray[np.int64], board: Board) -> Array:
    """(rows, cols, 2) px of `pixels` (N, 2) with `ids` (N,), NaN where a corner is absent."""
    grid = np.full((board.count, 2), np.nan)
    grid[ids] = pixels
    return grid.reshape(board.rows, board.cols, 2)


def _view(grid: Array, blur: float, shape: tuple[int, ...], source: str) -> BoardView | None:
    height, width = shape
    flat = grid.reshape(-1, 2)
    off_rim = np.minimum(flat, np.array([width - 1.0, height - 1.0]) - flat).min(axis=1)
    inside = off_rim >= NARROWEST_PX  # nearer to the rim half of a crossing is missing, and tenths of a pixel with it
    ids = np.flatnonzero(inside)
    sides = side_px(grid)
    if len(ids) < FEWEST_CORNERS or not len(sides):
        return None
    return BoardView(flat[ids], ids, width, height, float(sides.min()), blur, source)


# -- chessboard detection ----------------------------------------------------------------------------------------------

_EVEN_LIGHT = cv2.CALIB_CB_FAST_CHECK
_UNEVEN_LIGHT = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
_QUICK = ((1.0, _EVEN_LIGHT), (0.4, cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_FAST_CHECK))  # scale, flags
_THOROUGH = ((1.0, _UNEVEN_LIGHT), (0.5, _UNEVEN_LIGHT))
_LARGE_PX, _SMALL_PX = 1500, 1000  # longest sides: also searched at a quarter, at twice the size
_SECTORS = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
_SAME_LEVEL = 1.0  # grey levels: nearer ones are the same colour


def find_chessboard(gray: Gray, board: Chessboard, *, thorough: bool) -> Array | None:
    """(rows, cols, 2) px in the board's order, good to a pixel or two; None when the whole board is not there.

    Without `thorough` only what fits between two frames of a live picture is tried.
    """
    size = (board.cols, board.rows)
    for scale, flags in (*_QUICK, *(_more(gray) if thorough else ())):
        corners = _search(gray, size, scale, flags)
        if corners is not None:
            return in_order(gray, corners)
    if thorough:
        found, sectors = cv2.findChessboardCornersSB(gray, size, flags=_SECTORS)
        if found:
            return in_order(gray, np.asarray(sectors, float).reshape(board.rows, board.cols, 2))
    return None


def _more(gray: Gray) -> list[tuple[float, int]]:
    """What else to try: squares of a few pixels survive the search's erosions when enlarged, blurred ones when not."""
    longest = max(gray.shape)
    more = list(_THOROUGH)
    if longest > _LARGE_PX:
        more.append((0.25, _UNEVEN_LIGHT))
    if longest < _SMALL_PX:
        more.append((2.0, _UNEVEN_LIGHT))
    return more


def _search(gray: Gray, size: tuple[int, int], scale: float, flags: int) -> Array | None:
    scaled = gray
    if scale != 1.0:
        smooth = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
        scaled = np.asarray(cv2.resize(gray, None, fx=scale, fy=scale, interpolation=smooth), np.uint8)
    found, corners = cv2.findChessboardCorners(scaled, size, flags=flags)
    if not found:
        return None
    return (np.asarray(corners, float).reshape(size[1], size[0], 2) + 0.5) / scale - 0.5


def in_order(gray: Gray, grid: Array) -> Array:
    """`grid` (rows, cols, 2) px counted as `boards.Chessboard` says, whatever end the search began at."""
    if not _right_handed(grid):
        grid = grid[:, ::-1]
    turns = range(4) if grid.shape[0] == grid.shape[1] else (0, 2)
    ways = [np.rot90(grid, turn) for turn in turns]
    first = [first_square_darkness(gray, way) for way in ways]
    darkest = max(first)
    margin = max((darkest - min(first)) / 2, _SAME_LEVEL)
    return max((way for way, dark in zip(ways, first, strict=True) if dark >= darkest - margin), key=_upright)


def first_square_darkness(gray: Gray, grid: Array) -> float:
    """How much darker the squares of the first one's colour are than the others, grey levels; negative when lighter."""
    centres = (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:]) / 4
    levels = cv2.remap(gray, centres[..., 0].astype(np.float32), centres[..., 1].astype(np.float32), cv2.INTER_LINEAR)
    row, col = np.indices(levels.shape)
    even = (row + col) % 2 == 0
    return float(levels[~even].mean() - levels[even].mean())


def _right_handed(grid: Array) -> bool:
    """Whether x right, y down as the printed side shows it: the board is never seen from behind."""
    along, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    return bool(along[0] * down[1] - along[1] * down[0] > 0)


def _upright(grid: Array) -> float:
    along = grid[:, -1].mean(axis=0) - grid[:, 0].mean(axis=0)
    return float(along[0] / (np.linalg.norm(along) + 1e-9))


# -- corners to a fraction of a pixel ----------------------------------------------------------------------------------

REACH = 0.45  # of the free space: the disc's radius
WIDEST_PX, NARROWEST_PX = 12.0, 2.5  # radii of the disc: more only costs time; less does not determine a crossing
_ASTRAY = 0.12  # of the free space: a corner farther than this from where its neighbours expect it is tried again
_ASTRAY_PX = 0.5
_BESIDE = 0.05  # of the free space: how well neighbours predict a corner that was not found
_WORSE = 2.5  # times the misfit of the others
_FAINTER = 0.6  # of the others' contrast, or the reverse: what has less is not the board


def refine(gray: NDArray[np.uint8], grid: Array, lines: tuple[Array, Array], *,
           free: float = 1.0) -> tuple[Array, float]:
    """`grid` (rows, cols, 2) px, NaN where a corner is absent, moved to where the picture has the corners.

    `lines`: the board's. `free` says which part of the way to the next grid line is empty around a corner: less than 1
    where squares hold markers. Absent corners that the picture shows beside others are added. Returns the grid and the
    blur of the edges (median SD in px, of the blurrier direction). A corner whose edges cannot be fitted becomes NaN.
    """
    fitted = _fit(gray, grid, grid, lines, free)
    expected = _expected(fitted[..., :2], lines)
    astray = _apart(fitted, expected) > np.maximum(_ASTRAY * clearance_px(grid, lines), _ASTRAY_PX)
    again = np.logical_and(astray | np.isnan(fitted[..., 0]), np.isfinite(grid[..., 0])).reshape(*astray.shape, 1)
    fitted = np.where(again, _fit(gray, np.where(again, expected, np.nan), grid, lines, free), fitted)
    known = np.isfinite(fitted[..., 0])
    for _ in range(max(grid.shape) if known.any() and not known.all() else 0):
        more = _beside(gray, fitted, lines, free)
        if not np.isfinite(more[..., 0]).any():
            break
        fitted = np.where(np.isfinite(more), more, fitted)
    blurs = fitted[..., 2:4].max(axis=-1)
    return fitted[..., :2], float(np.nanmedian(blurs)) if np.isfinite(blurs).any() else float("nan")


def _fit(gray: NDArray[np.uint8], starts: Array, grid: Array, lines: tuple[Array, Array], free: float) -> Array:
    """(rows, cols, 6) of `fit_saddles` from `starts` (rows, cols, 2) px, NaN for none, with the lines of `grid`."""
    space = clearance_px(grid, lines)
    radii = np.where(np.isfinite(space), np.clip(REACH * free * space, NARROWEST_PX, WIDEST_PX), 0.0)
    fitted = fit_saddles(gray, np.ascontiguousarray(starts).reshape(-1, 2), _directions(grid).reshape(-1, 2),
                         radii.reshape(-1))
    return fitted.reshape(*grid.shape[:2], FIELDS)


def _beside(gray: NDArray[np.uint8], fitted: Array, lines: tuple[Array, Array], free: float) -> Array:
    """(rows, cols, 6), NaN for most: absent corners that the picture shows where their neighbours expect them.

    They count when they fit like the others, at the place and with the contrast that the board has there: a finger or
    the rim of a sheet does not.
    """
    known = np.isfinite(fitted[..., :1])
    expected = np.where(known, np.nan, _expected(fitted[..., :2], lines))
    inside = np.all((expected > 0.0) & (expected < np.array(gray.shape[::-1]) - 1.0), axis=-1, keepdims=True)
    expected = np.where(inside, expected, np.nan)
    filled = np.where(known, fitted[..., :2], expected)
    found = _fit(gray, expected, filled, lines, free)
    row, col = np.indices(known.shape[:2])
    sign = (-1.0) ** (row + col)
    usual, misfit = np.median((fitted[..., 4] * sign)[known[..., 0]]), np.median(fitted[..., 5][known[..., 0]])
    contrast = found[..., 4] * sign / usual
    good = (contrast > _FAINTER) & (contrast < 1.0 / _FAINTER) & (found[..., 5] < _WORSE * misfit)
    good &= _apart(found, expected) < np.maximum(_BESIDE * clearance_px(filled, lines), _ASTRAY_PX)
    return np.where(good[..., None], found, np.nan)


def _apart(fitted: Array, places: Array) -> Array:
    """(rows, cols) px."""
    return np.asarray(np.linalg.norm(fitted[..., :2] - places, axis=-1))


def _expected(grid: Array, lines: tuple[Array, Array]) -> Array:
    """(rows, cols, 2) px, where the corners within two steps along rows and columns expect each one (median)."""
    guesses = []
    for axis, places in ((1, lines[0]), (0, lines[1])):
        for one, other in ((-1, 1), (1, 2), (-1, -2)):
            near, far = _beyond(grid, one, axis), _beyond(grid, other, axis)
            at_near, at_far = (_beyond(places[:, None], step, 0)[:, 0] for step in (one, other))
            share = ((places - at_near) / (at_far - at_near)).reshape((1, -1, 1) if axis else (-1, 1, 1))
            guesses.append(near + share * (far - near))
    ordered = np.sort(np.stack(guesses), axis=0)  # NaN last
    count = np.isfinite(ordered).sum(axis=0, keepdims=True)
    middle = [np.take_along_axis(ordered, np.maximum(place, 0), axis=0) for place in ((count - 1) // 2, count // 2)]
    return np.asarray(np.where(count > 0, (middle[0] + middle[1]) / 2.0, np.nan)[0])


def _beyond(values: Array, step: int, axis: int) -> Array:
    """`values` moved so that each place holds what is `step` further along an axis, NaN beyond the ends."""
    pad = [(0, 0)] * values.ndim
    pad[axis] = (max(-step, 0), max(step, 0))
    start = max(step, 0)
    return np.take(np.pad(values, pad, constant_values=np.nan), range(start, start + values.shape[axis]), axis)


def side_px(grid: Array) -> Array:
    """Lengths in px of all sides of squares between corners of `grid` (rows, cols, 2) that were found."""
    sides = np.concatenate([np.linalg.norm(np.diff(grid, axis=axis), axis=-1).ravel() for axis in (0, 1)])
    return sides[np.isfinite(sides)]


def clearance_px(grid: Array, lines: tuple[Array, Array]) -> Array:
    """(rows, cols) px, how far the nearest parallel grid line is from each corner of `grid` (rows, cols, 2), by the
    part of the board beside it and by the least distance of its `lines`.

    inf for a corner that is absent (NaN) or has no whole square beside it.
    """
    along, down = np.diff(grid, axis=1), np.diff(grid, axis=0)
    wide, high = (np.diff(places) for places in lines)
    least = min(float(wide.min()), float(high.min()))
    nearest = np.full(grid.shape[:2], np.inf)
    first, last = slice(1, None), slice(None, -1)
    for rows in (first, last):  # the four squares that meet in a corner
        for cols in (first, last):
            a, d = along[rows], down[:, cols]
            area = np.abs(a[..., 0] * d[..., 1] - a[..., 1] * d[..., 0])
            across = area / np.maximum(np.linalg.norm(d, axis=-1), 1e-9) * (least / wide)
            upright = area / np.maximum(np.linalg.norm(a, axis=-1), 1e-9) * (least / high)[:, None]
            nearest[rows, cols] = np.fmin(nearest[rows, cols], np.fmin(across, upright))
    return np.where(np.isfinite(grid).all(axis=-1), nearest, np.inf)


def _directions(grid: Array) -> Array:
    """(rows, cols, 2) rad, of the grid lines through each corner along x and y, from the neighbours there are."""
    found = np.zeros(grid.shape)
    for which, axis in ((0, 1), (1, 0)):
        step = np.diff(grid, axis=axis)
        pad = [(0, 0), (0, 0), (0, 0)]
        pad[axis] = (1, 1)
        padded = np.pad(step, pad, constant_values=np.nan)
        count = padded.shape[axis]
        both = np.stack([np.take(padded, range(count - 1), axis), np.take(padded, range(1, count), axis)])
        there = np.isfinite(both).all(axis=-1, keepdims=True)
        mean = np.where(there, both, 0.0).sum(axis=0)
        found[..., which] = np.arctan2(mean[..., 1], mean[..., 0])
    return found
