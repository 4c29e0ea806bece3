"""Frames of the twin's hand held still in many poses, by both cameras, with the true outlines of its markers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import msgspec
import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel, undistort_point
from rhot_app.simulator.body import HandBody
from rhot_app.simulator.painter import PoseSource
from rhot_app.simulator.raycast import NO_HIT, PREPARED, hit, prepare
from rhot_app.simulator.scene import Scene, TwinSettings, make_scene, twin_defaults
from rhot_app.simulator.shot import make_renderer, make_shot
from rhot_node.detect.image import YuvImage, from_i420

Array = NDArray[np.float64]

WHOLE = 0.999  # visible part of a marker whose outline is the outline of its body
FINE = 8  # samples per pixel along each axis
REACH = 60  # px around a marker's centre that its outline is sought in


@dataclass(frozen=True, slots=True)
class Pose:
    """One pose in both cameras: `frames[camera][k]`, noise apart alike; `outline` (2, M, 2) px, the centroid of each
    marker's outline, and `centre` (2, M, 2) px, where its centre projects; NaN where something hides a part of it."""

    frames: tuple[list[YuvImage], list[YuvImage]]
    outline: Array
    centre: Array


@dataclass(frozen=True)
class _Held:
    """A motion, stopped."""

    motion: PoseSource
    at_s: float

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        return self.motion.sample(np.full(len(times_s), self.at_s))


def twin_scene(background: str = "cloth", preset: str = "wide", distance_m: float = 0.6, seed: int = 1) -> Scene:
    """The twin's defaults but for what is given."""
    merged = msgspec.to_builtins(twin_defaults()) | {
        "preset": preset, "distance_m": distance_m, "background": background}
    return make_scene(msgspec.convert(merged, TwinSettings), seed)


def held_poses(scene: Scene, motion: str, poses: int, frames: int, every_s: float = 0.31) -> Iterator[Pose]:
    """The motion stopped every `every_s`, `frames` pictures each."""
    shot = make_shot(scene, motion, 1.0)
    body, preset = shot.act.thing, scene.preset
    assert isinstance(body, HandBody)
    renderers = [make_renderer(shot, index) for index in (0, 1)]
    for number in range(poses):
        source = _Held(shot.act.source, every_s * (number + 0.5))
        pictures: tuple[list[YuvImage], list[YuvImage]] = ([], [])
        outline, centre = np.full((2, 2, body.marker_count, 2), np.nan)
        for index, renderer in enumerate(renderers):
            for k in range(frames):
                packed, visible = renderer.render(source, 0.0, number * frames + k)
                pictures[index].append(from_i420(packed.copy(), preset.width, preset.height))
            camera = scene.camera(index)
            seen = visible > WHOLE
            outline[index, seen] = outlines(body, camera, source)[seen]
            centre[index, seen] = camera.project(body.marker_positions(*source.sample(np.zeros(1)))[0][seen])
        yield Pose(pictures, outline, centre)


def outlines(body: HandBody, camera: CameraModel, source: PoseSource) -> Array:
    """(M, 2) px: the centroid of each painted solid's outline, nothing before it."""
    transforms, angles = source.sample(np.zeros(1))
    parameters = body.place(camera.camera_from_world @ transforms, angles)[0]
    middles = camera.project(body.marker_positions(transforms, angles)[0])
    points = np.full((body.marker_count, 2), np.nan)
    for n in range(int((body.marker >= 0).sum())):  # painted solids come first
        marker = body.marker[n]
        points[marker] = _outline_centroid(body.kind[n], parameters[n], body.size, n, camera.intrinsics,
                                           middles[marker])
    return points


@njit(cache=True)
def _outline_centroid(kind, row, size, n, intrinsics, middle):
    prepared = np.empty((1, len(size), PREPARED))
    prepare(kind, row, size, prepared, 0, n)
    count, sum_x, sum_y = 0, 0.0, 0.0
    x0, y0 = np.floor(middle[0]) - REACH, np.floor(middle[1]) - REACH
    for j in range(2 * REACH * FINE):
        for i in range(2 * REACH * FINE):
            x, y = x0 + (i + 0.5) / FINE, y0 + (j + 0.5) / FINE
            rx, ry, _, _, _, _ = undistort_point(x, y, intrinsics)
            if hit(kind, prepared, 0, n, rx, ry) < NO_HIT:
                count += 1
                sum_x += x
                sum_y += y
    return np.array([sum_x / count, sum_y / count])
