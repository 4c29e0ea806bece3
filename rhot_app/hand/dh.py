"""Denavit-Hartenberg tables: articulated trees of revolute joints, independent of what they describe.

Row k places its frame in the frame of its parent row by Rot_z(theta) Trans_z(d) Trans_x(a) Rot_x(alpha)
(Rehg 1995, eq. 2.2); a row without a parent stands in the body's root frame, for a hand the palm. A moving row
adds sign * angle to its theta.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

ROOT = -1
FIXED = -1


@dataclass(frozen=True, slots=True)
class DhRow:
    """One row. Lengths in m, angles in rad. `angle`: index of the joint angle that turns the row, or FIXED."""

    parent: int  # an earlier row, or ROOT
    theta: float = 0.0
    d: float = 0.0
    a: float = 0.0
    alpha: float = 0.0
    angle: int = FIXED
    sign: float = 1.0

    def mirrored(self) -> DhRow:
        """The row of the body mirrored in y: x and z translations stay, turns about x and z change sign."""
        return DhRow(self.parent, -self.theta, self.d, self.a, -self.alpha, self.angle, -self.sign)


class DhArrays(NamedTuple):
    """A compiled table of R rows and the P points that ride on it, as the numba kinematics takes it.

    `parent` (R,), `theta` (R,), `d` (R,), `a` (R,), `cos_alpha` (R,), `sin_alpha` (R,), `angle` (R,), `sign` (R,);
    `point_row` (P,): the row whose frame carries the point (ROOT: the root frame), `point_offset` (P, 3) m in it.
    """

    parent: Indices
    theta: Array
    d: Array
    a: Array
    cos_alpha: Array
    sin_alpha: Array
    angle: Indices
    sign: Array
    point_row: Indices
    point_offset: Array


def compile_table(rows: Sequence[DhRow], points: Sequence[tuple[int, tuple[float, float, float]]]) -> DhArrays:
    """Arrays of a table and its points (row, offset in the row's frame, m).

    Raises ValueError when a row's parent does not come before it or a point rides on a row that does not exist.
    """
    for index, row in enumerate(rows):
        if not ROOT <= row.parent < index:
            raise ValueError(f"DH row {index} names parent {row.parent}, which is not an earlier row")

    def column(name: str) -> Array:
        return np.array([getattr(row, name) for row in rows], dtype=np.float64)

    table = DhArrays(
        parent=np.array([row.parent for row in rows], dtype=np.int64),
        theta=column("theta"), d=column("d"), a=column("a"),
        cos_alpha=np.cos(column("alpha")), sin_alpha=np.sin(column("alpha")),
        angle=np.array([row.angle for row in rows], dtype=np.int64), sign=column("sign"),
        point_row=np.empty(0, dtype=np.int64), point_offset=np.empty((0, 3)),
    )
    return riding_points(table, points)


def riding_points(table: DhArrays, points: Sequence[tuple[int, tuple[float, float, float]]]) -> DhArrays:
    """The table with these points (row, offset in the row's frame, m) instead of its own.

    Raises ValueError when a point rides on a row that does not exist.
    """
    for index, (row, _) in enumerate(points):
        if not ROOT <= row < len(table.parent):
            raise ValueError(f"point {index} rides on DH row {row}, which does not exist")
    return table._replace(point_row=np.array([row for row, _ in points], dtype=np.int64),
                          point_offset=np.array([offset for _, offset in points], dtype=np.float64).reshape(-1, 3))


def rigid_rows(parent: int, first: int, rotation: Array, translation: Array) -> tuple[list[DhRow], float]:
    """Two fixed rows, numbered `first` and `first` + 1, and a left-over turn that reach any frame from `parent`.

    The first row goes to `translation` (3,) m; the second begins `rotation` (3, 3), written as turns about z, x
    and z. The last turn, rad, is returned: the row that follows adds it to its own theta.
    """
    x, y, z = (float(value) for value in translation)
    heading = math.atan2(y, x)
    cos, sin = math.cos(heading), math.sin(heading)
    rest = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ rotation
    alpha = math.atan2(math.hypot(rest[0, 2], rest[1, 2]), rest[2, 2])
    if math.sin(alpha) > 1e-9:
        before, after = math.atan2(rest[0, 2], -rest[1, 2]), math.atan2(rest[2, 0], rest[2, 1])
    else:  # both z axes are parallel: one turn about them says it all
        before, after = math.atan2(rest[1, 0], rest[0, 0]), 0.0
    return [DhRow(parent, theta=heading, d=z, a=math.hypot(x, y)),
            DhRow(first, theta=before, alpha=alpha)], after
