"""The track of one marker: what the last frames say about where it is, how big it is and how it looks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.band import ARC, length_of
from rhot_node.detect.image import EVEN, table_of
from rhot_node.detect.outline_pixels import BLUR_VARIANCE
from rhot_node.markers import Shape
from rhot_node.wire.messages import MarkerFlag

# -- reported covariance and quality -----------------------------------------------------------------------------------
# A covariance holds what the picture itself tells: the noise, carried through the estimate; how steeply the paint is
# shaded, because a round body darkens towards its limb as no slope can follow; how far the edge is smeared by motion;
# what surrounds the marker; and how far its area is from what was expected.
#
# Lengths are chroma pixels, but for what is written out (luma pixels).

NOISE_INFLATION = 1.2  # paint and surroundings are themselves means of few noisy pixels
FLOOR_VARIANCE = 4e-4  # luma px^2: sampling leaves about 0.02 px
OUTLINE_FLOOR_VARIANCE = 1.5e-4  # luma px^2: of a fitted outline
AROUND_VARIANCE = 0.09  # luma px^2 per squared contrast that the surroundings vary by: they may do so right beside it
BAND_ACROSS_VARIANCE, BAND_ALONG_VARIANCE = 2e-3, 5e-3  # luma px^2: shade looks like a bend of the band's rims
BAND_ALONG = 0.0018  # of the band's breadth: perspective, wrists that are no circles
SMALL_AREA, SMALL_VARIANCE = 22.0, 0.01  # px^2, luma px^2: too few inner pixels to see the shading

# Share of the paint's brightness that changes over a radius, times this, is how far the limb's shade draws the place of
# a round body to its dark side: measured on capsules and spheres under Lambert's law. A fitted outline learns most of
# it, the more the larger the marker is: of the outline, this is divided by the square root of the radius.
LIMB_COVERAGE, LIMB_OUTLINE = 0.34, 0.33
LIMB_ROUND = 0.8, 0.5
LIMB_OF_SHAPE = {"disc": (0.0, 0.0), "blob": (0.0, 1.0),
                 "sphere": LIMB_ROUND, "capsule": LIMB_ROUND, "band": LIMB_ROUND}
"""Share of that shift that is taken off, and share that remains as a standard deviation (other lights and curvatures).
A disc is flat; a blob may be either, and is left where it is seen."""
OFF_AXIS_SD = 0.3
"""Standard deviation of the centroid of a band about its axis, as a share of its extent, when no rims are visible and
it is not round."""
LIMB_SHADE = 0.2  # share of brightness per radius: with less, as by a lamp beside the camera, as much remains
SHARP = 0.48  # px: what lens and 2x2 mean leave of an edge (`edge_width`)
LIMB_LOST = 0.6  # px more, at which an edge is so wide that the limb no longer shows
SMEAR_BIAS = 0.145  # px of bias per px^2 that the squared edge width exceeds the sharp one's
STEADY_AREA = 0.04  # relative change against the expectation beyond which the covariance covers what hiding,
# uncovering or joining that much would do
SMEAR_AREA = 3.0  # more of such change per px of smear and of the square root of the area


@njit(cache=True)
def mask_variance(area):
    """Variance, luma px^2 per axis, of the centroid of a disc of `area` chroma px^2 whose edge is rounded to pixels.

    Each of the edge's 2 pi r pixels is wrong by a uniformly distributed share, with a variance of 1/12 px^2.
    """
    return 2.0 * 2.0 * EVEN / math.sqrt(math.pi * area)


@njit(cache=True)
def edge_width(soft, area, major, minor):
    """Standard deviation of the blur at a marker's edge: for a blurred step the sum of a (1 - a) over the pixels,
    here `soft` times the area, is the outline's length times this / sqrt(pi). `major`, `minor`: second moments."""
    a, b = 2.0 * math.sqrt(major), 2.0 * math.sqrt(minor)
    around = math.pi * math.sqrt(2.0 * (a * a + b * b))
    return math.sqrt(math.pi) * soft * area / max(around, 1.0)


@njit(cache=True)
def limb_shift(slope_x, slope_y, area):
    """(x, y, scale): how far the shade of a round body draws the centroid of its coverage, as long as its edge is
    sharp; and how far at least some light may do so.

    `slope_x`, `slope_y`: of the paint's brightness, of itself per px.
    """
    radius = math.sqrt(area / math.pi)
    return (-LIMB_COVERAGE * radius * slope_x, -LIMB_COVERAGE * radius * slope_y,
            LIMB_COVERAGE * max(radius * math.hypot(slope_x, slope_y), LIMB_SHADE))


@njit(cache=True)
def limb_shows(width):
    """0..1: how much of that an edge of this width lets through."""
    return min(max(1.0 - (width - SHARP) / LIMB_LOST, 0.0), 1.0)


@njit(cache=True)
def outline_limb_shift(slope_x, slope_y, area):
    """(x, y, scale) as of `limb_shift`, of the centroid of a fitted outline."""
    x, y, scale = limb_shift(slope_x, slope_y, area)
    share = LIMB_OUTLINE / LIMB_COVERAGE / math.sqrt(math.sqrt(area / math.pi))
    return share * x, share * y, share * scale


@njit(cache=True)
def smear_bias(width):
    """Standard deviation of how far an edge of this width, smeared by motion, may have drawn the centroid."""
    return SMEAR_BIAS * max(width * width - SHARP * SHARP, 0.0)


@njit(cache=True)
def hidden_bias(ratio, whole, area, width):
    """Standard deviation of how far hiding or uncovering may have drawn the centroid of a marker.

    `ratio`: of its `area` to what was expected; `whole`: its length; `width`: its edge's, which smears the area too.
    """
    change = 1.0 - min(ratio, 1.0 / ratio) - SMEAR_AREA * max(width - SHARP, 0.0) / math.sqrt(area)
    return 0.5 * change * whole if change > STEADY_AREA else 0.0


class Report(NamedTuple):
    """What is reported of a marker, luma px. `done`: whether it was followed in the last frame."""

    x: float
    y: float
    diameter: float
    cov_xx: float
    cov_xy: float
    cov_yy: float
    quality: float
    done: float


@njit(cache=True)
def state(place, floor, bias, level, noise, report):
    """Write x, y, diameter, covariance and quality of a measured place (a record of chroma px, whose covariance is per
    unit variance of the noise) to a `Report`. `floor`, luma px^2, is what is added to it."""
    scale = NOISE_INFLATION * (2.0 * noise) ** 2
    if place.area < SMALL_AREA:
        floor += SMALL_VARIANCE
    widened = floor + (2.0 * bias) ** 2
    report.x, report.y = 2.0 * place.x + 0.5, 2.0 * place.y + 0.5  # a chroma pixel is the mean of 2x2 of luma
    report.diameter = 2.0 * 2.0 * math.sqrt(place.area / math.pi)
    report.cov_xx, report.cov_xy = scale * place.v_xx + widened, scale * place.v_xy
    report.cov_yy = scale * place.v_yy + widened
    report.quality = min(1.0, level / (15.0 * noise))


@njit(cache=True)
def widen_band(axis_x, axis_y, breadth, report):
    """Add to the covariance of a report what shade and shape do to a band whose breadth lies along the axis (a unit
    vector)."""
    more = BAND_ALONG_VARIANCE - BAND_ACROSS_VARIANCE + (2.0 * BAND_ALONG * breadth) ** 2
    report.cov_xx += BAND_ACROSS_VARIANCE + more * axis_y * axis_y
    report.cov_xy -= more * axis_x * axis_y
    report.cov_yy += BAND_ACROSS_VARIANCE + more * axis_x * axis_x


# -- track of one marker -----------------------------------------------------------------------------------------------

MEMORY_FRAMES = 40  # for which a lost marker's size and velocity are kept
VELOCITY_GAIN = 0.7
AREA_GAIN = 0.4  # per frame, of the expected log area and of its trend
COVERED = 0.5  # of a cover's shift of the centroid: midway to a turn, which does not shift it, so neither is favoured
GROWTH_MAX = 0.1  # of log area per frame: 2 m/s of approach at 1 m, at 40 frames/s
PARTIAL_AREA = 0.82  # of the expected area: less is half hidden
BROKEN_AREA = 0.93  # of the expected area: a band with less whose rims no longer fit is half hidden
HIDDEN_DECAY = 0.99  # per frame, of the expected area: what looks hidden for long is that small
SLIVER_AREA = 0.15  # of the expected area: too little to be believed without the gate of a search
JUMP_AREA = 1.35  # of the expected area: something else joined the marker
RIVAL_MARGIN = 4.0  # squared standard deviations that a second blob must be worse by
SAG_STALE = 0.5  # of a band's last sag: what it may be off by
MARGIN = 4.0  # chroma px around a resting marker
AWAY = 0.2  # of its length: standard deviation of its predicted place, beside a pixel and half a frame's way
PARTIAL, EDGE, AMBIGUOUS = int(MarkerFlag.PARTIAL), int(MarkerFlag.EDGE), int(MarkerFlag.AMBIGUOUS)


class Track(NamedTuple):
    """Chroma px, and px per frame, of the whole marker, also while something hides a part of it (`Cover`).

    `area`: expected in the next frame; `growth`: trend of its logarithm per frame, by approach. `m_xx`, `m_xy`, `m_yy`:
    second moments, without blur; `extent`: the longest length. `fitted`: a band's curvature is known; `sag_x`, `sag_y`:
    from its centre to its centroid. `missed`: frames since the last observation. `limb_taken`, `limb_left`:
    LIMB_OF_SHAPE; `band`: whether its marker is one."""

    x: float = 0.0
    y: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    area: float = 0.0
    growth: float = 0.0
    extent: float = 0.0
    m_xx: float = 0.0
    m_xy: float = 0.0
    m_yy: float = 0.0
    level: float = 0.0
    fitted: float = 0.0
    sag_x: float = 0.0
    sag_y: float = 0.0
    alive: float = 0.0
    missed: float = MEMORY_FRAMES
    limb_taken: float = 0.0
    limb_left: float = 0.0
    band: float = 0.0


class Cover(NamedTuple):
    """Second moments xx, xy, yy of the whole marker, px^2; growth of its log area by approach; and how far a cover has
    moved the centroid of what is visible, px, 0 without one."""

    moments: tuple[float, float, float]
    growth: float
    x: float
    y: float


class Request(NamedTuple):
    """Where a marker is expected, its standard deviation, half the window, and how large and saturated it was; chroma
    px and grey levels."""

    x: float
    y: float
    half_x: float
    half_y: float
    sigma: float
    area: float
    level: float
    band: float


def new_tracks(shapes: Sequence[Shape]) -> NDArray[np.void]:
    """(S,) tracks of which nothing is known."""
    return np.array([Track(limb_taken=LIMB_OF_SHAPE[shape][0], limb_left=LIMB_OF_SHAPE[shape][1],
                           band=shape == "band") for shape in shapes], table_of(Track))


@njit(cache=True)
def half_window(extent, speed):
    """Half the side of the window in which a marker of this length and speed is measured, px."""
    return 0.5 * (extent + speed) + MARGIN


@njit(cache=True)
def expect(tracks, slot, recall, request):
    """Fill the `request` (1,) for the next frame: constant velocity, with a margin that grows with speed and size.
    `recall`: for the very frame that was observed last."""
    track, out = tracks[slot], request[0]
    speed = math.hypot(track.vx, track.vy)
    ahead = 0.0 if recall else 1.0
    out.x, out.y = track.x + ahead * track.vx + track.sag_x, track.y + ahead * track.vy + track.sag_y
    out.half_x = out.half_y = half_window(track.extent, speed)
    out.sigma = 1.0 + AWAY * track.extent + 0.5 * speed
    out.area, out.level, out.band = track.area, track.level, track.band


@njit(cache=True)
def is_outside(tracks, slot, measured):
    """Whether what was `measured` (1,) may be specks that lie where the marker was, so that a search should decide."""
    return measured[0].area < SLIVER_AREA * tracks[slot].area


@njit(cache=True)
def observe(tracks, slot, measured, noise, flags, reports):
    """Judge what was `measured` (1,) by the last frames, take it into the track, and report it. Returns the flags.

    `noise`: standard deviation of the chroma noise, grey levels. `flags`: bits of MarkerFlag.
    """
    track, row, report = tracks[slot], measured[0], reports[slot]
    known = track.missed < MEMORY_FRAMES and track.area > 0.0
    ratio = row.area / track.area if known else 1.0
    extent = length_of(row.var_major)
    flags |= _judge(track, row, ratio, known)
    width = edge_width(row.soft, row.area, row.var_major, row.var_minor)
    limb_x, limb_y, limb = limb_shift(row.slope_x, row.slope_y, row.area)
    taken, x, y = track.limb_taken * limb_shows(width), row.x, row.y
    row.x, row.y = row.x - taken * limb_x, row.y - taken * limb_y
    bias = math.hypot(_plausible_bias(track, row, ratio, width, flags), math.hypot(smear_bias(width),
                                                                                   track.limb_left * limb))
    if track.band > 0.0 and row.fit == 0.0 and (track.fitted > 0.0 or row.round == 0.0):
        row.x, row.y = row.x - track.sag_x, row.y - track.sag_y
        off_axis = SAG_STALE * math.hypot(track.sag_x, track.sag_y) if track.fitted > 0.0 else OFF_AXIS_SD * extent
        bias = math.hypot(bias, off_axis)
    if not known:
        track.vx = track.vy = track.area = track.growth = track.fitted = track.sag_x = track.sag_y = 0.0
    cover = cover_of(track, row, _moments(row))
    take(track, row, cover, row.level, flags & (PARTIAL | EDGE) and ratio < 1.0)
    floor = FLOOR_VARIANCE if row.careful > 0.0 else mask_variance(row.area)
    state(row, floor, bias, row.level, noise, report)
    widen_covered(cover, report)
    if row.fit > 0.0:
        sag = ARC * row.sag
        track.fitted, track.sag_x, track.sag_y = 1.0, -row.axis_y * sag, row.axis_x * sag
        widen_band(row.axis_x, row.axis_y, extent, report)
    row.x, row.y = x, y  # as they were measured
    if flags & (PARTIAL | EDGE | AMBIGUOUS):
        report.quality *= 0.5
    return flags


@njit(cache=True)
def _judge(track, row, ratio, known):
    flags = 0
    if row.at_border > 0.0:
        flags |= EDGE
    broken = track.band > 0.0 and track.fitted > 0.0 and row.fit == 0.0
    if ratio < PARTIAL_AREA or row.fragments > 1.0 or (broken and ratio < BROKEN_AREA):
        flags |= PARTIAL
    if row.rival_cost < row.cost + RIVAL_MARGIN or (known and ratio > JUMP_AREA):
        flags |= AMBIGUOUS
    return flags


@njit(cache=True)
def _plausible_bias(track, row, ratio, width, flags):
    """Standard deviation, chroma px, of how far what is hidden or mistaken may have drawn the centroid."""
    whole = max(length_of(row.var_major), track.extent)
    if row.fit > 0.0 and not flags & PARTIAL:  # a band's rims are those of a whole one
        bias = hidden_bias(math.sqrt(ratio), length_of(row.var_minor), row.area, width)
    else:
        bias = hidden_bias(ratio, whole, row.area, width)
    if flags & PARTIAL:
        bias = max(bias, 0.05 * whole)
    if flags & (EDGE | AMBIGUOUS):  # it may lie anywhere along the marker
        bias = max(bias, math.sqrt(EVEN) * whole)
    return bias


@njit(cache=True)
def _moments(row):
    """xx, xy and yy of what was measured, less the blur that coverage has, as of a fitted outline."""
    blur = BLUR_VARIANCE if row.careful > 0.0 else 0.0
    major, minor = max(row.var_major - blur, EVEN), max(row.var_minor - blur, EVEN)
    ax, ay = row.axis_x, row.axis_y
    return (major * ax * ax + minor * ay * ay, (major - minor) * ax * ay, major * ay * ay + minor * ax * ax)


@njit(cache=True)
def principal(moments):
    """Variances along the major and the minor axis, of second moments xx, xy, yy."""
    xx, xy, yy = moments
    half, spread = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
    return half + spread, half - spread


@njit(cache=True)
def _change(before, now):
    """(growth, x, y): how the second moments of a marker have changed, by approach and by a cover.

    Approach scales both principal lengths alike: `growth`, of the log area, is twice the lesser of theirs. A cover
    takes a share of the area from one side, and so shortens one direction alone. That is the u of the least l in

        M u = l W u;  share = 1 - sqrt(|M| / |W|) / exp(growth);  (x, y) = share sqrt(3) W u / sqrt(u'W u)

    with W, M the moments before and now. (x, y), or its opposite, is how far the centroid of what stays has moved:
    exactly, for a rectangle that is cut along a side.
    """
    major, minor = principal(before)
    long, short = principal(now)
    if not min(minor, short) > 0.0:
        return 0.0, 0.0, 0.0
    along, across = math.log(long / major), math.log(short / minor)
    growth = 0.0
    if along * across > 0.0:
        growth = along if abs(along) < abs(across) else across
    share = 1.0 - math.exp(0.5 * (along + across) - growth)
    w_xx, w_xy, w_yy = before
    xx, xy, yy = now
    whole = major * minor
    half = 0.5 * (xx * w_yy - 2.0 * xy * w_xy + yy * w_xx) / whole
    least = half - math.sqrt(max(half * half - long * short / whole, 0.0))
    a, b, c = xx - least * w_xx, xy - least * w_xy, yy - least * w_yy
    u_x, u_y = (-b, a) if abs(a) > abs(c) else (c, -b)
    v_x, v_y = w_xx * u_x + w_xy * u_y, w_xy * u_x + w_yy * u_y
    square = u_x * v_x + u_y * v_y
    if not (share > 0.0 and square > 0.0):
        return growth, 0.0, 0.0
    scale = share * math.sqrt(3.0 / square)
    return growth, scale * v_x, scale * v_y


@njit(cache=True)
def cover_of(track, place, moments):
    """What the change of a marker's moments (xx, xy, yy, without blur) says: a `Cover`.

    A marker that turns away and one that is covered both lose area in one direction. They differ by their centroid: of
    the former it goes on as it moved, of the latter it is drawn from the cover by just as much as it lost. With d the
    way of the centroid off its motion, px, and s the shift that a cover of this loss makes, a cover is what has

        |d - s| < COVERED |s|

    A turn has d = 0. What is off the motion in any other way is motion that the track does not know yet, no cover.
    """
    if not track.area > 0.0:
        return Cover(moments, 0.0, 0.0, 0.0)
    before, gap = (track.m_xx, track.m_xy, track.m_yy), track.missed + 1.0
    growth, shift_x, shift_y = _change(before, moments)
    dx, dy = place.x - track.x - gap * track.vx, place.y - track.y - gap * track.vy
    if dx * shift_x + dy * shift_y < 0.0:
        shift_x, shift_y = -shift_x, -shift_y
    off = math.hypot(dx - shift_x, dy - shift_y)
    if track.alive > 0.0 and off < COVERED * math.hypot(shift_x, shift_y):
        grown = math.exp(growth)
        return Cover((grown * before[0], grown * before[1], grown * before[2]), growth, shift_x, shift_y)
    return Cover(moments, growth, 0.0, 0.0)


@njit(cache=True)
def widen_covered(cover, report):
    """Add to the covariance of a report, luma px, how far a cover has moved the centroid."""
    x, y = 2.0 * cover.x, 2.0 * cover.y
    report.cov_xx += x * x
    report.cov_xy += x * y
    report.cov_yy += y * y


@njit(cache=True)
def take(track, place, cover, level, hidden):
    """Take a measured place into a track: motion, and, unless something hides a part, size and its trend.

    What is covered keeps its size, and the centre that it has with that. A track whose area is 0 knows nothing yet.
    """
    gap = track.missed + 1.0
    covered = cover.x != 0.0 or cover.y != 0.0
    x, y = place.x - cover.x, place.y - cover.y
    if not track.area > 0.0:
        track.area = place.area
    else:
        gain = VELOCITY_GAIN if track.alive > 0.0 else 1.0
        track.vx += gain * ((x - track.x) / gap - track.vx)
        track.vy += gain * ((y - track.y) / gap - track.vy)
        if hidden:
            track.area *= HIDDEN_DECAY
            track.growth = 0.0
        else:
            track.growth += AREA_GAIN * (min(max(cover.growth / gap, -GROWTH_MAX), GROWTH_MAX) - track.growth)
            if not covered:
                track.area *= (place.area / track.area) ** AREA_GAIN
            track.area *= math.exp(track.growth)
    if not hidden or track.extent == 0.0:
        track.m_xx, track.m_xy, track.m_yy = cover.moments
        track.extent = length_of(principal(cover.moments)[0])
    track.x, track.y, track.level = x, y, level
    track.alive, track.missed = 1.0, 0.0
