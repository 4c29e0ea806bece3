"""A recording sent through candidate filters as the tracker does it: filter pixels, triangulate, filter metres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.calibration.observations import InstantTable
from rhot_app.filters import one_euro
from rhot_app.geometry.camera import CameraModel, undistort_point
from rhot_app.geometry.triangulate import triangulate
from rhot_app.project import CameraPose, Intrinsics, Rig

Array = NDArray[np.float64]

OFF = (math.inf, 0.0, 1.0)
"""Parameters of a 1-euro filter that changes nothing."""


@dataclass(frozen=True, slots=True)
class Footage:
    """What the filters work on. `times_s` (T,); `pixels` (T, C, M, 2), NaN where not to be used; `intrinsics` (C, 9),
    `cameras` (C, 3, 4) camera_from_world m, `focal` (C, 2) px."""

    times_s: Array
    pixels: Array
    intrinsics: Array
    cameras: Array
    focal: Array

    @property
    def markers(self) -> int:
        """M."""
        return self.pixels.shape[2]


def make_footage(instants: InstantTable, rig: Rig) -> Footage:
    """The measured part of a recording; a rig without stereo geometry gets the cameras that eq. 6.12 assumes."""
    pixels = np.where(instants.measured[:, None, :, None], instants.pixels, np.nan)
    models = [CameraModel.from_rig(lens, pose) for lens, pose in _lenses(rig)]
    return Footage(instants.times_s, np.ascontiguousarray(pixels), np.array([model.intrinsics for model in models]),
                   np.array([model.camera_from_world[:3] for model in models]),
                   np.array([model.intrinsics[:2] for model in models]))


def simulate(footage: Footage, pixel: Array, position: Array) -> tuple[Array, Array]:
    """Filtered pixels (T, C, M, 2) and positions (T, M, 3) with parameters (M, 3) of both filters."""
    cameras, markers = footage.pixels.shape[1:3]
    pixels, positions = np.empty_like(footage.pixels), np.empty((len(footage.times_s), markers, 3))
    _run(footage.times_s, footage.pixels, footage.intrinsics, footage.cameras, footage.focal,
         np.tile(np.repeat(pixel, 2, axis=0), (cameras, 1)), np.repeat(position, 3, axis=0), one_euro.RESET_GAP_S,
         pixels, positions)
    return pixels, positions


def _lenses(rig: Rig) -> list[tuple[Intrinsics, CameraPose]]:
    if rig.depth.mode == "stereo":
        return [(node.intrinsics, node.pose) for node in rig.nodes]
    found = []
    for k, node in enumerate(rig.nodes):
        width, height = node.intrinsics.width, node.intrinsics.height
        focal = 0.5 * width / math.tan(0.5 * math.radians(rig.depth.view_angle_deg))
        lens = Intrinsics(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1))
        found.append((lens, CameraPose(translation_m=(k * rig.depth.baseline_m, 0.0, 0.0))))
    return found


@njit(cache=True)
def _run(times: Array, seen: Array, intrinsics: Array, cameras: Array, focal: Array, pixel_parameters: Array,
         position_parameters: Array, gap_s: float, pixels: Array, positions: Array) -> None:
    count, markers = seen.shape[1], seen.shape[2]
    pixel_state = np.full((2 * count * markers, 3), math.nan)
    position_state = np.full((3 * markers, 3), math.nan)
    rays, spread, used = np.empty((count, 2)), np.zeros((count, 2, 2)), np.empty(count, np.bool_)
    covariance = np.empty((3, 3))
    for c in range(count):
        spread[c, 0, 0], spread[c, 1, 1] = 1.0 / focal[c, 0] ** 2, 1.0 / focal[c, 1] ** 2
    for t in range(len(times)):
        one_euro.step(times[t], seen[t].reshape(-1), pixel_parameters, pixel_state, gap_s, pixels[t].reshape(-1))
        for m in range(markers):
            for c in range(count):
                x, y, _, _, _, _ = undistort_point(pixels[t, c, m, 0], pixels[t, c, m, 1], intrinsics[c])
                rays[c, 0], rays[c, 1] = x, y
                used[c] = math.isfinite(x) and math.isfinite(y)
            triangulate(rays, spread, cameras, focal, used, positions[t, m], covariance)
        flat = positions[t].reshape(-1)
        one_euro.step(times[t], flat, position_parameters, position_state, gap_s, flat)
