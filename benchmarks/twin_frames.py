"""Frames of the twin's hand, moving or held still in many poses, with the true outlines of its markers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import msgspec
import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.geometry.camera import CameraModel, undistort_point
from rhot_app.simulator.film.shot import make_renderer, make_shot
from rhot_app.simulator.render.body import CYLINDER, HandBody
from rhot_app.simulator.render.painter import PoseSource
from rhot_app.simulator.render.raycast import NO_HIT, PREPARED, hit, prepare
from rhot_app.simulator.render.scanline_bounds import outline
from rhot_app.simulator.scene.scene import Scene, TwinSettings, make_scene, twin_defaults
from rhot_node.detect.image import YuvImage, from_i420

Array = NDArray[np.float64]

WHOLE = 0.999  # visible part of a marker whose outline is the outline of its body
FINE = 8  # samples per pixel along each axis


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
    body, preset = shot.scene_object.thing, scene.preset
    assert isinstance(body, HandBody)
    renderers = [make_renderer(shot, index) for index in (0, 1)]
    for number in range(poses):
        source = _Held(shot.scene_object.source, every_s * (number + 0.5))
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


@dataclass(frozen=True, slots=True)
class Moment:
    """One picture of a moving hand: `place` (M, 2) px, where each marker truly is at its own row's mid-exposure (see
    `places`), and `visible` (M,), its part that nothing hides."""

    image: YuvImage
    place: Array
    visible: Array


def moving_frames(scene: Scene, motion: str, index: int, frames: int) -> Iterator[Moment]:
    """The first `frames` pictures of one camera."""
    shot = make_shot(scene, motion, frames / scene.preset.fps)
    body, renderer, preset = shot.scene_object.thing, make_renderer(shot, index), scene.preset
    assert isinstance(body, HandBody)
    for number, t_ns in enumerate(scene.frame_times_ns(index, 2.0 + frames / preset.fps)[:frames]):
        packed, visible = renderer.render(shot.scene_object.source, 1e-9 * t_ns, number)
        yield Moment(from_i420(packed.copy(), preset.width, preset.height),
                     places(body, scene.camera(index), shot.scene_object.source, 1e-9 * t_ns, 1e-9 * scene.row_time_ns),
                     visible.copy())


def places(body: HandBody, camera: CameraModel, source: PoseSource, t_row0_s: float, row_time_s: float) -> Array:
    """(M, 2) px: the centroid of each painted solid's outline, of a band the middle of the silhouette of its ellipsoid
    (`geometry.camera.point_rays`: what the master takes its place for), at the time of the very row it is in."""
    transforms, angles = source.sample(np.array([t_row0_s]))
    rows = camera.project(body.marker_positions(transforms, angles)[0])[:, 1]
    points = np.full((body.marker_count, 2), np.nan)
    for n in range(int((body.solids.marker >= 0).sum())):  # painted solids come first
        marker = body.solids.marker[n]
        for _ in range(2):
            transforms, angles = source.sample(np.array([t_row0_s + row_time_s * rows[marker]]))
            solid = body.place(camera.camera_from_world @ transforms, angles)[0, n]
            points[marker] = _band_middle(camera, solid, body.solids.size[n]) if body.solids.kind[n] == CYLINDER else \
                _outline_centroid(body.solids.kind[n], solid, body.solids.size, n, camera.intrinsics)
            rows[marker] = points[marker, 1]
    return points


def _band_middle(camera: CameraModel, solid: Array, size: Array) -> Array:
    """(2,) px: the centre of the conic that the ellipsoid of a cylinder in the camera's frame is seen as."""
    centre, axes = solid[:3], solid[3:].reshape(3, 3).T
    shape = (axes * np.square(size)) @ axes.T
    depth2 = centre[2] ** 2 - shape[2, 2]
    ray = np.append((centre[:2] * centre[2] - shape[:2, 2]) / depth2, 1.0)
    world_from_camera = np.linalg.inv(camera.camera_from_world)
    return np.asarray(camera.project((world_from_camera[:3, :3] @ ray + world_from_camera[:3, 3])[None])[0])


def outlines(body: HandBody, camera: CameraModel, source: PoseSource) -> Array:
    """(M, 2) px: the centroid of each painted solid's outline, nothing before it."""
    transforms, angles = source.sample(np.zeros(1))
    parameters = body.place(camera.camera_from_world @ transforms, angles)[0]
    points = np.full((body.marker_count, 2), np.nan)
    for n in range(int((body.solids.marker >= 0).sum())):
        points[body.solids.marker[n]] = _outline_centroid(body.solids.kind[n], parameters[n], body.solids.size, n,
                                                          camera.intrinsics)
    return points


@njit(cache=True)
def _outline_centroid(kind, row, size, n, intrinsics):
    prepared = np.empty((1, len(size), PREPARED))
    prepare(kind, row, size, prepared, 0, n)
    u0, v0, u1, v1, reach = outline(kind, row, size, n, intrinsics)
    if not reach > 0.0:
        return np.array([np.nan, np.nan])
    x0, x1 = np.floor(min(u0, u1) - reach) - 2.0, np.ceil(max(u0, u1) + reach) + 2.0
    y0, y1 = np.floor(min(v0, v1) - reach) - 2.0, np.ceil(max(v0, v1) + reach) + 2.0
    count, sum_x, sum_y = 0, 0.0, 0.0
    for j in range(int(y1 - y0) * FINE):
        for i in range(int(x1 - x0) * FINE):
            x, y = x0 + (i + 0.5) / FINE, y0 + (j + 0.5) / FINE
            rx, ry, _, _, _, _ = undistort_point(x, y, intrinsics)
            if hit(kind, prepared, 0, n, rx, ry) < NO_HIT:
                count += 1
                sum_x += x
                sum_y += y
    return np.array([sum_x, sum_y]) / count if count > 0 else np.array([np.nan, np.nan])
