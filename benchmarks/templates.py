"""Layered templates and visibility orders, with known truth.

    python benchmarks/templates.py [--only crossing,order,turning] [--seeds 3] [--poses 10000] [--seconds 60]
        [--hand-seed 1] [--outline]

crossing: two planar fingers curl by turns before one camera at 15 Hz, with and without layers (Rehg 1995, 4.4.2).
order: the visibility order of a 27-degree hand against a depth buffer. turning: a textured hand of the digital twin
turns to and fro at 90 degrees per second, 60 Hz, two cameras. Pictures come from meshes that no tracker knows.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
import time
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), *(str(ROOT / "tests" / name) for name in ("", "barehand", "articulated"))]

from bare_scenes import model_and_surface  # noqa: E402
from depth_buffer import depth_labels  # noqa: E402
from objects import Followed, object_of  # noqa: E402
from painted_object import meshes_of, picture, waves  # noqa: E402
from pictures import look_at, wall  # noqa: E402
from shipped_rig import RIGHT_HAND  # noqa: E402

from rhot_app.articulated.bodies import ANGLES, camera_rays, hand_bodies, place  # noqa: E402
from rhot_app.articulated.visibility import segment, visibility  # noqa: E402
from rhot_app.export.layers_picture import draw_layers  # noqa: E402
from rhot_app.geometry.camera import CameraModel  # noqa: E402
from rhot_app.hand.kinematics import forward  # noqa: E402
from rhot_app.hand.limits import pose_prior  # noqa: E402
from rhot_app.hand.motion.hand_process import FASTEST, PALM_SPREAD, HandProcess  # noqa: E402
from rhot_app.hand.motion.hand_state import pose_of  # noqa: E402
from rhot_app.hand.skeleton import HandPose  # noqa: E402
from rhot_app.simulator.bare_hand.painter import BareHand, BareHandPainter, light_of  # noqa: E402
from rhot_app.simulator.bare_hand.skin import skin_colours  # noqa: E402
from rhot_app.simulator.bare_hand.surface import build_surface  # noqa: E402
from rhot_app.simulator.render.exposure_samples import FrameTime, Shutter  # noqa: E402
from rhot_app.simulator.render.painter import lit_image  # noqa: E402
from rhot_app.tracking.kinds.templates import (  # noqa: E402
    ConstantVelocity,
    LayeredTrack,
    free_of,
    rest_of,
)

CURL_HZ = 15.0
SAME_M = 1e-6


def curling(t_s: float) -> np.ndarray:
    """Degrees: both fingers curl fully in a second, one opens while the other closes."""
    part = 0.5 - 0.5 * np.cos(np.pi * t_s)
    return np.array([10.0 + 80.0 * part, 10.0 + 90.0 * part, 90.0 - 80.0 * part, 100.0 - 90.0 * part])


def crossing(seeds: int, texture: float = 0.15, frames: int = 61) -> None:
    model, bodies, _ = object_of("two_fingers")
    camera = look_at(np.array([0.10, -0.28, 0.27]), np.array([0.04, 0.0, 0.0]), focal=700.0)
    root, _ = rest_of(model)
    print(f"two fingers, one camera, {CURL_HZ:.0f} Hz, {frames - 1} frames; rms error of the angles, degrees")
    print("seed  layers  first mcp    pip  second mcp   pip   largest   ms a frame")
    for seed in range(seeds):
        meshes, background = meshes_of(model, seed, texture), wall(camera, seed, False)
        empty = np.clip(background, 0.0, 255.0).astype(np.uint8)
        images = [picture(model, meshes, root, np.radians(curling(k / CURL_HZ)), camera, background, 100 * seed + k)
                  for k in range(frames)]
        for layered in (True, False):
            process = ConstantVelocity(free_of(model), pace_hz=0.75)
            track = LayeredTrack("fingers", bodies, model.limits, process, [camera], layered=layered,
                                 backgrounds=[empty])
            scene = Followed(track, [camera])
            scene.start(process.start(root, np.radians(curling(0.0))), [images[0]])
            errors, begun = [], time.process_time()
            for k in range(1, frames):
                state = scene.see([images[k]], round(1e9 * k / CURL_HZ))
                errors.append(np.degrees(state[ANGLES:ANGLES + 4]) - curling(k / CURL_HZ))
            spent = 1e3 * (time.process_time() - begun) / (frames - 1)
            rms = np.sqrt(np.mean(np.square(errors), axis=0))
            print(f"{seed:4d}  {'yes' if layered else 'no':6s}  {rms[0]:9.2f} {rms[1]:6.2f}  {rms[2]:10.2f} "
                  f"{rms[3]:5.2f}  {np.abs(errors).max():8.1f}  {spent:11.1f}", flush=True)


def order(poses: int) -> None:
    model, surface = model_and_surface()
    bodies, _ = hand_bodies(surface)
    camera = look_at(np.zeros(3), np.array([0.0, 0.0, 0.5]), focal=150.0, width=160, height=120)
    rays, record = camera_rays(camera), camera.record
    rng, covariance = np.random.default_rng(1), np.linalg.inv(pose_prior().information)
    wrong = deep = digits = cyclic = above = 0
    worst, spent = 0.0, 0.0
    for _ in range(poses):
        angles = np.clip(rng.multivariate_normal(pose_prior().mean, covariance), *model.limits.T)
        root = np.eye(4)
        root[:3, :3] = Rotation.random(random_state=rng).as_matrix()
        root[:3, 3] = [0.0, 0.0, 0.5] - 0.09 * root[:3, 0]
        placed = place(bodies, root, angles)
        begun = time.process_time()
        seen = visibility(bodies, placed, record)
        spent += time.process_time() - begun
        labels = segment(bodies, placed, seen.order, record, rays)
        nearest, depth = depth_labels(bodies, placed, camera, rays, labels >= 0)
        digit = (labels >= 0) & ((labels < 15) | (nearest < 15))
        own = np.take_along_axis(depth, np.maximum(labels, 0)[..., None], 2)[..., 0]
        behind = own[digit] - depth.min(axis=2)[digit]
        part = float(np.mean(behind > SAME_M))
        wrong, deep, digits = wrong + np.sum(behind > SAME_M), deep + np.sum(behind > 3e-3), digits + len(behind)
        cyclic, above, worst = cyclic + seen.cyclic, above + (part > 0.01), max(worst, part)
    print(f"visibility order of a hand, {poses} poses of the prior, turned anyhow, against a depth buffer")
    print(f"digit pixels that differ        {100.0 * wrong / digits:6.3f} %")
    print(f"  by more than 3 mm of depth    {100.0 * deep / digits:6.3f} %")
    print(f"poses with more than 1 %        {100.0 * above / poses:6.2f} %   worst pose {100.0 * worst:.1f} %")
    print(f"cyclic orders, cut              {100.0 * cyclic / poses:6.2f} %")
    print(f"processor time of an order      {1e3 * spent / poses:6.2f} ms", flush=True)


class Turning:
    """A hand with its fingers up that turns about the vertical at `speed` rad/s; a `PoseSource`. `amplitude` rad: it
    turns to and fro by so much, at most as fast; 0: on and on."""

    def __init__(self, angles: np.ndarray, distance_m: float, speed: float, amplitude: float) -> None:
        self.angles, self.distance_m, self.speed, self.amplitude = angles, distance_m, speed, amplitude

    def sample(self, times_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As `PoseSource`."""
        out = np.tile(np.eye(4), (len(times_s), 1, 1))
        up = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # columns: palm x, y, z in the world
        for k, t in enumerate(times_s):
            turned = self.speed * t
            if self.amplitude:
                turned = self.amplitude * np.sin(self.speed * t / self.amplitude)
            out[k, :3, :3] = Rotation.from_rotvec([0.0, turned, 0.0]).as_matrix() @ up
            out[k, :3, 3] = [0.0, 0.09, self.distance_m]
        return out, np.tile(self.angles, (len(times_s), 1))


def textured_hand(source: Turning, seed: int) -> BareHand:
    surface = build_surface(RIGHT_HAND, spacing_m=2e-3)
    rng = np.random.default_rng(seed)
    colours = skin_colours(surface, 4.0, None, seed) * np.exp(0.2 * waves(surface.right, rng))[:, None]
    arm = source.sample(np.zeros(1))[0][0, :3, 0]
    return BareHand(surface, np.clip(colours, 6.0, 250.0), arm, light_of((0.3, -0.2)), 0.5)


def filmed(painters: list[BareHandPainter], walls: list[np.ndarray], source: Turning, t_s: float,
           seed: int) -> list[np.ndarray]:
    shutter, out = Shutter(4e-3, 0.0), []
    for c, painter in enumerate(painters):
        lit = lit_image(walls[c], np.ones(3))
        painter.paint(lit, source, FrameTime(shutter, lit.image.shape[1], t_s), 0)
        noise = np.random.default_rng([seed, c]).normal(0.0, 2.0, lit.image.shape[1:])
        smooth = cv2.GaussianBlur(lit.image.transpose(1, 2, 0), (0, 0), 0.7) + noise[..., None]
        out.append(np.clip(smooth + 0.5, 0.0, 255.0).astype(np.uint8))
    return out


def two_cameras() -> list[CameraModel]:
    return [look_at(np.array([x, 0.0, 0.0]), np.array([0.0, 0.0, 0.45])) for x in (-0.12, 0.12)]


def turning(seconds: float, seed: int = 1, outline: bool = False, amplitude_deg: float = 35.0, rate_hz: float = 60.0,
            speed_deg: float = 90.0, show: Path | None = None) -> None:
    model, surface = model_and_surface()
    bodies, _ = hand_bodies(surface)
    cameras, source = two_cameras(), Turning(pose_prior().mean.copy(), 0.45, *np.radians([speed_deg, amplitude_deg]))
    hand = textured_hand(source, seed)
    walls = [np.ascontiguousarray(wall(camera, k, False).transpose(2, 0, 1), np.float32)
             for k, camera in enumerate(cameras)]
    painters = [BareHandPainter(hand, camera, samples=4) for camera in cameras]
    empty = [np.clip(one.transpose(1, 2, 0), 0.0, 255.0).astype(np.uint8) for one in walls]
    natural = pose_prior()
    process = HandProcess(surface.dh, model.limits, natural.mean, np.asarray(np.linalg.inv(natural.information)),
                          PALM_SPREAD, np.full(3, FASTEST), FASTEST, np.zeros((0, 3, 3)), 1.0)
    track = LayeredTrack("hand", bodies, model.limits, process, cameras, outline=outline, backgrounds=empty)
    scene = Followed(track, cameras)
    away, spent = [], 0.0
    for k in range(round(seconds * rate_hz)):
        images = filmed(painters, walls, source, k / rate_hz, k)
        world, angles = (one[0] for one in source.sample(np.array([k / rate_hz])))
        if k == 0:
            scene.start(process.start(world, angles, (1e-3, 0.01)), images)
            continue
        begun = time.process_time()
        state = scene.see(images, round(1e9 * k / rate_hz))
        spent += time.process_time() - begun
        found = pose_of(state).world_from_palm
        joints = [forward(model, HandPose(*pose)).joints
                  for pose in ((found, state[ANGLES:ANGLES + 21]), (world, angles))]
        away.append(1e3 * (joints[0] - joints[1]))
        if show is not None and k % 10 == 0:
            drawn = [draw_layers(images[c], bodies, place(bodies, found, state[ANGLES:ANGLES + 21]), camera,
                                 track.views[c].rays) for c, camera in enumerate(cameras)]
            cv2.imwrite(str(show / f"turning_{k:04d}.png"), np.hstack([images[0], *drawn])[100:, :, ::-1])
            tips = np.linalg.norm(away[-1], axis=1)[[0, 4, 8, 12, 16, 20]]
            print(k, np.round(tips, 1), len(track.templates.templates), flush=True)
    away = np.array(away)
    errors = np.linalg.norm(away, axis=2)
    way = f"to and fro by {amplitude_deg:.0f} degrees" if amplitude_deg else "on and on"
    print(f"a textured hand (seed {seed}) turning {way} at {speed_deg:.0f} degrees/s, {rate_hz:.0f} Hz, two cameras, "
          f"{'with' if outline else 'without'} the boundary part")
    print("seconds   mean joint error mm   wrist mm   median   p95   largest joint mm")
    period = round(10.0 * rate_hz)
    for first in range(0, len(errors), period):
        part = errors[first:first + period]
        print(f"{round(first / rate_hz):3d}-{round((first + len(part)) / rate_hz):3d}   {part.mean():19.2f}   "
              f"{part[:, 0].mean():8.2f}   {np.median(part):6.2f} {np.percentile(part, 95):5.2f}   "
              f"{part.max():16.1f}")
    turn = round(2.0 * np.pi * amplitude_deg / speed_deg * rate_hz) if amplitude_deg else len(away)
    if len(away) >= 2 * turn:  # drift: the mean error vector of the last turn less that of the first, by joint
        drift = np.linalg.norm(away[-turn:].mean(axis=0) - away[:turn].mean(axis=0), axis=1)
        print(f"drift of the joints over {len(away) / rate_hz:.0f} s, mm: median {np.median(drift):.2f}, worst "
              f"{drift.max():.2f}, wrist {drift[0]:.2f}")
    print(f"templates {len(track.templates.templates)}, processor time {1e3 * spent / max(len(errors), 1):.0f} ms a "
          "frame")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="crossing,order,turning")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--poses", type=int, default=10_000)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--hand-seed", type=int, default=1, help="texture of the turning hand")
    parser.add_argument("--outline", action="store_true", help="turning: compare outlines, too")
    arguments = parser.parse_args()
    for name in arguments.only.split(","):
        {"crossing": lambda: crossing(arguments.seeds), "order": lambda: order(arguments.poses),
         "turning": lambda: turning(arguments.seconds, arguments.hand_seed, arguments.outline)}[name]()


if __name__ == "__main__":
    main()
