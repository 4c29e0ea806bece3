"""Edges along slices of drawn images: places, signs, noise, and what is learnt of hand and background."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot_node.detect.edges import find_edges, noise_of
from rhot_node.detect.foreground import (
    foreground_map,
    learn_background,
    learn_skin,
    no_foreground,
    skin_foreground,
)

SKIN, DARK = np.array([205.0, 150.0, 125.0]), np.array([40.0, 60.0, 90.0])


def half_plane(edge: float, angle: float, seed: int, noise: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """An image (120, 160, 3), skin up to `edge` px from the middle along `angle` and dark beyond; and the normal."""
    normal = np.array([np.cos(angle), np.sin(angle)])
    y, x = np.mgrid[0:120, 0:160]
    along = (x - 80) * normal[0] + (y - 60) * normal[1] - edge
    share = np.clip(0.5 - along, 0.0, 1.0)[..., None]
    image = cv2.GaussianBlur(share * SKIN + (1.0 - share) * DARK, (0, 0), 0.8)
    image += np.random.default_rng(seed).normal(0.0, noise, image.shape)
    return np.clip(image + 0.5, 0, 255).astype(np.uint8), normal


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.1, -1.3])
def test_an_edge_is_found_to_a_fraction_of_a_pixel(angle: float) -> None:
    errors = []
    for seed, edge in enumerate(np.linspace(-4.0, 4.0, 9)):
        image, normal = half_plane(float(edge), angle, seed)
        along = np.array([-normal[1], normal[0]])
        slices = np.array([[80.0 + k * along[0], 60.0 + k * along[1], *normal, 10.0] for k in range(-20, 21, 5)])
        edges = find_edges(image, slices, no_foreground(), noise_of(image))
        best = np.argmax(np.where(np.arange(edges.offset.shape[1]) < edges.number[:, None],
                                  np.abs(edges.strength), -1.0), axis=1)
        rows = np.arange(len(slices))
        assert np.all(edges.strength[rows, best] < 0.0)  # it gets darker outwards
        errors.append(edges.offset[rows, best] - edge)
    assert abs(np.mean(errors)) < 0.05
    assert np.std(errors) < 0.15


def test_noise_alone_is_rarely_an_edge() -> None:
    rng = np.random.default_rng(3)
    image = np.clip(rng.normal(120.0, 3.0, (120, 160, 3)), 0, 255).astype(np.uint8)
    slices = np.array([[x, y, 1.0, 0.0, 10.0] for x in range(30, 130, 10) for y in range(30, 90, 5)], dtype=float)
    edges = find_edges(image, slices, no_foreground(), noise_of(image))
    assert edges.number.sum() < 0.2 * len(slices)


def test_slices_may_leave_the_image() -> None:
    image, _ = half_plane(0.0, 0.0, 1)
    edges = find_edges(image, np.array([[2.0, 2.0, -1.0, 0.0, 20.0], [400.0, 400.0, 1.0, 0.0, 5.0]]), no_foreground(),
                       2.0)
    assert edges.number[1] == 0


def test_the_foreground_tells_the_sides_of_an_edge() -> None:
    image, normal = half_plane(0.0, 0.0, 1)
    empty = np.broadcast_to(DARK, image.shape).astype(np.uint8)
    model = learn_background(skin_foreground(), [empty])
    edges = find_edges(image, np.array([[80.0, 60.0, *normal, 8.0]]), model, 2.0)
    strongest = int(np.argmax(np.abs(edges.strength[0, :edges.number[0]])))
    assert edges.inside[0, strongest] > 0.9
    assert edges.outside[0, strongest] < 0.1


@pytest.mark.parametrize("gain", [(1.0, 1.0, 1.0), (1.3, 1.3, 1.3), (0.75, 0.7, 0.8)])
def test_an_automatic_exposure_makes_no_background_a_hand(gain: tuple[float, ...]) -> None:
    rng = np.random.default_rng(0)
    scene = rng.uniform(50.0, 180.0, (120, 160, 1)) * [1.0, 0.8, 0.6]

    def photo(values: np.ndarray, factor: tuple[float, ...]) -> np.ndarray:
        return np.clip(values * factor + rng.normal(0.0, 2.0, values.shape) + 0.5, 0.0, 255.0).astype(np.uint8)

    model = learn_background(skin_foreground(), [photo(scene, (1.0, 1.0, 1.0)) for _ in range(8)])
    with_hand = scene.copy()
    with_hand[:, 40:120] = SKIN  # half of the picture
    probability = foreground_map(photo(with_hand, gain), model, 2)
    assert np.mean(probability[:, 22:58] > 0.5) > 0.95
    assert np.mean(probability[:, :18] > 0.5) < 0.03


def test_a_brighter_empty_scene_shows_no_skin() -> None:
    rng = np.random.default_rng(0)
    scene = SKIN * rng.uniform(0.6, 0.8, (120, 160, 1))
    known = learn_background(no_foreground(), [np.clip(scene + rng.normal(0.0, 2.0, scene.shape), 0, 255)
                                               .astype(np.uint8) for _ in range(8)])
    brighter = np.clip(1.25 * scene + rng.normal(0.0, 2.0, scene.shape), 0, 255).astype(np.uint8)
    assert np.array_equal(learn_skin(brighter, known).hand, skin_foreground().hand)


def test_nothing_learnt_is_said_and_decides_nothing() -> None:
    image, _ = half_plane(0.0, 0.0, 1)
    assert "No background is learnt" in no_foreground().sentence
    assert np.allclose(foreground_map(image, no_foreground(), 4), 0.5)
    with pytest.raises(ValueError, match="without a hand"):
        learn_background(no_foreground(), [])


def test_skin_is_learnt_from_one_image() -> None:
    image, _ = half_plane(0.0, 0.0, 1)
    probability = foreground_map(image, learn_skin(image), 4)
    assert probability[:, :18].mean() > 0.9
    assert probability[:, 22:].mean() < 0.1


def test_shading_does_not_displace_an_edge_before_a_learnt_background() -> None:
    """A finger gets darker towards its limb, until it is hardly brighter than the wall."""
    wall = np.full((120, 160, 3), [110.0, 105.0, 100.0])
    rng = np.random.default_rng(5)
    empty = [np.clip(wall + rng.normal(0.0, 2.0, wall.shape) + 0.5, 0, 255).astype(np.uint8) for _ in range(8)]
    learnt = learn_background(skin_foreground(), empty)
    errors: dict[bool, list[float]] = {True: [], False: []}
    for edge in np.linspace(-2.0, 2.0, 9):
        along = np.mgrid[0:120, 0:160][1] - 80.0 - edge
        shade = np.clip(0.6 - along / 15.0, 0.6, 1.0)[..., None]
        share = np.clip(0.5 - along, 0.0, 1.0)[..., None]
        image = cv2.GaussianBlur(share * shade * SKIN + (1.0 - share) * wall, (0, 0), 1.0)
        image = np.clip(image + rng.normal(0.0, 2.0, image.shape) + 0.5, 0, 255).astype(np.uint8)
        slices = np.array([[80.0, y, 1.0, 0.0, 6.0] for y in range(10, 110, 5)])
        for known, foreground in ((True, learnt), (False, skin_foreground())):
            edges = find_edges(image, slices, foreground, 2.0)
            good = (np.arange(edges.offset.shape[1]) < edges.number[:, None]) & (edges.outside < 0.5)
            errors[known] += list(edges.offset[good] - edge)
    assert abs(np.median(errors[True])) < 0.1
    assert np.percentile(np.abs(errors[True]), 90) < 0.3
    assert abs(np.median(errors[False])) > 0.3
