"""Find the markers in one picture whose light is known: tracked ones carefully near where they are expected, lost ones
by a search of the whole frame.

Markers that are followed in plain view are the quick lane's (`followed`), which shares the tracks.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect import measure as m
from rhot_node.detect.candidates import Blobs, ranked_by, request_of, worth_of
from rhot_node.detect.follow import learn_noise, noise_level
from rhot_node.detect.followed import Followed
from rhot_node.detect.gate import ColourGate
from rhot_node.detect.image import YuvImage
from rhot_node.detect.labels import directions, sector_table
from rhot_node.detect.light import Light
from rhot_node.detect.outline import INTERIOR, OUTSIDE
from rhot_node.detect.search import AREA, LABEL, SUM_X, SUM_Y
from rhot_node.detect.track import TRACK_COLUMNS, Track, lost_observation
from rhot_node.detect.whereabouts import Whereabouts, middle_of
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import NO_FLAGS, MarkerFlag, MarkerObservation

CANDIDATES = 4  # blobs per marker that are measured until one proves to be paint
NOISE_START, NOISE_START_BLOCKS = 1.5, 20.0  # grey levels of chroma noise, until so many blocks of paint have told
LARGEST = 0.12  # of the picture: no worn marker is nearer than that
PAINT_PIXELS_MIN = 4  # chroma pixels that are all paint: fewer show no colour to rely on
DOUBTFUL = MarkerFlag.PARTIAL | MarkerFlag.EDGE | MarkerFlag.AMBIGUOUS
PALE = 0.5  # of the least chroma that a search takes for paint: a tracked marker in shade has more
SEARCH_STEP = 2  # chroma rows: every other one shows where markers are


class Finder:
    """The tracks of all markers, and what finds them."""

    def __init__(self, markers: MarkerSet, light: Light) -> None:
        """`light`: that of the pictures, read and set by the caller."""
        self._markers, self._light = markers.markers, light
        self._directions = directions(markers)
        self._sector = sector_table(markers)
        self.gate = ColourGate(markers)
        self._request = np.zeros(m.REQUEST_COLUMNS)
        self._row = np.zeros(m.MEASURE_COLUMNS)
        self._scratch = m.Scratch(0, 0)
        self._states = np.zeros((len(self._markers), TRACK_COLUMNS))
        self._tracks: list[Track] = []
        self._noise_variance = np.array([NOISE_START**2, NOISE_START_BLOCKS])
        self.followed = Followed([marker.shape for marker in self._markers], self._states, self._noise_variance)
        self.paint = np.zeros((len(self._markers), 3))
        """(M, 3) Y, Cb and Cr (minus 128) of every marker's paint as the camera showed it when it was measured."""
        self._paint_pixels = np.zeros(len(self._markers))
        self.forget()

    def find(self, camera_image: YuvImage) -> tuple[MarkerObservation, ...]:
        """Every marker, in the picture as it would look in the light of the calibration."""
        found: dict[int, MarkerObservation] = {}
        lost = []
        if self.followed.count:
            found = {mark.index: mark for mark in self.followed.observations()}
        image = camera_image if len(found) == len(self._tracks) else self._light.balanced(camera_image)
        for index, track in enumerate(self._tracks):
            if index in found:
                continue
            if track.alive and self._measure(image, index, track.request(self._request)) \
                    and not track.is_litter(self._row.tolist()):
                found[index] = self._observe(index, NO_FLAGS, camera_image)
            else:
                lost.append(index)
        for index in self._strays(found):  # what was taken for a marker, far from the hand
            self._tracks[index] = Track(self._markers[index].shape, self._states[index])
            self.followed.drop(index)
            lost.append(index)
        if lost:
            self._acquire(camera_image, lost, found)
        return tuple(found[index] for index in range(len(self._tracks)))

    def note_paint(self) -> None:
        """The colours of the markers that are followed."""
        for index, colour in self.followed.paint():
            self.paint[index] = colour

    def plainly(self, seen: tuple[MarkerObservation, ...]) -> list[int]:
        """Indices of the markers that are in plain view, so that their paint's colour can be relied on."""
        return [mark.index for mark in seen if mark.found and not mark.flags & DOUBTFUL
                and self._paint_pixels[mark.index] >= PAINT_PIXELS_MIN]

    def paint_mask(self, image: YuvImage, seen: MarkerObservation) -> NDArray[np.bool_]:
        """(H/2, W/2) the chroma pixels inside a marker that `detect` has just placed in this very `image`.

        Its edge, where paint and surroundings share pixels, is left out; small markers have no inside.
        """
        self._scratch.kind[:] = OUTSIDE
        if seen.found:
            self._measure(self._light.balanced(image), seen.index, self._tracks[seen.index].recall(self._request))
        return np.asarray(self._scratch.kind == INTERIOR)

    def all_blobs(self, image: YuvImage) -> list[list[MarkerObservation]]:
        """Every blob of every marker's colour, largest first, without regard to tracks; a list per marker.

        In the light of the last frame that was searched for markers.
        """
        image = self._light.balanced(image)
        everything: list[list[MarkerObservation]] = []
        blobs = self.gate.blobs(image, range(len(self._markers))).copy()
        for index, marker in enumerate(self._markers):
            own = []
            for blob in blobs[blobs[:, LABEL] == index + 1]:
                if self._measure(image, index, self._request_of(index, blob)):
                    own.append(Track(marker.shape).observe(index, self._row.tolist(), self._noise, MarkerFlag.ACQUIRED))
            everything.append(sorted(own, key=lambda seen: -seen.diameter))
        return everything

    def forget(self) -> None:
        """Forget all tracks."""
        self._tracks = [Track(marker.shape, state) for marker, state in zip(self._markers, self._states, strict=True)]
        self.followed.forget()

    def fit(self, image: YuvImage) -> bool:
        """Make room for pictures of this size; False when there is already."""
        if self._scratch.mask.shape == image.u.shape:
            return False
        self._scratch = m.Scratch(*image.u.shape)
        return True

    @property
    def _noise(self) -> float:
        return float(noise_level(self._noise_variance))

    def _measure(self, image: YuvImage, index: int, request: NDArray[np.float64]) -> bool:
        """Measure marker `index` into `self._row`; the paint's noise is learnt on the way."""
        row = self._row
        if not m.measure(image.y, image.u, image.v, self._sector, index + 1, self._directions[index], request,
                         self._scratch.arrays, row):
            return False
        learn_noise(self._noise_variance, row[m.NOISE_SUM], row[m.NOISE_COUNT])
        return True

    def _request_of(self, index: int, blob: Blobs) -> NDArray[np.float64]:
        return request_of(blob, self._directions[index], self._markers[index].shape, self._request)

    def _observe(self, index: int, flags: MarkerFlag, camera_image: YuvImage) -> MarkerObservation:
        """Take what was measured into the marker's track, and follow it from now on when it is in plain view."""
        row = self._row
        self._paint_pixels[index] = row[m.PAINT_PIXELS]
        self.paint[index] = self._light.unbalanced(row[m.PAINT_Y:m.PAINT_CR + 1])
        values = row.tolist()
        seen = self._tracks[index].observe(index, values, self._noise, flags)
        if not seen.flags & DOUBTFUL:
            self.followed.start(camera_image, index, values)
        return seen

    def _acquire(self, camera_image: YuvImage, lost: list[int], found: dict[int, MarkerObservation]) -> None:
        """Search the whole frame for the lost markers and state each as found or lost."""
        image = self._light.balanced(camera_image)
        blobs = self.gate.blobs(image, lost, step=SEARCH_STEP).copy()
        own = {index: blobs[blobs[:, LABEL] == index + 1] for index in lost}
        worth, hand = worth_of(own, self._markers, self._tracks, self._scratch.mask.shape)
        for index in lost:
            track = self._tracks[index]
            ranked, flags = ranked_by(track, own[index], worth[index])
            for blob in ranked[:CANDIDATES]:
                if self._is_elsewhere(index, blob, hand):
                    continue
                if self._measure(image, index, self._request_of(index, blob)) and not self._is_pale(
                        index, self._row[m.LEVEL]):
                    self._row[m.RIVAL_COST] = np.inf  # rivals were judged over the whole frame
                    found[index] = self._observe(index, flags, camera_image)
                    break
            else:
                track.lose()
                found[index] = lost_observation(index)

    def _is_pale(self, index: int, level: float) -> bool:
        """Whether a level of chroma is too low for the marker's paint: a track has slid to something else."""
        return bool(level < PALE * self._markers[index].chroma.magnitude_min)

    def _is_elsewhere(self, index: int, blob: Blobs, hand: Whereabouts | None) -> bool:
        """Whether a blob is where the hand, which wears the marker, cannot reach, or larger than anything it wears."""
        if self._markers[index].role is None:
            return False
        return bool(blob[AREA] > LARGEST * self._scratch.mask.size
                    or (hand is not None and hand.beyond(blob[SUM_X] / blob[AREA], blob[SUM_Y] / blob[AREA])))

    def _strays(self, found: dict[int, MarkerObservation]) -> list[int]:
        """Tracked markers that are none: too pale, or worn where no hand can reach from the others."""
        pale = [index for index in found if self._is_pale(index, self._tracks[index].level)]
        worn = [index for index in found if self._markers[index].role is not None]
        hand = middle_of([(self._tracks[index].x, self._tracks[index].y, self._tracks[index].area) for index in worn])
        if hand is None:
            return pale
        return pale + [index for index in worn if index not in pale
                       and hand.beyond(self._tracks[index].x, self._tracks[index].y)]
