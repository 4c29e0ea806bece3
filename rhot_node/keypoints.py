"""Keypoints by a neural network that the user places on the node: a region of the image in, its points out.

A model card says which network finds the points, what it takes and what it gives: format ``rhot-keypoints``, TOML,
docs/landmarks.md. Files that a card names stand beside it. Nothing is downloaded. The table `anatomy` is the master's
and is passed over here.

A network gives points for every image, also for one that shows something else. What is reported has a probability: that
of the network, of the region, and of points that a second, tighter region confirms. Below one half there is nothing.
Markers of the set that are paint are found by the fast detector.
"""

from __future__ import annotations

import hashlib
import math
import os
import tomllib
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple

import cv2
import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from rhot_node.detect.image import Detector, YuvImage, to_bgr
from rhot_node.errors import KeypointError
from rhot_node.files import read_input
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerFlag, MarkerObservation

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

# -- model cards -------------------------------------------------------------------------------------------------------

Side = Annotated[int, Meta(ge=16, le=1024)]
Share = Annotated[float, Meta(gt=0, le=1)]
FileName = Annotated[str, Meta(pattern=r"\A[A-Za-z0-9][A-Za-z0-9_.-]{0,127}\Z")]

CARD_BYTES_MAX = 65_536
_BYTE = 1 / 255  # what a pixel is multiplied by for 0 to 1


class Network(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An ONNX file and how an image enters it: (pixel - `mean`) * `scale`, per channel in the order `channels`."""

    file: FileName
    sha256: Annotated[str, Meta(pattern=r"\A[0-9a-f]{64}\Z")]
    input_px: tuple[Side, Side]  # width, height
    layout: Literal["nchw", "nhwc"] = "nchw"
    channels: Literal["rgb", "bgr"] = "rgb"
    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scale: tuple[float, float, float] = (_BYTE, _BYTE, _BYTE)


class Points(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The output: `count` points of `numbers` each, of which x and y come first, in pixels of the input or as a
    fraction of it. `sigma`: their standard deviation, as a part of the region's side."""

    count: Annotated[int, Meta(ge=3, le=64)]
    sigma: Share
    output: str = ""  # the network's name of it; empty: the only one
    numbers: Annotated[int, Meta(ge=2, le=8)] = 3
    unit: Literal["px", "fraction"] = "px"
    score_output: str = ""  # a probability that the object is there; empty: there is none
    upright: tuple[int, int] | None = None  # two points: the region is turned until the second is above the first


class Regions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The companion that finds the first region: rows of x0, y0, x1, y1 (fractions of the image) and a probability."""

    network: Network
    output: str = ""


class ModelCard(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A model card. `region_factor`: side of a region, by the greatest extent of the points in it."""

    name: Annotated[str, Meta(min_length=1, max_length=100)]
    licence: Annotated[str, Meta(min_length=1, max_length=100)]
    network: Network
    points: Points
    regions: Regions | None = None
    region_factor: Annotated[float, Meta(ge=1, le=4)] = 1.5
    anatomy: dict[str, Any] = {}
    format: Literal["rhot-keypoints"] = "rhot-keypoints"
    version: Literal[1] = 1

    def __post_init__(self) -> None:
        if self.points.upright is not None and not all(0 <= k < self.points.count for k in self.points.upright):
            raise ValueError(f"points.upright names a point that is not there; they are 0 to {self.points.count - 1}")


def card_path(name: str) -> Path:
    """Where the node looks for the card of `keypoints:NAME`."""
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "rhot" / "keypoints" / f"{name}.toml"


def load_card(path: Path) -> ModelCard:
    """Read a model card. Raises KeypointError naming file and field."""
    try:
        data = read_input(path, CARD_BYTES_MAX)
    except OSError as exc:
        raise KeypointError(f"{path}: there is no model card ({exc.strerror}). Place the card and its network there.") \
            from exc
    try:
        return msgspec.convert(tomllib.loads(data.decode()), ModelCard)
    except (ValueError, RecursionError, msgspec.ValidationError) as exc:
        raise KeypointError(f"{path}: not a model card ({exc}). docs/landmarks.md describes it.") from exc


def read_network(card: Path, network: Network) -> bytes:
    """The bytes of a card's network, whose hash agrees. Raises KeypointError."""
    path = card.parent / network.file
    try:
        data = read_input(path)
    except OSError as exc:
        raise KeypointError(f"{path}: the network of {card.name} cannot be read ({exc.strerror}). Place it beside the "
                            "card; RHOT downloads none.") from exc
    found = hashlib.sha256(data).hexdigest()
    if found != network.sha256:
        raise KeypointError(f"{path}: is not the network that {card.name} describes. Its SHA-256 is {found}; the card "
                            f"has {network.sha256}. Place the right file, or correct the card.")
    return data


# -- the networks of a card, by cv2.dnn --------------------------------------------------------------------------------

class Found(NamedTuple):
    """Points of one region: `pixels` (P, 2) px of the image; `probability` that the object is there."""

    pixels: Array
    probability: float


class _Runner:
    """One network. `outputs`: names of the outputs to take; an empty one is the network's only output."""

    def __init__(self, card: Path, network: Network, outputs: tuple[str, ...]) -> None:
        self._network, self._where = network, card.parent / network.file
        data = np.frombuffer(read_network(card, network), np.uint8)
        try:
            self._net: Any = cv2.dnn.readNetFromONNX(data)
        except cv2.error as exc:
            raise KeypointError(f"{self._where}: OpenCV cannot read this network ({_reason(exc)}). Export it to ONNX "
                                "with plain layers.") from exc
        there = list(self._net.getUnconnectedOutLayersNames())
        missing = next((name for name in outputs if name and name not in there), None)
        if missing is not None or (any(not name for name in outputs) and len(there) != 1):
            said = "has several outputs, and the card names none" if missing is None else f"has no output {missing!r}"
            raise KeypointError(f"{self._where}: {said}; it has {', '.join(there)}. Name one of them in {card.name}.")
        self._outputs = [name or there[0] for name in outputs]
        try:
            self.run(np.zeros((network.input_px[1], network.input_px[0], 3), np.uint8))
        except cv2.error as exc:
            raise KeypointError(f"{self._where}: does not take an image of {network.input_px[0]} x "
                                f"{network.input_px[1]} px in the layout {network.layout} ({_reason(exc)}). Correct "
                                f"input_px or layout in {card.name}.") from exc

    def run(self, bgr: Image) -> list[Array]:
        """The outputs for an image (H, W, 3) of the input's size."""
        one = self._network
        pixels = bgr[:, :, ::-1] if one.channels == "rgb" else bgr
        values = ((pixels - np.array(one.mean)) * np.array(one.scale)).astype(np.float32)
        blob = values.transpose(2, 0, 1)[None] if one.layout == "nchw" else values[None]
        self._net.setInput(np.ascontiguousarray(blob))
        return [np.asarray(output, np.float64) for output in self._net.forward(self._outputs)]


class KeypointNetwork:
    """The networks of a card. Raises KeypointError when a file is missing, another one, or not as the card says."""

    def __init__(self, path: Path, card: ModelCard) -> None:
        self.card, points = card, card.points
        outputs = (points.output, points.score_output) if points.score_output else (points.output,)
        self._points = _Runner(path, card.network, outputs)
        width, height = card.network.input_px
        blank = self._points.run(np.zeros((height, width, 3), np.uint8))
        if blank[0].size != points.count * points.numbers:
            raise KeypointError(f"{path.parent / card.network.file}: gives {blank[0].size} numbers; {path.name} "
                                f"expects {points.count} points of {points.numbers}. Correct points.count or "
                                "points.numbers.")
        if points.score_output and blank[1].size != 1:
            raise KeypointError(f"{path.parent / card.network.file}: its score {points.score_output!r} has "
                                f"{blank[1].size} numbers, not one. Name another output in {path.name}.")
        self._regions = None
        if card.regions is not None:
            self._regions = _Runner(path, card.regions.network, (card.regions.output,))
            width, height = card.regions.network.input_px
            rows = self._regions.run(np.zeros((height, width, 3), np.uint8))[0]
            if rows.size % 5:
                raise KeypointError(f"{path.parent / card.regions.network.file}: gives {rows.size} numbers, which are "
                                    "no rows of x0, y0, x1, y1 and a probability. Export it with its decoder.")

    def region(self, bgr: Image) -> tuple[Array, float, float]:
        """Centre (2,) px and side px of the likeliest region of a whole image, and its probability."""
        height, width = bgr.shape[:2]
        if self._regions is None or self.card.regions is None:
            return np.array([0.5 * (width - 1), 0.5 * (height - 1)]), float(max(width, height)), 1.0
        small = np.asarray(cv2.resize(bgr, self.card.regions.network.input_px), np.uint8)
        rows = self._regions.run(small)[0].reshape(-1, 5)
        best = rows[np.argmax(rows[:, 4])]
        corners = best[:4] * (width, height, width, height)
        if not np.isfinite(best).all():
            return np.zeros(2), 0.0, 0.0
        side = float(np.max(np.abs(corners[2:] - corners[:2])))
        return 0.5 * (corners[:2] + corners[2:]) - 0.5, side, float(np.clip(best[4], 0.0, 1.0))

    def points(self, bgr: Image, centre: Array, side: float, turn: float) -> Found:
        """The points in a square region of an image; `turn` rad: clockwise, how its upright stands in the image."""
        (width, height), points = self.card.network.input_px, self.card.points
        c, s = np.cos(turn) * side, np.sin(turn) * side
        into = np.array([[c / width, -s / height], [s / width, c / height]])  # px of the image per px of the input
        origin = centre - into @ (0.5 * np.array([width - 1.0, height - 1.0]))
        crop = cv2.warpAffine(bgr, np.hstack([into, origin[:, None]]), (width, height),
                              flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        outputs = self._points.run(np.asarray(crop, np.uint8))
        own = outputs[0].reshape(points.count, points.numbers)[:, :2]
        if points.unit == "fraction":
            own = own * (width, height) - 0.5
        probability = float(np.clip(outputs[1].item(), 0.0, 1.0)) if points.score_output else 1.0
        pixels = own @ into.T + origin
        return Found(pixels, probability if np.isfinite(pixels).all() and np.isfinite(probability) else 0.0)


def _reason(exc: cv2.error) -> str:
    """OpenCV's words, short."""
    return " ".join(str(exc).split())[:160]


# -- the detector ------------------------------------------------------------------------------------------------------

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
