"""Unmixing against a plain numpy twin, and what it makes of edges, holes and neighbours."""

import numpy as np
import pytest
from marker_rendering import SKIN, Canvas, capsule, disc
from numpy.typing import NDArray

from rhot_node.detect import coverage as c
from rhot_node.detect.image import YuvImage
from rhot_node.detect.segment import scratch

Array = NDArray[np.float64]
PAINT = (205.0, 40.0, 165.0)


def classified(inside: NDArray[np.bool_]) -> tuple[NDArray[np.uint8], tuple[int, int, int, int]]:
    height, width = inside.shape
    region = (0, width - 1, 0, height - 1)
    kind = np.zeros(inside.shape, dtype=np.uint8)
    mask = np.where(inside, 2, 0).astype(np.int16)
    c.classify(region, np.array([True]), mask, kind, np.zeros(inside.size, dtype=np.int32))
    return kind, region


def measured(image: YuvImage, inside: NDArray[np.bool_]) -> tuple[Array, Array, NDArray[np.uint8]]:
    kind, region = classified(inside)
    room = scratch(*inside.shape)
    room.kind[:] = kind
    c.unmix(image, region, 80.0, room, np.empty((3, 3)))
    return room.coverage.astype(np.float64), room.gain.astype(np.float64), kind


def twin(image: YuvImage, kind: NDArray[np.uint8]) -> Array:
    """Coverage by the definition, pixel by pixel, with numpy's own linear algebra."""
    height, width = kind.shape
    luma = image.y.reshape(height, 2, width, 2).mean(axis=(1, 3))
    colour = np.stack([luma, image.u, image.v], axis=2).astype(np.float64)
    ys, xs = np.mgrid[:height, :width].astype(np.float64)
    paint = kind == c.INTERIOR
    design = np.column_stack([np.ones(paint.sum()), xs[paint], ys[paint]])
    slopes = np.linalg.lstsq(design, colour[paint], rcond=None)[0][1:]
    result = np.where(np.isin(kind, (c.INTERIOR, c.HOLE)), 1.0, 0.0)
    for y, x in zip(*np.nonzero(np.isin(kind, (c.EDGE, c.RIM))), strict=True):
        near = (np.abs(ys - y) <= c.REACH) & (np.abs(xs - x) <= c.REACH)
        own, around = near & paint, near & (kind == c.OUTSIDE)
        if not own.any() or not around.any():
            result[y, x] = np.nan
            continue
        here = colour[own].mean(axis=0) + np.array([x - xs[own].mean(), y - ys[own].mean()]) @ slopes
        mean = colour[around].mean(axis=0)
        covariance = np.cov(colour[around].T, bias=True) + c.FLATNESS * np.eye(3)
        weight = np.linalg.solve(covariance, here - mean)
        weight /= weight @ (here - mean)
        result[y, x] = np.clip(weight @ (colour[y, x] - mean), -c.CLIP, 1.0 + c.CLIP)
    return result


def test_coverage_equals_the_numpy_twin() -> None:
    rng = np.random.default_rng(3)
    canvas = Canvas(60, 56, (90, 110, 140)).paint(capsule((5, 50), (28, 28), 9), SKIN, (20, 40), 40)
    image = canvas.paint(disc(30, 27, 10), PAINT, (30, 27), 13, 0.25).expose(rng)
    inside = image.v.astype(int) > 128 + 36
    cover, _, kind = measured(image, inside)
    expected = twin(image, kind)
    known = ~np.isnan(expected)
    assert known.sum() > 800
    np.testing.assert_allclose(cover[known], expected[known], atol=1e-4)


def test_coverage_adds_up_to_the_painted_area_whatever_lies_around() -> None:
    for backdrop in ((120.0, 122.0, 118.0), (60.0, 90.0, 130.0), (230.0, 225.0, 235.0)):
        canvas = Canvas(60, 56, backdrop).paint(capsule((5, 50), (28, 28), 9), SKIN, (20, 40), 40)
        image = canvas.paint(disc(30.3, 27.1, 10), PAINT, (30, 27), 13, 0.25).expose()
        cover, _, _ = measured(image, image.v.astype(int) > 128 + 36)
        assert 4.0 * cover.sum() == pytest.approx(np.pi * 100.0, rel=0.012)


def test_a_hole_is_filled_and_a_ring_is_not() -> None:
    inside = np.zeros((40, 40), dtype=np.bool_)
    inside[8:24, 8:24] = True
    inside[14:17, 14:18] = False
    kind, _ = classified(inside)
    assert (kind[14:17, 14:18] == c.HOLE).all()
    inside[10:22, 10:22] = False
    kind, _ = classified(inside)
    assert (kind[13:19, 13:19] == c.OUTSIDE).all()


def test_classes_lie_where_they_should() -> None:
    inside = np.zeros((30, 30), dtype=np.bool_)
    inside[10:18, 10:20] = True
    kind, _ = classified(inside)
    assert (kind[11:17, 11:19] == c.INTERIOR).all()
    assert (kind[10, 10:20] == c.EDGE).all()
    assert (kind[8:10, 8:22] == c.RIM).all()
    assert kind[7, 15] == c.OUTSIDE
    assert (kind == c.INTERIOR).sum() == 48
    assert (kind == c.RIM).sum() == 12 * 14 - 80


def test_noise_is_estimated_from_the_paint_under_shading() -> None:
    rng = np.random.default_rng(5)
    ys, xs = np.mgrid[:40, :40]
    u = np.rint(170 - 0.5 * xs + 0.3 * ys + rng.normal(0, 1.6, (40, 40))).astype(np.uint8)
    v = np.rint(150 - 0.2 * xs + rng.normal(0, 1.6, (40, 40))).astype(np.uint8)
    kind, region = classified(np.ones((40, 40), dtype=np.bool_))
    total, count = c.chroma_noise(u, v, region, kind)
    assert np.sqrt(total / count) == pytest.approx(1.6, rel=0.06)
