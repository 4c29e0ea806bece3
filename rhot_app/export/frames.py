"""The frame and the axes in which an export states positions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.export.states import HandStates

Array = NDArray[np.float64]

Frame = Literal["rig", "wrist"]
Up = Literal["-y", "z"]
Axes = Literal["own", "y-up", "z-up"]

_SAME: Final = np.eye(3)
_HALF_TURN: Final = np.diag([1.0, -1.0, -1.0])  # x right, y down, z away -> x right, y up, z towards the viewer
_Z_TO_Y: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # x, y forward, z up -> x, y up, z back
_Y_DOWN_TO_Z: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # x right, y down, z away -> z up


def file_from_frame(up: Up, axes: Axes) -> Array:
    """(3, 3) rotation from a frame whose `up` points up (as in the rig file) to the axes of a file."""
    if axes == "own":
        return _SAME
    if axes == "y-up":
        return _HALF_TURN if up == "-y" else _Z_TO_Y
    return _Y_DOWN_TO_Z if up == "-y" else _SAME


def frame_up(up: Up, frame: Frame) -> Up:
    """Which axis points up: the rig's, or in the wrist's frame the one out of the back of the hand."""
    return up if frame == "rig" else "z"


def in_frame(states: HandStates, frame: Frame) -> HandStates:
    """The positions of `states` in the rig frame (as they are), or each relative to the wrist joint along the axes of
    the palm frame (docs/conventions.md).

    In the wrist's frame, covariances of positions are NaN: they would be those of differences, which are not known
    (docs/states.md). `world_from_palm` stays in the rig frame. Markers are relative to the first hand's wrist, those of
    `other` to its own.
    """
    if frame == "rig":
        return states
    changed: dict[str, Any] = {}
    for name in ("marker_positions", "marker_raw_positions", "joint_positions", "fingertip_positions"):
        changed[name] = _relative(states.world_from_palm, getattr(states, name))
    for name in ("marker_covariances", "joint_covariances", "fingertip_covariances"):
        changed[name] = np.full_like(getattr(states, name), np.nan)
    other = None if states.other is None else in_frame(states.other, frame)
    return replace(states, **changed, other=other)


def _relative(world_from_palm: Array, positions: Array) -> Array:
    """(N, P, 3) m in the palm frame of each state, of positions in the rig frame."""
    rotation, origin = world_from_palm[:, :3, :3], world_from_palm[:, None, :3, 3]
    return np.asarray((positions - origin) @ rotation)
