"""The track of one marker: what the last frames say about where it is, how big it is and how it looks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect import measure as m
from rhot_node.detect import position as p
from rhot_node.markers import Shape
from rhot_node.wire.messages import NO_FLAGS, MarkerFlag, MarkerObservation

Row = list[float]

MEMORY_FRAMES = 40  # how long a lost marker's motion and size are held against candidates
VELOCITY_GAIN = 0.7
AREA_GAIN, RATE_GAIN = 0.4, 0.1  # per frame, of the expected log area and its trend
RATE_MAX = 0.08  # of log area per frame: 2 m/s of approach at 1 m, or a finger bending fast, at 40 frames/s
HIDDEN_DECAY = 0.99  # per frame: what looks hidden for long is believed to be that small
PARTIAL_AREA = 0.82  # of the expected area: less is half hidden
STEADY_AREA = 0.04  # relative change against the expectation beyond which the covariance covers what hiding,
# uncovering or joining that much would do
LITTER_AREA, LITTER_LEVEL = 0.25, 0.75  # of what is expected: less of both at once is no paint
SLIVER_AREA = 0.15  # of the expected area: too little to be believed without the gate of a search
JUMP_AREA = 1.35  # of the expected area: something else joined the marker
RIVAL_MARGIN = 4.0  # squared standard deviations that a second blob must be worse by
FLOOR_VARIANCE = 4e-4  # px^2: sampling and shading leave about 0.02 px
BAND_FLOOR_VARIANCE = 3e-3  # px^2: the fit of a band's curvature magnifies them
SMALL_AREA, SMALL_VARIANCE = 22.0, 0.01  # chroma px^2, px^2: too few inner pixels to see the shading
NOISE_INFLATION = 1.2  # paint and surroundings are themselves means of few noisy pixels
MARGIN = 5.0  # chroma px around a resting marker

CHROMA_TO_LUMA = 2.0
SITING = 0.5  # chroma (x, y) lies at luma 2 (x, y) + 0.5


@dataclass(slots=True)
class Track:
    """State between frames; chroma pixels."""

    shape: Shape
    alive: bool = False
    missed: int = MEMORY_FRAMES
    x: float = 0.0
    y: float = 0.0
    vx: float = 0.0  # px per frame
    vy: float = 0.0
    area: float = 0.0  # expected in the next frame
    rate: float = 0.0  # trend of its logarithm per frame: approach, foreshortening
    extent: float = 0.0  # length along the major axis
    level: float = 0.0
    fitted: bool = False  # a band's curvature is known
    sag_x: float = 0.0  # from a band's centre to its centroid
    sag_y: float = 0.0

    @property
    def remembered(self) -> bool:
        """Is the last sight recent enough to judge candidates by?"""
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

    def candidate_cost(self, x: float, y: float, area: float) -> float:
        """How badly a blob of a full search fits the last sight, in squared standard deviations."""
        gap = self.missed + 1
        reach = self.extent + gap * (3.0 + 0.75 * math.hypot(self.vx, self.vy))
        hold = min(gap, 4)  # a velocity says little after a few frames
        away = math.hypot(x - self.x - hold * self.vx, y - self.y - hold * self.vy) / reach
        size = math.log(area / self.area) / (0.35 + 0.02 * gap)
        return away * away + size * size

    def is_litter(self, row: Row) -> bool:
        """Whether a measured row may be of specks that lie where the marker was, so that a search should decide.

        What hides a marker leaves some of it in its colour, and shade leaves it its size.
        """
        pale = row[m.LEVEL] < LITTER_LEVEL * self.level
        return row[p.AREA] < LITTER_AREA * self.area and (pale or row[p.AREA] < SLIVER_AREA * self.area)

    def lose(self) -> None:
        """Not in this frame."""
        self.alive = False
        self.missed = min(self.missed + 1, MEMORY_FRAMES)

    def observe(self, index: int, row: Row, noise: float, flags: MarkerFlag) -> MarkerObservation:
        """Judge a measured row by the last frames, state it as an observation and take it into the track.

        `noise`: standard deviation of the chroma noise, grey levels.
        """
        known = self.remembered and self.area > 0.0
        ratio = row[p.AREA] / self.area if known else 1.0
        extent = math.sqrt(12.0 * row[p.VAR_MAJOR])
        flags |= self._judge(row, ratio, known)
        x, y = row[p.X], row[p.Y]
        bias = self._plausible_bias(row, ratio, extent, flags)
        if self.shape == "band" and not row[p.FIT]:
            x, y = x - self.sag_x, y - self.sag_y
            bias = math.hypot(bias, 0.5 * math.hypot(self.sag_x, self.sag_y) if self.fitted else 0.3 * extent)
        self._update(row, x, y, extent, ratio, known, flags)
        return _observation(index, row, x, y, bias, noise, ratio, flags)

    def _judge(self, row: Row, ratio: float, known: bool) -> MarkerFlag:
        flags = NO_FLAGS
        if row[m.AT_BORDER]:
            flags |= MarkerFlag.EDGE
        elongated = self.shape == "sphere" and row[p.VAR_MAJOR] > 1.7 * row[p.VAR_MINOR] + 1.0
        broken = self.shape == "band" and self.fitted and not row[p.FIT]
        if ratio < PARTIAL_AREA or row[m.FRAGMENTS] > 1 or elongated or (broken and ratio < 0.93):
            flags |= MarkerFlag.PARTIAL
        if row[m.RIVAL_COST] < row[m.COST] + RIVAL_MARGIN or (known and ratio > JUMP_AREA):
            flags |= MarkerFlag.AMBIGUOUS
        return flags

    def _plausible_bias(self, row: Row, ratio: float, extent: float, flags: MarkerFlag) -> float:
        """Standard deviation, chroma px, of how far what is hidden or mistaken may have drawn the centroid."""
        whole = max(extent, self.extent)
        change = 1.0 - min(ratio, 1.0 / ratio)
        bias = 0.5 * change * whole if change > STEADY_AREA else 0.0
        if flags & MarkerFlag.PARTIAL:
            bias = max(bias, 0.05 * whole)
        if flags & MarkerFlag.EDGE:
            bias = max(bias, 0.15 * whole)
        if flags & MarkerFlag.AMBIGUOUS:
            bias = max(bias, 0.3 * whole)
        return bias

    def _update(self, row: Row, x: float, y: float, extent: float, ratio: float, known: bool,
                flags: MarkerFlag) -> None:
        gap = self.missed + 1
        if known:
            gain = VELOCITY_GAIN if self.alive else 1.0
            self.vx += gain * ((x - self.x) / gap - self.vx)
            self.vy += gain * ((y - self.y) / gap - self.vy)
        else:
            self.vx = self.vy = 0.0
        self.x, self.y, self.level = x, y, row[m.LEVEL]
        if not known:
            self.area, self.rate, self.extent = row[p.AREA], 0.0, extent
        elif flags & (MarkerFlag.PARTIAL | MarkerFlag.EDGE) and ratio < 1.0:
            self.area, self.rate = self.area * HIDDEN_DECAY, 0.0
        else:
            surprise = math.log(ratio)
            self.rate = min(max(self.rate + RATE_GAIN * surprise, -RATE_MAX), RATE_MAX)
            self.area *= math.exp(AREA_GAIN * surprise + self.rate)
            self.extent = extent
        if not known:
            self.fitted, self.sag_x, self.sag_y = False, 0.0, 0.0
        if row[p.FIT]:
            sag = 0.25 * math.pi * row[p.SAG]
            self.fitted, self.sag_x, self.sag_y = True, -row[p.AXIS_Y] * sag, row[p.AXIS_X] * sag
        self.alive, self.missed = True, 0


def _observation(index: int, row: Row, x: float, y: float, bias: float, noise: float, ratio: float,
                 flags: MarkerFlag) -> MarkerObservation:
    scale = CHROMA_TO_LUMA**2 * NOISE_INFLATION * noise**2
    floor = BAND_FLOOR_VARIANCE if row[p.FIT] else FLOOR_VARIANCE
    if row[p.AREA] < SMALL_AREA:
        floor += SMALL_VARIANCE
    widened = floor + (CHROMA_TO_LUMA * bias) ** 2
    area = row[p.AREA]
    quality = min(1.0, row[m.LEVEL] / (15.0 * noise)) * min(1.0, area / 12.0)
    if flags & MarkerFlag.PARTIAL:
        quality *= min(ratio, 0.8)
    if flags & MarkerFlag.EDGE:
        quality *= 0.7
    if flags & MarkerFlag.AMBIGUOUS:
        quality *= 0.5
    return MarkerObservation(
        index=index, x=CHROMA_TO_LUMA * x + SITING, y=CHROMA_TO_LUMA * y + SITING,
        diameter=CHROMA_TO_LUMA * math.sqrt(4.0 * area / math.pi),
        cov_xx=scale * row[p.COV_XX] + widened, cov_xy=scale * row[p.COV_XY],
        cov_yy=scale * row[p.COV_YY] + widened, quality=quality, flags=flags)


def lost_observation(index: int) -> MarkerObservation:
    """A marker that is stated as lost."""
    nan = math.nan
    return MarkerObservation(index, nan, nan, 0.0, nan, nan, nan, 0.0, MarkerFlag.LOST)
