"""Quantiles and tail probabilities of the distributions that gates and tests use.

From scipy.special: scipy.stats has the same, but takes a third of a second to import.
"""

from __future__ import annotations

from typing import Any

from scipy.special import chdtrc, chdtri, fdtrc, ndtri


def chi_squared(probability: Any, freedom: Any) -> Any:
    """Value below which a chi-squared variable of `freedom` degrees lies with this probability."""
    return chdtri(freedom, 1.0 - probability)


def chi_squared_isf(tail: Any, freedom: Any) -> Any:
    """Value above which a chi-squared variable of `freedom` degrees lies with the probability `tail`."""
    return chdtri(freedom, tail)


def chi_squared_tail(value: Any, freedom: Any) -> Any:
    """Probability that a chi-squared variable of `freedom` degrees exceeds `value`."""
    return chdtrc(freedom, value)


def normal_isf(tail: float) -> float:
    """Standard deviations above which a Gaussian variable lies with the probability `tail`."""
    return -float(ndtri(tail))


def f_tail(value: float, numerator: float, denominator: float) -> float:
    """Probability that an F variable of these degrees of freedom exceeds `value`."""
    return float(fdtrc(numerator, denominator, value))
