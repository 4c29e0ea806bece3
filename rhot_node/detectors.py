"""The detector that a node's settings name, compiled and warmed up: one of its own, a keypoint network's, or a plug-in.

``"detector": "plug:NAME"`` takes what the entry point NAME of the group ``rhot.detectors`` makes: a callable
``(markers) -> Detector`` (docs/plugins.md).
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from typing import Final

import numpy as np

from rhot_node.config import NodeSettings, network_model
from rhot_node.detect.image import Detector, YuvImage
from rhot_node.errors import KeypointError, PluginError
from rhot_node.health.checks import Check
from rhot_node.keypoints import KeypointDetector, PaintedMarkers, card_path
from rhot_node.markers import MarkerSet
from rhot_node.plugins import about_plugin, load_plugin
from rhot_node.threads import FOREIGN, TimedCalls
from rhot_node.wire.messages import CANDIDATES_MAX, MarkerFlag, MarkerObservation

log = logging.getLogger(__name__)

GROUP: Final = "rhot.detectors"


BEGIN_S: Final = 120.0
"""A detector may compile or load a network when it begins."""

DETECT_S: Final = 2.0
"""A detector that takes longer over a frame, or to begin anew, is not asked again."""


class PluginDetector:
    """A detector of a plug-in, in a thread of its own. A frame over which it fails has no markers; `trouble` says why,
    until one succeeds. One that hangs is given up, and `otherwise` detects in its place."""

    def __init__(self, name: str, markers: MarkerSet, otherwise: Callable[[], Detector]) -> None:
        """Raises PluginError when there is no such plug-in, or when it cannot begin."""
        self.trouble = ""
        self._name = name
        self._count = len(markers.markers)
        self._otherwise = otherwise
        self._instead: Detector | None = None
        self._thread = TimedCalls(f"runs the detector {name!r}")
        make = load_plugin(GROUP, name)
        try:
            self._detector: Detector = self._thread.call(lambda: make(markers), BEGIN_S)
            self._thread.call(self._detector.reset, BEGIN_S)
        except FOREIGN as exc:  # it is somebody else's program
            self._thread.close()
            raise PluginError(self._failed("cannot begin", exc)) from exc

    def detect(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """All markers of one image, as `Detector.detect`; all lost when the plug-in fails."""
        if self._instead is not None:
            return self._instead.detect(image)
        try:
            found = self._thread.call(lambda: tuple(self._detector.detect(image)), DETECT_S)
            self._check(found)
        except TimeoutError as exc:
            self._give_up(exc)
            return lost(self._count)
        except FOREIGN as exc:
            self._say(self._failed("failed over a frame", exc))
            return lost(self._count)
        self.trouble = ""
        return found

    def reset(self) -> None:
        """Forget all tracks."""
        try:
            if self._instead is None:
                self._thread.call(self._detector.reset, DETECT_S)
            else:
                self._instead.reset()
        except TimeoutError as exc:
            self._give_up(exc)
        except FOREIGN as exc:
            self._say(self._failed("failed to begin anew", exc))

    def close(self) -> None:
        """End its thread, or leave it to itself when it hangs."""
        self._thread.close()

    def _give_up(self, exc: TimeoutError) -> None:
        self._instead = self._otherwise()
        self._say(f"{about_plugin(GROUP, self._name)} hangs ({exc}), and is not asked any more. "
                  f"{_consequence(self._instead)}")

    def _check(self, found: tuple[MarkerObservation, ...]) -> None:
        if not all(isinstance(one, MarkerObservation) for one in found):
            raise TypeError("it gave something else than MarkerObservation")
        indices = [one.index for one in found]
        if indices[:self._count] != list(range(self._count)):
            raise ValueError("its first observations are not one of each marker, in the order of the set")
        if any(not 0 <= index < self._count or indices.count(index) > CANDIDATES_MAX for index in indices):
            raise ValueError(f"there are more than {CANDIDATES_MAX} candidates of a marker, or one of no marker")

    def _failed(self, what: str, exc: BaseException) -> str:
        return f"{about_plugin(GROUP, self._name)} {what} ({type(exc).__name__}: {exc})."

    def _say(self, sentence: str) -> None:
        if not self.trouble:
            log.error("%s", sentence)
        self.trouble = sentence


def lost(count: int) -> tuple[MarkerObservation, ...]:
    """One observation of each of `count` markers: it is lost."""
    return tuple(MarkerObservation(index, math.nan, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, MarkerFlag.LOST)
                 for index in range(count))


class NoDetector:
    """Finds nothing: all markers are lost."""

    def __init__(self, markers: MarkerSet) -> None:
        self._count = len(markers.markers)

    def detect(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """See `Detector`."""
        return lost(self._count)

    def reset(self) -> None:
        """See `Detector`."""


def _consequence(instead: Detector) -> str:
    """What it means that a detector works in another one's place."""
    return "All markers are lost." if isinstance(instead, NoDetector) else "The fast detector works in its place."


class DetectorChoice:
    """Makes the detector that the settings ask for; where that is a plug-in that cannot begin, the fast one. Landmarks
    have no colour: where their detector cannot begin, or none is named, they are lost."""

    def __init__(self, otherwise: Callable[[NodeSettings], Detector]) -> None:
        """`otherwise`: makes the detectors that are no plug-ins."""
        self._otherwise = otherwise
        self._refusal = ""
        self._detector: PluginDetector | None = None

    def make(self, settings: NodeSettings) -> Detector:
        """A new detector."""
        if self._detector is not None:
            self._detector.close()
        self._refusal, self._detector = "", None
        landmarks = any(marker.shape == "landmark" for marker in settings.markers.markers)

        def instead() -> Detector:
            return NoDetector(settings.markers) if landmarks else self._otherwise(settings)

        kind, _, name = settings.detector.partition(":")
        try:
            if kind == "keypoints":
                return KeypointDetector(card_path(name), settings.markers)
            if kind == "plug":
                self._detector = PluginDetector(name, settings.markers, instead)
                return self._detector
        except KeypointError as exc:
            return self._refuse(NoDetector(settings.markers), str(exc))
        except PluginError as exc:
            return self._refuse(instead(), str(exc))
        if landmarks and network_model(settings.detector) is None:
            return self._refuse(instead(), f"the detector {settings.detector!r} finds no landmarks, which the marker "
                                           "set has. Choose landmarks, keypoints:NAME or a plug-in.")
        if not landmarks:
            return self._otherwise(settings)
        painted = PaintedMarkers(settings.markers)
        if painted.own.markers:
            warm_up(painted, painted.own, (settings.camera.width, settings.camera.height))
        return painted

    def _refuse(self, instead: Detector, why: str) -> Detector:
        self._refusal = f"{why} {_consequence(instead)}"
        log.error("%s", self._refusal)
        return instead

    def troubles(self) -> list[Check]:
        """What is wrong with the plug-in, for the node's report."""
        text = self._refusal or ("" if self._detector is None else self._detector.trouble)
        return [Check("detector", "error", text[:1].upper() + text[1:])] if text else []


def make_detector(settings: NodeSettings) -> Detector:
    """The detector that the settings name, no plug-in, compiled and warmed up."""
    detector: Detector
    if settings.detector == "reference":
        from rhot_node.detect.reference import ReferenceDetector
        detector = ReferenceDetector(settings.markers)
    else:
        from rhot_node.detect.fast import FastDetector
        detector = FastDetector(settings.markers)
    warm_up(detector, settings.markers, (settings.camera.width, settings.camera.height))
    return detector


# -- warming up --------------------------------------------------------------------------------------------------------

DISC_RADIUS = 10  # px
FRAMES = 3  # acquire, then track


def warm_up(detector: Detector, markers: MarkerSet, size: tuple[int, int]) -> None:
    """Show the detector a few frames of `size` (width, height) with a disc of every marker's colour, then reset it.

    The first frame is blank, so that markers are also sought in other lights; blank frames alone would leave the code
    that measures a marker uncompiled until the first one is seen.
    """
    from rhot_node.detect.illuminant import fit_temperature_shift
    width, height = size
    grey = np.full((height // 2, width // 2), 128, dtype=np.uint8)
    detector.detect(YuvImage(np.full((height, width), 128, dtype=np.uint8), grey, grey))
    image = warm_up_image(markers, size)
    for _ in range(FRAMES):
        detector.detect(image)
    detector.reset()
    fit_temperature_shift(np.zeros(1), np.zeros((1, 3)), np.linspace(-1.0, 1.0, 3))  # of colours stronger than these


def warm_up_image(markers: MarkerSet, size: tuple[int, int]) -> YuvImage:
    """Mid-grey with the markers' discs on a grid."""
    width, height = size
    luma = np.full((height, width), 128, dtype=np.uint8)
    chroma = np.full((2, height // 2, width // 2), 128, dtype=np.uint8)
    rows, columns = np.mgrid[:height // 2, :width // 2]
    across = max(1, width // (4 * DISC_RADIUS))
    for index, marker in enumerate(markers.markers):
        x, y = 2 * DISC_RADIUS * (1 + 2 * (index % across)), 2 * DISC_RADIUS * (1 + 2 * (index // across))
        disc = (2 * columns + 0.5 - x) ** 2 + (2 * rows + 0.5 - y) ** 2 <= DISC_RADIUS**2
        for plane, mean in zip(chroma, (marker.chroma.cb, marker.chroma.cr), strict=True):
            plane[disc] = np.clip(128 + round(mean), 0, 255)
    return YuvImage(luma, chroma[0], chroma[1])
