"""The track of one marker: what the last frames say about where it is, how big it is and how it looks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.region import measure as m
from rhot_node.detect.region import position as p
from rhot_node.detect.search import Blob
from rhot_node.markers import Shape
from rhot_node.wire.messages import FLAGS, MarkerFlag, MarkerObservation

# -- reported covariance and quality -----------------------------------------------------------------------------------
# A covariance holds what the picture itself tells: the noise, carried through the estimate; how steeply the paint is
# shaded, because a round body darkens towards its limb as no slope can follow; how far the edge is smeared by motion;
# what surrounds the marker; and how far its area is from what was expected.
#
# Lengths are chroma pixels, but for what is written out (luma pixels).

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


# -- track of one marker -----------------------------------------------------------------------------------------------

Row = list[float]

MEMORY_FRAMES = 40  # how long a lost marker's motion and size are held against candidates
VELOCITY_GAIN = 0.7
AREA_GAIN, RATE_GAIN = 0.4, 0.1  # per frame, of the expected log area and its trend
RATE_MAX = 0.08  # of log area per frame: 2 m/s of approach at 1 m, or a finger bending fast, at 40 frames/s
HIDDEN_DECAY = 0.99  # per frame: what looks hidden for long is believed to be that small
PARTIAL_AREA = 0.82  # of the expected area: less is half hidden
LITTER_AREA, LITTER_LEVEL = 0.25, 0.75  # of what is expected: less of both at once is no paint
SLIVER_AREA = 0.15  # of the expected area: too little to be believed without the gate of a search
JUMP_AREA = 1.35  # of the expected area: something else joined the marker
RIVAL_MARGIN = 4.0  # squared standard deviations that a second blob must be worse by
SAG_STALE, SAG_HIDDEN = 0.15, 0.5  # of a band's last sag: what it may be off by, whole and partly hidden
MARGIN = 5.0  # chroma px around a resting marker
PARTIAL, EDGE, AMBIGUOUS = int(MarkerFlag.PARTIAL), int(MarkerFlag.EDGE), int(MarkerFlag.AMBIGUOUS)


# Columns of a track's state; chroma pixels. VX, VY: px per frame. AREA: expected in the next frame; RATE: the trend of
# its logarithm per frame (approach, foreshortening). EXTENT: length along the major axis. FITTED: a band's curvature is
# known. SAG_X, SAG_Y: from a band's centre to its centroid.
X, Y, VX, VY, AREA, RATE, EXTENT, LEVEL, FITTED, SAG_X, SAG_Y, ALIVE, MISSED = range(13)
TRACK_COLUMNS = 13


def _field(column: int) -> Any:
    return property(lambda track: track.state[column].item(),
                    lambda track, value: track.state.__setitem__(column, value))


class Track:
    """State between frames, in a row of numbers that compiled code shares."""

    __slots__ = ("shape", "state")

    x, y, vx, vy = _field(X), _field(Y), _field(VX), _field(VY)
    area, rate, extent, level = _field(AREA), _field(RATE), _field(EXTENT), _field(LEVEL)
    fitted, sag_x, sag_y = _field(FITTED), _field(SAG_X), _field(SAG_Y)
    alive, missed = _field(ALIVE), _field(MISSED)

    def __init__(self, shape: Shape, state: NDArray[np.float64] | None = None) -> None:
        """`state` (TRACK_COLUMNS,) is taken over and cleared; None: an own one."""
        self.shape = shape
        self.state = np.zeros(TRACK_COLUMNS) if state is None else state
        self.state[:] = 0.0
        self.missed = MEMORY_FRAMES

    @property
    def remembered(self) -> bool:
        """Is the last observation recent enough to judge candidates by?"""
        return self.missed < MEMORY_FRAMES

    def request(self, out: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where to look in the next frame: constant velocity, with a margin that grows with speed and size."""
        speed = math.hypot(self.vx, self.vy)
        half = 0.5 * self.extent + MARGIN + 0.15 * self.extent + 0.75 * speed
        out[m.PX] = self.x + self.vx + self.sag_x
        out[m.PY] = self.y + self.vy + self.sag_y
        out[m.HALF_X] = out[m.HALF_Y] = half
        out[m.SIGMA] = 1.5 + 0.15 * self.extent + 0.4 * speed
        out[m.AREA_REF], out[m.LEVEL_REF] = self.area, self.level
        out[m.IS_BAND] = self.shape == "band"
        return out

    def recall(self, out: NDArray[np.float64]) -> NDArray[np.float64]:
        """The request for the very frame that was observed last."""
        self.request(out)
        out[m.PX], out[m.PY] = self.x + self.sag_x, self.y + self.sag_y
        return out

    def candidate_cost(self, blob: Blob) -> float:
        """How badly a blob of a full search fits the last observation, in squared standard deviations."""
        x, y = blob.centroid
        gap = self.missed + 1
        reach = self.extent + gap * (3.0 + 0.75 * math.hypot(self.vx, self.vy))
        hold = min(gap, 4)  # a velocity says little after a few frames
        away = math.hypot(x - self.x - hold * self.vx, y - self.y - hold * self.vy) / reach
        size = math.log(blob.area / self.area) / (0.35 + 0.02 * gap)
        return away * away + size * size

    def is_outside(self, row: Row) -> bool:
        """Whether a measured row may be of specks that lie where the marker was, so that a search should decide.

        What hides a marker leaves some of it in its colour, and shade leaves it its size.
        """
        pale = row[m.LEVEL] < LITTER_LEVEL * self.level
        return row[p.AREA] < LITTER_AREA * self.area and (pale or row[p.AREA] < SLIVER_AREA * self.area)

    def lose(self) -> None:
        """Not in this frame."""
        self.alive = 0.0
        self.missed = min(self.missed + 1, MEMORY_FRAMES)

    def observe(self, index: int, row: Row, noise: float, flags: int,
                floor: float = FLOOR_VARIANCE) -> MarkerObservation:
        """Judge a measured row by the last frames, state it as an observation and take it into the track.

        `noise`: standard deviation of the chroma noise, grey levels. `flags`: bits of MarkerFlag. `floor`: luma px^2,
        the variance of the position without any noise.
        """
        known = self.remembered and self.area > 0.0
        ratio = row[p.AREA] / self.area if known else 1.0
        extent = math.sqrt(12.0 * row[p.VAR_MAJOR])
        flags |= self._judge(row, ratio, known)
        width = edge_width(row[p.SOFT], row[p.AREA], row[p.VAR_MAJOR], row[p.VAR_MINOR])
        limb_x, limb_y, limb = limb_shift(row[m.SLOPE_X], row[m.SLOPE_Y], row[p.AREA])
        taken, left = LIMB_OF_SHAPE[self.shape]
        taken *= limb_shows(width)
        x, y = row[p.X] - taken * limb_x, row[p.Y] - taken * limb_y
        bias = math.hypot(self._plausible_bias(row, ratio, extent, width, flags), smear_bias(width),
                          left * limb)
        if self.shape == "band" and not row[p.FIT] and (self.fitted or not row[p.ROUND]):
            x, y = x - self.sag_x, y - self.sag_y
            stale = SAG_STALE if not flags & PARTIAL else SAG_HIDDEN
            off_axis = stale * math.hypot(self.sag_x, self.sag_y) if self.fitted else OFF_AXIS_SD * extent
            bias = math.hypot(bias, off_axis)
        self._update(row, x, y, extent, ratio, known, flags)
        return _observation(index, row, x, y, bias, noise, floor, ratio, flags)

    def _judge(self, row: Row, ratio: float, known: bool) -> int:
        flags = 0
        if row[m.AT_BORDER]:
            flags |= EDGE
        elongated = self.shape == "sphere" and row[p.VAR_MAJOR] > 1.7 * row[p.VAR_MINOR] + 1.0
        broken = self.shape == "band" and self.fitted and not row[p.FIT]
        if ratio < PARTIAL_AREA or row[m.FRAGMENTS] > 1 or elongated or (broken and ratio < 0.93):
            flags |= PARTIAL
        if row[m.RIVAL_COST] < row[m.COST] + RIVAL_MARGIN or (known and ratio > JUMP_AREA):
            flags |= AMBIGUOUS
        return flags

    def _plausible_bias(self, row: Row, ratio: float, extent: float, width: float, flags: int) -> float:
        """Standard deviation, chroma px, of how far what is hidden or mistaken may have drawn the centroid."""
        whole = max(extent, self.extent)
        if row[p.FIT] and not flags & PARTIAL:  # a band's rims are those of a whole one
            bias = hidden_bias(math.sqrt(ratio), math.sqrt(12.0 * row[p.VAR_MINOR]), row[p.AREA], width)
        else:
            bias = hidden_bias(ratio, whole, row[p.AREA], width)
        if flags & PARTIAL:
            bias = max(bias, 0.05 * whole)
        if flags & EDGE:
            bias = max(bias, 0.15 * whole)
        if flags & AMBIGUOUS:
            bias = max(bias, 0.3 * whole)
        return bias

    def _update(self, row: Row, x: float, y: float, extent: float, ratio: float, known: bool,
                flags: int) -> None:
        if not known:
            self.state[VX:EXTENT] = self.state[FITTED:ALIVE] = 0.0
        hidden = bool(flags & (PARTIAL | EDGE)) and ratio < 1.0
        take(self.state, x, y, row[p.AREA], extent, row[m.LEVEL], hidden)
        if row[p.FIT]:
            sag = 0.25 * math.pi * row[p.SAG]
            self.fitted, self.sag_x, self.sag_y = 1.0, -row[p.AXIS_Y] * sag, row[p.AXIS_X] * sag


@njit(cache=True)
def take(state, x, y, area, extent, level, hidden):
    """Take what was seen into a track's state: motion, and, unless something hides a part, size and its trend.

    A track whose area is 0 knows nothing yet.
    """
    gap = state[MISSED] + 1.0
    if state[AREA] > 0.0:
        gain = VELOCITY_GAIN if state[ALIVE] > 0.0 else 1.0
        state[VX] += gain * ((x - state[X]) / gap - state[VX])
        state[VY] += gain * ((y - state[Y]) / gap - state[VY])
        if hidden:
            state[AREA] *= HIDDEN_DECAY
            state[RATE] = 0.0
        else:
            surprise = math.log(area / state[AREA])
            state[RATE] = min(max(state[RATE] + RATE_GAIN * surprise, -RATE_MAX), RATE_MAX)
            state[AREA] *= math.exp(AREA_GAIN * surprise + state[RATE])
            state[EXTENT] = extent
    else:
        state[AREA], state[EXTENT] = area, extent
    state[X], state[Y], state[LEVEL] = x, y, level
    state[ALIVE], state[MISSED] = 1.0, 0.0


def _observation(index: int, row: Row, x: float, y: float, bias: float, noise: float, floor: float, ratio: float,
                 flags: int) -> MarkerObservation:
    out = np.empty(7)
    luma_values(x, y, row[p.AREA], row[p.COV_XX], row[p.COV_XY], row[p.COV_YY], floor, bias,
                   row[m.LEVEL], noise, out)
    if row[p.FIT]:
        widen_band(row[p.AXIS_X], row[p.AXIS_Y], math.sqrt(12.0 * row[p.VAR_MAJOR]), out)
    x, y, diameter, cov_xx, cov_xy, cov_yy, quality = out.tolist()
    if flags & PARTIAL:
        quality *= min(ratio, 0.8)
    if flags & EDGE:
        quality *= 0.7
    if flags & AMBIGUOUS:
        quality *= 0.5
    return MarkerObservation(index, x, y, diameter, cov_xx, cov_xy, cov_yy, quality, FLAGS[flags])


def lost_observation(index: int) -> MarkerObservation:
    """A marker that is stated as lost."""
    nan = math.nan
    return MarkerObservation(index, nan, nan, 0.0, nan, nan, nan, 0.0, MarkerFlag.LOST)
