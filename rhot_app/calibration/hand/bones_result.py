"""What a calibration of bones found out, bone by bone, ready for a page, a terminal or JSON."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand.bones_collector import RigidPair
from rhot_app.calibration.hand.shape import BONE_COUNT, MARKERS, ROOTS, HandUnknowns
from rhot_app.calibration.verdict import Verdict
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.skeleton import BONES, FINGERS

Array = NDArray[np.float64]

OBSERVED_BELOW, PRIOR_ABOVE = 0.4, 0.8
"""What is left of a bone's scatter among hands of this size: below the first the markers show it, above the second
they do not, and the length is what is usual."""


MODEL_STD_MM = 0.3
"""No length is stated to be better than this: skin slides otherwise than it is modelled, and joints are no hinges."""


class Known(enum.Enum):
    """How a length came to be known."""

    OBSERVED = "observed"
    PARTLY = "partly"
    PRIOR = "prior"  # not observed: what is usual for a hand of this size
    ENTERED = "entered"

    @property
    def word(self) -> str:
        """As a person reads it."""
        return {Known.PARTLY: "partly observed", Known.PRIOR: "not observed: what is usual"}.get(self, self.value)


@dataclass(frozen=True, slots=True)
class BoneLength:
    """One bone, named as "index.proximal". `usual_std_mm`: its scatter among hands of this size."""

    name: str
    length_mm: float
    std_mm: float
    usual_std_mm: float
    known: Known


@dataclass(frozen=True, slots=True)
class Reach:
    """From the wrist over the finger's root to its stretched tip."""

    finger: str
    length_mm: float
    std_mm: float


@dataclass(frozen=True, slots=True)
class MarkerSpot:
    """Where a marker sits, mm: `along` its bone from the joint at which that begins, `across` towards the thumb,
    `above` towards the back of the hand; on the palm in the palm frame. `std_mm` of each."""

    marker: str
    place: str
    along_mm: float
    across_mm: float
    above_mm: float
    std_mm: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class RigidDistance:
    """Two markers that keep their distance."""

    first: str
    second: str
    distance_mm: float
    std_mm: float


@dataclass(frozen=True, slots=True)
class BonesResult:
    """The result: a hand file and its uncertainty.

    `method`: "landmarks" (each bone's median), "movement" (all lengths from many markers), "reach" (size and reaches
    from few), "entered" (by hand).
    `size` compares the hand with the base hand by the reach of its four fingers, `size_std` its deviation.
    `residual_mm`: rms per axis of the markers about the fitted hand; `noise_mm` of the tracks; `error_mm` beyond it;
    None where nothing was fitted.
    """

    hand: HandAnatomy
    method: str
    size: float
    size_std: float
    bones: tuple[BoneLength, ...]
    reaches: tuple[Reach, ...]
    markers: tuple[MarkerSpot, ...]
    rigid: tuple[RigidDistance, ...]
    residual_mm: float | None
    noise_mm: float
    error_mm: float | None
    seconds: float
    instants: int
    verdict: Verdict

    def bone(self, name: str) -> BoneLength:
        """The bone of that name; raises KeyError."""
        return {bone.name: bone for bone in self.bones}[name]


def bone_name(finger: int, bone: int) -> str:
    """As "index.proximal"."""
    return f"{FINGERS[finger]}.{BONES[finger][bone]}"


def bone_lengths(unknowns: HandUnknowns, vector: Array, covariance: Array) -> tuple[BoneLength, ...]:
    """Every bone with what is known of it."""
    usual = np.sqrt(np.diag(unknowns.prior.fixed_size)[:BONE_COUNT])
    std = np.hypot(np.sqrt(np.diag(covariance)[:BONE_COUNT]), 1e-3 * MODEL_STD_MM)
    found = []
    for k in range(BONE_COUNT):
        left = std[k] / usual[k]
        known = Known.OBSERVED if left < OBSERVED_BELOW else Known.PRIOR if left > PRIOR_ABOVE else Known.PARTLY
        found.append(BoneLength(bone_name(k // 3, k % 3), float(1e3 * vector[k]), float(1e3 * std[k]),
                                float(1e3 * usual[k]), known))
    return tuple(found)


def finger_reaches(unknowns: HandUnknowns, vector: Array, covariance: Array) -> tuple[tuple[Reach, ...], float, float]:
    """Each finger's reach, then the hand's size against the base hand's with its standard deviation."""
    shape, slope = unknowns.shape(vector), np.zeros((5, len(vector)))
    for finger in range(5):
        slope[finger, 3 * finger:3 * finger + 3] = 1.0
        root = shape.roots[finger]
        slope[finger, ROOTS + 3 * finger:ROOTS + 3 * finger + 3] = root / np.linalg.norm(root)
    spread = slope @ covariance @ slope.T
    reaches = tuple(Reach(name, float(1e3 * shape.reaches[k]), float(1e3 * np.sqrt(spread[k, k])))
                    for k, name in enumerate(FINGERS))
    weights = np.array([0.0, 0.25, 0.25, 0.25, 0.25]) / unknowns.shape(unknowns.prior.mean).reaches
    return reaches, float(weights @ shape.reaches), float(np.sqrt(weights @ spread @ weights))


def marker_spots(unknowns: HandUnknowns, vector: Array, covariance: Array) -> tuple[MarkerSpot, ...]:
    """Where every marker sits."""
    rows = slice(MARKERS, unknowns.slides)
    spots = (1e3 * vector[rows].reshape(-1, 3)).tolist()
    deviations = (1e3 * np.sqrt(np.diag(covariance)[rows]).reshape(-1, 3)).tolist()
    return tuple(MarkerSpot(place.name, place.word, spot[0], spot[1], spot[2], (std[0], std[1], std[2]))
                 for place, spot, std in zip(unknowns.places, spots, deviations, strict=True))


def rigid_distances(pairs: list[RigidPair], unknowns: HandUnknowns) -> tuple[RigidDistance, ...]:
    """The pairs by name."""
    names = [place.name for place in unknowns.places]
    return tuple(RigidDistance(names[pair.first], names[pair.second], 1e3 * pair.distance_m, 1e3 * pair.sd_m)
                 for pair in pairs)
