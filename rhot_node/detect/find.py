"""Find the markers in one picture whose light is known: tracks in their predicted windows, other blobs by a search.

A marker has up to CANDIDATES_MAX tracks, one for each object of its colour. The master decides which of them is the
marker. The fast lane (`follow`) measures tracks in plain view, and `measure` the others.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.colour import directions, sector_table
from rhot_node.detect.coverage import INTERIOR, OUTSIDE, PIXELS_LEAST, Measured
from rhot_node.detect.follow import Followed, Noise, noise_level
from rhot_node.detect.illuminant import Illuminant
from rhot_node.detect.image import YuvImage, rows_of, table_of
from rhot_node.detect.search import AREA_MIN, Blob, ColourGate
from rhot_node.detect.segment import Paint, measure, scratch
from rhot_node.detect.track import (
    AWAY,
    MARGIN,
    MEMORY_FRAMES,
    Report,
    Request,
    Track,
    expect,
    is_outside,
    new_tracks,
    observe,
)
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import CANDIDATES_MAX, FLAGS, NO_FLAGS, MarkerFlag, MarkerObservation

NOISE_START, NOISE_START_BLOCKS = 1.5, 20.0  # grey levels of chroma noise, until so many blocks of paint have told
LARGEST = 0.12  # of the picture: a larger blob is no marker
TWIN_DISTANCE = 0.5  # of their length: nearer tracks of one marker are of one object
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
        sector = sector_table(markers)
        self._paints = [Paint(sector, index + 1, direction) for index, direction in enumerate(directions(markers))]
        self.gate = ColourGate(markers)
        self._request, self._measured = np.zeros(1, table_of(Request)), np.zeros(1, table_of(Measured))
        self._scratch = scratch(0, 0)
        self._unknown = new_tracks([marker.shape for marker in self._markers] * CANDIDATES_MAX)
        self._tracks = self._unknown.copy()
        self._rows = rows_of(self._tracks)
        self._reports = np.zeros(len(self._tracks), table_of(Report))
        self._noise = np.array([Noise(NOISE_START**2, NOISE_START_BLOCKS)], table_of(Noise))
        self.followed = Followed(self._count, self._tracks, self._noise)
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
        for slot in np.flatnonzero(self._tracks["alive"]).tolist():
            if slot not in seen:
                expect(self._tracks, slot, False, self._request)
                if self._measure(camera_image, slot) and not is_outside(self._tracks, slot, self._measured):
                    seen[slot] = self._observe(slot, NO_FLAGS)
                    self._follow(camera_image, slot, seen[slot])
                else:
                    self._lose(slot)
        for slot in self._pale_or_twin(seen):
            del seen[slot]
            self._lose(slot)
        self._search(camera_image, seen, whole)
        complete = all(slot in seen for slot in self._best)
        self._tracked = int(np.count_nonzero(self._tracks["alive"])) if complete else -1
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
                if not mark.flags.value & _NOT_PLAIN and pixels[mark.index] >= PIXELS_LEAST
                and mark.index not in rivalled]

    def paint_mask(self, image: YuvImage, seen: MarkerObservation) -> NDArray[np.bool_]:
        """(H/2, W/2) the chroma pixels inside a marker that `detect` has just placed in this very `image`.

        Its edge, where paint and surroundings share pixels, is left out; small markers have no inside.
        """
        self._scratch.kind[:], self._balanced = OUTSIDE, None
        if seen.found:
            slot = self._best[seen.index]
            expect(self._tracks, slot, True, self._request)
            self._measure(image, slot)
        return np.asarray(self._scratch.kind == INTERIOR)

    def all_blobs(self, image: YuvImage) -> list[list[MarkerObservation]]:
        """Every blob of every marker's colour, largest first, without regard to tracks; a list per marker.

        In the light of the last frame that was searched for markers.
        """
        everything: list[list[MarkerObservation]] = [[] for _ in self._markers]
        self._balanced = None
        tracks, reports = self._unknown.copy(), np.zeros_like(self._reports)
        for blob in self.gate.blobs(self._light.balanced(image), range(self._count)):
            index = int(blob.label) - 1
            self._request_blob(index, blob)
            if self._measure(image, index):
                tracks[index] = self._unknown[index]
                flags = observe(tracks, index, self._measured, noise_level(self._noise), MarkerFlag.ACQUIRED.value,
                                reports)
                everything[index].append(_observation(index, reports[index], flags))
        return [sorted(own, key=lambda seen: -seen.diameter) for own in everything]

    def forget(self) -> None:
        """Forget all tracks."""
        self._tracks[:] = self._unknown
        self._best = list(range(self._count))  # the track of each marker that is reported first
        self.followed.forget()

    def fit(self, image: YuvImage) -> bool:
        """Make room for pictures of this size; False when there is already."""
        if self._scratch.mask.shape == image.u.shape:
            return False
        self._scratch = scratch(*image.u.shape)
        return True

    def _measure(self, camera_image: YuvImage, slot: int, careful: bool = True) -> bool:
        """Measure the marker of a track as requested; False when the window does not show it."""
        if self._balanced is None:
            self._balanced = self._light.balanced(camera_image)
        return bool(measure(self._balanced, self._paints[slot % self._count], self._request, self._scratch, careful,
                            self._noise, self._measured))

    def _observe(self, slot: int, flags: MarkerFlag) -> MarkerObservation:
        """Take what was measured into a track and return it as an observation."""
        index = slot % self._count
        if slot == self._best[index]:
            row = self._measured[0]
            self._paint_pixels[index] = row["paint_pixels"]
            if row["careful"]:
                self.paint[index] = self._light.unbalanced(np.array([row["paint_y"], row["paint_cb"], row["paint_cr"]]))
        flag = observe(self._tracks, slot, self._measured, noise_level(self._noise), flags.value, self._reports)
        return _observation(index, self._reports[slot], flag)

    def _follow(self, camera_image: YuvImage, slot: int, seen: MarkerObservation) -> bool:
        """Let the fast lane follow the track that was just measured; returns False if it is not in plain view."""
        return not seen.flags & DOUBTFUL and self.followed.start(camera_image, slot, self._measured)

    def _lose(self, slot: int) -> None:
        self._tracks["alive"][slot] = 0.0
        self.followed.drop(slot)

    def _pale_or_twin(self, seen: Iterable[int]) -> list[int]:
        """Tracks whose chroma is too low for the marker's paint, or that are where another track of the marker is."""
        gone = [slot for slot in seen if self._is_pale(slot, self._tracks["level"][slot])]
        for slot in seen:
            if slot != self._best[slot % self._count] and slot not in gone:
                twin = [other for other in seen
                        if other != slot and other not in gone and other % self._count == slot % self._count
                        and self._relative_distance(slot, other) < TWIN_DISTANCE]
                gone += [slot] if twin else []
        return gone

    def _relative_distance(self, slot: int, other: int) -> float:
        """Distance of two tracks, as a share of the longer one's length."""
        one, two = self._track(slot), self._track(other)
        return math.hypot(one.x - two.x, one.y - two.y) / max(one.extent, two.extent, 1.0)

    def _track(self, slot: int) -> Track:
        return Track._make(self._rows[slot].tolist())

    def _is_pale(self, slot: int, level: float) -> bool:
        """Whether a level of chroma, grey levels, is too low for the marker's paint."""
        return bool(level < PALE * self._markers[slot % self._count].chroma.magnitude_min)

    def _search(self, camera_image: YuvImage, seen: dict[int, MarkerObservation], whole: bool) -> None:
        """Search for blobs without a track. The best blob of a lost marker becomes its track; of the others one in each
        picture is measured, all if `whole`. New tracks are added to `seen`, which is indexed by track.
        """
        step, first = (SEARCH_STEP, 0) if whole else (2 * len(INTERLACED), INTERLACED[self._searches % len(INTERLACED)])
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
        xs, ys, extents = (self._tracks[name].tolist() for name in ("x", "y", "extent"))
        for slot in seen:
            tracked[slot % self._count].append((xs[slot], ys[slot], extents[slot]))
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
        """Find a lost marker among its blobs `own`, in the order of `Blob.merit`, and add it to `seen`.

        Returns the other blobs.
        """
        slot = self._best[index]
        marker, shape = self._markers[index], self._scratch.mask.shape
        if len(own) > 1:
            own.sort(key=lambda blob: -blob.merit(marker, shape))
        for place, blob in enumerate(own[:CANDIDATES_MAX]):
            self._request_blob(index, blob)
            if self._measure(camera_image, slot, careful) and not self._is_pale(slot, self._measured["level"].item()):
                self._measured["rival_cost"] = np.inf  # it was the best blob of the whole frame
                seen[slot] = self._observe(slot, MarkerFlag.ACQUIRED)
                return own[:place] + own[place + 1:]
        return own[CANDIDATES_MAX:]

    def _measure_rival(self, camera_image: YuvImage, index: int, blob: Blob,
                       seen: dict[int, MarkerObservation]) -> None:
        """Measure a blob as a further candidate of a marker and give it a free track, if there is one."""
        slots = range(index, len(self._tracks), self._count)
        slot = next((slot for slot in slots if slot not in seen and slot != self._best[index]), None)
        self._request_blob(index, blob)
        if slot is None or not self._measure(camera_image, slot) \
                or self._is_pale(slot, self._measured["level"].item()):
            return
        self._tracks[slot] = self._unknown[slot]
        self._measured["rival_cost"] = np.inf
        seen[slot] = self._observe(slot, MarkerFlag.ACQUIRED)
        if slot in self._pale_or_twin(seen):
            del seen[slot]
            self._lose(slot)
        else:
            self._follow(camera_image, slot, seen[slot])

    def _request_blob(self, index: int, blob: Blob) -> None:
        """Request to measure a blob as marker `index`."""
        direction, (x, y) = self._paints[index].direction, blob.centroid
        self._request[0] = Request(
            x, y, max(blob.x_max - x, x - blob.x_min) + MARGIN, max(blob.y_max - y, y - blob.y_min) + MARGIN,
            1.0 + AWAY * math.sqrt(blob.area), blob.area,
            (blob.sum_u * direction[0] + blob.sum_v * direction[1]) / blob.area, self._markers[index].shape == "band")

    def _report(self, seen: dict[int, MarkerObservation]) -> tuple[MarkerObservation, ...]:
        """The observations of one picture as `find` returns them."""
        if len(seen) == self._count and all(slot in seen for slot in self._best):
            return tuple([seen[slot] for slot in self._best])
        first, further = [], []
        for index in range(self._count):
            own = [slot for slot in range(index, len(self._tracks), self._count) if slot in seen]
            best = self._best[index]
            if best not in seen:
                self._lose(best)
                self._tracks["missed"][best] = min(self._tracks["missed"][best] + 1.0, MEMORY_FRAMES)
            own.sort(key=lambda slot: (slot != best, -seen[slot].diameter))
            if own and self._tracks["missed"][best] >= MEMORY_FRAMES:
                self._best[index] = own[0]
            first.append(seen[own[0]] if own else _lost(index))
            further += [(rank, seen[slot]) for rank, slot in enumerate(own[1:])]
        further.sort(key=lambda one: one[0])  # the second candidates of all markers first
        return (*first, *(mark for _, mark in further))


def _observation(index: int, report: NDArray[np.void], flags: int) -> MarkerObservation:
    x, y, diameter, xx, xy, yy, quality, _ = report.item()
    return MarkerObservation(index, x, y, diameter, xx, xy, yy, quality, FLAGS[flags])


def _lost(index: int) -> MarkerObservation:
    nan = math.nan
    return MarkerObservation(index, nan, nan, 0.0, nan, nan, nan, 0.0, MarkerFlag.LOST)
