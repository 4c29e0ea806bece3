"""The one-pass search against OpenCV's connected components, colour by colour."""

import cv2
import msgspec
import numpy as np
import pytest
from shipped_markers import RHOT6

from rhot_node.detect import search as s
from rhot_node.detect.colour import acquisition_table
from rhot_node.detect.image import YuvImage
from rhot_node.markers import MarkerSet

ANY_LUMA = (0, 255)


def gate_of(table: np.ndarray, monkeypatch: pytest.MonkeyPatch, luma: tuple[int, int] = ANY_LUMA) -> s.ColourGate:
    """The gate of a table of labels, of at most six markers with these limits of luma."""
    monkeypatch.setattr(s, "acquisition_table", lambda markers: table)
    return s.ColourGate(MarkerSet(tuple(msgspec.structs.replace(marker, chroma=msgspec.structs.replace(
        marker.chroma, luma_min=luma[0], luma_max=luma[1])) for marker in RHOT6.markers)))


def oracle(labels: np.ndarray, u: np.ndarray, v: np.ndarray, area_min: int) -> list[tuple[float, ...]]:
    """Blobs of a label image by OpenCV, each as a row of the search's columns."""
    rows = []
    for label in range(1, int(labels.max()) + 1):
        count, components = cv2.connectedComponents((labels == label).astype(np.uint8), connectivity=8)
        for number in range(1, count):
            ys, xs = np.nonzero(components == number)
            if len(xs) >= area_min:
                rows.append((label, len(xs), xs.sum(), ys.sum(), (u[ys, xs].astype(int) - 128).sum(),
                             (v[ys, xs].astype(int) - 128).sum(), xs.min(), xs.max(), ys.min(), ys.max()))
    return sorted(rows)


@pytest.mark.parametrize(("seed", "density", "area_min"), [(0, 0.3, 1), (1, 0.55, 1), (2, 0.8, 5), (3, 0.05, 2)])
def test_blobs_equal_connected_components(seed: int, density: float, area_min: int,
                                           monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(seed)
    labels = np.where(rng.random((23, 41)) < density, rng.integers(1, 4, (23, 41)), 0)
    if seed == 2:
        labels = np.kron(labels, np.ones((4, 4), dtype=int))
    table = np.zeros((256, 256), dtype=np.uint8)
    table[10:20, :], table[20:30, :], table[30:40, :] = 1, 2, 3
    u = (10 * labels + rng.integers(0, 10, labels.shape)).astype(np.uint8)
    v = rng.integers(0, 256, labels.shape).astype(np.uint8)
    image = YuvImage(np.full((2 * labels.shape[0], 2 * labels.shape[1]), 90, dtype=np.uint8), u, v)
    blobs = gate_of(table, monkeypatch).blobs(image, range(3), area_min)
    assert sorted(map(tuple, blobs)) == oracle(labels, u, v, area_min)


def test_luma_limits_and_unwanted_labels_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    table = np.zeros((256, 256), dtype=np.uint8)
    table[200, :], table[60, :] = 1, 2
    u = np.full((20, 20), 128, dtype=np.uint8)
    u[2:8, 2:8], u[12:18, 12:18] = 200, 60
    v = np.full((20, 20), 128, dtype=np.uint8)
    luma = np.full((40, 40), 100, dtype=np.uint8)
    luma[4:16, 4:10] = 5
    (first,) = gate_of(table, monkeypatch, (12, 250)).blobs(YuvImage(luma, u, v), [0], 4)
    assert first.area == 18
    assert first.x_min == 5


def test_more_runs_than_the_buffer_holds_end_the_search_quietly(monkeypatch: pytest.MonkeyPatch) -> None:
    table = np.zeros((256, 256), dtype=np.uint8)
    table[200, :] = 1
    u = np.full((400, 400), 128, dtype=np.uint8)
    u[:, ::2] = 200
    v = np.full((400, 400), 128, dtype=np.uint8)
    luma = np.full((800, 800), 100, dtype=np.uint8)
    blobs = gate_of(table, monkeypatch).blobs(YuvImage(luma, u, v), [0], 4)
    assert len(blobs) == 200
    assert sum(blob.area for blob in blobs) == 200 * (s.RUNS_MAX // 200)


def colourful_picture(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Patches of every chroma there is, hard ones and soft ones, in planes whose rows are whole words."""
    rng = np.random.default_rng(seed)
    planes = [cv2.resize(rng.integers(0, 256, (12, 20)).astype(np.uint8), (160, 120), interpolation=how)
              for how in (cv2.INTER_NEAREST, cv2.INTER_CUBIC)]
    luma = cv2.resize(rng.integers(0, 256, (12, 20)).astype(np.uint8), (320, 240))
    return luma, np.ascontiguousarray(planes[seed % 2]), np.ascontiguousarray(planes[1])


@pytest.mark.parametrize("seed", range(4))
def test_passing_over_dull_words_loses_no_pixel(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    luma, u, v = colourful_picture(seed)
    table = acquisition_table(RHOT6)
    blobs = gate_of(table, monkeypatch).blobs(YuvImage(luma, u, v), range(6), 1)
    assert len(blobs) > 5
    assert sorted(map(tuple, blobs)) == oracle(table[u, v], u, v, 1)


def test_the_dull_box_holds_grey_and_skin_and_nobodys_colour() -> None:
    table = acquisition_table(RHOT6)
    u_min, u_max, v_min, v_max = s.dull_box(table)
    assert not table[u_min:u_max + 1, v_min:v_max + 1].any()
    assert u_min <= 128 - 20 and v_max >= 128 + 24
    assert u_max >= 133 and v_min <= 123
    everything = np.ones((256, 256), dtype=np.uint8)
    u_min, u_max, _, _ = s.dull_box(everything)
    assert u_min > u_max


def test_every_other_row_stands_for_its_neighbour(monkeypatch: pytest.MonkeyPatch) -> None:
    table = np.zeros((256, 256), dtype=np.uint8)
    table[200, :], table[60, :] = 1, 2
    u, v = np.full((80, 96), 128, dtype=np.uint8), np.full((80, 96), 128, dtype=np.uint8)
    for x, y, radius, level in ((20, 20, 5, 200), (60, 31, 11, 60), (25, 61, 8, 60)):
        cv2.circle(u, (x, y), radius, level, -1)
    luma = np.full((160, 192), 90, dtype=np.uint8)
    gate = gate_of(table, monkeypatch)
    whole, half = (gate.blobs(YuvImage(luma, u, v), range(6), 6, step) for step in (1, 2))
    assert len(whole) == len(half) == 3
    for blob, same in zip(whole, half, strict=True):
        assert same.label == blob.label
        assert same.area == pytest.approx(blob.area, rel=0.1)
        np.testing.assert_allclose(same.centroid, blob.centroid, atol=0.6)
        np.testing.assert_allclose(same[-4:], blob[-4:], atol=1)
