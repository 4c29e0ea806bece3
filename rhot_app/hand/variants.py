"""Variants of the hand with fewer degrees of freedom, and the joint limits by which they are held.

A variant is a linear map from its coordinates q to the 21 angles, angles = mean + basis q, so every solver has it for
the price of one product: its Jacobian is the full one times the basis. Each angle follows one coordinate or none,
which turns a box of angle limits into a box of coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.couplings import THESIS_COUPLINGS, Coupling, coupling_complaints
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import ANGLES, FINGERS

Array = NDArray[np.float64]

VariantName = Literal["full", "coupled"]
LimitsName = Literal["anatomical", "thesis"]

_THESIS_LIMITS_DEG: Final = {"mcp_abduction": (-15.0, 15.0), "mcp_flexion": (0.0, 90.0), "pip_flexion": (0.0, 110.0),
                             "dip_flexion": (0.0, 90.0)}

INTER_FINGER_LAG: Final = math.radians(65.0)
"""How far the middle and the ring finger's MCP joints may stay behind a neighbour's (see `inter_finger`)."""


@dataclass(frozen=True, slots=True)
class Variant:
    """A linear map angles = mean + basis q. `names` (n,) of the coordinates, each the angle that it equals.

    `mean` (A,) rad; `basis` (A, n): every column has a 1 at its own angle; every row has at most one entry.
    """

    name: str
    names: tuple[str, ...]
    mean: Array
    basis: Array

    def angles(self, coordinates: Array) -> Array:
        """(..., A) rad of coordinates (..., n) rad."""
        return np.asarray(self.mean + coordinates @ self.basis.T)

    def coordinates(self, angles: Array) -> Array:
        """(..., n) rad: the coordinates whose angles lie nearest to `angles` (..., A) in the least squares sense."""
        return np.asarray((angles - self.mean) @ (self.basis / np.sum(self.basis ** 2, axis=0)))

    def limits(self, limits: Array) -> Array:
        """(n, 2) rad: the coordinates all of whose angles keep `limits` (A, 2) rad.

        Raises ValueError when an angle's couplings and limits leave it nowhere to be.
        """
        box = np.tile([-math.inf, math.inf], (len(self.names), 1))
        for angle, row in enumerate(self.basis):
            for k in np.flatnonzero(row):
                ends = np.sort((limits[angle] - self.mean[angle]) / row[k])
                box[k] = max(box[k, 0], ends[0]), min(box[k, 1], ends[1])
        if np.any(box[:, 0] > box[:, 1]):
            name = self.names[int(np.argmax(box[:, 0] > box[:, 1]))]
            raise ValueError(f"the limits of {name} and of what is coupled to it exclude each other")
        return box


def make_variant(name: VariantName, couplings: Sequence[Coupling] = THESIS_COUPLINGS) -> Variant:
    """``full``: 21 coordinates, the angles themselves. ``coupled``: without those that `couplings` bind, which are the
    hand file's (`HandAnatomy.couplings`) or, as a hand file has them by default, the thesis's: 15 coordinates."""
    return linear_variant(name, ANGLES, couplings if name == "coupled" else ())


def linear_variant(name: str, angles: Sequence[str], couplings: Sequence[Coupling]) -> Variant:
    """The variant of any body in which some angles follow others or stay where they are.

    Raises ValueError for couplings that cannot be: of angles that do not exist, or that follow a bound one.
    """
    complaint = next(coupling_complaints(couplings, angles), None)
    if complaint:
        raise ValueError(complaint)
    bound = {coupling.angle: coupling for coupling in couplings}
    free = tuple(angle for angle in angles if angle not in bound)
    mean, basis = np.zeros(len(angles)), np.zeros((len(angles), len(free)))
    for row, angle in enumerate(angles):
        coupling = bound.get(angle, Coupling(angle, angle))
        mean[row] = math.radians(coupling.offset_deg)
        if coupling.follows is not None:
            basis[row, free.index(coupling.follows)] = coupling.factor
    return Variant(name, free, mean, basis)


def limit_set(model: HandModel, name: LimitsName) -> Array:
    """(21, 2) rad, low and high. ``anatomical``: the hand file's. ``thesis``: RHOT eq. 2.1 for the four fingers.

    Eq. 2.1 speaks of MP, PIP and DIP joints; the thumb, which has no such three, keeps the hand file's limits.
    """
    limits = model.limits.copy()
    if name == "thesis":
        for finger in FINGERS[1:]:
            for joint, range_deg in _THESIS_LIMITS_DEG.items():
                limits[ANGLES.index(f"{finger}_{joint}")] = np.radians(range_deg)
    return limits


def inter_finger(lag: float = INTER_FINGER_LAG) -> tuple[Array, Array]:
    """Rows (4, 21) and bounds (4,) rad of the inter-finger constraint: rows @ angles <= bounds.

    Bending one finger's MCP joint forces its neighbour's to bend as well (RHOT 2.1.1). That holds for the middle and
    the ring finger; index and little finger have extensors of their own and may stay straight, as in pointing. The
    thesis gives no number: `lag` is ours, the least in steps of 5 degrees that cuts none of the shipped motions.
    """
    rows = np.zeros((4, len(ANGLES)))
    pairs = (("index", "middle"), ("ring", "middle"), ("middle", "ring"), ("little", "ring"))
    for row, (bent, forced) in zip(rows, pairs, strict=True):
        row[ANGLES.index(f"{bent}_mcp_flexion")] = 1.0
        row[ANGLES.index(f"{forced}_mcp_flexion")] = -1.0
    return rows, np.full(len(rows), lag)
