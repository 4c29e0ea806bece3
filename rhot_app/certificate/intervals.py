"""95 % intervals of means, standard deviations and percentiles of samples that follow one another and are correlated.

N correlated samples say as much as fewer independent ones (Priestley 1981, 5.3.2). The autocorrelation is summed up to
where pairs of it are no longer positive (Geyer 1992). That sum is itself an estimate; one standard deviation of it
(Madras and Sokal 1988) is taken off the number, so that the intervals of short records are not too narrow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Array = NDArray[np.float64]

LEVEL = 0.95
"""Of every interval on a certificate."""

_BELOW, _ABOVE = 0.5 * (1.0 - LEVEL), 0.5 * (1.0 + LEVEL)

_ROUNDING = 1e-12
"""Relative: what differs by less is one number that was added up."""

LEAST = 8
"""Samples without which there is no interval: a correlation of fewer is noise."""


@dataclass(frozen=True, slots=True)
class Interval:
    """A `value` and its 95 % interval, in the unit of the samples; NaN when there are too few of them."""

    value: float
    low: float
    high: float

    @property
    def half_width(self) -> float:
        """Half of the interval's length."""
        return 0.5 * (self.high - self.low)

    def holds(self, value: float) -> bool:
        """Whether `value` lies inside."""
        return self.low <= value <= self.high

    def together(self, count: int) -> Interval:
        """Wider, so that `count` such intervals all hold their values in 95 of 100 cases (Bonferroni)."""
        factor = float(stats.norm.ppf(1.0 - _BELOW / count) / stats.norm.ppf(_ABOVE))
        return Interval(self.value, self.value - factor * (self.value - self.low),
                        self.value + factor * (self.high - self.value))

    def scaled(self, factor: float) -> Interval:
        """In another unit; `factor` is above 0."""
        return Interval(factor * self.value, factor * self.low, factor * self.high)

    def widened(self, sd: float) -> Interval:
        """With another independent error of this standard deviation, which no number of samples averages out."""
        more = float(stats.norm.ppf(_ABOVE)) * sd
        return Interval(self.value, self.value - math.hypot(self.value - self.low, more),
                        self.value + math.hypot(self.high - self.value, more))


UNKNOWN = Interval(math.nan, math.nan, math.nan)


def effective_size(samples: Array, *, squares: bool = False) -> float:
    """How many independent samples say as much about the mean as these (N,); with `squares` about the variance, whose
    correlation is the square of the samples'. From 1 to N."""
    count = len(samples)
    off = samples - samples.mean()
    variance = float(off @ off)
    if count < LEAST or variance <= count * (_ROUNDING * float(np.abs(samples).max())) ** 2:
        return float(count)
    spectrum = np.abs(np.fft.rfft(off, 2 * count)) ** 2
    correlation = np.fft.irfft(spectrum)[:count] / variance  # of lag 0, 1, ...; biased towards 0
    taken = 1.0 / max(count / (1.0 + 2.0 * float(np.sum(_positive(correlation)))), 1.0)  # by the samples' own mean
    kept = _positive((correlation + taken) / (1.0 + taken))
    total = float(np.sum(kept * kept)) if squares else float(np.sum(kept))
    relative_sd = math.sqrt(2.0 * (2.0 * len(kept) + 1.0) / count)
    return float(np.clip(count / ((1.0 + 2.0 * total) * (1.0 + relative_sd)), 1.0, count))


def _positive(correlation: Array) -> Array:
    """Those of lag 1, 2, ... (N - 1,) before the first pair whose sum is not positive."""
    pairs = correlation[1:len(correlation) - 1:2] + correlation[2::2]
    ends = np.flatnonzero(pairs <= 0.0)
    return correlation[1:(2 * int(ends[0]) if len(ends) else 2 * len(pairs)) + 1]


def mean_of(samples: Array) -> Interval:
    """The mean of (N,) samples, by Student's t with their effective number; NaN ones are left out."""
    known = samples[np.isfinite(samples)]
    if len(known) < LEAST:
        return UNKNOWN
    effective = max(effective_size(known), 2.0)
    mean, sd = float(known.mean()), float(known.std(ddof=1))
    half = float(stats.t.ppf(_ABOVE, effective - 1.0)) * sd / math.sqrt(effective)
    return Interval(mean, mean - half, mean + half)


def sd_of(series: Sequence[Array]) -> Interval:
    """The standard deviation common to some series (N,), each about its own mean, by chi-squared with their effective
    number of degrees of freedom. NaN samples are left out, series that are too short as well."""
    total, freedom = 0.0, 0.0
    for samples in series:
        known = samples[np.isfinite(samples)]
        if len(known) < LEAST:
            continue
        of_mean = max(effective_size(known), 2.0)
        variance = float(known.var()) / (1.0 - 1.0 / of_mean)  # about the true mean, not that of the samples
        mine = max(effective_size(known, squares=True) - 1.0, 1.0)
        total, freedom = total + mine * variance, freedom + mine
    if freedom == 0.0:
        return UNKNOWN
    low, high = stats.chi2.ppf((_ABOVE, _BELOW), freedom)
    return Interval(math.sqrt(total / freedom), math.sqrt(total / float(low)), math.sqrt(total / float(high)))


def percentile_of(samples: Array, part: float) -> Interval:
    """The quantile `part` of (N,) samples by order statistics, whatever their distribution; what counts as correlated
    is which samples lie above it. An end that so few samples do not bound is infinite."""
    known = samples[np.isfinite(samples)]
    if len(known) < LEAST:
        return UNKNOWN
    effective = max(round(effective_size((known > np.quantile(known, part)).astype(np.float64))), 2)
    known = np.sort(known)
    below, above = (float(stats.binom.ppf(p, effective, part)) for p in (_BELOW, _ABOVE))
    low = known[int((below - 1.0) / effective * len(known))] if below >= 1.0 else -math.inf
    high = math.inf
    if above < effective:
        high = float(known[min(math.ceil((above + 1.0) / effective * len(known)), len(known)) - 1])
    return Interval(float(np.quantile(known, part)), float(low), high)
