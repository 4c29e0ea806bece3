"""The tracks that are followed in plain view: their state, and the interface to the compiled functions.

A marker may have several tracks: track s is of marker s modulo the number of markers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect import contour_columns as c
from rhot_node.detect import position as p
from rhot_node.detect.begin import start
from rhot_node.detect.follow import DONE, OUT_COLUMNS, follow, noise_level
from rhot_node.detect.followed_band import IS_BAND, LIMB_LEFT, LIMB_TAKEN, MARK_COLUMNS, OFF_AXIS, READY, SAG_VARIANCE
from rhot_node.detect.image import YuvImage
from rhot_node.detect.stated import LIMB_OF_SHAPE, OFF_AXIS_SD
from rhot_node.detect.track import FITTED
from rhot_node.markers import Shape
from rhot_node.wire.messages import MarkerObservation

Array = NDArray[np.float64]


class Followed:
    """What is kept of the tracks in plain view from frame to frame, and room to work in: a frame allocates nothing."""

    def __init__(self, shapes: Sequence[Shape], markers: int, tracks: Array, noise_variance: Array) -> None:
        """S tracks of `markers` markers. `tracks` (S, TRACK_COLUMNS) and `noise_variance` (2,) are shared with the
        careful lane."""
        count = len(shapes)
        self._markers, self._tracks, self._noise_variance = markers, tracks, noise_variance
        self._looks = np.zeros((count, c.LOOK_COLUMNS))
        self._radii, self._rims = np.zeros((count, c.NODES + 1)), np.zeros((count, 2, c.NODES + 1))
        self._marks = np.zeros((count, MARK_COLUMNS))
        self._bands = [shape == "band" for shape in shapes]
        self._marks[:, LIMB_TAKEN:LIMB_LEFT + 1] = [LIMB_OF_SHAPE[shape] for shape in shapes]
        self._pixels, self._work = np.zeros((c.PIXELS_MAX, c.PIXEL_COLUMNS)), np.zeros((c.NODES + 1, c.WORK_COLUMNS))
        self._soft, self._fitted = np.zeros(3), np.zeros(c.FIT_COLUMNS)
        self._seen = np.zeros((count, OUT_COLUMNS))
        self.count = 0
        """Tracks that were seen in the last frame."""

    def forget(self) -> None:
        """Nothing is followed any more."""
        self._marks[:, READY] = self._seen[:, DONE] = 0.0
        self.count = 0

    def drop(self, index: int) -> None:
        """The track is no longer followed."""
        self._marks[index, READY] = self._seen[index, DONE] = 0.0

    def follow(self, image: YuvImage, precise: bool) -> None:
        """Locate the followed tracks in the next picture; `precise` False: by their soft centroids."""
        self.count = follow(image.y, image.u, image.v, self._tracks, self._looks, self._radii, self._rims, self._marks,
                            self._noise_variance, precise, self._pixels, self._work, self._soft, self._fitted,
                            self._seen)

    def observations(self) -> dict[int, MarkerObservation]:
        """By track: the observations of the last frame."""
        count = self._markers
        return {slot: MarkerObservation(slot % count, x, y, diameter, xx, xy, yy, quality)
                for slot, (x, y, diameter, xx, xy, yy, quality, done) in enumerate(self._seen.tolist()) if done}

    def start(self, image: YuvImage, index: int, row: Sequence[float]) -> bool:
        """Follow track `index`, which was measured in plain view with the result `row` of `measure`.

        Returns whether its outline was found. A band that never showed its rims is followed by its outline alone.
        """
        band = self._bands[index] and bool(row[p.FIT])
        if self._bands[index] and not band and self._tracks[index, FITTED]:
            return False  # its rims have been visible and are now occluded
        self._marks[index, IS_BAND] = band
        self._marks[index, OFF_AXIS] = OFF_AXIS_SD if self._bands[index] and not (band or row[p.ROUND]) else 0.0
        self._marks[index, SAG_VARIANCE] = row[p.SAG_VARIANCE]
        start(image.y, image.u, image.v, row[p.X], row[p.Y], row[p.VAR_MAJOR], row[p.VAR_MINOR], row[p.AXIS_X],
              row[p.AXIS_Y], row[p.AREA], noise_level(self._noise_variance), band, row[p.SAG], self._marks[index],
              self._looks[index], self._radii[index], self._rims[index], self._pixels, self._work, self._fitted)
        return bool(self._marks[index, READY])

    def paint(self) -> Iterator[tuple[int, tuple[float, float, float]]]:
        """Track, and Y, Cb and Cr (minus 128) of its paint as the camera showed it, of the tracks of the last frame."""
        for index in np.flatnonzero(self._seen[:, DONE]).tolist():
            look = self._looks[index]
            yield index, (look[c.PAINT_Y].item(), look[c.PAINT_U].item() - 128.0, look[c.PAINT_V].item() - 128.0)
