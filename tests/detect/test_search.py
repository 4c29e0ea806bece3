"""The one-pass search against OpenCV's connected components, colour by colour."""

import cv2
import numpy as np
import pytest

from rhot_node.detect import search as s


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


def find(labels: np.ndarray, table: np.ndarray, u: np.ndarray, v: np.ndarray, area_min: int) -> np.ndarray:
    limits = np.tile(np.array([0, 255], dtype=np.uint8), (3, 1))
    luma = np.full((2 * labels.shape[0], 2 * labels.shape[1]), 90, dtype=np.uint8)
    return s.Searcher(table, limits).find(luma, u, v, np.array([False, True, True, True]), area_min)


@pytest.mark.parametrize(("seed", "density", "area_min"), [(0, 0.3, 1), (1, 0.55, 1), (2, 0.8, 5), (3, 0.05, 2)])
def test_blobs_equal_connected_components(seed: int, density: float, area_min: int) -> None:
    rng = np.random.default_rng(seed)
    labels = np.where(rng.random((23, 41)) < density, rng.integers(1, 4, (23, 41)), 0)
    if seed == 2:
        labels = np.kron(labels, np.ones((4, 4), dtype=int))
    table = np.zeros((256, 256), dtype=np.uint8)
    table[10:20, :], table[20:30, :], table[30:40, :] = 1, 2, 3
    u = (10 * labels + rng.integers(0, 10, labels.shape)).astype(np.uint8)
    v = rng.integers(0, 256, labels.shape).astype(np.uint8)
    blobs = find(labels, table, u, v, area_min)
    assert sorted(map(tuple, blobs.tolist())) == oracle(labels, u, v, area_min)


def test_luma_limits_and_unwanted_labels_are_left_out() -> None:
    table = np.zeros((256, 256), dtype=np.uint8)
    table[200, :], table[60, :] = 1, 2
    u = np.full((20, 20), 128, dtype=np.uint8)
    u[2:8, 2:8], u[12:18, 12:18] = 200, 60
    v = np.full((20, 20), 128, dtype=np.uint8)
    luma = np.full((40, 40), 100, dtype=np.uint8)
    luma[4:16, 4:10] = 5
    limits = np.array([(12, 250), (12, 250)], dtype=np.uint8)
    searcher = s.Searcher(table, limits)
    first = searcher.find(luma, u, v, np.array([False, True, False]), 4)
    assert first.shape[0] == 1
    assert first[0, s.AREA] == 18
    assert first[0, s.X_MIN] == 5


def test_more_runs_than_the_buffer_holds_end_the_search_quietly() -> None:
    table = np.zeros((256, 256), dtype=np.uint8)
    table[200, :] = 1
    u = np.full((400, 400), 128, dtype=np.uint8)
    u[:, ::2] = 200
    v = np.full((400, 400), 128, dtype=np.uint8)
    luma = np.full((800, 800), 100, dtype=np.uint8)
    limits = np.array([(12, 250)], dtype=np.uint8)
    blobs = s.Searcher(table, limits).find(luma, u, v, np.array([False, True]), 4)
    assert blobs.shape[0] == 200
    assert blobs[:, s.AREA].sum() == 200 * (s.RUNS_MAX // 200)
