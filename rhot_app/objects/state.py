"""The state of a tracked object at one instant, as trackers publish it."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TWIST = 6
"""Numbers of a pose's tangent space."""


class Validity(enum.StrEnum):
    """What a pose is worth."""

    SEARCHING = "searching"  # not observed yet; NaN
    TRACKED = "tracked"
    AMBIGUOUS = "ambiguous"  # a second pose, such as a planar tag's flip, has a probability of 1 % or more
    PREDICTED = "predicted"  # not observed for some frames
    LOST = "lost"  # was tracked; NaN


def _unknown() -> Array:
    return np.full(5, np.nan)


@dataclass(frozen=True, slots=True)
class ObjectState:
    """An object at one instant, in the rig frame.

    `world_from_object` (4, 4) m. `covariance` (6, 6) m^2 and rad^2: translation, then rotation about the object's
    origin, world axes. `velocity` (6,): of the origin, m/s, and angular, rad/s, world axes. All NaN unless `tracked`.

    Of the hand whose state it belongs to, in the order of FINGERS: `distances` (5,) m from the fingertips to the
    object's surface, negative within it, their standard deviations `distance_sd` (5,) m, and `contacts` (5,), whether
    each touches it. NaN and False where the hand, the object or its shape is not known.
    """

    name: str
    t_master_ns: int
    validity: Validity
    world_from_object: Array
    covariance: Array
    velocity: Array
    distances: Array = field(default_factory=_unknown)
    distance_sd: Array = field(default_factory=_unknown)
    contacts: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(5, np.bool_))

    @property
    def tracked(self) -> bool:
        """Whether there is a pose."""
        return self.validity not in (Validity.SEARCHING, Validity.LOST)

    @property
    def translation_sd(self) -> float:
        """m: standard deviation of the place, root of the trace; NaN without a pose."""
        return float(np.sqrt(np.trace(self.covariance[:3, :3])))

    @property
    def rotation_sd(self) -> float:
        """rad: likewise of the rotation."""
        return float(np.sqrt(np.trace(self.covariance[3:, 3:])))


def unknown_object(name: str, t_ns: int, validity: Validity) -> ObjectState:
    """The state of an object without a pose."""
    return ObjectState(name, t_ns, validity, np.full((4, 4), np.nan), np.full((TWIST, TWIST), np.nan),
                       np.full(TWIST, np.nan))
