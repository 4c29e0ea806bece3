"""Edges along slices: short line segments in an image, each across an expected edge (Rehg 1995, 4.3.1).

The node knows no hands. For every slice it reports all intensity steps along it, with their places, standard
deviations, signs, and the foreground probability on both sides. The master decides which one is the hand's edge.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.foreground import Foreground, foreground_at, gain_of
from rhot_node.detect.image import MAD_SD

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

EDGES_MAX = 6
"""Edges reported of one slice, the strongest."""

SIGNIFICANT = 4.0
"""Standard deviations of the noise that a step must exceed: one false step in 10 000 samples."""

BEYOND = 6
"""px of a profile beyond its slice's ends, for the smoothing and for the sides of an edge."""

BLUR_PX = 1.5
"""px: standard deviation of the Gaussian whose derivative finds the steps (Canny 1986), as wide as lenses and
demosaicing blur them."""

FOREGROUND_STEP = 100.0
"""A step of the foreground probability from 0 to 1 counts as one of so many grey levels: skin before a dark or a bright
wall."""

SHADE_SD = 0.3
"""Of the hand's brightness: how much it varies within a finger's breadth, which is all of Lambert's law from 45 degrees
to the limb."""

SHADED_PX = 0.5
"""px: standard deviation by which shading and low contrast displace the steepest place: 0.49 px rms on the outlines of
drawn hands (`python benchmarks/bare_hand.py --only edges`, "skin")."""

_BLEND_REACH = 3  # px from the steepest place to where hand and background are half and half
_BESIDE = 0.5 * 0.5  # weight of either neighbour in a mean of three
_BLEND_SMOOTHED = math.sqrt(0.5 * 0.5 + 2.0 * _BESIDE**2)  # noise of that mean

_HALF = 4
_PLACES = np.arange(-_HALF, _HALF + 1.0)
_TAPS = np.exp(-0.5 * (_PLACES / BLUR_PX) ** 2) * _PLACES
_TAPS /= np.sum(_TAPS * _PLACES)  # answers with the slope of a ramp

_TAPS_NOISE = math.sqrt(float(np.sum(_TAPS**2)) / 2.0)  # of a profile that is a mean of about two pixels

_LEAST_SD, _MOST_SD = 0.05, 3.0  # px


class Edges(NamedTuple):
    """Edges of N slices. `number` (N,); the others (N, EDGES_MAX), the first `number` of each row are valid.

    `offset` px along the slice's normal from its centre, `sd` px; `strength` of 255 per px: positive where it gets
    brighter along the normal; `inside`, `outside`: foreground probability before and behind the edge.
    """

    number: NDArray[np.int64]
    offset: Array
    sd: Array
    strength: Array
    inside: Array
    outside: Array


def find_edges(image: Image, slices: Array, foreground: Foreground, noise: float) -> Edges:
    """The edges on `slices` (N, 5): centre x, y px, unit normal x, y, half length px. `image` (H, W, 3) RGB.

    An edge lies where it is steepest. Where the background is learnt, an edge from the hand to the background lies
    where both have half a pixel instead: shading displaces the steepest place. `noise`: standard deviation of a pixel's
    value, of 255 (`noise_of`).
    """
    n = len(slices)
    edges = Edges(np.zeros(n, np.int64), *(np.zeros((n, EDGES_MAX)) for _ in range(5)))
    if n:
        _find(image, slices, foreground, gain_of(image, foreground), noise, edges)
    return edges


def noise_of(image: Image) -> float:
    """Standard deviation of a pixel's noise, of 255: the median deviation of green from its neighbours' mean."""
    green = image[::2, :, 1].astype(np.float32)
    deviation = np.abs(green[:, 1:-1] - 0.5 * (green[:, :-2] + green[:, 2:]))
    return max(1.0, MAD_SD * float(np.median(deviation)) / math.sqrt(1.0 + 0.5))


@njit(cache=True, error_model="numpy")
def _bilinear(image, x, y):
    """The colour at (x, y), which is within the image by a pixel."""
    column, row = int(x), int(y)
    fx, fy = x - column, y - row
    a, b, c, d = (1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy
    upper, lower = image[row], image[row + 1]
    return (a * upper[column, 0] + b * upper[column + 1, 0] + c * lower[column, 0] + d * lower[column + 1, 0],
            a * upper[column, 1] + b * upper[column + 1, 1] + c * lower[column, 1] + d * lower[column + 1, 1],
            a * upper[column, 2] + b * upper[column + 1, 2] + c * lower[column, 2] + d * lower[column + 1, 2])


@njit(cache=True, error_model="numpy")
def _across(image, x, y, nx, ny):
    """The colour at (x, y), a mean over three pixels across the direction (nx, ny); NaN unless all are in the image."""
    ax, ay = abs(nx), abs(ny)
    if not (ay <= x < image.shape[1] - 1 - ay and ax <= y < image.shape[0] - 1 - ax):
        return np.nan, np.nan, np.nan
    r, g, b = _bilinear(image, x, y)
    r1, g1, b1 = _bilinear(image, x - ny, y + nx)
    r2, g2, b2 = _bilinear(image, x + ny, y - nx)
    return 0.5 * r + _BESIDE * (r1 + r2), 0.5 * g + _BESIDE * (g1 + g2), 0.5 * b + _BESIDE * (b1 + b2)


@njit(cache=True, error_model="numpy")
def _find(image, slices, foreground, gain, noise, edges):
    count, offset, spread, strength, inside, outside = edges
    noise_slope, mean = noise * _TAPS_NOISE, foreground.mean
    longest = 2 * math.ceil(slices[:, 4].max()) + 1 + 2 * BEYOND
    profile, derivative = np.empty((4, longest)), np.empty((4, longest))
    ours, slope = np.empty(longest), np.empty(longest)
    for s in range(slices.shape[0]):
        cx, cy, nx, ny = slices[s, 0], slices[s, 1], slices[s, 2], slices[s, 3]
        half = math.ceil(slices[s, 4])
        length = 2 * half + 1 + 2 * BEYOND
        first, last = length, -1  # samples within the image
        for i in range(length):
            along = i - half - BEYOND
            x, y = cx + along * nx, cy + along * ny
            r, g, b = _across(image, x, y, nx, ny)
            if math.isnan(r):
                continue
            first, last = min(first, i), i
            ours[i] = foreground_at(image, int(y + 0.5), int(x + 0.5), foreground, gain)
            profile[0, i], profile[1, i], profile[2, i], profile[3, i] = r, g, b, FOREGROUND_STEP * ours[i]
        slope[:length] = 0.0
        if last - first >= 2 * _HALF:
            _slopes(profile[:, first:last + 1], derivative[:, first + _HALF:], slope[first + _HALF:])
        found = 0
        for i in range(BEYOND, length - BEYOND):
            if slope[i] < SIGNIFICANT * noise_slope or slope[i] < slope[i - 1] or slope[i] <= slope[i + 1]:
                continue
            place = found
            if found == EDGES_MAX:  # in place of the weakest, if that is weaker
                place = 0
                for k in range(1, EDGES_MAX):
                    if abs(strength[s, k]) < abs(strength[s, place]):
                        place = k
                if abs(strength[s, place]) >= slope[i]:
                    continue
            else:
                found += 1
            bend = 2.0 * slope[i] - slope[i - 1] - slope[i + 1]
            shift = 0.5 * (slope[i + 1] - slope[i - 1]) / max(bend, 1e-9)
            offset[s, place] = i - half - BEYOND + min(max(shift, -0.5), 0.5)
            spread[s, place] = min(math.hypot(0.7 * noise_slope / max(bend, 1e-9), SHADED_PX), _MOST_SD)
            brighter = derivative[0, i] + derivative[1, i] + derivative[2, i]
            strength[s, place] = slope[i] if brighter >= 0.0 else -slope[i]
            inside[s, place] = _mean_beside(ours, i, -1, first, last)
            outside[s, place] = _mean_beside(ours, i, 1, first, last)
            if mean.shape[0] and i - 1 - _HALF >= first and inside[s, place] > 0.5 > outside[s, place]:
                along = i - half - BEYOND
                shift, sd_px = _half_hand(mean, gain, noise, profile, i, (cx + along * nx, cy + along * ny, nx, ny))
                if sd_px < SHADED_PX:
                    offset[s, place], spread[s, place] = along + shift, max(sd_px, _LEAST_SD)
        count[s] = found


@njit(cache=True, error_model="numpy")
def _slopes(profile, derivative, slope):
    """Fill the `derivative` (4, n) of a profile (4, n + 2 _HALF), and add its length to `slope` (n,)."""
    n = profile.shape[1] - 2 * _HALF
    for k in range(4):
        out = derivative[k]
        out[:n] = 0.0
        for j in range(1, _HALF + 1):  # the taps are odd
            tap, after, before = _TAPS[_HALF + j], profile[k, _HALF + j:], profile[k, _HALF - j:]
            for i in range(n):
                out[i] += tap * (after[i] - before[i])
        for i in range(n):
            slope[i] += out[i] * out[i]
    for i in range(n):
        slope[i] = math.sqrt(slope[i])


@njit(cache=True, error_model="numpy")
def _half_hand(mean, gain, noise, profile, i, at):
    """Where, px from sample `i` of the profile, hand and background have half of a pixel each, and its standard
    deviation px; infinite where there is no such place or noise hides it. `at`: x, y, px, and the unit normal's.

    A sample is a blend a f + (1 - b) g of the hand's colour f, a little inside, and of the background's g at the same
    place. The hand's part b differs from `a` by the hand's shading.
    """
    x, y, nx, ny = at
    variance, prior = 0.5 * noise * noise, 1.0 / SHADE_SD**2
    hand, ff = np.zeros(3), prior
    for k in range(3):
        hand[k] = np.mean(profile[k, i - 1 - _HALF:i - 1 - _HALF + _BLEND_REACH])
        ff += hand[k] * hand[k] / variance
    part, spread, behind = np.empty(2 * _BLEND_REACH + 4), np.empty(2 * _BLEND_REACH + 4), np.empty(3)
    for n in range(part.shape[0]):
        j = n - _BLEND_REACH - 1
        behind[0], behind[1], behind[2] = _across(mean, x + j * nx, y + j * ny, nx, ny)
        if math.isnan(behind[0]):
            return 0.0, math.inf
        fg, gg, f_side, g_side = prior, prior, 0.0, 0.0
        for k in range(3):
            colour = gain[k] * behind[k]
            above = profile[k, i + j] - colour
            fg += hand[k] * colour / variance
            gg += colour * colour / variance
            f_side += hand[k] * above / variance
            g_side -= colour * above / variance
        determinant = max(ff * gg - fg * fg, 1e-12)
        part[n] = (ff * g_side + fg * f_side) / determinant
        spread[n] = ff / determinant
    nearest, sd_px = math.inf, math.inf
    before = _BESIDE * (part[0] + part[2]) + 0.5 * part[1]
    for n in range(2, part.shape[0] - 1):
        after = _BESIDE * (part[n - 1] + part[n + 1]) + 0.5 * part[n]
        if before >= 0.5 > after:
            place = n - 2 - _BLEND_REACH + (before - 0.5) / (before - after)
            if abs(place) < abs(nearest):
                nearest = place
                sd_px = _BLEND_SMOOTHED * math.sqrt(max(spread[n - 1], spread[n])) / (before - after)
        before = after
    return nearest, sd_px


@njit(cache=True, error_model="numpy")
def _mean_beside(ours, i, direction, first, last):
    total, number = 0.0, 0
    for k in range(2, 6):
        j = i + direction * k
        if first <= j <= last:
            total += ours[j]
            number += 1
    return total / number if number else 0.5
