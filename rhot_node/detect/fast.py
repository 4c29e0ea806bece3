"""The fast detector: predicted windows for tracked markers, one search of the frame for all other blobs.

Works on the planes of a YUV420 image as the camera delivers them, in one thread.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.find import DOUBTFUL, SEARCH_STEP, Finder
from rhot_node.detect.illuminant import DEAD_ZONE, MARKERS_LEAST, SWITCHED, Illuminant, guess_illuminant
from rhot_node.detect.image import YuvImage
from rhot_node.detect.occlusion import widen_touching
from rhot_node.detect.search import Labels
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerFlag, MarkerObservation

__all__ = ["DOUBTFUL", "GLANCE", "SEARCH_STEP", "FastDetector"]

SUDDENLY = 2  # markers fewer tracked than found in the last frame: a lamp may have been switched
GUESS_EVERY, GUESS_SELDOM = 20, 200
"""Frames without all markers tracked until the light is guessed anew; the second while MARKERS_LEAST are tracked."""
STEADY, STEADY_FEW = 0.7, 0.95  # per frame, weight of the last light; with fewer than MARKERS_LEAST in plain view
GLANCE = 8  # frames between readings of the light, and between searches while all markers are followed in plain view
_NOT_TRACKED = int(MarkerFlag.LOST | MarkerFlag.ACQUIRED)
LIGHT_PASSES = 3  # of finding the markers and reading the light from them, in a picture of which nothing is known


class FastDetector:
    """Finds the candidates of every marker in one YUV420 image after the other; see
    `rhot_node.detect.image.Detector`."""

    def __init__(self, markers: MarkerSet) -> None:
        self._set = markers
        self._markers = markers.markers
        self._light = Illuminant(markers)
        self._fresh = True  # no picture has been seen yet
        self._until_guess = GUESS_EVERY
        self._found = 0  # markers found in the last frame
        self._finder = Finder(markers, self._light)
        self._until_glance = 0
        self.reset()

    def reset(self) -> None:
        """Forget all tracks and the light: the next frame is searched as a whole."""
        self.lose_all()
        self._light.temperature_shift = 0.0
        self._fresh, self._until_guess, self._found = True, GUESS_EVERY, 0

    def lose_all(self) -> None:
        """Forget all tracks, but not the light."""
        self._finder.forget()

    def paint_colours(self) -> NDArray[np.float64]:
        """(M, 3) Y, Cb and Cr (minus 128) of every marker's paint as the camera showed it when it was found last."""
        self._finder.note_paint()
        return self._finder.paint.copy()

    def paint_mask(self, image: YuvImage, seen: MarkerObservation) -> NDArray[np.bool_]:
        """(H/2, W/2) the chroma pixels inside a marker that `detect` has just placed in this very `image`.

        Its edge, where paint and surroundings share pixels, is left out; small markers have no inside.
        """
        return self._finder.paint_mask(image, seen)

    @property
    def temperature_shift(self) -> float:
        """How much warmer the light is than the one the colours were learnt in; see `rhot_node.detect.illuminant`."""
        return self._light.temperature_shift

    def detect(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """The best candidate of every marker, in the order of the marker set, lost markers reported as lost; then the
        other candidates, at most CANDIDATES_MAX of a marker in all."""
        return widen_touching(image, self._find(image), self._finder.paint)

    def _find(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        self._fit(image)
        if self._fresh:
            seen = self._find_at_first(image)
        else:
            self._finder.followed.follow(image)
            self._until_glance -= 1
            followed = self._finder.report_followed()
            if followed is not None and self._until_glance > 0:
                return followed
            seen = self._finder.find(image)
            if self._light_in_doubt(seen):
                seen = self._find_in_guessed_light(image, seen)
            if self._until_glance > 0:
                self._found = self._count_found(seen)
                return seen
            if self._read_light(seen, anew=False) >= SWITCHED:  # somebody switched a lamp
                seen = self._find_in_new_light(image)
        self._until_glance = GLANCE
        self._fresh = False
        self._found = self._count_found(seen)
        return seen

    def _count_found(self, seen: tuple[MarkerObservation, ...]) -> int:
        return sum(mark.found for mark in seen[:len(self._markers)])

    def _find_at_first(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """Find the markers in a picture of which nothing is known: by the light of the calibration, if that shows all
        of them, else by the light in which most are recognised."""
        seen = self._finder.find(image, whole=True)
        if len(self._finder.plainly(seen)) < len(self._markers):
            return self._find_in_guessed_light(image, seen)
        return seen if self._read_light(seen, anew=True) < DEAD_ZONE else self._find_in_new_light(image)

    def _light_in_doubt(self, seen: tuple[MarkerObservation, ...]) -> bool:
        """Whether several markers were lost at once, or some have not been tracked for a while.

        In another light the hue of a paint leaves its sector, and the track ends.
        """
        tracked = sum(not mark.flags.value & _NOT_TRACKED for mark in seen[:len(self._markers)])
        suddenly = self._found - tracked >= SUDDENLY
        if tracked == len(self._markers):
            self._until_guess = GUESS_EVERY
            return False
        self._until_guess -= 1
        if self._until_guess > 0 and not suddenly:
            return False
        self._until_guess = GUESS_EVERY if tracked < MARKERS_LEAST else GUESS_SELDOM
        return True

    def _find_in_guessed_light(self, image: YuvImage,
                               seen: tuple[MarkerObservation, ...]) -> tuple[MarkerObservation, ...]:
        """Find the markers in the light in which most are recognised; `seen`: those found in the last known light.

        The guess is kept if more markers are then in plain view, with a chroma as strong as paint has in that light.
        """
        known, before = self._light.temperature_shift, len(self._finder.plainly(seen, lone=False))
        if not guess_illuminant(image, self._light, self._finder.gate, self._set):
            return seen if not self._fresh else self._find_in_new_light(image)
        guessed = self._find_in_new_light(image)
        plain = self._finder.plainly(guessed, lone=False)
        strong = np.count_nonzero(self._light.strong(plain, self._finder.paint[plain]))
        if strong >= MARKERS_LEAST and strong > before:
            return guessed
        self._light.temperature_shift = known
        return self._find_in_new_light(image)

    def _find_in_new_light(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """Find the markers, read the light from them, and find them again in that."""
        for _ in range(LIGHT_PASSES):
            self._finder.forget()
            seen = self._finder.find(image, whole=True)
            if self._read_light(seen, anew=True) < DEAD_ZONE:
                break
        return seen

    def _read_light(self, seen: tuple[MarkerObservation, ...], *, anew: bool) -> float:
        """Read the light from the markers in plain view; returns by how much its warmth changed.

        `anew`: the last known light has no weight, unless few markers are in plain view.
        """
        self._finder.note_paint()
        plain = self._finder.plainly(seen)
        steady = 0.0 if anew else STEADY**GLANCE
        if len(plain) < MARKERS_LEAST:  # other objects of a marker's colour must not set the light
            steady = STEADY_FEW if anew else STEADY_FEW**GLANCE
        return self._light.read(plain, self._finder.paint[plain], steady)

    def labels(self, image: YuvImage) -> Labels:
        """(H/2, W/2) for every chroma pixel 1 + the index of the marker that the search takes it for, 0 for none.

        In the light of the last frame that was searched for markers.
        """
        return self._finder.gate.labels(self._light.balanced(image))

    def all_blobs(self, image: YuvImage) -> list[list[MarkerObservation]]:
        """Every blob of every marker's colour, largest first, without regard to tracks; a list per marker.

        In the light of the last frame that was searched for markers.
        """
        self._fit(image)
        return self._finder.all_blobs(image)

    def _fit(self, image: YuvImage) -> None:
        if self._finder.fit(image):
            self.reset()

