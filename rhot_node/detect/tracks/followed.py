"""The tracks that are followed in plain view: their state, and the interface to the compiled functions.

A marker may have several tracks: track s is of marker s modulo the number of markers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.image import YuvImage
from rhot_node.detect.region import position as p
from rhot_node.detect.region.position import BLUR_VARIANCE
from rhot_node.detect.tracks import contour_pixels as c
from rhot_node.detect.tracks.contour import fit
from rhot_node.detect.tracks.contour_pixels import project
from rhot_node.detect.tracks.follow import (
    AREA_LEAST,
    DONE,
    ELONGATED,
    IS_BAND,
    LIMB_LEFT,
    LIMB_TAKEN,
    MARK_COLUMNS,
    MISFIT_MOST,
    MISFIT_NOISE,
    NOISE_MOST,
    OFF_AXIS,
    OUT_COLUMNS,
    READY,
    SAG,
    SAG_FRAMES,
    SAG_VARIANCE,
    SAG_ZERO,
    follow,
    noise_level,
)
from rhot_node.detect.tracks.track import FITTED, LIMB_OF_SHAPE, OFF_AXIS_SD
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


# -- start of fast tracking --------------------------------------------------------------------------------------------

START_AWAY, START_RATIO = 0.35, 1.15  # px, area: how well outline and careful measurement agree
ARC_VARIANCE = 2.0 / 3.0 - (0.25 * math.pi) ** 2  # of sqrt(1 - u^2) over -1..1


@njit(**c.FAST)
def start(y, u, v, x, y_at, var_long, var_high, axis_x, axis_y, area, noise, is_band, sag, mark, look, radius, rim,
          pixels, work, fitted):
    """Begin to follow a marker that was measured carefully in this picture; sets READY when its outline is found.

    `x`, `y_at`: its place; `var_long`, `var_high`, `axis_x`, `axis_y`: second moments and major axis; `sag`: a band's.
    """
    mark[READY] = 0.0
    first_x, first_y = x, y_at
    long2, high2 = max(var_long - BLUR_VARIANCE, 0.5), max(var_high - BLUR_VARIANCE, 0.5)
    if area < AREA_LEAST:
        return
    if not _levels(u, v, x - 0.25 * math.pi * sag * axis_y, y_at + 0.25 * math.pi * sag * axis_x, axis_x, axis_y,
                   math.sqrt(4.0 * long2), math.sqrt(4.0 * high2), look):
        return
    high2 = max(high2 - ARC_VARIANCE * sag * sag, 0.5)
    look[c.BEND], look[c.WIDTH], mark[SAG] = sag, math.sqrt(3.0 * long2) if is_band else 0.0, 0.0
    aspect = math.sqrt(long2 / high2)
    look[c.AXIS_X], look[c.AXIS_Y] = axis_x, axis_y
    look[c.LONG] = look[c.HIGH] = 1.0
    side = math.sqrt(math.sqrt(long2 * high2) * (3.0 if is_band else 4.0))
    if aspect > ELONGATED:
        look[c.LONG], look[c.HIGH] = math.sqrt(aspect), 1.0 / math.sqrt(aspect)
        aspect = 1.0
    for j in range(c.NODES):
        cosine, sine = c.COSINES[j], c.SINES[j]
        if is_band:
            radius[j] = side / max(abs(cosine), abs(sine))
        else:
            radius[j] = side / math.sqrt(cosine * cosine / aspect + sine * sine * aspect)
    radius[c.NODES] = radius[0]
    rim[:] = 0.0
    look[c.SLOPE_X] = look[c.SLOPE_Y] = look[c.AGE] = 0.0
    look[c.BLUR] = c.BLUR_START
    for _ in range(3):
        project(look)
        if not look[c.GAIN] * noise < NOISE_MOST:
            return
        if not fit(y, u, v, x, y_at, look, radius, rim, np.int64(3), pixels, work, fitted):
            return
        x, y_at = fitted[c.X], fitted[c.Y]
    mark[SAG_FRAMES] = mark[SAG_ZERO] = 0.0
    mark[READY] = (
        fitted[c.MISFIT] < math.hypot(MISFIT_NOISE * look[c.GAIN] * noise, MISFIT_MOST)
        and fitted[c.AREA] < START_RATIO * area and area < START_RATIO * fitted[c.AREA]
        and math.hypot(x - first_x, y_at - first_y) < START_AWAY)


@njit(**c.FAST)
def _levels(u, v, x, y_at, ax, ay, long, high, look):
    """Mean chroma of the inner half of the marker, and mean and covariance around it, by ellipses."""
    reach = int(long + 6.0)
    x0, x1 = max(int(x) - reach, 0), min(int(x) + reach + 1, u.shape[1] - 1)
    y0, y1 = max(int(y_at) - reach, 0), min(int(y_at) + reach + 1, u.shape[0] - 1)
    n = s_u = s_v = r_n = r_u = r_v = r_uu = r_uv = r_vv = 0.0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            dx, dy = column - x, row - y_at
            long_way, high_way = dx * ax + dy * ay, dy * ax - dx * ay
            cu, cv = u[row, column] - 128.0, v[row, column] - 128.0
            if (long_way / long) ** 2 + (high_way / high) ** 2 < 0.4:
                n += 1.0
                s_u += cu
                s_v += cv
            elif (long_way / (1.1 * long + 2.0)) ** 2 + (high_way / (1.1 * high + 2.0)) ** 2 > 1.0 and (
                    (long_way / (1.1 * long + 4.5)) ** 2 + (high_way / (1.1 * high + 4.5)) ** 2 < 1.0):
                r_n += 1.0
                r_u += cu
                r_v += cv
                r_uu += cu * cu
                r_uv += cu * cv
                r_vv += cv * cv
    if n < 4.0 or r_n < 10.0:
        return False
    m_u, m_v = r_u / r_n, r_v / r_n
    look[c.PAINT_U], look[c.PAINT_V] = 128.0 + s_u / n, 128.0 + s_v / n
    look[c.AROUND_U], look[c.AROUND_V] = 128.0 + m_u, 128.0 + m_v
    look[c.C_UU], look[c.C_UV], look[c.C_VV] = r_uu / r_n - m_u * m_u, r_uv / r_n - m_u * m_v, r_vv / r_n - m_v * m_v
    return True
