"""The quick lane: markers in plain view, followed from frame to frame in one call of compiled code.

A marker's window is predicted at constant velocity. The projection of its chroma, whose levels come from the last frame
as the camera shows it (so that no light has to be mended), gives a soft centroid; about that the outline of the last
frame is fitted anew (`contour`). Whatever is not as plain as it was - area, level, outline, misfit, the frame's border,
a rival in the window - sends the marker back to the careful measurement (`measure`), which also brings it here
(`rhot_node.detect.tracks.followed`).

All coordinates are chroma pixels.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot_node.detect.tracks import contour_pixels as c
from rhot_node.detect.tracks import track as t
from rhot_node.detect.tracks.contour import fit
from rhot_node.detect.tracks.contour_pixels import project

# -- axis of a band ----------------------------------------------------------------------------------------------------
# All coordinates are chroma pixels.

# The wrist band's sag (`position.band_center`): a measured value within so many standard deviations of the last one is
# taken in with this gain, any other as it is.
SAG_GAIN, SAG_STEADY = 0.25, 5.0
SAG_MOST = 0.3  # of half the band's length: what the sag may change before the outline is straightened anew
SAG_SETTLE, SAG_JUMP = 4.0, 0.35  # frames that say what is no sag; px that it may jump in them
GAUSS_AT = 0.5 + 0.5 * np.polynomial.legendre.leggauss(4)[0]
GAUSS_WEIGHT = 0.5 * np.polynomial.legendre.leggauss(4)[1]

# Columns of `marks`: how a marker is followed.
# LIMB_TAKEN, LIMB_LEFT: `stated.LIMB_OF_SHAPE`. IS_BAND: a band with visible rims, which give a point on its axis.
# OFF_AXIS: of a band without visible rims, the standard deviation of its centroid about its axis, as a share of its
# extent.
READY, IS_BAND, SAG, SAG_VARIANCE, SAG_ZERO, SAG_FRAMES, LIMB_TAKEN, LIMB_LEFT, OFF_AXIS = range(9)
MARK_COLUMNS = 9


@njit(**c.FAST)
def mend_band(look, radius, mark, noise, fitted, track):
    """Place a band on its axis: by what its sag, smoothed, differs from that which its outline is straightened by.

    The corners, which the outline rounds, look like a bend of their own: that is what the first frames measure, and it
    is taken off. False when the sag differs too much.
    """
    half = 0.5 * (fitted[c.M_XX] + fitted[c.M_YY])
    spread = math.hypot(0.5 * (fitted[c.M_XX] - fitted[c.M_YY]), fitted[c.M_XY])
    ax, ay = look[c.AXIS_X], look[c.AXIS_Y]
    measured = sag_of(radius, look)
    mark[SAG_FRAMES] += 1.0
    if mark[SAG_FRAMES] <= SAG_SETTLE:
        if mark[SAG_FRAMES] > 1.0 and abs(measured - mark[SAG_ZERO]) > SAG_JUMP:
            return False
        mark[SAG_ZERO] += (measured - mark[SAG_ZERO]) / mark[SAG_FRAMES]
    away = measured - mark[SAG_ZERO] - mark[SAG]
    steady = SAG_STEADY * noise * math.sqrt(mark[SAG_VARIANCE])
    if mark[SAG_FRAMES] > SAG_SETTLE:
        mark[SAG] += (SAG_GAIN if abs(away) < steady else 1.0) * away
    rest = 0.25 * math.pi * mark[SAG]
    sag = 0.25 * math.pi * (look[c.BEND] + mark[SAG])
    fitted[c.X] += ay * rest
    fitted[c.Y] -= ax * rest
    track[t.SAG_X], track[t.SAG_Y] = -ay * sag, ax * sag
    # (pi / 4)^2 of the smoothed sag's, and of that which was there at first, which no later frame tells anew.
    along = 0.6 * mark[SAG_VARIANCE] * (1.0 + 1.0 / SAG_SETTLE + SAG_GAIN)
    fitted[c.V_XX] += ay * ay * along
    fitted[c.V_XY] -= ax * ay * along
    fitted[c.V_YY] += ax * ax * along
    return abs(mark[SAG]) < SAG_MOST * math.sqrt(max(3.0 * (half - spread), 0.0))


@njit(**c.FAST)
def sag_of(radius, look):
    """s of `position.band_center`, of the area inside the outline, which is straightened already: what is left of it.

    Least squares of the axial coordinate on (1, u, sqrt(1 - u^2)), by angle and, with Gauss's points, by radius.
    """
    to_u = look[c.LONG] / look[c.WIDTH]
    n = n_u = n_b = uu = ub = bb = s_v = uv = bv = 0.0
    for j in range(c.NODES):
        for half in range(2):
            r = radius[j] + 0.5 * half * (radius[j + 1] - radius[j])
            cosine, sine = c.COSINES[j], c.SINES[j]
            if half == 1:
                cosine, sine = c.HALF_COSINES[j], c.HALF_SINES[j]
            for k in range(4):
                rho = r * GAUSS_AT[k]
                weight = GAUSS_WEIGHT[k] * rho * r
                across, along = to_u * rho * cosine, look[c.HIGH] * rho * sine
                arc = math.sqrt(max(1.0 - across * across, 0.0))
                n += weight
                n_u += weight * across
                n_b += weight * arc
                uu += weight * across * across
                ub += weight * across * arc
                bb += weight * arc * arc
                s_v += weight * along
                uv += weight * across * along
                bv += weight * arc * along
    uu, ub, bb = uu - n_u * n_u / n, ub - n_u * n_b / n, bb - n_b * n_b / n
    uv, bv = uv - n_u * s_v / n, bv - n_b * s_v / n
    return (uu * bv - ub * uv) / (uu * bb - ub * ub)


# -- tracking of unobstructed markers ----------------------------------------------------------------------------------

AREA_LEAST = 22.0  # px^2: a smaller marker has too little inside
NOISE_MOST = 0.12  # of the contrast
SOFT_LOW, SOFT_HIGH = 0.25, 0.75  # projected chroma that counts not at all, and as paint
OTHER_HUE = 0.4  # of the contrast: what lies further beside the line from surroundings to paint is another paint
SOFT_RATIO = 1.35  # of the expected area: what the soft area may be off, both ways
AREA_RATIO = 1.10  # and the outline's
LEVEL_OFF = 0.10  # of the paint's level from one frame to the next: another light, or another paint
AWAY_MOST = 0.8  # px from the soft centroid to the outline's
DENT_MOST = 0.45  # px that a radius may move against the others in a frame
MISFIT_NOISE, MISFIT_MOST = 2.0, 0.10  # standard deviations of the noise, and of the contrast
TURN_MOST = 0.17  # rad: an elongated marker that has turned further gets new axes
ELONGATED = 1.3
SPEED_MOST = 8.0  # px per frame: a faster marker's edges are smeared, by one side more than by the other
MARGIN = 3.0  # px around a resting marker

NOISE_MIN = 0.5  # grey levels of chroma noise; quantisation alone leaves 0.3
NOISE_BLOCKS_MOST = 600.0  # that its mean is taken over

# Columns of what is stated about a marker, luma pixels.
OUT_X, OUT_Y, OUT_DIAMETER, OUT_XX, OUT_XY, OUT_YY, OUT_QUALITY, DONE = range(8)
OUT_COLUMNS = 8


@njit(**c.FAST)
def follow(y, u, v, tracks, looks, radii, rims, marks, noise_variance, precise, pixels, work, soft, fitted, out):
    """Follow every ready marker; rows of `out` (M, OUT_COLUMNS) with DONE 1 are filled, and their tracks updated.

    `precise` False takes the soft centroid as it is. A marker whose DONE is 0 is no longer ready. Learns the
    `noise_variance` (2,). Returns how many are done.
    """
    noise = noise_level(noise_variance)
    count = 0
    for index in range(tracks.shape[0]):
        out[index, DONE] = 0.0
        if marks[index, READY] == 0.0:
            continue
        marks[index, READY] = 0.0
        track, look = tracks[index], looks[index]
        project(look)
        if not look[c.GAIN] * noise < NOISE_MOST or not _soft(u, v, track, look, soft):
            continue
        if precise:
            # The outline of a straightened band is written about its centroid.
            rest = 0.25 * math.pi * marks[index, SAG]
            soft[0] -= look[c.AXIS_Y] * rest
            soft[1] += look[c.AXIS_X] * rest
            if not _outline(y, u, v, track, look, radii[index], rims[index], noise, pixels, work, soft, fitted):
                continue
            if marks[index, IS_BAND] > 0.0 and not mend_band(look, radii[index], marks[index], noise, fitted, track):
                continue
        else:
            _take_soft(track, look, soft, fitted)
        _state(track, fitted, look, noise, marks[index], precise, out[index])
        _learn_noise_inside(u, v, fitted, noise_variance)
        marks[index, READY] = 1.0
        out[index, DONE] = 1.0
        count += 1
    return count


@njit(**c.FAST)
def noise_level(noise_variance):
    """Standard deviation of the chroma noise, grey levels."""
    return max(math.sqrt(noise_variance[0]), NOISE_MIN)


@njit(**c.FAST)
def learn_noise(noise_variance, total, count):
    """Take in the noise of `count` 2x2 blocks inside a marker's paint, a sum of variances (`coverage.chroma_noise`).

    A running mean: `noise_variance` (2,) holds it and how many blocks it is worth.
    """
    noise_variance[1] += count
    noise_variance[0] += (total - count * noise_variance[0]) / noise_variance[1]
    noise_variance[1] = min(noise_variance[1], NOISE_BLOCKS_MOST)


@njit(**c.FAST)
def _learn_noise_inside(u, v, fitted, noise_variance):
    """From the square inside the marker: mixed second differences, which cancel any linear shading."""
    half = 0.5 * (fitted[c.M_XX] + fitted[c.M_YY])
    short = half - math.hypot(0.5 * (fitted[c.M_XX] - fitted[c.M_YY]), fitted[c.M_XY])
    reach = math.sqrt(max(2.0 * short, 0.0)) - 0.7  # half a side of the square in a disc, less the edge
    x, y = fitted[c.X], fitted[c.Y]
    total = 0.0
    count = 0
    for row in range(math.ceil(y - reach), int(y + reach)):
        for column in range(math.ceil(x - reach), int(x + reach)):
            du = np.float64(u[row, column]) - u[row, column + 1] - u[row + 1, column] + u[row + 1, column + 1]
            dv = np.float64(v[row, column]) - v[row, column + 1] - v[row + 1, column] + v[row + 1, column + 1]
            total += (du * du + dv * dv) * 0.125
            count += 1
    learn_noise(noise_variance, total, count)


@njit(**c.FAST)
def _soft(u, v, track, look, soft):
    """Sum the soft coverage over the predicted window into `soft`.

    False when the frame's border may cut the outline, or the area is not as expected.
    """
    speed = math.hypot(track[t.VX], track[t.VY])
    half = 0.6 * track[t.EXTENT] + MARGIN + 0.5 * speed
    px, py = track[t.X] + track[t.VX] + track[t.SAG_X], track[t.Y] + track[t.VY] + track[t.SAG_Y]
    edge = 0.5 * track[t.EXTENT] + c.BAND + 0.5 * speed
    height, width = u.shape
    if not speed < SPEED_MOST or not min(px, py, width - 1.0 - px, height - 1.0 - py) > edge:
        return False
    x0, x1 = max(int(px - half), 0), min(int(px + half) + 1, width - 1)
    y0, y1 = max(int(py - half), 0), min(int(py + half) + 1, height - 1)
    ramp = 1.0 / (SOFT_HIGH - SOFT_LOW)
    wu, wv = look[c.W_U] * ramp, look[c.W_V] * ramp
    zero = wu * look[c.AROUND_U] + wv * look[c.AROUND_V] + SOFT_LOW * ramp
    du, dv = look[c.PAINT_U] - look[c.AROUND_U], look[c.PAINT_V] - look[c.AROUND_V]
    tint = du * look[c.AROUND_V] - dv * look[c.AROUND_U]
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
    if not track[t.AREA] < SOFT_RATIO * area or not area < SOFT_RATIO * track[t.AREA]:
        return False
    # A band is placed on its axis: by the sag of the last frame.
    soft[0], soft[1], soft[2] = x0 + sum_x / area - track[t.SAG_X], y0 + sum_y / area - track[t.SAG_Y], area
    return True


@njit(**c.FAST)
def _outline(y, u, v, track, look, radius, rim, noise, pixels, work, soft, fitted):
    """Fit the outline about the soft centroid; False when the marker is not as plainly in view as it was."""
    growth = math.exp(0.5 * track[t.RATE])
    for j in range(c.NODES + 1):
        radius[j] *= growth
    before_u, before_v = look[c.PAINT_U], look[c.PAINT_V]
    contrast = math.hypot(before_u - look[c.AROUND_U], before_v - look[c.AROUND_V])
    if not fit(y, u, v, soft[0], soft[1], look, radius, rim, np.int64(1), pixels, work, fitted):
        return False
    area = fitted[c.AREA]
    return (track[t.AREA] < AREA_RATIO * area and area < AREA_RATIO * track[t.AREA]
            and math.hypot(look[c.PAINT_U] - before_u, look[c.PAINT_V] - before_v) < LEVEL_OFF * contrast
            and math.hypot(fitted[c.X] - soft[0], fitted[c.Y] - soft[1]) < AWAY_MOST
            and fitted[c.DENT] < DENT_MOST
            and fitted[c.MISFIT] < math.hypot(MISFIT_NOISE * look[c.GAIN] * noise, MISFIT_MOST)
            and _axes_hold(look, fitted))


@njit(**c.FAST)
def _axes_hold(look, fitted):
    """Whether an elongated marker still lies along the axes that its outline is written in."""
    half = 0.5 * (fitted[c.M_XX] + fitted[c.M_YY])
    spread = math.hypot(0.5 * (fitted[c.M_XX] - fitted[c.M_YY]), fitted[c.M_XY])
    aspect2 = (half + spread) / max(half - spread, 1e-9)
    own2 = (look[c.LONG] / look[c.HIGH]) ** 2
    if aspect2 > (ELONGATED * ELONGATED) ** 2 * own2:
        return False
    if own2 < ELONGATED * ELONGATED:
        return True
    angle = 0.5 * math.atan2(2.0 * fitted[c.M_XY], fitted[c.M_XX] - fitted[c.M_YY])
    turned = math.sin(angle) * look[c.AXIS_X] - math.cos(angle) * look[c.AXIS_Y]
    return abs(turned) < TURN_MOST and own2 < (ELONGATED * ELONGATED) ** 2 * aspect2


@njit(**c.FAST)
def _take_soft(track, look, soft, fitted):
    """The soft centroid as a result: every pixel around the outline carries noise into it."""
    fitted[c.X], fitted[c.Y], fitted[c.AREA], fitted[c.LEVEL] = soft[0], soft[1], soft[2], 1.0
    spread = track[t.EXTENT] ** 2 / 12.0
    fitted[c.M_XX] = fitted[c.M_YY] = spread
    fitted[c.M_XY] = fitted[c.V_XY] = 0.0
    length = math.sqrt(4.0 * math.pi * soft[2])  # of the outline; its ramp is a pixel wide
    slope = look[c.GAIN] / (SOFT_HIGH - SOFT_LOW) / soft[2]
    fitted[c.V_XX] = fitted[c.V_YY] = length * 2.0 * spread * slope * slope


@njit(**c.FAST)
def _state(track, fitted, look, noise, mark, precise, out):
    """Write the observation and take the result into the track."""
    area = fitted[c.AREA]
    ratio = area / track[t.AREA]
    extent = math.sqrt(6.0 * (fitted[c.M_XX] + fitted[c.M_YY]
                              + math.hypot(fitted[c.M_XX] - fitted[c.M_YY], 2.0 * fitted[c.M_XY])))
    bias = math.hypot(t.hidden_bias(ratio, max(extent, track[t.EXTENT]), area, t.SHARP), t.smear_bias(look[c.BLUR]))
    bias = math.hypot(bias, mark[OFF_AXIS] * extent)
    level = track[t.LEVEL] * fitted[c.LEVEL]
    varied = (look[c.W_U] ** 2 * look[c.C_UU] + 2.0 * look[c.W_U] * look[c.W_V] * look[c.C_UV]
              + look[c.W_V] ** 2 * look[c.C_VV] - (look[c.GAIN] * noise) ** 2)
    floor = t.OUTLINE_FLOOR_VARIANCE + t.AROUND_VARIANCE * max(varied, 0.0)
    if not precise:
        floor += t.SOFT_FLOOR_VARIANCE
    elif mark[IS_BAND] == 0.0:
        bright = 1.0 / look[c.INSIDE]
        limb_x, limb_y, limb = t.outline_limb_shift(bright * look[c.SLOPE_X], bright * look[c.SLOPE_Y], area)
        fitted[c.X] -= mark[LIMB_TAKEN] * limb_x
        fitted[c.Y] -= mark[LIMB_TAKEN] * limb_y
        bias = math.hypot(bias, mark[LIMB_LEFT] * limb)
    t.luma_values(fitted[c.X], fitted[c.Y], area, fitted[c.V_XX], fitted[c.V_XY], fitted[c.V_YY], floor, bias, level,
                   noise, out)
    if mark[IS_BAND] > 0.0:
        t.widen_band(look[c.AXIS_X], look[c.AXIS_Y], extent, out)
    t.take(track, fitted[c.X], fitted[c.Y], area, extent, level, False)
