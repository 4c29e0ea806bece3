"""What is stated about a measured place: its covariance and quality, and where the shade of its limb has drawn it.

A covariance holds what the picture itself tells: the noise, carried through the estimate; how steeply the paint is
shaded, because a round body darkens towards its limb as no slope can follow; how far the edge is smeared by motion;
what surrounds the marker; and how far its area is from what was expected.

Lengths are chroma pixels, but for what is written out (luma pixels).
"""

from __future__ import annotations

import math

from numba import njit

NOISE_INFLATION = 1.2  # paint and surroundings are themselves means of few noisy pixels
FLOOR_VARIANCE = 4e-4  # luma px^2: sampling leaves about 0.02 px
OUTLINE_FLOOR_VARIANCE = 1.5e-4  # luma px^2: of a fitted outline
SOFT_FLOOR_VARIANCE = 0.01  # luma px^2: of a soft centroid, which shading and surroundings draw
AROUND_VARIANCE = 0.09  # luma px^2 per squared contrast that the surroundings vary by: they may do so right beside it
BAND_ACROSS_VARIANCE, BAND_ALONG_VARIANCE = 2e-3, 5e-3  # luma px^2: shade looks like a bend of the band's rims
BAND_ALONG = 0.0018  # of the band's breadth: perspective, wrists that are no circles
SMALL_AREA, SMALL_VARIANCE = 22.0, 0.01  # px^2, luma px^2: too few inner pixels to see the shading

# Share of the paint's brightness that changes over a radius, times this, is how far the limb's shade draws the place of
# a round body to its dark side: measured on capsules and spheres under Lambert's law. A fitted outline learns most of
# it, the more the larger the marker is: of the outline, this is divided by the square root of the radius.
LIMB_COVERAGE, LIMB_OUTLINE = 0.34, 0.33
LIMB_OF_SHAPE = {"disc": (0.0, 0.0), "blob": (0.0, 1.0), "sphere": (0.8, 0.5), "capsule": (0.8, 0.5),
                 "band": (0.8, 0.5)}
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


def mask_variance(area: float) -> float:
    """Variance, luma px^2 per axis, of the centroid of a disc of `area` chroma px^2 whose edge is rounded to pixels.

    Each of the edge's 2 pi r pixels is wrong by a uniformly distributed share, with a variance of 1/12 px^2.
    """
    return 4.0 / (12.0 * math.sqrt(math.pi * area))


@njit(cache=True)
def edge_width(soft, area, major, minor):
    """Standard deviation of the blur at a marker's edge: for a blurred step the sum of a (1 - a) over the pixels,
    here `soft` times the area, is the outline's length times this / sqrt(pi). `major`, `minor`: second moments."""
    a, b = 2.0 * math.sqrt(major), 2.0 * math.sqrt(minor)
    around = math.pi * (3.0 * (a + b) - math.sqrt((3.0 * a + b) * (a + 3.0 * b)))
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


@njit(cache=True)
def luma_values(x, y, area, cov_xx, cov_xy, cov_yy, floor, bias, level, noise, out):
    """Write x, y, diameter, the covariance (xx, xy, yy) and the quality of an observation, luma px.

    Given in chroma px, the covariance per unit variance of the noise; `floor`, luma px^2, is what is added to it.
    """
    scale = 4.0 * NOISE_INFLATION * noise**2
    if area < SMALL_AREA:
        floor += SMALL_VARIANCE
    widened = floor + 4.0 * bias * bias
    out[0], out[1] = 2.0 * x + 0.5, 2.0 * y + 0.5  # a chroma pixel is the mean of 2x2 of luma
    out[2] = 2.0 * math.sqrt(4.0 * area / math.pi)
    out[3], out[4], out[5] = scale * cov_xx + widened, scale * cov_xy, scale * cov_yy + widened
    out[6] = min(1.0, level / (15.0 * noise)) * min(1.0, area / 12.0)


@njit(cache=True)
def widen_band(axis_x, axis_y, breadth, out):
    """Add to the covariance in `out` what shade and shape do to a band whose breadth lies along the axis (a unit
    vector)."""
    more = BAND_ALONG_VARIANCE - BAND_ACROSS_VARIANCE + (2.0 * BAND_ALONG * breadth) ** 2
    out[3] += BAND_ACROSS_VARIANCE + more * axis_y * axis_y
    out[4] -= more * axis_x * axis_y
    out[5] += BAND_ACROSS_VARIANCE + more * axis_x * axis_x
