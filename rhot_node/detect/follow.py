"""The fast lane: tracks in plain view, followed from frame to frame in one call of compiled code.

A marker's window is predicted at constant velocity. The projection of its chroma, whose levels come from the last frame
as the camera shows it (so that no light has to be mended), gives a soft centroid; about that the outline of the last
frame is fitted anew (`outline`). Whatever is not as plain as it was - area, level, outline, misfit, the frame's border,
a rival in the window - sends the marker back to the careful measurement (`segment.measure`), which also brings it here.

All coordinates are chroma pixels.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect import outline_pixels as c
from rhot_node.detect import track as t
from rhot_node.detect.band import ARC, length_of, mend_band
from rhot_node.detect.coverage import PIXELS_LEAST, block_noise
from rhot_node.detect.image import GREY, YuvImage, rows_of, table_of
from rhot_node.detect.outline import fit
from rhot_node.detect.outline_pixels import project, workspace
from rhot_node.wire.messages import MarkerObservation

NOISE_MOST = 0.12  # of the contrast
SOFT = 0.25  # projected chroma that counts not at all; so much below that of paint, it counts as paint
LEVEL_OFF = 0.10  # of the paint's contrast from one frame to the next: another light, or another paint
AWAY_MOST = 0.8  # px from the soft centroid to the outline's
DENT_MOST = 0.45  # px that a radius may move against the others in a frame: a neighbour touches the outline
SPEED_MOST = 8.0  # px per frame: a faster marker's edges are smeared, by one side more than by the other
OTHER_HUE = 0.4  # of the contrast: what lies further beside the line from surroundings to paint is another paint
SOFT_RATIO = 1.35  # of the expected area: what the soft area may be off, both ways; a switched lamp changes it
AREA_RATIO = 1.10  # and the outline's
MISFIT_NOISE, MISFIT_MOST = 2.0, 0.10  # standard deviations of the noise, and of the contrast
TURN_MOST = 0.17  # rad: an elongated marker that has turned further gets new axes
ELONGATED = 1.3

NOISE_MIN = 0.5  # grey levels of chroma noise; quantisation alone leaves 0.3
NOISE_BLOCKS_MOST = 600.0  # that its mean is taken over


class Noise(NamedTuple):
    """Variance of the chroma noise, grey levels^2: a running mean, and how many blocks of paint it is worth."""

    variance: float
    blocks: float


class Followed:
    """What is kept of the tracks in plain view from frame to frame, and room to work in: a frame allocates nothing.

    Track s is of marker s modulo the number of markers.
    """

    def __init__(self, markers: int, tracks: NDArray[np.void], noise: NDArray[np.void]) -> None:
        """`tracks` (S,) `Track` and `noise` (1,) `Noise` records of `markers` markers are shared with the careful
        lane."""
        self._markers, self._tracks, self._noise = markers, tracks, noise
        self._outlines = np.zeros(len(tracks), c.OUTLINE)
        self._reports = np.zeros(len(tracks), table_of(t.Report))
        self._rows = rows_of(self._reports)
        self._work = workspace()
        self.count = 0
        """Tracks that were found in the last frame."""

    def forget(self) -> None:
        """Nothing is followed any more."""
        self._outlines["ready"] = self._reports["done"] = 0.0
        self.count = 0

    def drop(self, slot: int) -> None:
        """The track is no longer followed."""
        self._outlines["ready"][slot] = self._reports["done"][slot] = 0.0

    def follow(self, image: YuvImage) -> None:
        """Locate the followed tracks in the next picture."""
        self.count = follow(image, self._tracks, self._outlines, self._noise, self._work, self._reports)

    def observations(self) -> dict[int, MarkerObservation]:
        """By track: the observations of the last frame."""
        return {slot: MarkerObservation(slot % self._markers, *self._rows[slot].tolist()[:-1])
                for slot, done in enumerate(self._reports["done"].tolist()) if done}

    def start(self, image: YuvImage, slot: int, measured: NDArray[np.void]) -> bool:
        """Follow a track, which was `measured` (1,) in plain view in this picture. Returns whether its outline was
        found. A band that never showed its rims is followed by its outline alone."""
        return bool(start(image, self._tracks, self._outlines, slot, measured, self._noise, self._work))

    def paint(self) -> Iterator[tuple[int, tuple[float, float, float]]]:
        """Track, and Y, Cb and Cr (minus 128) of its paint as the camera showed it, of the tracks of the last frame."""
        for slot in np.flatnonzero(self._reports["done"]).tolist():
            y, u, v = (self._outlines[name][slot].item() for name in ("paint_y", "paint_u", "paint_v"))
            yield slot, (y, u - GREY, v - GREY)


# -- one frame --------------------------------------------------------------------------------------------------------

@njit(**c.FAST)
def follow(image, tracks, outlines, noises, work, reports):
    """Follow every ready outline; the `reports` (S,) of those that are followed are `done`, and their tracks updated.

    An outline that is not followed is no longer ready. Learns the noise. Returns how many are followed.
    """
    noise, fitted = noise_level(noises), work.fitted[0]
    count = 0
    for slot in range(tracks.shape[0]):
        track, outline, report = tracks[slot], outlines[slot], reports[slot]
        report.done = 0.0
        if outline.ready == 0.0:
            continue
        outline.ready = 0.0
        project(outline)
        if not outline.gain * noise < NOISE_MOST or not _soft(image, track, outline, fitted):
            continue
        # The outline of a straightened band is written about its centroid.
        rest = ARC * outline.sag
        fitted.x -= outline.axis_y * rest
        fitted.y += outline.axis_x * rest
        if not _outline(image, track, outline, noise, work):
            continue
        if outline.rims > 0.0 and not mend_band(outline, fitted, track):
            continue
        _state(track, fitted, outline, noise, report)
        _learn_noise_inside(image, fitted, noises)
        outline.ready = report.done = 1.0
        count += 1
    return count


@njit(**c.FAST)
def noise_level(noises):
    """Standard deviation of the chroma noise, grey levels."""
    return max(math.sqrt(noises[0].variance), NOISE_MIN)


@njit(**c.FAST)
def learn_noise(noises, total, count):
    """Take in the noise of `count` 2x2 blocks inside a marker's paint, a sum of variances (`coverage.chroma_noise`)."""
    noise = noises[0]
    noise.blocks += count
    noise.variance += (total - count * noise.variance) / noise.blocks
    noise.blocks = min(noise.blocks, NOISE_BLOCKS_MOST)


@njit(**c.FAST)
def _learn_noise_inside(image, fitted, noises):
    """From the square inside the marker."""
    u, v = image.u, image.v
    half = 0.5 * (fitted.m_xx + fitted.m_yy)
    short = half - math.hypot(0.5 * (fitted.m_xx - fitted.m_yy), fitted.m_xy)
    reach = math.sqrt(max(2.0 * short, 0.0)) - 1.0  # half a side of the square in a disc, less the edge
    x, y = fitted.x, fitted.y
    total = 0.0
    count = 0
    for row in range(math.ceil(y - reach), int(y + reach)):
        for column in range(math.ceil(x - reach), int(x + reach)):
            total += block_noise(u, v, row, column)
            count += 1
    learn_noise(noises, total, count)


@njit(**c.FAST)
def _soft(image, track, outline, fitted):
    """Set place and area of `fitted` to those of the soft coverage over the predicted window.

    False when the frame's border may cut the outline, or the area is not as expected.
    """
    u, v = image.u, image.v
    speed = math.hypot(track.vx, track.vy)
    half = t.half_window(track.extent, speed)
    px, py = track.x + track.vx + track.sag_x, track.y + track.vy + track.sag_y
    edge = 0.5 * track.extent + c.BAND + 0.5 * speed
    height, width = u.shape
    if not speed < SPEED_MOST or not min(px, py, width - 1.0 - px, height - 1.0 - py) > edge:
        return False
    x0, x1 = max(int(px - half), 0), min(int(px + half) + 1, width - 1)
    y0, y1 = max(int(py - half), 0), min(int(py + half) + 1, height - 1)
    ramp = 1.0 / (1.0 - 2.0 * SOFT)
    wu, wv = outline.w_u * ramp, outline.w_v * ramp
    zero = wu * outline.around_u + wv * outline.around_v + SOFT * ramp
    du, dv = outline.paint_u - outline.around_u, outline.paint_v - outline.around_v
    tint = du * outline.around_v - dv * outline.around_u
    other = OTHER_HUE * (du * du + dv * dv)
    area = sum_x = sum_y = 0.0
    for row in range(y0, y1 + 1):
        line = line_x = 0.0
        for column in range(x0, x1 + 1):
            cu, cv = np.float64(u[row, column]), np.float64(v[row, column])
            a = min(max(wu * cu + wv * cv - zero, 0.0), 1.0)
            a = a if abs(du * cv - dv * cu - tint) < other else 0.0
            line += a
            line_x += a * (column - x0)
        area += line
        sum_x += line_x
        sum_y += line * (row - y0)
    if not track.area < SOFT_RATIO * area or not area < SOFT_RATIO * track.area:
        return False
    # A band is placed on its axis: by the sag of the last frame.
    fitted.x, fitted.y, fitted.area = x0 + sum_x / area - track.sag_x, y0 + sum_y / area - track.sag_y, area
    return True


@njit(**c.FAST)
def _outline(image, track, outline, noise, work):
    """Fit the outline about the soft centroid; False when the marker is not as plainly in view as it was."""
    fitted, radius = work.fitted[0], outline.radius
    growth = math.exp(0.5 * track.growth)
    for j in range(c.NODES + 1):
        radius[j] *= growth
    x, y, before_u, before_v = fitted.x, fitted.y, outline.paint_u, outline.paint_v
    contrast = math.hypot(before_u - outline.around_u, before_v - outline.around_v)
    return (fit(image, x, y, outline, np.int64(1), work)
            and math.hypot(outline.paint_u - before_u, outline.paint_v - before_v) < LEVEL_OFF * contrast
            and math.hypot(fitted.x - x, fitted.y - y) < AWAY_MOST
            and fitted.dent < DENT_MOST
            and track.area < AREA_RATIO * fitted.area and fitted.area < AREA_RATIO * track.area
            and _misfit_is_noise(outline, fitted, noise)
            and _axes_hold(outline, fitted))


@njit(**c.FAST)
def _misfit_is_noise(outline, fitted, noise):
    return fitted.misfit < math.hypot(MISFIT_NOISE * outline.gain * noise, MISFIT_MOST)


@njit(**c.FAST)
def _axes_hold(outline, fitted):
    """Whether an elongated marker still lies along the axes that its outline is written in."""
    half = 0.5 * (fitted.m_xx + fitted.m_yy)
    spread = math.hypot(0.5 * (fitted.m_xx - fitted.m_yy), fitted.m_xy)
    aspect2 = (half + spread) / max(half - spread, 1e-9)
    own2 = (outline.long / outline.high) ** 2
    if aspect2 > (ELONGATED * ELONGATED) ** 2 * own2:
        return False
    if own2 < ELONGATED * ELONGATED:
        return True
    angle = 0.5 * math.atan2(2.0 * fitted.m_xy, fitted.m_xx - fitted.m_yy)
    turned = math.sin(angle) * outline.axis_x - math.cos(angle) * outline.axis_y
    return abs(turned) < TURN_MOST and own2 < (ELONGATED * ELONGATED) ** 2 * aspect2


@njit(**c.FAST)
def _state(track, fitted, outline, noise, report):
    """Report what was fitted, and take it into the track."""
    moments = fitted.m_xx, fitted.m_xy, fitted.m_yy
    extent = length_of(t.principal(moments)[0])
    bias = math.hypot(t.hidden_bias(fitted.area / track.area, max(extent, track.extent), fitted.area, t.SHARP),
                      t.smear_bias(outline.blur))
    bias = math.hypot(bias, outline.off_axis * extent)
    level = track.level * fitted.level
    varied = (outline.w_u ** 2 * outline.c_uu + 2.0 * outline.w_u * outline.w_v * outline.c_uv
              + outline.w_v ** 2 * outline.c_vv - (outline.gain * noise) ** 2)
    floor = t.OUTLINE_FLOOR_VARIANCE + t.AROUND_VARIANCE * max(varied, 0.0)
    if outline.rims == 0.0:
        bright = 1.0 / outline.inside
        limb_x, limb_y, limb = t.outline_limb_shift(bright * outline.slope_x, bright * outline.slope_y, fitted.area)
        fitted.x -= track.limb_taken * limb_x
        fitted.y -= track.limb_taken * limb_y
        bias = math.hypot(bias, track.limb_left * limb)
    t.state(fitted, floor, bias, level, noise, report)
    cover = t.cover_of(track, fitted, moments)
    t.widen_covered(cover, report)
    if outline.rims > 0.0:
        t.widen_band(outline.axis_x, outline.axis_y, extent, report)
    t.take(track, fitted, cover, level, False)


# -- start of fast tracking --------------------------------------------------------------------------------------------

ARC_VARIANCE = 2.0 / 3.0 - ARC * ARC  # of sqrt(1 - u^2) over -1..1
START_AWAY = 0.35
"""Chroma px that outline and careful measurement may differ by. Where they differ by more, a marker would jump whenever
it changes lanes: so does a real cube's green face, beside the cyan one (TriFinger, `tests/detect`)."""


@njit(**c.FAST)
def start(image, tracks, outlines, slot, measured, noises, work):
    """Begin to follow a track that was `measured` (1,) in plain view in this picture; makes its outline ready, and
    returns True, when that is found."""
    track, outline, place, fitted = tracks[slot], outlines[slot], measured[0], work.fitted[0]
    outline.ready, noise = 0.0, noise_level(noises)
    rims = track.band > 0.0 and place.fit > 0.0
    if track.band > 0.0 and track.fitted > 0.0 and not rims:
        return False  # its rims have been visible and are now occluded
    if place.area < t.SMALL_AREA:
        return False
    outline.rims = 1.0 if rims else 0.0
    outline.off_axis = t.OFF_AXIS_SD if track.band > 0.0 and not rims and place.round == 0.0 else 0.0
    outline.axis_x, outline.axis_y = place.axis_x, place.axis_y
    outline.sag_variance, outline.sag = place.sag_variance, 0.0
    long2, high2 = max(place.var_major - c.BLUR_VARIANCE, 0.5), max(place.var_minor - c.BLUR_VARIANCE, 0.5)
    away = ARC * place.sag
    if not _levels(image, place.x - away * place.axis_y, place.y + away * place.axis_x, 2.0 * math.sqrt(long2),
                   2.0 * math.sqrt(high2), outline):
        return False
    outline.bend, outline.width = place.sag, 0.5 * length_of(long2) if rims else 0.0
    _first_radii(outline, long2, max(high2 - ARC_VARIANCE * place.sag * place.sag, 0.5))
    x, y = place.x, place.y
    for _ in range(3):
        project(outline)
        if not outline.gain * noise < NOISE_MOST or not fit(image, x, y, outline, np.int64(2), work):
            return False
        x, y = fitted.x, fitted.y
    outline.sag_frames = outline.sag_zero = 0.0
    found = (_misfit_is_noise(outline, fitted, noise)
             and fitted.area < AREA_RATIO * place.area and place.area < AREA_RATIO * fitted.area
             and math.hypot(x - place.x, y - place.y) < START_AWAY)
    outline.ready = 1.0 if found else 0.0
    return found


@njit(**c.FAST)
def _first_radii(outline, long2, high2):
    """Begin with an ellipse, or with a band's rectangle, of these second moments."""
    radius, aspect = outline.radius, math.sqrt(long2 / high2)
    variance = math.sqrt(long2 * high2)
    side = 0.5 * length_of(variance) if outline.rims > 0.0 else 2.0 * math.sqrt(variance)
    outline.long = outline.high = 1.0
    if aspect > ELONGATED:
        outline.long, outline.high = math.sqrt(aspect), 1.0 / math.sqrt(aspect)
        aspect = 1.0
    for j in range(c.NODES):
        cosine, sine = c.COSINES[j], c.SINES[j]
        if outline.rims > 0.0:
            radius[j] = side / max(abs(cosine), abs(sine))
        else:
            radius[j] = side / math.sqrt(cosine * cosine / aspect + sine * sine * aspect)
    radius[c.NODES] = radius[0]
    outline.rim[:] = 0.0
    outline.slope_x = outline.slope_y = outline.age = 0.0
    outline.blur = math.sqrt(c.BLUR_VARIANCE)


@njit(**c.FAST)
def _levels(image, x, y_at, long, high, outline):
    """Mean chroma of the inner half of the marker, and mean and covariance around it, by ellipses of these half axes
    and such that lie RING_NEAR and RING_FAR outside."""
    u, v, ax, ay = image.u, image.v, outline.axis_x, outline.axis_y
    reach = math.ceil(long + c.RING_FAR) + 1
    x0, x1 = max(int(x) - reach, 0), min(int(x) + reach + 1, u.shape[1] - 1)
    y0, y1 = max(int(y_at) - reach, 0), min(int(y_at) + reach + 1, u.shape[0] - 1)
    n = s_u = s_v = r_n = r_u = r_v = r_uu = r_uv = r_vv = 0.0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            dx, dy = column - x, row - y_at
            long_way, high_way = dx * ax + dy * ay, dy * ax - dx * ay
            cu, cv = u[row, column] - GREY, v[row, column] - GREY
            if (long_way / long) ** 2 + (high_way / high) ** 2 < 0.5:
                n += 1.0
                s_u += cu
                s_v += cv
            elif (long_way / (long + c.RING_NEAR)) ** 2 + (high_way / (high + c.RING_NEAR)) ** 2 > 1.0 and (
                    (long_way / (long + c.RING_FAR)) ** 2 + (high_way / (high + c.RING_FAR)) ** 2 < 1.0):
                r_n += 1.0
                r_u += cu
                r_v += cv
                r_uu += cu * cu
                r_uv += cu * cv
                r_vv += cv * cv
    if n < PIXELS_LEAST or r_n < c.NODES:
        return False
    m_u, m_v = r_u / r_n, r_v / r_n
    outline.paint_u, outline.paint_v = GREY + s_u / n, GREY + s_v / n
    outline.around_u, outline.around_v = GREY + m_u, GREY + m_v
    outline.c_uu, outline.c_uv, outline.c_vv = r_uu / r_n - m_u * m_u, r_uv / r_n - m_u * m_v, r_vv / r_n - m_v * m_v
    return True
