"""Detectors from other packages: ``"detector": "plug:NAME"`` in a node's settings takes what the entry point NAME of
``rhot.detectors`` makes: a callable ``(markers) -> Detector`` (docs/plugins.md)."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from typing import Final

from rhot_node.config import NodeSettings
from rhot_node.detect.detector import Detector
from rhot_node.detect.image import YuvImage
from rhot_node.errors import PluginError
from rhot_node.health.check import Check
from rhot_node.markers import MarkerSet
from rhot_node.plugins import PREFIX, about_plugin, load_plugin
from rhot_node.wire.messages import CANDIDATES_MAX, MarkerFlag, MarkerObservation

log = logging.getLogger(__name__)

GROUP: Final = "rhot.detectors"


class PluginDetector:
    """A detector of a plug-in. A frame over which it fails has no markers; `trouble` says why, until one succeeds."""

    def __init__(self, name: str, markers: MarkerSet) -> None:
        """Raises PluginError when there is no such plug-in, or when it cannot begin."""
        self.trouble = ""
        self._name = name
        self._count = len(markers.markers)
        make = load_plugin(GROUP, name)
        try:
            self._detector: Detector = make(markers)
            self._detector.reset()
        except Exception as exc:  # it is somebody else's program
            raise PluginError(self._failed("cannot begin", exc)) from exc

    def detect(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """All markers of one image, as `Detector.detect`; all lost when the plug-in fails."""
        try:
            found = tuple(self._detector.detect(image))
            self._check(found)
        except Exception as exc:
            self._say(self._failed("failed over a frame", exc))
            return tuple(MarkerObservation(index, math.nan, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, MarkerFlag.LOST)
                         for index in range(self._count))
        self.trouble = ""
        return found

    def reset(self) -> None:
        """Forget all tracks."""
        try:
            self._detector.reset()
        except Exception as exc:
            self._say(self._failed("failed to begin anew", exc))

    def _check(self, found: tuple[MarkerObservation, ...]) -> None:
        if not all(isinstance(one, MarkerObservation) for one in found):
            raise TypeError("it gave something else than MarkerObservation")
        indices = [one.index for one in found]
        if indices[:self._count] != list(range(self._count)):
            raise ValueError("its first observations are not one of each marker, in the order of the set")
        if any(not 0 <= index < self._count or indices.count(index) > CANDIDATES_MAX for index in indices):
            raise ValueError(f"there are more than {CANDIDATES_MAX} candidates of a marker, or one of no marker")

    def _failed(self, what: str, exc: Exception) -> str:
        return f"{about_plugin(GROUP, self._name)} {what} ({type(exc).__name__}: {exc})."

    def _say(self, sentence: str) -> None:
        if not self.trouble:
            log.error("%s", sentence)
        self.trouble = sentence


class DetectorChoice:
    """Makes the detector that the settings ask for; where that is a plug-in that cannot begin, the fast one."""

    def __init__(self, otherwise: Callable[[NodeSettings], Detector]) -> None:
        """`otherwise`: makes the detectors that are no plug-ins."""
        self._otherwise = otherwise
        self._refusal = ""
        self._detector: PluginDetector | None = None

    def make(self, settings: NodeSettings) -> Detector:
        """A new detector."""
        self._refusal, self._detector = "", None
        if settings.detector.startswith(PREFIX):
            try:
                self._detector = PluginDetector(settings.detector.removeprefix(PREFIX), settings.markers)
            except PluginError as exc:
                log.error("%s The fast detector works in its place.", exc)
                self._refusal = f"{exc} The fast detector works in its place."
            else:
                return self._detector
        return self._otherwise(settings)

    def troubles(self) -> list[Check]:
        """What is wrong with the plug-in, for the node's report."""
        text = self._refusal or ("" if self._detector is None else self._detector.trouble)
        return [Check("detector", "error", text[:1].upper() + text[1:])] if text else []
