"""Rays against solids: the point of entry lies on the surface, and nothing of the solid is nearer."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from rhot_app.simulator.render.body import CAPSULE, CYLINDER
from rhot_app.simulator.render.raycast import NO_HIT, PREPARED, hit, lambert, prepare


@njit(cache=True)
def cast(kind, row, sizes, x, y, light):  # type: ignore[no-untyped-def]
    """Depth of entry and cosine to `light`."""
    table = np.empty((1, 1, PREPARED))
    prepare(kind, row, sizes, table, 0, 0)
    depth = hit(kind, table, 0, 0, x, y)
    return depth, (lambert(kind, table, 0, 0, x, y, depth, light) if depth < NO_HIT else 0.0)


def inside(kind: int, row: np.ndarray, size: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Signed: below 0 for points (N, 3) inside the solid."""
    if kind == CAPSULE:
        a, along = row[:3], row[3:6] - row[:3]
        part = np.clip((points - a) @ along / (along @ along), 0.0, 1.0)
        return np.linalg.norm(points - a - part[:, None] * along, axis=1) - size[0]
    local = (points - row[:3]) @ row[3:].reshape(3, 3).T / size
    return np.maximum(np.abs(local[:, 0]) - 1.0, np.hypot(local[:, 1], local[:, 2]) - 1.0)


@pytest.mark.parametrize("kind", [CAPSULE, CYLINDER])
def test_entry_is_the_first_point_inside(kind: int) -> None:
    rng = np.random.default_rng(3)
    hits = 0
    for _ in range(200):
        row, centre = np.zeros(12), rng.uniform((-0.05, -0.05, 0.4), (0.05, 0.05, 0.8))
        if kind == CAPSULE:
            row[:3], row[3:6] = centre, centre + rng.normal(0.0, 0.02, 3)
            size = np.array([rng.uniform(0.005, 0.02), 0.0, 0.0])
        else:
            turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            row[:3], row[3:] = centre, turn.ravel()
            size = rng.uniform(0.008, 0.03, 3)
        x, y = centre[:2] / centre[2] + rng.normal(0.0, 0.03, 2)
        direction = np.array([x, y, 1.0])
        depth, _ = cast(kind, row, size[None], x, y, np.array([0.0, 0.0, -1.0]))
        depths = np.linspace(0.2, 1.0, 8001)
        signed = inside(kind, row, size, depths[:, None] * direction)
        if depth == NO_HIT:
            assert signed.min() > -1e-4
            continue
        hits += 1
        assert abs(inside(kind, row, size, depth * direction[None])[0]) < 1e-6
        assert not (signed[depths < depth - 1e-6] < -1e-9).any()
    assert hits > 25


def test_light_falls_on_a_ball_as_lambert_says() -> None:
    row = np.array([0.0, 0.0, 0.5, 0.0, 1e-9, 0.5, *[0.0] * 6])
    size = np.array([[0.05, 0.0, 0.0]])
    depth, facing = cast(CAPSULE, row, size, 0.0, 0.0, np.array([0.0, 0.0, -1.0]))
    assert depth == pytest.approx(0.45) and facing == pytest.approx(1.0)
    _, oblique = cast(CAPSULE, row, size, 0.0, 0.0, np.array([0.6, 0.0, -0.8]))
    assert oblique == pytest.approx(0.8)
    assert cast(CAPSULE, row, size, 0.0, 0.0, np.array([0.0, 0.0, 1.0]))[1] == 0.0


def test_band_is_closed_at_its_ends() -> None:
    row = np.array([0.0, 0.0, 0.5, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0])  # its length runs along the ray
    depth, facing = cast(CYLINDER, row, np.array([[0.01, 0.03, 0.02]]), 0.02, 0.01, np.array([0.0, 0.0, -1.0]))
    assert depth == pytest.approx(0.49) and facing == pytest.approx(1.0)
