"""Runs the networks of a model card by cv2.dnn, and checks once that they take and give what the card says."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_node.errors import KeypointError
from rhot_node.keypoints.card import ModelCard, Network, read_network

Array = NDArray[np.float64]
Image = NDArray[np.uint8]


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
