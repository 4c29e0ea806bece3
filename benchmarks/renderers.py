"""The simulator's two renderers, rays against solids and triangles: where each puts a ball's centre, and its time.

    python benchmarks/renderers.py [--balls 60] [--frames 20]

Truth is the ball's outline, sampled 64 times along each side of a pixel. Both renderers take 16 samples of a pixel.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from numpy.typing import NDArray

from rhot_app.geometry.camera import intrinsics_row
from rhot_app.simulator.bare_hand.rasterise import SAMPLES, accumulate
from rhot_app.simulator.film.shot import make_renderer, make_shot
from rhot_app.simulator.render.exposure_samples import NODES
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.simulator.scene.scene_description import BareHandShow, HandShow

Array = NDArray[np.float64]

SIDE, FOCAL_PX, AWAY_M, RADIUS_M = 96, 600.0, 0.6, 0.009
MIDDLE = SIDE / 2
TRUTH_SAMPLES = 64
FACETS = (16, 32, 64, 128)
ROWS, COLS = (axis.astype(np.float64) for axis in np.mgrid[:SIDE, :SIDE])


def covered(u: Array, v: Array, place: Array) -> NDArray[np.bool_]:
    """Whether rays through px (u, v) hit the ball whose centre is seen at `place` (2,)."""
    x, y = (u - MIDDLE) / FOCAL_PX, (v - MIDDLE) / FOCAL_PX
    cx, cy = (place - MIDDLE) / FOCAL_PX * AWAY_M
    along = x * cx + y * cy + AWAY_M
    return np.asarray(along**2 / (x * x + y * y + 1.0) > cx * cx + cy * cy + AWAY_M**2 - RADIUS_M**2)


def summary(cover: Array, u: Array, v: Array) -> Array:
    """(3,) px, px, px^2: centre and area."""
    total = cover.sum()
    return np.array([(cover * u).sum() / total, (cover * v).sum() / total, total])


def truth(place: Array) -> Array:
    """What the outline encloses."""
    steps = (np.arange(SIDE)[:, None] + (np.arange(TRUTH_SAMPLES) + 0.5) / TRUTH_SAMPLES - 0.5).ravel()
    u, v = np.meshgrid(steps, steps)
    return summary(covered(u, v, place).astype(np.float64), u, v) / (1.0, 1.0, TRUTH_SAMPLES**2)


def by_rays(place: Array, rng: np.random.Generator) -> Array:
    """The ball by a lattice of rays that is shifted at random for each pixel, as `render.rays.scatter` does."""
    cover, shift = np.zeros((SIDE, SIDE)), rng.random((2, SIDE, SIDE))
    for k in range(SAMPLES):
        u, v = COLS + (k + shift[0]) / SAMPLES - 0.5, ROWS + (5 * k % SAMPLES + shift[1]) / SAMPLES - 0.5
        cover += covered(u, v, place)
    return summary(cover / SAMPLES, COLS, ROWS)


def mesh(facets: int) -> tuple[Array, NDArray[np.int64]]:
    """(V, 3) and (T, 3): a ball of radius 1 of so many meridians."""
    polar, around = np.linspace(0.0, np.pi, facets // 2 + 1), np.linspace(0.0, 2.0 * np.pi, facets, endpoint=False)
    vertices = np.array([[np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)] for t in polar for p in around])
    at = np.arange(len(vertices)).reshape(facets // 2 + 1, facets)
    a, b, c, d = at[:-1], np.roll(at[:-1], -1, axis=1), at[1:], np.roll(at[1:], -1, axis=1)
    pairs = np.concatenate([np.stack([a, c, b], axis=-1), np.stack([b, c, d], axis=-1)])
    return vertices, pairs.reshape(-1, 3).astype(np.int64)


def by_triangles(place: Array, ball: tuple[Array, NDArray[np.int64]]) -> Array:
    """The ball as a mesh."""
    vertices, triangles = ball
    count = len(vertices)
    series = np.zeros((count, 3, NODES))
    series[:, :, 0] = RADIUS_M * vertices + [*(place - MIDDLE) / FOCAL_PX * AWAY_M, AWAY_M]
    work = (np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count, np.uint8),
            np.zeros_like(triangles))
    depth, cover = np.zeros((SIDE, SIDE), np.float32), np.zeros((SIDE, SIDE), np.float32)
    shown, total = np.zeros((SIDE, SIDE, 3), np.float32), np.zeros((SIDE, SIDE, 3), np.float32)
    lens = intrinsics_row([FOCAL_PX, FOCAL_PX, MIDDLE, MIDDLE, *np.zeros(8)])
    accumulate(series, np.zeros(3), lens, triangles, np.ones((count, 3), np.float32), SAMPLES, work,
               np.zeros(4, np.int64), depth, shown, total, cover)
    return summary(cover.astype(np.float64) / SAMPLES, COLS, ROWS)


def frame_ms(show: HandShow | BareHandShow, frames: int) -> float:
    """The median of one thread's time for a picture of 640 x 480, before lens and sensor."""
    shot = make_shot(make_scene(twin_defaults(), 1), show, 2.0)
    renderer, source = make_renderer(shot, 0), shot.scene_object.source
    times = []
    for number in range(frames + 1):
        begun = time.thread_time()
        renderer.radiance(source, 0.5 + 0.02 * number, number)
        times.append(1e3 * (time.thread_time() - begun))
    return float(np.median(times[1:]))


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--balls", type=int, default=60, help="places of the ball, at random within 4 px")
    parser.add_argument("--frames", type=int, default=20, help="pictures of a hand, for the time")
    args = parser.parse_args()
    rng = np.random.default_rng(0)
    places = MIDDLE + 4.0 * rng.random((args.balls, 2))
    exact = np.array([truth(place) for place in places])
    print(f"{'a ball of 9 px':<24}{'centre, px rms':>16}{'area, %':>10}")
    drawn = {"rays": np.array([by_rays(place, rng) for place in places])}
    for facets in FACETS:
        ball = mesh(facets)
        drawn[f"mesh of {facets} meridians"] = np.array([by_triangles(place, ball) for place in places])
    for name, found in drawn.items():
        centre = np.sqrt(((found - exact)[:, :2] ** 2).mean())
        print(f"{name:<24}{centre:>16.4f}{100.0 * (found[:, 2] / exact[:, 2] - 1.0).mean():>10.3f}")
    rays, triangles = (frame_ms(show, args.frames) for show in (HandShow(), BareHandShow()))
    print(f"\na hand, ms a picture: by rays {rays:.1f}, by triangles {triangles:.1f} ({triangles / rays:.1f} times)")


if __name__ == "__main__":
    main()
