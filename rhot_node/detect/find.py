"""Find the markers in one picture whose light is known: tracks in their predicted windows, other blobs by a search.

A marker has up to CANDIDATES_MAX tracks, one for each object of its colour. The master decides which of them is the
marker. The fast lane (`followed`) measures tracks in plain view, and `measure` the others.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.colour import directions, sector_table
from rhot_node.detect.illuminant import Illuminant
from rhot_node.detect.image import YuvImage
from rhot_node.detect.region import measure as m
from rhot_node.detect.region.outline import INTERIOR, OUTSIDE
from rhot_node.detect.search import AREA_MIN, Blob, ColourGate
from rhot_node.detect.tracks.follow import learn_noise, noise_level
from rhot_node.detect.tracks.followed import Followed
from rhot_node.detect.tracks.track import (
    ALIVE,
    EXTENT,
    FLOOR_VARIANCE,
    MARGIN,
    TRACK_COLUMNS,
    Track,
    lost_observation,
    mask_variance,
)
from rhot_node.detect.tracks.track import X as TRACK_X
from rhot_node.detect.tracks.track import Y as TRACK_Y
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import CANDIDATES_MAX, NO_FLAGS, MarkerFlag, MarkerObservation

NOISE_START, NOISE_START_BLOCKS = 1.5, 20.0  # grey levels of chroma noise, until so many blocks of paint have told
LARGEST = 0.12  # of the picture: a larger blob is no marker
TWIN_DISTANCE = 0.5  # of their length: nearer tracks of one marker are of one object
PAINT_PIXELS_MIN = 4  # chroma pixels that are all paint: fewer show no colour to rely on
DOUBTFUL = MarkerFlag.PARTIAL | MarkerFlag.EDGE | MarkerFlag.AMBIGUOUS
PALE = 0.5  # of the least chroma that a search takes for paint: a tracked marker in shade has more
SEARCH_STEP = 2  # chroma rows: every other one shows all markers
INTERLACED = (0, 4, 2, 6)  # chroma rows, of 8, that are searched in turn: four frames search as much as SEARCH_STEP

_NOT_PLAIN = int(DOUBTFUL | MarkerFlag.LOST)


class Finder:
    """The tracks of all markers, and the search for new ones. Track s is of marker s modulo the number of markers."""

    def __init__(self, markers: MarkerSet, light: Illuminant) -> None:
        """`light`: that of the pictures, read and set by the caller."""
        self._markers, self._light = markers.markers, light
        self._count = len(self._markers)
        self._directions = directions(markers)
        self._sector = sector_table(markers)
        self.gate = ColourGate(markers)
        self._request = np.zeros(m.REQUEST_COLUMNS)
        self._row = np.zeros(m.MEASURE_COLUMNS)
        self._scratch = m.Scratch(0, 0)
        self._shapes = [marker.shape for marker in self._markers] * CANDIDATES_MAX
        self._states = np.zeros((len(self._shapes), TRACK_COLUMNS))
        self._noise_variance = np.array([NOISE_START**2, NOISE_START_BLOCKS])
        self.followed = Followed(self._shapes, self._count, self._states, self._noise_variance)
        self.paint = np.zeros((self._count, 3))
        """(M, 3) Y, Cb and Cr (minus 128) of every marker's paint as the camera showed it when it was measured."""
        self._paint_pixels = np.zeros(self._count)
        self._searches = 0
        self._tracked = -1  # number of tracks if every marker has one, else -1
        self._balanced: YuvImage | None = None  # the picture in the light of the calibration; None until needed
        self.forget()

    def find(self, camera_image: YuvImage, *, whole: bool = False) -> tuple[MarkerObservation, ...]:
        """The best candidate of every marker, lost or not, in the order of the set, and then the other candidates.

        `whole`: search every SEARCH_STEP-th chroma row, for a picture without known tracks. Otherwise every eighth is
        searched, in the order of INTERLACED.
        """
        seen, self._balanced = self.followed.observations(), None
        for slot in np.flatnonzero(self._states[:, ALIVE]).tolist():
            if slot not in seen:
                track = self._tracks[slot]
                if self._measure(camera_image, slot, track.request(self._request)) \
                        and not track.is_outside(self._row.tolist()):
                    seen[slot] = self._observe(slot, NO_FLAGS)
                    self._follow(camera_image, slot, seen[slot])
                else:
                    self._lose(slot)
        for slot in self._pale_or_twin(seen):
            del seen[slot]
            self._lose(slot)
        self._search(camera_image, seen, whole)
        complete = all(slot in seen for slot in self._best)
        self._tracked = int(np.count_nonzero(self._states[:, ALIVE])) if complete else -1
        return self._report(seen)

    def report_followed(self) -> tuple[MarkerObservation, ...] | None:
        """The observations of a picture in which the fast lane followed every track of all markers; else None."""
        return self._report(self.followed.observations()) if self.followed.count == self._tracked else None

    def note_paint(self) -> None:
        """Store the paint's colour of the best tracks that are followed in `paint`."""
        for slot, colour in self.followed.paint():
            if slot == self._best[slot % self._count]:
                self.paint[slot % self._count] = colour

    def plainly(self, seen: tuple[MarkerObservation, ...], *, lone: bool = True) -> list[int]:
        """Indices of the markers in plain view with enough pixels of paint. `lone`: only markers without a further
        candidate, whose colour is certainly that of their paint."""
        pixels, rivalled = self._paint_pixels.tolist(), {mark.index for mark in seen[self._count:]} if lone else set()
        return [mark.index for mark in seen[:self._count]
                if not mark.flags.value & _NOT_PLAIN and pixels[mark.index] >= PAINT_PIXELS_MIN
                and mark.index not in rivalled]

    def paint_mask(self, image: YuvImage, seen: MarkerObservation) -> NDArray[np.bool_]:
        """(H/2, W/2) the chroma pixels inside a marker that `detect` has just placed in this very `image`.

        Its edge, where paint and surroundings share pixels, is left out; small markers have no inside.
        """
        self._scratch.kind[:], self._balanced = OUTSIDE, None
        if seen.found:
            slot = self._best[seen.index]
            self._measure(image, slot, self._tracks[slot].recall(self._request))
        return np.asarray(self._scratch.kind == INTERIOR)

    def all_blobs(self, image: YuvImage) -> list[list[MarkerObservation]]:
        """Every blob of every marker's colour, largest first, without regard to tracks; a list per marker.

        In the light of the last frame that was searched for markers.
        """
        everything: list[list[MarkerObservation]] = [[] for _ in self._markers]
        self._balanced = None
        for blob in self.gate.blobs(self._light.balanced(image), range(self._count)):
            index = int(blob.label) - 1
            if self._measure(image, index, self._request_of(index, blob)):
                everything[index].append(Track(self._shapes[index]).observe(index, self._row.tolist(), self._noise,
                                                                            MarkerFlag.ACQUIRED))
        return [sorted(own, key=lambda seen: -seen.diameter) for own in everything]

    def forget(self) -> None:
        """Forget all tracks."""
        self._tracks = [Track(shape, state) for shape, state in zip(self._shapes, self._states, strict=True)]
        self._best = list(range(self._count))  # the track of each marker that is reported first
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

    def _measure(self, camera_image: YuvImage, slot: int, request: NDArray[np.float64], careful: bool = True) -> bool:
        """Measure the marker of a track into `self._row` and learn the chroma noise from its paint.

        `careful` as in `measure`. Returns False when the window does not show the marker.
        """
        row, index = self._row, slot % self._count
        if self._balanced is None:
            self._balanced = self._light.balanced(camera_image)
        image = self._balanced
        if not m.measure(image.y, image.u, image.v, self._sector, index + 1, self._directions[index], request,
                         self._scratch.arrays, careful, row):
            return False
        learn_noise(self._noise_variance, row[m.NOISE_SUM], row[m.NOISE_COUNT])
        return True

    def _observe(self, slot: int, flags: MarkerFlag, careful: bool = True) -> MarkerObservation:
        """Take `self._row` into a track and return it as an observation. `careful`: how it was measured."""
        row, index = self._row, slot % self._count
        if slot == self._best[index]:
            self._paint_pixels[index] = row[m.PAINT_PIXELS]
            if careful:
                self.paint[index] = self._light.unbalanced(row[m.PAINT_Y:m.PAINT_CR + 1])
        floor = FLOOR_VARIANCE if careful else mask_variance(row[m.AREA])
        return self._tracks[slot].observe(index, row.tolist(), self._noise, int(flags), floor)

    def _follow(self, camera_image: YuvImage, slot: int, seen: MarkerObservation) -> bool:
        """Let the fast lane follow the track that was just measured; returns False if it is not in plain view."""
        return not seen.flags & DOUBTFUL and self.followed.start(camera_image, slot, self._row.tolist())

    def _lose(self, slot: int) -> None:
        self._states[slot, ALIVE] = 0.0
        self.followed.drop(slot)

    def _pale_or_twin(self, seen: Iterable[int]) -> list[int]:
        """Tracks whose chroma is too low for the marker's paint, or that are where another track of the marker is."""
        gone = [slot for slot in seen if self._is_pale(slot, self._tracks[slot].level)]
        for slot in seen:
            if slot != self._best[slot % self._count] and slot not in gone:
                twin = [other for other in seen
                        if other != slot and other not in gone and other % self._count == slot % self._count
                        and self._relative_distance(slot, other) < TWIN_DISTANCE]
                gone += [slot] if twin else []
        return gone

    def _relative_distance(self, slot: int, other: int) -> float:
        """Distance of two tracks, as a share of the longer one's length."""
        one, two = self._states[slot], self._states[other]
        return math.hypot(one[TRACK_X] - two[TRACK_X], one[TRACK_Y] - two[TRACK_Y]) / max(one[EXTENT], two[EXTENT], 1.0)

    def _is_pale(self, slot: int, level: float) -> bool:
        """Whether a level of chroma, grey levels, is too low for the marker's paint."""
        return bool(level < PALE * self._markers[slot % self._count].chroma.magnitude_min)

    def _search(self, camera_image: YuvImage, seen: dict[int, MarkerObservation], whole: bool) -> None:
        """Search for blobs without a track. The best blob of a lost marker becomes its track; of the others one in each
        picture is measured, all if `whole`. New tracks are added to `seen`, which is indexed by track.
        """
        step, first = (SEARCH_STEP, 0) if whole else (8, INTERLACED[self._searches % len(INTERLACED)])
        self._searches += 1
        image = self._light.balanced(camera_image, step, first)
        left: list[tuple[int, Blob]] = []
        blobs = self.gate.blobs(image, range(self._count), AREA_MIN, step, first)
        for index, own in self._unexplained(blobs, seen).items():
            if self._best[index] not in seen:
                own = self._acquire(camera_image, index, own, seen, whole)
            left += [(index, blob) for blob in own]
        if whole:
            left.sort(key=lambda one: -one[1].area)
        elif left:  # another one each time that the same rows are searched
            left = [left[(self._searches + self._searches // len(INTERLACED)) % len(left)]]
        for index, blob in left:
            self._measure_rival(camera_image, index, blob, seen)

    def _unexplained(self, blobs: list[Blob], seen: Iterable[int]) -> dict[int, list[Blob]]:
        """By marker, the blobs that are not too large and not where a track of the marker is."""
        tracked: list[list[tuple[float, float, float]]] = [[] for _ in self._markers]
        for slot in seen:
            state = self._states[slot].tolist()
            tracked[slot % self._count].append((state[TRACK_X], state[TRACK_Y], state[EXTENT]))
        found: dict[int, list[Blob]] = {}
        for blob in blobs:
            index, area = int(blob.label) - 1, blob.area
            x, y = blob.centroid
            size = max(blob.x_max - blob.x_min, blob.y_max - blob.y_min) + 1.0
            if area < LARGEST * self._scratch.mask.size and not any(
                    math.hypot(x - track_x, y - track_y) < 0.5 * (size + extent)
                    for track_x, track_y, extent in tracked[index]):
                found.setdefault(index, []).append(blob)
        return found

    def _acquire(self, camera_image: YuvImage, index: int, own: list[Blob], seen: dict[int, MarkerObservation],
                 careful: bool) -> list[Blob]:
        """Find a lost marker among its blobs `own` and add it to `seen`; returns the other blobs.

        While the track is remembered, blobs are tried in the order of its motion and size, else by `Blob.merit`.
        """
        slot = self._best[index]
        track = self._tracks[slot]
        if len(own) > 1:
            if track.remembered:
                own = sorted(own, key=track.candidate_cost)
            else:
                marker, shape = self._markers[index], self._scratch.mask.shape
                own = sorted(own, key=lambda blob: -blob.merit(marker, shape))
        for place, blob in enumerate(own[:CANDIDATES_MAX]):
            if self._measure(camera_image, slot, self._request_of(index, blob), careful) \
                    and not self._is_pale(slot, self._row[m.LEVEL]):
                self._row[m.RIVAL_COST] = np.inf  # it was the best blob of the whole frame
                seen[slot] = self._observe(slot, MarkerFlag.ACQUIRED, careful)
                return own[:place] + own[place + 1:]
        return own[CANDIDATES_MAX:]

    def _measure_rival(self, camera_image: YuvImage, index: int, blob: Blob,
                       seen: dict[int, MarkerObservation]) -> None:
        """Measure a blob as a further candidate of a marker and give it a free track, if there is one."""
        slots = range(index, len(self._shapes), self._count)
        slot = next((slot for slot in slots if slot not in seen and slot != self._best[index]), None)
        if slot is None or not self._measure(camera_image, slot, self._request_of(index, blob)) \
                or self._is_pale(slot, self._row[m.LEVEL]):
            return
        self._tracks[slot] = Track(self._shapes[slot], self._states[slot])
        self._row[m.RIVAL_COST] = np.inf
        seen[slot] = self._observe(slot, MarkerFlag.ACQUIRED)
        if slot in self._pale_or_twin(seen):
            del seen[slot]
            self._lose(slot)
        else:
            self._follow(camera_image, slot, seen[slot])

    def _request_of(self, index: int, blob: Blob) -> NDArray[np.float64]:
        """The request to measure a blob as marker `index`."""
        out, area, direction = self._request, blob.area, self._directions[index]
        out[m.PX], out[m.PY] = blob.centroid
        out[m.HALF_X] = max(blob.x_max - out[m.PX], out[m.PX] - blob.x_min) + MARGIN
        out[m.HALF_Y] = max(blob.y_max - out[m.PY], out[m.PY] - blob.y_min) + MARGIN
        out[m.SIGMA] = 1.0 + 0.25 * math.sqrt(area)
        out[m.AREA_REF] = area
        out[m.LEVEL_REF] = (blob.sum_u * direction[0] + blob.sum_v * direction[1]) / area
        out[m.IS_BAND] = self._shapes[index] == "band"
        return out

    def _report(self, seen: dict[int, MarkerObservation]) -> tuple[MarkerObservation, ...]:
        """The observations of one picture as `find` returns them."""
        if len(seen) == self._count and all(slot in seen for slot in self._best):
            return tuple([seen[slot] for slot in self._best])
        first, further = [], []
        for index in range(self._count):
            own = [slot for slot in range(index, len(self._shapes), self._count) if slot in seen]
            best = self._tracks[self._best[index]]
            if self._best[index] not in seen:
                best.lose()
            own.sort(key=lambda slot: (slot != self._best[index], -seen[slot].diameter))
            if own and not best.remembered:
                self._best[index] = own[0]
            first.append(seen[own[0]] if own else lost_observation(index))
            further += [(rank, seen[slot]) for rank, slot in enumerate(own[1:])]
        further.sort(key=lambda one: one[0])  # the second candidates of all markers first
        return (*first, *(mark for _, mark in further))
