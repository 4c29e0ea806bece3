"""The search for landmarks of bare hands by the hand networks, beside that for painted markers."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

import numpy as np

from rhot_node.capture.camera import Frame
from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings, network_model
from rhot_node.detect.image import YuvImage
from rhot_node.errors import KeypointError
from rhot_node.frame_search import FrameSearch, Waiting
from rhot_node.health.checks import Check
from rhot_node.network.session import Stream
from rhot_node.wire.messages import LANDMARKS, HandLandmarks, LandmarkedHand

if TYPE_CHECKING:
    from rhot_node.landmarks.networks import DetectedHand, HandNetworks

log = logging.getLogger(__name__)

RETRY_S: Final = 5.0
"""Between tries to open the networks: somebody may install them meanwhile. A node that is not reminded to spare its
search for so long searches again."""

_OPENING_S = 15.0  # on a slow computer, LiteRT takes seconds to load

OpenNetworks = Callable[[str], "HandNetworks"]


def open_networks(model: str) -> HandNetworks:
    """The installed networks. Raises KeypointError."""
    from rhot_node.landmarks.networks import open_hand_networks
    return open_hand_networks(model=model)


class LandmarkSearch(FrameSearch[YuvImage]):
    """Searches frames and sends the hands that it finds, a message without hands included."""

    names = "landmark", "hands_found", "landmarks"

    def __init__(self, settings: NodeSettings, clock: NodeClock, open_with: OpenNetworks | None = None) -> None:
        """`open_with`: opens the networks of a model; None: the installed ones. Nothing is loaded before `prepare`."""
        super().__init__(settings.node_id, clock)
        self.trouble = ""
        """Why the networks cannot be used; empty when they can, or are not asked for."""
        self._model = network_model(settings.detector)
        self._open_with = open_networks if open_with is None else open_with
        self._networks: tuple[str | None, HandNetworks | None] = (None, None)  # and their model
        self._retry_s = self._spared_s = 0.0

    def prepare(self) -> None:
        """Open the networks and start the thread, if the settings ask for landmarks."""
        if self._model is not None:
            self._opened(self._model)
            self.start("finds landmarks of hands", _OPENING_S)

    def configure(self, settings: NodeSettings) -> None:
        """Go on with other settings."""
        model = network_model(settings.detector)
        if model != self._model:
            self._model, self._retry_s, self.trouble = model, 0.0, ""
        if model is not None:
            self.start("finds landmarks of hands", _OPENING_S)

    def spare(self) -> None:
        """Search nothing for RETRY_S: nobody uses what would be found. Any thread may ask."""
        self._spared_s = time.monotonic() + RETRY_S

    @property
    def wanted(self) -> bool:
        """Whether landmarks are searched for."""
        return self._model is not None and time.monotonic() >= self._spared_s

    def due(self, frame: Frame, stream: Stream) -> bool:
        """Whenever landmarks are searched for."""
        return self.wanted

    def work(self, frame: Frame) -> YuvImage:
        """The whole picture."""
        return frame.image.copy()

    def troubles(self) -> list[Check]:
        """What is wrong, for the node's report."""
        return [Check("landmarks", "error", self.trouble[:1].upper() + self.trouble[1:])] if self.trouble else []

    def search(self, waiting: Waiting[YuvImage]) -> None:
        """Search one frame."""
        model = self._model
        networks = None if model is None else self._opened(model)
        if networks is not None:  # not switched off meanwhile
            hands = networks.find(waiting.work)
            self.found += len(hands)
            self.send(HandLandmarks(*self.head(waiting, HandLandmarks), tuple(landmarked(hand, waiting.work.size)
                                                                              for hand in hands)), waiting)

    def _opened(self, model: str) -> HandNetworks | None:
        """The networks of a model; None while they cannot be opened."""
        if self._networks[0] == model:
            return self._networks[1]
        if time.monotonic() < self._retry_s:
            return None
        try:
            self._networks = model, self._open_with(model)
        except KeypointError as exc:
            if str(exc) != self.trouble:
                log.error("%s", exc)
            self.trouble, self._retry_s = str(exc), time.monotonic() + RETRY_S
            return None
        self.trouble = ""
        return self._networks[1]


def landmarked(hand: DetectedHand, size: tuple[int, int]) -> LandmarkedHand:
    """A hand as the wire has it: landmarks outside the image of `size` (width, height) px are none."""
    from rhot_node.landmarks.networks import HAND_SIGMA
    variance = (HAND_SIGMA * hand.region.side) ** 2
    inside = np.all((hand.landmarks >= -0.5) & (hand.landmarks <= np.array(size) - 0.5), axis=1)
    points = tuple((float(x), float(y), variance, 0.0, variance) if shown else (0.0,) * 5
                   for (x, y), shown in zip(hand.landmarks, inside.tolist(), strict=True))
    assert len(points) == LANDMARKS
    return LandmarkedHand(min(hand.presence, 1.0), min(max(hand.right, 0.0), 1.0), points)
