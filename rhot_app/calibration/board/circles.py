"""OpenCV's asymmetric grid of circles in pictures: each centre to a hundredth of a pixel.

The centroid of a circle's image is not the image of its centre: perspective and distortion move it (Heikkila 2000).
The bias follows from the grid itself: a smooth map from the board to the picture is fitted to all centres, and the
circles' rims are mapped by it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import CircleGrid

Array = NDArray[np.float64]
Gray = NDArray[np.uint8]

_SMALL_PX = 1000  # longest side: pictures below are searched at twice their size, too
_LEAST_PX2, _LARGEST = 20.0, 0.05  # area of a circle; of the picture
_OFF = 0.25  # of the spacing: centres farther from their places are of another board
_WINDOW = 0.5 * float(np.sqrt(2.0))  # of the spacing: halfway to the nearest circle
_PAPER = (0.75, 0.95)  # of the spacing, from a circle's middle: there, between its neighbours, is white paper
_CONTRAST = 10.0  # grey levels
_ITERATIONS = 3
_STEP = 2.0 * np.pi / 24
_RIM = np.sqrt(_STEP / np.sin(_STEP)) * np.exp(1j * _STEP * np.arange(24))  # a polygon of the circle's area


@dataclass(frozen=True, slots=True)
class Centres:
    """`grid` (rows, cols, 2) px of the circles' centres, and `blur_px`, the SD of the blur across their rims."""

    grid: Array
    blur_px: float


def find_circles(gray: Gray, board: CircleGrid, *, thorough: bool = False) -> Centres | None:
    """All circles of the board, dark on light or light on dark; None where they are not all there.

    `thorough` looks again, enlarged, and where clusters of other blobs are around.
    """
    flags = [cv2.CALIB_CB_ASYMMETRIC_GRID]
    scales = [1.0]
    if thorough:
        flags.append(cv2.CALIB_CB_ASYMMETRIC_GRID | cv2.CALIB_CB_CLUSTERING)
        scales += [2.0] if max(gray.shape) < _SMALL_PX else [0.5]
    for picture in (gray, np.asarray(cv2.bitwise_not(gray), np.uint8)):
        for scale in scales:
            for flag in flags:
                rough = _search(picture, board, scale, flag)
                if rough is not None:
                    return _refined(picture, rough, board)
    return None


def _search(gray: Gray, board: CircleGrid, scale: float, flags: int) -> Array | None:
    """(N, 2) px, good to a pixel, in the board's order."""
    picture = gray if scale == 1.0 else np.asarray(cv2.resize(
        gray, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC), np.uint8)
    found, places = cv2.findCirclesGrid(picture, (board.cols, board.rows), flags=flags, blobDetector=_blobs(picture))
    if not found or places is None:
        return None
    pixels = (np.asarray(places, float).reshape(-1, 2) + 0.5) / scale - 0.5
    grid = pixels.reshape(board.rows, board.cols, 2)
    ways = [grid, grid[::-1], grid[:, ::-1], grid[::-1, ::-1]]
    fitting = [way for way in ways if _fits(way.reshape(-1, 2), board)]
    return None if not fitting else max(fitting, key=_upright).reshape(-1, 2)


def _fits(pixels: Array, board: CircleGrid) -> bool:
    """Whether the centres (N, 2) stand as on the board, seen from its printed side."""
    places = board.object_points()[:, :2] / board.square_m
    found, _ = cv2.findHomography(places, pixels)
    if found is None:
        return False
    off = cv2.perspectiveTransform(places[:, None], found)[:, 0] - pixels
    linear = np.linalg.lstsq(places - places.mean(axis=0), pixels - pixels.mean(axis=0), rcond=None)[0]
    area = float(np.linalg.det(linear))
    return area > 0.0 and float(np.linalg.norm(off, axis=1).max()) < 2.0 * _OFF * np.sqrt(area)


def _upright(grid: Array) -> float:
    along = grid[:, -1].mean(axis=0) - grid[:, 0].mean(axis=0)
    return float(along[0] / (np.linalg.norm(along) + 1e-9))


def _blobs(picture: Gray) -> cv2.SimpleBlobDetector:
    parameters = cv2.SimpleBlobDetector.Params()
    parameters.minArea, parameters.maxArea = _LEAST_PX2, _LARGEST * picture.size
    parameters.minDistBetweenBlobs = 3.0
    return cv2.SimpleBlobDetector.create(parameters)


# -- centres to a fraction of a pixel ----------------------------------------------------------------------------------

def _refined(gray: Gray, rough: Array, board: CircleGrid) -> Centres | None:
    """The circles' centres (N, 2): centroids of their ink, less the bias by perspective and distortion."""
    places = board.object_points()[:, :2] / board.square_m
    pixels = rough
    for _ in range(_ITERATIONS):
        smooth = _SmoothMap.fit(places, pixels)
        measured = [_ink(gray, pixel, slope) for pixel, slope in zip(pixels, smooth.slopes(places), strict=True)]
        if any(one is None for one in measured):
            return None
        middles, areas, blurs = (np.array(part) for part in zip(*(one for one in measured if one is not None),
                                                                strict=True))
        scales = np.abs(np.linalg.det(smooth.slopes(places)))
        radius = float(np.sqrt(np.median(areas / scales) / np.pi))
        pixels = middles - smooth.displacements(places, radius)
    return Centres(pixels.reshape(board.rows, board.cols, 2), float(np.median(blurs)))


def _ink(gray: Gray, centre: Array, slope: Array) -> tuple[Array, float, float] | None:
    """(centroid (2,) px, area px^2, blur px) of the dark circle near `centre`, within half the way to the next one;
    None where the picture does not show it whole. `slope` (2, 2) px a spacing."""
    reach = np.ceil(_PAPER[1] * np.linalg.norm(slope, axis=1)).astype(int)
    u0, v0 = np.rint(centre).astype(int)
    height, width = gray.shape
    if u0 < reach[0] + 1 or v0 < reach[1] + 1 or u0 + reach[0] + 1 >= width or v0 + reach[1] + 1 >= height:
        return None
    window = gray[v0 - reach[1]:v0 + reach[1] + 1, u0 - reach[0]:u0 + reach[0] + 1].astype(np.float64)
    v, u = np.indices(window.shape)
    offsets = np.stack([u + u0 - reach[0], v + v0 - reach[1]], -1) - centre
    on_board = offsets @ np.linalg.inv(slope).T
    distance, beside = np.linalg.norm(on_board, axis=-1), np.linalg.norm(np.abs(on_board) - 1.0, axis=-1)
    inside, white = distance <= _WINDOW, (distance > _PAPER[0]) & (distance < _PAPER[1]) & (beside > _PAPER[0])
    if np.count_nonzero(white) < 6:
        return None
    around = np.column_stack([offsets[white], np.ones(np.count_nonzero(white))])
    plane = np.linalg.lstsq(around, window[white], rcond=None)[0]
    paper = offsets @ plane[:2] + plane[2]
    ink = np.where(inside, paper - window, 0.0)
    depth = float(np.median(ink[ink > 0.75 * np.percentile(ink[inside], 95)]))
    if depth < _CONTRAST:
        return None
    total = float(ink.sum())
    middle = np.array([(ink * offsets[..., k]).sum() for k in (0, 1)]) / total + centre
    steepest = [float(np.abs(np.gradient(window, axis=axis)[inside]).max()) for axis in (0, 1)]
    blur = depth / (np.sqrt(2.0 * np.pi) * max(min(steepest), 1e-9))
    return middle, total / depth, float(blur)


@dataclass(frozen=True, slots=True, eq=False)
class _SmoothMap:
    """From the board, in spacings, to the picture, in px: a homography, and then a polynomial of third order for the
    lens."""

    homography: Array
    middle: Array
    size: float
    polynomial: Array

    @classmethod
    def fit(cls, places: Array, pixels: Array) -> _SmoothMap:
        homography = np.asarray(cv2.findHomography(places, pixels)[0], np.float64)
        middle, size = pixels.mean(axis=0), float(np.abs(pixels - pixels.mean(axis=0)).max())
        plane = cv2.perspectiveTransform(places[:, None], homography)[:, 0]
        polynomial = np.linalg.lstsq(_powers((plane - middle) / size), pixels - plane, rcond=None)[0]
        return cls(homography, middle, size, np.asarray(polynomial, np.float64))

    def __call__(self, places: Array) -> Array:
        flat = places.reshape(-1, 2)
        plane = cv2.perspectiveTransform(flat[:, None], self.homography)[:, 0]
        return np.asarray(plane + _powers((plane - self.middle) / self.size) @ self.polynomial).reshape(places.shape)

    def slopes(self, places: Array) -> Array:
        """(N, 2, 2) px a spacing."""
        step = 1e-3
        return np.stack([(self(places + move) - self(places - move)) / (2.0 * step)
                         for move in (np.array([step, 0.0]), np.array([0.0, step]))], axis=-1)

    def displacements(self, places: Array, radius: float) -> Array:
        """(N, 2) px, from the images of the circles' centres to the centroids of the circles' images."""
        rims = self(places[:, None] + radius * np.stack([_RIM.real, _RIM.imag], -1))
        return np.array([_centroid(rim) for rim in rims]) - self(places)


def _powers(x: Array) -> Array:
    return np.column_stack([x[:, 0]**i * x[:, 1]**j for i in range(4) for j in range(4 - i)])


def _centroid(outline: Array) -> Array:
    """(2,) of the area in a closed outline (N, 2)."""
    origin = outline.mean(axis=0)
    a, b = outline - origin, np.roll(outline, -1, axis=0) - origin
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return np.asarray(((a + b) * cross[:, None]).sum(axis=0) / (3.0 * cross.sum()) + origin)
