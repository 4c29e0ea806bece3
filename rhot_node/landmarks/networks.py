"""Hands of a picture by two networks: one finds palms in the whole picture, one 21 landmarks in a region about a hand.

The next picture's region follows from the landmarks, so that palms are searched for only where a hand is missing.
Source of the geometry: MediaPipe Hands (Zhang et al. 2020), graphs `palm_detection` and `hand_landmark` of the version
that `install` names. Its pixels are kept: a region is sampled without half a pixel.
"""

from __future__ import annotations

import math
import timeit
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Final, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.image import YuvImage, to_bgr
from rhot_node.errors import KeypointError
from rhot_node.landmarks.install import installed_folder, read_network
from rhot_node.landmarks.runtime import Network, Tensor, best_runtime, open_network

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

MODELS: Final = ("full", "lite")
PALM_PX: Final = 192
HAND_PX: Final = 224
"""Sides of the networks' inputs."""

LEAST_PROBABILITY: Final = 0.5
"""Of a palm, and of a hand's presence: less is none."""

SEARCH_EVERY: Final = 4
"""Pictures from one search to the next, for a further hand and in an empty scene. A search costs about as much as the
landmarks of a hand."""

REACQUISITION: Final = 30
"""Pictures without a hand, the first ones and those after a loss, that are all searched. Chosen: a second."""

PART: Final = 0.6
"""Side, by the longer one of the picture, of its parts that are searched by turns with the whole: in the whole picture
a small or far hand has too few px. Five of them cover it."""

OVERLAP: Final = 0.3
"""Intersection over union from which two boxes are of one palm (MediaPipe's ``min_suppression_threshold``)."""

SAME: Final = 0.125
"""Part of a region's side: two palms that are less apart are one hand. It is a quarter of a hand's extent."""

HAND_SIGMA: Final = 0.004
"""Standard deviation of a landmark's own error, per axis, as a part of its region's side
(`python benchmarks/hand_networks.py`)."""

PALM_REGION: Final = 2.6, 0.5
NEXT_REGION: Final = 2.0, 0.1
"""Side of the region of a palm's box, and of landmarks, by the box's longer side; and by which part of its height the
region is moved towards the fingers (MediaPipe's ``RectTransformationCalculator``)."""


class Landmark(IntEnum):
    """MediaPipe's numbers of the landmarks that a hand's next region lies about: no outer joints, no fingertips."""

    WRIST = 0
    THUMB_CMC = 1
    THUMB_MCP = 2
    THUMB_IP = 3
    INDEX_MCP = 5
    INDEX_PIP = 6
    MIDDLE_MCP = 9
    MIDDLE_PIP = 10
    RING_MCP = 13
    RING_PIP = 14
    LITTLE_MCP = 17
    LITTLE_PIP = 18


PALM_LANDMARKS: Final = (Landmark.WRIST, Landmark.INDEX_MCP, Landmark.MIDDLE_MCP, Landmark.RING_MCP,
                         Landmark.LITTLE_MCP, Landmark.THUMB_CMC, Landmark.THUMB_MCP)
"""The landmarks that the palm detector finds, too, in its order."""

_PALM_BOX, _PALM_POINTS = 2, len(PALM_LANDMARKS)  # rows of two of the palm detector: centre and size, then points
_ANCHORS = ((24, 2), (12, 6))  # of the palm detector: cells of a grid along a side, and anchors in each
_SAMPLED_PX = 4.0  # a region of more px of the picture per px of the network is averaged before it is sampled
_SMALLEST_PX = 8.0  # a region of less shows nothing


class Region(NamedTuple):
    """A square region of a picture. `centre` (2,) px, (0, 0) at the centre of the first pixel; `side` px; `turn` rad:
    clockwise, how the hand's upright stands in the picture."""

    centre: Array
    side: float
    turn: float

    def from_input(self, size: int) -> Array:
        """(2, 3): px of a network's input of `size` px, counted from its corner, to px of the picture."""
        c, s = self.side / size * math.cos(self.turn), self.side / size * math.sin(self.turn)
        into = np.array([[c, -s], [s, c]])
        return np.column_stack([into, self.centre - into @ np.full(2, 0.5 * size)])


@dataclass(frozen=True, slots=True)
class DetectedHand:
    """A hand in a picture. `landmarks` (21, 2) px, (0, 0) at the centre of the first pixel, in the order of
    docs/landmarks.md. `world` (21, 3) m: about the hand's centre, of a hand of usual size; x and y along the picture's
    axes. `presence`: probability that the region shows a hand; `right`: that it is a right one. `region`: where it was
    looked for."""

    landmarks: Array
    world: Array
    presence: float
    right: float
    region: Region


class _Palm(NamedTuple):
    points: Array  # (7, 2) px: PALM_LANDMARKS
    region: Region


class HandNetworks:
    """Hands of pictures that follow each other. One thread at a time."""

    def __init__(self, palm: Network, hand: Network, hands: int = 2) -> None:
        """`palm`, `hand`: the networks. `hands`: so many are looked for at most."""
        self._palm, self._hand, self._most = palm, hand, hands
        self._anchors = _anchors()
        self.reset()

    def reset(self) -> None:
        """The next picture does not follow the last one."""
        self._regions: list[Region] = []
        self._unsearched, self._empty, self._searches = SEARCH_EVERY, 0, -1  # pictures since a search, and a hand

    def find(self, picture: Picture | YuvImage) -> tuple[DetectedHand, ...]:
        """The hands in a picture (H, W, 3) BGR, or (H, W) grey, uint8, or one of planes, which is converted only when
        it is searched. Raises ValueError for any other array."""
        self._unsearched += 1
        self._empty = 0 if self._regions else self._empty + 1
        due = self._unsearched >= SEARCH_EVERY or (not self._regions and self._empty <= REACQUISITION)
        if isinstance(picture, YuvImage):
            if not self._regions and not due:
                return ()
            picture = to_bgr(picture)
        if picture.dtype != np.uint8 or picture.ndim not in (2, 3) or picture.shape[2:] not in ((), (3,)):
            raise ValueError(f"a picture is (H, W, 3) or (H, W) of uint8, not {picture.shape} of {picture.dtype}")
        hands: list[DetectedHand] = []
        for region in self._regions if picture.size else []:
            self._add(hands, picture, region)
        lost = len(hands) < len(self._regions)
        if picture.size and len(hands) < self._most and (lost or due):
            self._unsearched, self._searches = 0, 0 if lost else self._searches + 1
            for palm in self._palms(picture, _view(picture, self._searches)):
                if len(hands) < self._most and not any(_same(palm.points, palm.region, hand) for hand in hands):
                    self._add(hands, picture, palm.region)
        self._regions = [next_region(hand.landmarks) for hand in hands]
        return tuple(hands)

    def cost_s(self, picture: Picture) -> tuple[float, float]:
        """How long a search for palms in such a picture takes, and the landmarks of one hand, s: the quickest of
        several, because whatever else the machine does makes it longer."""
        whole = _whole(picture)
        return (min(timeit.repeat(lambda: self._palms(picture, whole), number=1)),
                min(timeit.repeat(lambda: landmarks_in(self._hand, picture, whole), number=1)))

    def _add(self, hands: list[DetectedHand], picture: Picture, region: Region) -> None:
        """Add the hand of a region, if there is one, and if it is another one than those before."""
        if not _usable(region, picture):
            return
        pixels, presence, right, world = landmarks_in(self._hand, picture, region)
        found = DetectedHand(pixels, world, presence, right, region)
        if not (found.presence >= LEAST_PROBABILITY and np.isfinite(pixels).all()):
            return
        if not any(_same(pixels[list(PALM_LANDMARKS)], region, hand) for hand in hands):
            hands.append(found)

    def _palms(self, picture: Picture, view: Region) -> list[_Palm]:
        """The palms of a part of a picture, the likeliest first: by weighted non-maximum suppression."""
        boxes, logits = self._palm(_sampled(picture, view, PALM_PX))[:2]
        probability = np.exp(-np.logaddexp(0.0, -logits.reshape(-1).astype(np.float64)))
        likely = np.flatnonzero(probability >= LEAST_PROBABILITY)
        likely = likely[np.argsort(-probability[likely], kind="stable")]
        # rows of centre, size and seven points, px of the input about the anchor
        points = boxes.reshape(-1, _PALM_BOX + _PALM_POINTS, 2)[likely].astype(np.float64)
        placed = np.arange(points.shape[1]) != 1  # all but the size
        points[:, placed] += PALM_PX * self._anchors[likely][:, None]
        into, palms = view.from_input(PALM_PX), []
        while len(likely):
            one = _overlaps(points[:, 0], points[:, 1]) > OVERLAP
            one[0] = True
            mean = np.average(points[one], axis=0, weights=probability[likely[one]])
            palms.append(_palm_region(mean[1] * view.side / PALM_PX,
                                      mean[placed] @ into[:, :2].T + into[:, 2]))
            points, likely = points[~one], likely[~one]
        return palms


def open_hand_networks(folder: Path | None = None, *, model: str = "full", runtime: str | None = None,
                       threads: int = 1, hands: int = 2) -> HandNetworks:
    """The installed networks. `model`: one of MODELS; `runtime`: `litert` or `opencv`, None the best that is there.
    Raises KeypointError."""
    folder = installed_folder() if folder is None else folder
    if folder is None:
        raise KeypointError("the hand networks are not installed. Run `rhot landmarks install`; on a node `rhot-node "
                            "landmarks install`, for its service `sudo rhot-node landmarks install --service`.")
    runtime = best_runtime() if runtime is None else runtime
    palm, hand = (open_network(read_network(folder, f"{name}_{model}.tflite"), runtime, threads)
                  for name in ("palm_detection", "hand_landmark"))
    return HandNetworks(palm, hand, hands)


def landmarks_in(hand: Network, picture: Picture, region: Region) -> tuple[Array, float, float, Array]:
    """What the landmark network finds in a region: landmarks (21, 2) px of the picture, the probabilities that a hand
    is there and that it is a right one, and `world` (21, 3) as of `DetectedHand`."""
    landmarks, presence, right, world = hand(_sampled(picture, region, HAND_PX))[:4]
    into = region.from_input(HAND_PX)
    pixels = landmarks.reshape(21, 3)[:, :2].astype(np.float64) @ into[:, :2].T + into[:, 2]
    turned = world.reshape(21, 3).astype(np.float64)
    turned[:, :2] = turned[:, :2] @ into[:, :2].T * (HAND_PX / region.side)  # the region's axes to the picture's
    return pixels, float(presence.item()), float(right.item()), turned


def next_region(landmarks: Array) -> Region:
    """The region in which the next picture shows the hand of these landmarks (21, 2) px."""
    knuckles = (0.25 * (landmarks[Landmark.INDEX_MCP] + landmarks[Landmark.RING_MCP])
                + 0.5 * landmarks[Landmark.MIDDLE_MCP])
    x, y = knuckles - landmarks[Landmark.WRIST]
    turn = math.atan2(x, -y)
    c, s = math.cos(turn), math.sin(turn)
    upright = landmarks[list(Landmark)] @ np.array([[c, -s], [s, c]])
    low, high = upright.min(axis=0), upright.max(axis=0)
    centre = np.array([[c, -s], [s, c]]) @ (0.5 * (low + high))
    return _region(centre, high - low, turn, *NEXT_REGION)


def _whole(picture: Picture) -> Region:
    height, width = picture.shape[:2]
    return Region(np.array([0.5 * (width - 1), 0.5 * (height - 1)]), float(max(width, height)), 0.0)


def _view(picture: Picture, search: int) -> Region:
    """What is searched next: the whole picture at every even `search`, else one of its corners, or its middle."""
    whole = _whole(picture)
    if search % 2 == 0:
        return whole
    side, number = PART * whole.side, search // 2 % 5
    if number == 4:
        return whole._replace(side=side)
    far = np.maximum(2.0 * whole.centre + 1.0 - side, 0.0)  # of a part from the picture's corner
    away = np.where(far > 0.0, far * [number % 2, number // 2] + 0.5 * (side - 1.0), whole.centre)
    return Region(away, side, 0.0)


def _palm_region(size: Array, points: Array) -> _Palm:
    """`size` (2,) px of a palm's box; `points` (8, 2): its centre and seven points."""
    x, y = points[3] - points[1]  # from the wrist to the middle finger
    return _Palm(points[1:], _region(points[0], size, math.atan2(x, -y), *PALM_REGION))


def _region(centre: Array, size: Array, turn: float, scale: float, up: float) -> Region:
    """A box's region: `scale` times its longer side, moved up by the part `up` of its height."""
    shift = up * size[1] * np.array([math.sin(turn), -math.cos(turn)])
    return Region(centre + shift, scale * float(size.max()), turn)


def _same(palm: Array, region: Region, hand: DetectedHand) -> bool:
    """Whether the points of a palm are those of a hand."""
    apart = np.linalg.norm(palm - hand.landmarks[list(PALM_LANDMARKS)], axis=1).mean()
    return bool(apart < SAME * max(region.side, hand.region.side))


def _overlaps(centres: Array, sizes: Array) -> Array:
    """Intersection over union of boxes (N, 2) with the first of them."""
    low, high = centres - 0.5 * sizes, centres + 0.5 * sizes
    both = np.prod(np.maximum(np.minimum(high, high[0]) - np.maximum(low, low[0]), 0.0), axis=1)
    areas = np.prod(np.maximum(sizes, 0.0), axis=1)
    return both / np.maximum(areas + areas[0] - both, 1e-12)


def _usable(region: Region, picture: Picture) -> bool:
    """Whether a region is one of the picture."""
    height, width = picture.shape[:2]
    return bool(np.isfinite([*region.centre, region.side, region.turn]).all()
                and _SMALLEST_PX <= region.side <= 4.0 * max(width, height)
                and -0.5 <= region.centre[0] <= width - 0.5 and -0.5 <= region.centre[1] <= height - 0.5)


def _sampled(picture: Picture, region: Region, size: int) -> Tensor:
    """A region (size, size, 3) RGB, 0..1; black outside the picture."""
    into = region.from_input(size)
    into[:, 2] += 0.5  # MediaPipe's pixels
    corners = np.array([[0, 0], [size, 0], [0, size], [size, size]]) @ into[:, :2].T + into[:, 2]
    height, width = picture.shape[:2]
    low = np.clip(np.floor(corners.min(axis=0)).astype(int) - 2, 0, [width, height])
    high = np.clip(np.ceil(corners.max(axis=0)).astype(int) + 3, 0, [width, height])
    part = picture[low[1]:high[1], low[0]:high[0]]
    if not part.size:
        return np.zeros((size, size, 3), np.float32)
    step = region.side / size
    if step > _SAMPLED_PX:
        reduced = max(int(0.5 * step), 1)
        shape = part.shape[1] // reduced, part.shape[0] // reduced
        if min(shape) == 0:
            return np.zeros((size, size, 3), np.float32)
        part = np.asarray(cv2.resize(part[:shape[1] * reduced, :shape[0] * reduced], shape,
                                     interpolation=cv2.INTER_AREA), np.uint8)
        into[:, 2] = (into[:, 2] - low - 0.5 * (reduced - 1)) / reduced
        into[:, :2] /= reduced
    else:
        into[:, 2] -= low
    crop = cv2.warpAffine(part, into, (size, size), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
    rgb = cv2.cvtColor(crop, cv2.COLOR_GRAY2RGB if picture.ndim == 2 else cv2.COLOR_BGR2RGB)
    return np.asarray(rgb, np.float32) / np.float32(255)


def _anchors() -> Array:
    """(2016, 2): centres of the palm detector's anchors, as a part of its input."""
    grids = []
    for size, count in _ANCHORS:
        y, x = (np.mgrid[:size, :size] + 0.5) / size
        grids.append(np.repeat(np.stack([x, y], -1).reshape(-1, 2), count, axis=0))
    return np.concatenate(grids)
