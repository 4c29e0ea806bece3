"""Variants of the hand with fewer degrees of freedom, and the joint limits by which they are held.

A variant is a linear map from its coordinates q to the 21 angles, angles = mean + basis q, so every solver has it for
the price of one product: its Jacobian is the full one times the basis. Each angle follows one coordinate or none,
which turns a box of angle limits into a box of coordinates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.limits import DIP_PER_PIP
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import ANGLES, FINGERS

Array = NDArray[np.float64]

VariantName = Literal["full", "coupled"]
LimitsName = Literal["anatomical", "thesis"]

_FIXED_IN_COUPLED: Final = ("middle_mcp_abduction", "thumb_mcp_abduction")  # RHOT eq. 2.2 and 2.3

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


def make_variant(name: VariantName) -> Variant:
    """``full``: 21 coordinates, the angles themselves. ``coupled``: 15, RHOT eq. 2.2 to 2.4.

    Coupled: DIP = 2/3 PIP in the four fingers; the middle finger does not abduct; the thumb has four angles. Eq. 2.3
    does not say which angle the thumb gives up. It is the MCP joint's abduction here: without it the other four still
    bring the tip of natural poses to 1.3 mm rms of its place, without the CMC joint's abduction only to 8 mm.
    """
    if name == "full":
        return Variant(name, ANGLES, np.zeros(len(ANGLES)), np.eye(len(ANGLES)))
    follows = {f"{finger}_dip_flexion": (f"{finger}_pip_flexion", DIP_PER_PIP) for finger in FINGERS[1:]}
    return linear_variant(name, ANGLES, follows, dict.fromkeys(_FIXED_IN_COUPLED, 0.0))


def linear_variant(name: str, angles: tuple[str, ...], follows: dict[str, tuple[str, float]],
                   fixed: dict[str, float], offsets: dict[str, float] | None = None) -> Variant:
    """The variant of any body in which some angles follow others and some are fixed.

    `follows`: angle -> (angle that it follows, factor), plus `offsets` rad; `fixed`: angle -> its value, rad. Raises
    ValueError when an angle follows one that is not free, or that does not exist.
    """
    free = tuple(angle for angle in angles if angle not in follows and angle not in fixed)
    mean, basis = np.zeros(len(angles)), np.zeros((len(angles), len(free)))
    for row, angle in enumerate(angles):
        leader, factor = follows.get(angle, (angle, 1.0))
        if angle in fixed:
            mean[row] = fixed[angle]
        elif leader not in free:
            raise ValueError(f"{angle} follows {leader}, which is not a free angle")
        else:
            basis[row, free.index(leader)] = factor
            mean[row] = (offsets or {}).get(angle, 0.0)
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
