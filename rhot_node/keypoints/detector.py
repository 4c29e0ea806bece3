"""The keypoint detector: the region of the last frame's points, or of the companion, through the network to markers.

A network gives points for every image, also for one that shows something else. What is reported has a probability:
that of the network, of the region, and of points that a second, tighter region confirms. Below one half there is
nothing. Markers of the set that are paint are found by the fast detector.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.image import Detector, YuvImage, to_bgr
from rhot_node.errors import KeypointError
from rhot_node.keypoints.card import card_path, load_card
from rhot_node.keypoints.network import Found, KeypointNetwork
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerFlag, MarkerObservation

Array = NDArray[np.float64]

PREFIX: Final = "keypoints:"
"""Begins the name of a model card in a node's settings."""

LEAST_PROBABILITY: Final = 0.5
"""Less likely points are none."""

_DIAMETER_PX = 1.0  # a point has none
_SMALLEST_PX = 8.0  # a region of less shows nothing


class KeypointDetector:
    """Implements `Detector` for a marker set whose landmarks are the network's points, in their order."""

    def __init__(self, path: Path, markers: MarkerSet) -> None:
        """Raises KeypointError when the card, its networks or the marker set do not belong together."""
        card = load_card(path)
        self._landmarks = [k for k, marker in enumerate(markers.markers) if marker.shape == "landmark"]
        if len(self._landmarks) != card.points.count:
            raise KeypointError(f"the marker set {markers.name!r} has {len(self._landmarks)} landmarks, but the "
                                f"network of {path.name} finds {card.points.count} points. Use the set that belongs "
                                "to it.")
        self._network, self._sigma, self._factor = KeypointNetwork(path, card), card.points.sigma, card.region_factor
        self._upright = card.points.upright
        self._painted = PaintedMarkers(markers)
        self._last: Array | None = None

    def reset(self) -> None:
        """See `Detector`."""
        self._last = None
        self._painted.reset()

    def detect(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """See `Detector`."""
        found = self._find(to_bgr(image))
        out = list(self._painted.detect(image))
        if found is not None:
            variance = (self._sigma * self._side(found.pixels)) ** 2
            width, height = image.size
            for k, (x, y) in zip(self._landmarks, found.pixels, strict=True):
                if -0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5:
                    out[k] = MarkerObservation(k, float(x), float(y), _DIAMETER_PX, variance, 0.0, variance,
                                               found.probability)
        return tuple(out)

    def _find(self, bgr: NDArray[np.uint8]) -> Found | None:
        """The points of an image, None when they are unlikely to be what the network was made for."""
        probability = 1.0
        if self._last is None:
            centre, side, probability = self._network.region(bgr)
            first = self._network.points(bgr, centre, side, 0.0) if side >= _SMALLEST_PX else None
            if first is None or probability * first.probability < LEAST_PROBABILITY:
                return None
            begin = first.pixels
        else:
            begin = self._last
        found = self._again(bgr, begin)
        if found is not None and self._last is None:  # a tighter region must show the same points
            confirmed = self._again(bgr, found.pixels)
            if confirmed is not None:
                agreement = self._agreement(found.pixels, confirmed.pixels)
                found = Found(confirmed.pixels, agreement * confirmed.probability)
            else:
                found = None
        if found is None or probability * found.probability < LEAST_PROBABILITY:
            self._last = None
            return None
        self._last = found.pixels
        return found

    def _again(self, bgr: NDArray[np.uint8], pixels: Array) -> Found | None:
        """The points in the region about other points; None when that is no region of the image."""
        side, turn = self._side(pixels), 0.0
        centre = 0.5 * (pixels.min(axis=0) + pixels.max(axis=0))
        height, width = bgr.shape[:2]
        if not (_SMALLEST_PX <= side <= 4.0 * max(width, height) and -side < centre[0] < width + side
                and -side < centre[1] < height + side):
            return None
        if self._upright is not None:
            x, y = pixels[self._upright[1]] - pixels[self._upright[0]]
            turn = math.atan2(x, -y)
        return self._network.points(bgr, centre, side, turn)

    def _side(self, pixels: Array) -> float:
        """Side of the region of these points, px."""
        return self._factor * float(np.ptp(pixels, axis=0).max())

    def _agreement(self, pixels: Array, again: Array) -> float:
        """Likelihood ratio of two looks, whose points err by `sigma` each, to the best agreement: exp(-d^2 / 2), d^2
        per point and axis."""
        apart = (again - pixels) / (math.sqrt(2.0) * self._sigma * self._side(pixels))
        return math.exp(-0.5 * max(float(np.mean(apart * apart)) - 1.0, 0.0))


def keypoint_detector(name: str, markers: MarkerSet) -> KeypointDetector:
    """The detector of the card NAME in the node's folder of cards. Raises KeypointError."""
    return KeypointDetector(card_path(name), markers)


class PaintedMarkers:
    """Implements `Detector` by the fast one for the painted markers of a set. Its landmarks are lost."""

    def __init__(self, markers: MarkerSet) -> None:
        """Compiles for a minute when there are any."""
        self._indices = [k for k, marker in enumerate(markers.markers) if marker.shape != "landmark"]
        self._count = len(markers.markers)
        self._fast: Detector | None = None
        self.own = msgspec.structs.replace(markers, markers=tuple(markers.markers[k] for k in self._indices))
        """The painted ones."""
        if self._indices:
            from rhot_node.detect.fast import FastDetector
            self._fast = FastDetector(self.own)

    def reset(self) -> None:
        """See `Detector`."""
        if self._fast is not None:
            self._fast.reset()

    def detect(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """See `Detector`."""
        out = [MarkerObservation(k, math.nan, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, MarkerFlag.LOST)
               for k in range(self._count)]
        if self._fast is None:
            return tuple(out)
        found = [msgspec.structs.replace(one, index=self._indices[one.index]) for one in self._fast.detect(image)]
        for best in found[:len(self._indices)]:
            out[best.index] = best
        return (*out, *found[len(self._indices):])
