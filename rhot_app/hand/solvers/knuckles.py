"""Cones and parabolas at the knuckles, for solvers that know boxes only.

A finger bends in one plane through its abduction axis, so its target alone says how far it is abducted. What a cone
or parabola then leaves of the flexion is a range again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rhot_app.hand.finger_chain import fold_abduction
from rhot_app.hand.skeleton import ANGLE_SLICES, FINGERS
from rhot_app.hand.solvers.joint_shapes import Shape, slice_flexion
from rhot_app.hand.solvers.problem import Problem

ON_AXIS = 1e-9
"""A target nearer to the abduction axis than this, m, does not show the finger's plane: the start's stands."""


def shape_knuckles(problem: Problem, shape: Shape) -> Problem:
    """The same problem with the limits of the four fingers' MCP joints as a CONE or PARABOLA instead of a box.

    The abduction is held where the target shows it, or at the end of its range. The thumb keeps its boxes.
    Raises ValueError when a range leaves out the joint's own axis, where neither shape has a middle.
    """
    limits = problem.limits.copy()
    for finger in range(1, len(FINGERS)):
        rows, target = ANGLE_SLICES[finger], problem.targets[finger]
        bounds = problem.limits[rows][:2]
        if (bounds[:, 0] > 0.0).any() or (bounds[:, 1] < 0.0).any():
            raise ValueError(f"the {FINGERS[finger]} finger's MCP limits leave out its straight pose")
        if not np.isfinite(target).all():
            continue
        shown = fold_abduction(target[0], target[1], ON_AXIS, problem.start[rows][0])
        abduction = min(max(shown, bounds[0, 0]), bounds[0, 1])
        limits[rows.start] = abduction
        limits[rows.start + 1] = slice_flexion(int(shape), bounds, abduction)
    return replace(problem, limits=limits)
