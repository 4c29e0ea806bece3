"""From the rig frame to the screen's world (z up).

Meshes take the rig frame as the left camera's: x right, y down, z away. A rig whose world lies on a table (`up` is z)
is brought into such axes at the scene's door, with the table on the floor grid.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import lens_parameters, lens_rays
from rhot_app.project import CameraPose, Intrinsics
from rhot_app.state import HandState
from rhot_app.ui.language import tr

# -- Floor grid and axes -----------------------------------------------------------------------------------------------

Array = NDArray[np.float64]

FLOOR_M = -0.2
"""Height of the floor grid in the scene's frame: 200 mm below the rig's origin, where a desk usually is."""

TABLE_ORIGIN = (0.0, 0.5, FLOOR_M)
"""Where the origin of a rig frame that lies on a table is drawn: on the floor, in the middle of the grid."""

X_RANGE = (-0.4, 0.4)
Y_RANGE = (0.0, 1.0)
Z_RANGE = (FLOOR_M, 0.4)
CELL_M = 0.1
TICK_M = 0.2


@dataclass(frozen=True, slots=True)
class Label:
    """A text at a place in the scene's frame, m."""

    place: tuple[float, float, float]
    text: str


def _steps(low: float, high: float, step: float) -> Array:
    numbers = np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1)
    return np.asarray(numbers * step + 0.0)  # turns -0.0 into 0.0


def floor_lines() -> tuple[Array, NDArray[np.bool_]]:
    """Segments (2 L, 3) m of the grid, and (2 L,) True where a line is a strong one (every 200 mm)."""
    segments, strong = [], []
    for x in _steps(*X_RANGE, CELL_M):
        segments += [(x, Y_RANGE[0], FLOOR_M), (x, Y_RANGE[1], FLOOR_M)]
        strong += [_is_tick(x)] * 2
    for y in _steps(*Y_RANGE, CELL_M):
        segments += [(X_RANGE[0], y, FLOOR_M), (X_RANGE[1], y, FLOOR_M)]
        strong += [_is_tick(y)] * 2
    return np.array(segments), np.array(strong)


def _is_tick(value: float) -> bool:
    return abs(value / TICK_M - round(value / TICK_M)) < 1e-6


def height_lines() -> Array:
    """Segments (2 L, 3) m of the upright scale at the grid's far left corner, with a short dash every 100 mm."""
    x, y = X_RANGE[0], Y_RANGE[1]
    segments = [(x, y, Z_RANGE[0]), (x, y, Z_RANGE[1])]
    for z in _steps(*Z_RANGE, CELL_M):
        dash = 0.024 if _is_tick(z) else 0.012
        segments += [(x, y, z), (x + dash, y, z)]
    return np.array(segments)


def axis_lines(length_m: float = 0.08, *, on_table: bool = False) -> tuple[Array, Array]:
    """The rig frame's own axes at its origin: segments (6, 3) m in the scene's frame and colours (6, 4) 0..1."""
    origin = np.array(TABLE_ORIGIN if on_table else (0.0, 0.0, 0.0))
    segments = np.array([point for axis in _axes(on_table) for point in (origin, origin + length_m * axis)])
    colours = np.array([(0.90, 0.45, 0.35, 1.0), (0.35, 0.75, 0.50, 1.0), (0.40, 0.65, 0.95, 1.0)])
    return segments, np.repeat(colours, 2, axis=0)


def axis_labels(length_m: float = 0.092, *, on_table: bool = False) -> list[Label]:
    """Names of the rig frame's axes at their ends."""
    origin = np.array(TABLE_ORIGIN if on_table else (0.0, 0.0, 0.0))
    ends = [origin + length_m * axis for axis in _axes(on_table)]
    return [Label((float(x), float(y), float(z)), name) for (x, y, z), name in zip(ends, "xyz", strict=True)]


def _axes(on_table: bool) -> Array:
    """Directions (3, 3) of the rig frame's x, y and z in the scene: a table's are the scene's own."""
    return np.eye(3) if on_table else np.array([(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)])


def tick_labels(*, on_table: bool = False) -> list[Label]:
    """Numbers along the grid's edges in the rig's axes, mm: x in front; at the right z, or a table's y; height."""
    away, zero, floor = ("y", TABLE_ORIGIN[1], FLOOR_M) if on_table else ("z", 0.0, 0.0)
    labels = [Label((float(x), Y_RANGE[0] - 0.035, FLOOR_M), f"{x * 1e3:.0f}") for x in _steps(*X_RANGE, TICK_M)]
    labels.append(Label((0.3, Y_RANGE[0] - 0.035, FLOOR_M), "x [mm]"))
    labels += [Label((X_RANGE[1] + 0.03, float(y), FLOOR_M), f"{round((y - zero) * 1e3)}")
               for y in _steps(*Y_RANGE, TICK_M)]
    labels.append(Label((X_RANGE[1] + 0.03, 0.9, FLOOR_M), f"{away} [mm]"))
    labels += [Label((X_RANGE[0] - 0.05, Y_RANGE[1], float(z)), f"{abs(z - floor) * 1e3:.0f}")
               for z in _steps(floor, Z_RANGE[1], TICK_M)]
    labels.append(Label((X_RANGE[0] - 0.05, Y_RANGE[1], Z_RANGE[1] - 0.1), tr("up [mm]")))
    return labels


# -- From the rig frame to the screen's world (z up) -------------------------------------------------------------------

DISPLAY_FROM_RIG: Array = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotation: right stays right, away from the camera becomes +y, up becomes +z."""


Up = Literal["-y", "z"]
"""Which axis of the rig frame points up, as the rig says."""


def camera_like(points: Array, up: Up) -> Array:
    """Rig-frame points (..., 3) m in axes like the left camera's."""
    return points if up == "-y" else (points + np.array(TABLE_ORIGIN)) @ DISPLAY_FROM_RIG


def camera_like_state(state: HandState, up: Up) -> HandState:
    """What the scene draws of `state` and of its other hand, in axes like the left camera's."""
    if up == "-y":
        return state
    turn = DISPLAY_FROM_RIG.T
    palm = _camera_like_pose(state.world_from_palm, up)
    return replace(state, marker_positions=camera_like(state.marker_positions, up), world_from_palm=palm,
                   joint_positions=camera_like(state.joint_positions, up),
                   fingertip_positions=camera_like(state.fingertip_positions, up),
                   marker_covariances=turn @ state.marker_covariances @ turn.T,
                   joint_covariances=turn @ state.joint_covariances @ turn.T,
                   fingertip_covariances=turn @ state.fingertip_covariances @ turn.T,
                   objects=tuple(replace(one, world_from_object=_camera_like_pose(one.world_from_object, up))
                                 for one in state.objects),
                   other=None if state.other is None else camera_like_state(state.other, up))


def _camera_like_pose(pose: Array, up: Up) -> Array:
    """(4, 4) a pose in axes like the left camera's."""
    out = pose.copy()
    out[:3, :3], out[:3, 3] = DISPLAY_FROM_RIG.T @ pose[:3, :3], camera_like(pose[:3, 3], up)
    return out


def to_display(points: Array) -> Array:
    """Rig-frame points or directions (..., 3) in the scene's frame, same unit."""
    return np.asarray(points @ DISPLAY_FROM_RIG.T)


def rotation_of(wxyz: tuple[float, float, float, float]) -> Array:
    """(3, 3) rotation of a unit quaternion wxyz."""
    w, x, y, z = np.asarray(wxyz, dtype=np.float64) / np.linalg.norm(wxyz)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def frustum_lines(intrinsics: Intrinsics, pose: CameraPose, depth_m: float, up: Up = "-y") -> Array:
    """A camera's field of view up to `depth_m` as line segments (20, 3), pairs of ends, scene frame, m.

    Four edges from the centre to the corners, the far rectangle, and a small roof over its top edge that says where
    the picture's up is. A corner without a ray is drawn as if the lens had no distortion.
    """
    right, low = intrinsics.width - 0.5, intrinsics.height - 0.5
    pixels = np.array([[-0.5, -0.5], [right, -0.5], [right, low], [-0.5, low]])
    lens = lens_parameters(intrinsics)
    rays = lens_rays(pixels, lens)
    corners = depth_m * np.column_stack([np.where(np.isfinite(rays), rays, (pixels - lens[2:4]) / lens[:2]),
                                         np.ones(4)])
    roof = 0.5 * (corners[0] + corners[1]) + np.array([0.0, -0.18 * np.ptp(corners[:, 1]), 0.0])
    centre = np.zeros(3)
    segments = [end for corner in corners for end in (centre, corner)]
    segments += [end for k in range(4) for end in (corners[k], corners[(k + 1) % 4])]
    segments += [corners[0], roof, roof, corners[1]]
    in_rig = np.array(segments) @ rotation_of(pose.rotation_wxyz).T + np.asarray(pose.translation_m)
    return to_display(camera_like(in_rig, up))
