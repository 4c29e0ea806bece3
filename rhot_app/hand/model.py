"""The hand model: an anatomy compiled to a Denavit-Hartenberg table and the arrays that the solvers need."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.anatomy import FingerAnatomy, HandAnatomy
from rhot_app.hand.dh import ROOT, DhArrays, DhRow, compile_table, rigid_rows
from rhot_app.hand.limits import NaturalPose, natural_pose
from rhot_app.hand.skeleton import ANGLE_SLICES, FINGERS, HandPose

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
    natural: NaturalPose  # of the angles, what to believe without evidence


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
        natural=natural_pose(),
    )


def neutral_pose(world_from_palm: Array | None = None) -> HandPose:
    """A relaxed hand: fingers slightly bent, thumb beside them; at the world's origin unless told where."""
    angles = np.radians([5.0, 5.0, 0.0, 12.0, 12.0,
                         *(2.0, 20.0, 28.0, 18.7), *(0.0, 22.0, 30.0, 20.0),
                         *(0.0, 24.0, 32.0, 21.3), *(-3.0, 26.0, 34.0, 22.7)])
    return HandPose(np.eye(4) if world_from_palm is None else world_from_palm, angles)


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
        moving = _thumb_rows if index == 0 else _finger_rows
        finger_rows, joint_rows = moving(len(rows), ANGLE_SLICES[index].start, finger, turn)
        joints += [(row, (0.0, 0.0, 0.0)) for row in (len(rows) - 1, *joint_rows)]
        rows += finger_rows
        markers.append((len(rows) - 1, (1e-3 * (finger.marker_mm - finger.bones_mm[2]), 0.0, 0.0)))
    return HandTable(rows, joints, markers)


def _compile_hand(anatomy: HandAnatomy) -> DhArrays:
    rows, joints, markers = hand_table(anatomy)
    if anatomy.side == "left":
        rows = [row.mirrored() for row in rows]  # every point lies on its frame's x axis and stays there
    return compile_table(rows, joints + markers)


def _finger_rows(first: int, angle: int, finger: FingerAnatomy, turn: float) -> tuple[list[DhRow], list[int]]:
    """Abduction about z, then three flexions about the common hinge axis; and the rows ending at PIP, DIP, tip."""
    proximal, medial, distal = (1e-3 * bone for bone in finger.bones_mm)
    return [DhRow(first - 1, theta=turn, alpha=-math.pi / 2, angle=angle),
            DhRow(first, a=proximal, angle=angle + 1),
            DhRow(first + 1, a=medial, angle=angle + 2),
            DhRow(first + 2, a=distal, angle=angle + 3)], [first + 1, first + 2, first + 3]


def _thumb_rows(first: int, angle: int, finger: FingerAnatomy, turn: float) -> tuple[list[DhRow], list[int]]:
    """Two saddle joints (CMC, MCP) of abduction and flexion, then the IP hinge; rows ending at MCP, IP, tip."""
    metacarpal, proximal, distal = (1e-3 * bone for bone in finger.bones_mm)
    return [DhRow(first - 1, theta=turn, alpha=-math.pi / 2, angle=angle),
            DhRow(first, a=metacarpal, alpha=math.pi / 2, angle=angle + 1),
            DhRow(first + 1, alpha=-math.pi / 2, angle=angle + 2),
            DhRow(first + 2, a=proximal, angle=angle + 3),
            DhRow(first + 3, a=distal, angle=angle + 4)], [first + 1, first + 3, first + 4]
