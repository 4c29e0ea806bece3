"""The fast detector: predicted windows for tracked markers, one pass over the frame for all lost ones.

Works on the planes of a YUV420 image as the camera delivers them, in one thread.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect import measure as m
from rhot_node.detect.candidates import Blobs, ranked_by, request_of, worth_of
from rhot_node.detect.company import Company
from rhot_node.detect.follow import learn_noise, noise_level
from rhot_node.detect.followed import Followed
from rhot_node.detect.gate import ColourGate, Labels
from rhot_node.detect.image import YuvImage
from rhot_node.detect.labels import directions, sector_table
from rhot_node.detect.light import DEAD_ZONE, SWITCHED, Light
from rhot_node.detect.light_guess import MARKERS_LEAST, guess_light
from rhot_node.detect.outline import INTERIOR, OUTSIDE
from rhot_node.detect.search import AREA, LABEL, SUM_X, SUM_Y
from rhot_node.detect.track import TRACK_COLUMNS, Track, lost_observation
from rhot_node.detect.whereabouts import Whereabouts, middle_of
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import NO_FLAGS, MarkerFlag, MarkerObservation

CANDIDATES = 4  # blobs per marker that are measured until one proves to be paint
NOISE_START, NOISE_START_BLOCKS = 1.5, 20.0  # grey levels of chroma noise, until so many blocks of paint have told
SUDDENLY = 2  # markers fewer in plain view than in the last frame: was a lamp switched?
GUESS_EVERY = 20  # frames without all markers in plain view until the light is guessed anew
STEADY, STEADY_FEW = 0.7, 0.95  # of the light is that of the last frame; with few markers in plain view
LARGEST = 0.12  # of the picture: no worn marker is nearer than that
PAINT_PIXELS_MIN = 4  # chroma pixels that are all paint: fewer show no colour to rely on
DOUBTFUL = MarkerFlag.PARTIAL | MarkerFlag.EDGE | MarkerFlag.AMBIGUOUS
PALE = 0.5  # of the least chroma that a search takes for paint: a tracked marker in shade has more
SEARCH_STEP = 2  # chroma rows: every other one shows where markers are
GLANCE = 8  # frames between looks at the light and the hand as a whole while all markers are followed in plain view
LIGHT_PASSES = 3  # of finding the markers and reading the light from them, in a picture of which nothing is known


class FastDetector:
    """Finds every marker of a set in one YUV420 image after the other; see `rhot_node.detect.detector.Detector`."""

    def __init__(self, markers: MarkerSet, *, precise: bool = True) -> None:
        """`precise` False: markers in plain view are placed by their soft centroid, without a fit of the outline."""
        self._set = markers
        self._markers = markers.markers
        self._light = Light(markers)
        self._fresh = True  # no picture has been seen yet
        self._until_guess = GUESS_EVERY
        self._plain = 0  # markers in plain view in the last frame
        self._directions = directions(markers)
        self._sector = sector_table(markers)
        self._gate = ColourGate(markers)
        self._request = np.zeros(m.REQUEST_COLUMNS)
        self._row = np.zeros(m.MEASURE_COLUMNS)
        self._scratch = m.Scratch(0, 0)
        self._states = np.zeros((len(self._markers), TRACK_COLUMNS))
        self._tracks: list[Track] = []
        self._noise_variance = np.array([NOISE_START**2, NOISE_START_BLOCKS])
        self._followed = Followed([marker.shape for marker in self._markers], self._states, self._noise_variance)
        self._precise = precise
        self._until_glance = 0
        self._company = Company(self._markers)
        self._sure_warmth: float | None = None  # the light before a guess that no markers in company have confirmed
        self._unsure = 0  # frames since that guess
        self._paint = np.zeros((len(self._markers), 3))
        self._paint_pixels = np.zeros(len(self._markers))
        self.reset()

    def reset(self) -> None:
        """Forget all tracks and the light: the next frame is searched as a whole."""
        self.lose_all()
        self._light.warmth, self._sure_warmth = 0.0, None
        self._fresh = True

    def lose_all(self) -> None:
        """Forget all tracks, but not the light: the next frame is searched as a whole."""
        self._forget_tracks()
        self._company.forget()

    def paint_colours(self) -> NDArray[np.float64]:
        """(M, 3) Y, Cb and Cr (minus 128) of every marker's paint as the camera showed it when it was found last."""
        self._note_paint()
        return self._paint.copy()

    def paint_mask(self, image: YuvImage, seen: MarkerObservation) -> NDArray[np.bool_]:
        """(H/2, W/2) the chroma pixels inside a marker that `detect` has just placed in this very `image`.

        Its edge, where paint and surroundings share pixels, is left out; small markers have no inside.
        """
        self._scratch.kind[:] = OUTSIDE
        if seen.found:
            self._measure(self._light.balanced(image), seen.index, self._tracks[seen.index].recall(self._request))
        return np.asarray(self._scratch.kind == INTERIOR)

    @property
    def warmth(self) -> float:
        """How much warmer the light is than the one the colours were learnt in; see `rhot_node.detect.light`."""
        return self._light.warmth

    def detect(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """One observation per marker, in the order of the marker set; lost markers are stated as lost."""
        self._fit_scratch(image)
        if self._fresh:
            seen = self._find_at_first(image)
        else:
            self._followed.follow(image, self._precise)
            if self._followed.count == len(self._markers):
                seen = self._glance(image)
                return seen if self._company.complete else self._company.judge(seen)
            seen = self._find(image)
            if self._light_in_doubt(seen):
                seen = self._find_in_guessed_light(image, seen)
            if self._read_light(seen, STEADY) >= SWITCHED:  # somebody switched a lamp
                seen = self._find_in_new_light(image)
        self._fresh, self._plain = False, len(self._plainly(seen))
        seen = self._company.judge(seen)
        self._doubt_light()
        return seen

    def _doubt_light(self) -> None:
        """Take a guessed light back when no markers in company have shown it to be right for long."""
        if self._sure_warmth is None:
            return
        self._unsure += 1
        if self._company.vouched >= MARKERS_LEAST:
            self._sure_warmth = None
        elif self._unsure >= GUESS_EVERY:
            self._light.warmth, self._sure_warmth = self._sure_warmth, None
            self._forget_tracks()

    def _find_at_first(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """Find the markers in a picture of which nothing is known: by the light of the calibration, if that shows all
        of them, else by the light in which most are recognised."""
        seen = self._find(image)
        if len(self._plainly(seen)) < len(seen):
            return self._find_in_guessed_light(image)
        return seen if self._read_light(seen, 0.0) < DEAD_ZONE else self._find_in_new_light(image)

    def _glance(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """The markers when all are followed in plain view; now and then with a look at the light and the hand."""
        self._until_glance -= 1
        if self._until_glance > 0:
            return self._followed.observations()
        self._until_glance = GLANCE
        self._plain, self._until_guess = len(self._markers), GUESS_EVERY
        seen = self._find(image)
        self._read_light(seen, STEADY**GLANCE)
        return seen

    def _note_paint(self) -> None:
        """The colours of the markers that are followed."""
        for index, colour in self._followed.paint():
            self._paint[index] = colour

    def _light_in_doubt(self, seen: tuple[MarkerObservation, ...]) -> bool:
        """Whether markers went out of plain view together, or some have not been in plain view for a while."""
        plain = len(self._plainly(seen))
        self._until_guess -= 1
        doubt = self._plain - plain >= SUDDENLY or self._until_guess <= 0
        if doubt or plain == len(seen):
            self._until_guess = GUESS_EVERY
        return doubt and plain < len(seen)

    def _find_in_guessed_light(self, image: YuvImage, seen: tuple[MarkerObservation, ...] = (),
                               ) -> tuple[MarkerObservation, ...]:
        """Find the markers in the light in which most are recognised, if enough of them then prove to be paint.

        `seen`: what was found by the last known light; nothing: it is searched by that as well.
        """
        known = self._light.warmth
        if guess_light(image, self._light, self._gate, self._set):
            guessed = self._find_in_new_light(image)
            plain = self._plainly(guessed)
            if np.count_nonzero(self._light.strong(plain, self._paint[plain])) >= MARKERS_LEAST:
                if self._sure_warmth is None:
                    self._sure_warmth, self._unsure = known, 0
                return guessed
            self._light.warmth = known
            seen = ()
        return seen or self._find_in_new_light(image)

    def _find_in_new_light(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """Find the markers, read the light from them, and find them again in that."""
        for _ in range(LIGHT_PASSES):
            self._forget_tracks()
            seen = self._find(image)
            if self._read_light(seen, 0.0) < DEAD_ZONE:
                break
        return seen

    def _plainly(self, seen: tuple[MarkerObservation, ...]) -> list[int]:
        """Indices of the markers that are in plain view, so that their paint's colour can be relied on."""
        return [mark.index for mark in seen if mark.found and not mark.flags & DOUBTFUL
                and self._paint_pixels[mark.index] >= PAINT_PIXELS_MIN]

    def _read_light(self, seen: tuple[MarkerObservation, ...], steady: float) -> float:
        """Take the light from the markers that are plainly seen; returns by how much its warmth changed."""
        self._note_paint()
        plain = self._plainly(seen)
        if len(plain) < MARKERS_LEAST:
            steady = STEADY_FEW  # things of a marker's colour must not tell the light
        return self._light.read(plain, self._paint[plain], steady)

    def _find(self, camera_image: YuvImage) -> tuple[MarkerObservation, ...]:
        """Every marker, in the picture as it would look in the light of the calibration."""
        found: dict[int, MarkerObservation] = {}
        lost = []
        if self._followed.count:
            found = {mark.index: mark for mark in self._followed.observations()}
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
            self._followed.drop(index)
            lost.append(index)
        if lost:
            self._acquire(camera_image, lost, found)
        return tuple(found[index] for index in range(len(self._tracks)))

    def labels(self, image: YuvImage) -> Labels:
        """(H/2, W/2) for every chroma pixel 1 + the index of the marker that the search takes it for, 0 for none.

        In the light of the last frame that was searched for markers.
        """
        return self._gate.labels(self._light.balanced(image))

    def all_blobs(self, image: YuvImage) -> list[list[MarkerObservation]]:
        """Every blob of every marker's colour, largest first, without regard to tracks; a list per marker.

        In the light of the last frame that was searched for markers.
        """
        self._fit_scratch(image)
        image = self._light.balanced(image)
        everything: list[list[MarkerObservation]] = []
        blobs = self._gate.blobs(image, range(len(self._markers))).copy()
        for index, marker in enumerate(self._markers):
            own = []
            for blob in blobs[blobs[:, LABEL] == index + 1]:
                if self._measure(image, index, self._request_of(index, blob)):
                    own.append(Track(marker.shape).observe(index, self._row.tolist(), self._noise, MarkerFlag.ACQUIRED))
            everything.append(sorted(own, key=lambda seen: -seen.diameter))
        return everything

    def _forget_tracks(self) -> None:
        self._tracks = [Track(marker.shape, state) for marker, state in zip(self._markers, self._states, strict=True)]
        self._followed.forget()

    @property
    def _noise(self) -> float:
        return float(noise_level(self._noise_variance))

    def _fit_scratch(self, image: YuvImage) -> None:
        if self._scratch.mask.shape != image.u.shape:
            self._scratch = m.Scratch(*image.u.shape)
            self.reset()

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
        self._paint[index] = self._light.unbalanced(row[m.PAINT_Y:m.PAINT_CR + 1])
        values = row.tolist()
        seen = self._tracks[index].observe(index, values, self._noise, flags)
        if not seen.flags & DOUBTFUL:
            self._followed.start(camera_image, index, values)
        return seen

    def _acquire(self, camera_image: YuvImage, lost: list[int], found: dict[int, MarkerObservation]) -> None:
        """Search the whole frame for the lost markers and state each as found or lost."""
        image = self._light.balanced(camera_image)
        blobs = self._gate.blobs(image, lost, step=SEARCH_STEP).copy()
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
