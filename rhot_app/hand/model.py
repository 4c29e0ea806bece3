"""The hand model: an anatomy compiled to a Denavit-Hartenberg table and arrays, and its variants of fewer freedoms."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.anatomy import THESIS_COUPLINGS, Coupling, FingerAnatomy, HandAnatomy, coupling_complaints
from rhot_app.hand.dh import ROOT, DhArrays, DhRow, compile_table, rigid_rows
from rhot_app.hand.limits import PosePrior, pose_prior
from rhot_app.hand.skeleton import ANGLE_SLICES, ANGLES, FINGERS, HandPose
from rhot_app.hand.tables import TABLES

Array = NDArray[np.float64]
Point = tuple[int, tuple[float, float, float]]


@dataclass(frozen=True, slots=True)
class HandModel:
    """A hand in metres and radians. Read-only.

    `dh`: the kinematic tree in the palm frame of this side; its points are the 21 joints of `skeleton.JOINTS`,
    then the five marker centres. The finger arrays describe a right hand in its palm frame; a left hand is its
    mirror image, so the solvers mirror their targets by `mirror`.
    """

    anatomy: HandAnatomy
    mirror: float  # +1 right hand, -1 left hand: factor of the palm frame's y
    dh: DhArrays
    limits: Array  # (21, 2) rad, low and high
    base: Array  # (5, 3) m, finger roots in the right hand's palm frame
    base_rotation: Array  # (5, 3, 3) palm_from_finger at zero angles, right hand
    bones: Array  # (5, 3) m
    radii: Array  # (5, 3) m
    marker: Array  # (5,) m, from the last joint along the distal bone
    chain: Array  # (5, 3) m, the bones, the last one only as far as its marker's centre
    chain_bend: Array  # (5,) rad, how much more the way to the marker's centre bends than the bone: < 0 for a nail
    pose_prior: PosePrior  # of the angles
    locked: tuple[int, ...] = ()  # angles that are held (`with_locked`)


def build_model(anatomy: HandAnatomy) -> HandModel:
    """Compile an anatomy. Its limits are the anatomy's; `dataclasses.replace` the model to try another set."""
    fingers = [anatomy.fingers[name] for name in FINGERS]
    base = 1e-3 * np.array([finger.base_mm for finger in fingers], dtype=np.float64)
    rotation = np.array([euler_zyx(*np.radians(finger.base_rotation_deg)) for finger in fingers])
    bones = 1e-3 * np.array([finger.bones_mm for finger in fingers], dtype=np.float64)
    marker = 1e-3 * np.array([finger.marker_mm for finger in fingers], dtype=np.float64)
    return HandModel(
        anatomy=anatomy,
        mirror=1.0 if anatomy.side == "right" else -1.0,
        dh=_compile_hand(anatomy),
        limits=np.radians(np.concatenate([np.array(finger.limits_deg, dtype=np.float64) for finger in fingers])),
        base=base,
        base_rotation=rotation,
        bones=bones,
        radii=1e-3 * np.array([finger.radii_mm for finger in fingers], dtype=np.float64),
        marker=marker,
        chain=np.column_stack([bones[:, :2], marker]),
        chain_bend=np.zeros(5),
        pose_prior=pose_prior(),
    )


LOCKED_SD_RAD: Final = math.radians(2.0)
"""rad: how far a joint is from the angle at which it is held. Chosen: Rehg's are exact, a goniometer repeats to 5
degrees, and a finger with that much freedom is still taken for its neighbour."""


def with_locked(model: HandModel, locked_deg: Mapping[str, float | tuple[float, float]]) -> HandModel:
    """The hand with angles, by their names, that it holds: the pose prior expects them there, or about there with the
    standard deviation that is given."""
    locked = tuple(ANGLES.index(name) for name, value in locked_deg.items() if not isinstance(value, tuple))
    rows = np.eye(len(ANGLES))[[ANGLES.index(name) for name in locked_deg]]
    both = np.radians([value if isinstance(value, tuple) else (value, math.degrees(LOCKED_SD_RAD))
                       for value in locked_deg.values()]).reshape(-1, 2)
    prior = model.pose_prior.with_terms(rows / both[:, 1:], both[:, 0] / both[:, 1])
    return replace(model, pose_prior=prior, locked=locked)


def neutral_pose(world_from_palm: Array | None = None) -> HandPose:
    """A relaxed hand: fingers slightly bent, thumb beside them; at the world's origin unless told where."""
    return HandPose(np.eye(4) if world_from_palm is None else world_from_palm, np.radians(TABLES.neutral_deg))


def euler_zyx(z: float, y: float, x: float) -> Array:
    """Rotation Rot_z(z) Rot_y(y) Rot_x(x), rad."""
    (cz, sz), (cy, sy), (cx, sx) = ((math.cos(angle), math.sin(angle)) for angle in (z, y, x))
    return np.array([[cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
                     [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
                     [-sy, cy * sx, cy * cx]])


class HandTable(NamedTuple):
    """A right hand's DH rows, and the points on them: the 21 joints of `skeleton.JOINTS`, then 5 marker centres."""

    rows: list[DhRow]
    joints: list[Point]
    markers: list[Point]


def hand_table(anatomy: HandAnatomy) -> HandTable:
    """The rows of the right hand that `anatomy` describes: for each finger two fixed ones, then one per angle."""
    rows: list[DhRow] = []
    joints: list[Point] = [(ROOT, (0.0, 0.0, 0.0))]
    markers: list[Point] = []
    for index, name in enumerate(FINGERS):
        finger = anatomy.fingers[name]
        base = 1e-3 * np.array(finger.base_mm, dtype=np.float64)
        fixed, turn = rigid_rows(ROOT, len(rows), euler_zyx(*np.radians(finger.base_rotation_deg)), base)
        rows += fixed
        joints.append((len(rows) - 1, (0.0, 0.0, 0.0)))
        for angle, (length, twist) in enumerate(_links(name, finger), ANGLE_SLICES[index].start):
            rows.append(DhRow(len(rows) - 1, theta=turn, a=length, alpha=twist, angle=angle))
            turn = 0.0
            if length > 0.0:
                joints.append((len(rows) - 1, (0.0, 0.0, 0.0)))
        markers.append((len(rows) - 1, (1e-3 * (finger.marker_mm - finger.bones_mm[2]), 0.0, 0.0)))
    return HandTable(rows, joints, markers)


def _compile_hand(anatomy: HandAnatomy) -> DhArrays:
    rows, joints, markers = hand_table(anatomy)
    if anatomy.side == "left":
        rows = [row.mirrored() for row in rows]  # every point lies on its frame's x axis and stays there
    return compile_table(rows, joints + markers)


def _links(name: str, finger: FingerAnatomy) -> list[tuple[float, float]]:
    """Length, m, and twist, rad, of the row that each angle turns. A finger abducts about z, then flexes about its
    common hinge axis. A thumb has two saddle joints (CMC, MCP) of abduction and flexion, then the IP hinge."""
    first, second, last = (1e-3 * bone for bone in finger.bones_mm)
    across = -0.5 * math.pi
    if name == "thumb":
        return [(0.0, across), (first, -across), (0.0, across), (second, 0.0), (last, 0.0)]
    return [(0.0, across), (first, 0.0), (second, 0.0), (last, 0.0)]


# -- variants with fewer degrees of freedom ----------------------------------------------------------------------------
# A variant is a linear map from its coordinates q to the 21 angles, angles = mean + basis q, so every solver has it for
# the price of one product: its Jacobian is the full one times the basis. Each angle follows one coordinate or none,
# which turns a box of angle limits into a box of coordinates.

VariantName = Literal["full", "coupled"]
LimitsName = Literal["anatomical", "thesis"]


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
            for joint, range_deg in TABLES.thesis_limits_deg.items():
                limits[ANGLES.index(f"{finger}_{joint}")] = np.radians(range_deg)
    return limits


def inter_finger() -> tuple[Array, Array]:
    """Rows (4, 21) and bounds (4,) rad of the inter-finger constraint: rows @ angles <= bounds.

    Bending one finger's MCP joint forces its neighbour's to bend as well (RHOT 2.1.1). That holds for the middle and
    the ring finger; index and little finger have extensors of their own and may stay straight, as in pointing. The
    thesis gives no number.
    """
    rows = np.zeros((4, len(ANGLES)))
    pairs = (("index", "middle"), ("ring", "middle"), ("middle", "ring"), ("little", "ring"))
    for row, (bent, forced) in zip(rows, pairs, strict=True):
        row[ANGLES.index(f"{bent}_mcp_flexion")] = 1.0
        row[ANGLES.index(f"{forced}_mcp_flexion")] = -1.0
    return rows, np.full(len(rows), math.radians(TABLES.inter_finger_lag_deg))
