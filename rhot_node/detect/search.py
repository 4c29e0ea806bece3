"""Full-frame search: every blob of every marker colour in one pass over the chroma planes.

Runs of equal label per row are joined with those of the row above by union-find into area, sums and box.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.image import Plane
from rhot_node.detect.labels import Table

RUNS_MAX = 16384  # more runs than this is noise or foliage, not markers; the rest of the frame is not searched
BLOBS_MAX = 512

# Columns of a blob row; positions and areas in chroma pixels.
LABEL, AREA, SUM_X, SUM_Y, SUM_U, SUM_V, X_MIN, X_MAX, Y_MIN, Y_MAX = range(10)
BLOB_COLUMNS = 10
# Columns of a run.
_LABEL, _START, _END, _ROW, _SUM_U, _SUM_V, _PARENT = range(7)


class Searcher:
    """Owns the buffers of the search so that a frame allocates nothing."""

    def __init__(self, table: Table, luma_limits: NDArray[np.uint8]) -> None:
        """`table`: acquisition table; `luma_limits`: (M, 2) lowest and highest luma of each marker."""
        self._table = table
        self._luma_limits = luma_limits
        self._runs = np.zeros((RUNS_MAX, 7), dtype=np.int32)
        self._slots = np.zeros(RUNS_MAX, dtype=np.int32)
        self._blobs = np.zeros((BLOBS_MAX, BLOB_COLUMNS), dtype=np.float64)

    def find(self, y: Plane, u: Plane, v: Plane, wanted: NDArray[np.bool_], area_min: int) -> NDArray[np.float64]:
        """(N, 10) blobs of the wanted labels with at least `area_min` chroma pixels; a view, valid until the next."""
        runs = label_runs(y, u, v, self._table, wanted, self._luma_limits, self._runs)
        count = gather_blobs(self._runs, runs, area_min, self._slots, self._blobs)
        return self._blobs[:count]


@njit(cache=True)
def label_at(y, u, v, row, column, table, luma_limits):
    """1 + the index of the marker that a chroma pixel is taken for, 0 for none: hue and magnitude, then luma."""
    label = int(table[u[row, column], v[row, column]])
    if label != 0:
        luma = y[2 * row, 2 * column]
        if luma < luma_limits[label - 1, 0] or luma > luma_limits[label - 1, 1]:
            return 0
    return label


@njit(cache=True)
def label_runs(y, u, v, table, wanted, luma_limits, runs):
    """Fill `runs` with the runs of equal wanted label, each joined to its neighbours above; return how many."""
    height, width = u.shape
    count = 0
    above_start = 0
    above_end = 0
    for row in range(height):
        row_start = count
        current = 0
        for column in range(width):
            label = label_at(y, u, v, row, column, table, luma_limits)
            if not wanted[label]:
                current = 0
                continue
            if label != current:
                if count == runs.shape[0]:
                    return count
                runs[count, _LABEL] = label
                runs[count, _START] = column
                runs[count, _ROW] = row
                runs[count, _SUM_U] = 0
                runs[count, _SUM_V] = 0
                runs[count, _PARENT] = count
                count += 1
                current = label
            runs[count - 1, _END] = column
            runs[count - 1, _SUM_U] += np.int32(u[row, column]) - 128
            runs[count - 1, _SUM_V] += np.int32(v[row, column]) - 128
        _join_rows(runs, above_start, above_end, row_start, count)
        above_start, above_end = row_start, count
    return count


@njit(cache=True)
def _join_rows(runs, above, above_end, here, here_end):
    """Union runs of two adjacent rows that touch (8-connected) and have the same label."""
    for run in range(here, here_end):
        while above < above_end and runs[above, _END] + 1 < runs[run, _START]:
            above += 1
        other = above
        while other < above_end and runs[other, _START] <= runs[run, _END] + 1:
            if runs[other, _LABEL] == runs[run, _LABEL]:
                first = _root(runs, other)
                second = _root(runs, run)
                runs[max(first, second), _PARENT] = min(first, second)
            other += 1


@njit(cache=True)
def _root(runs, index):
    while runs[index, _PARENT] != index:
        runs[index, _PARENT] = runs[runs[index, _PARENT], _PARENT]
        index = runs[index, _PARENT]
    return index


@njit(cache=True)
def gather_blobs(runs, run_count, area_min, slots, blobs):
    """Sum joined runs into `blobs`; keep those of at least `area_min` pixels, return how many."""
    areas = slots[:run_count]
    areas[:] = 0
    for index in range(run_count):
        areas[_root(runs, index)] += runs[index, _END] - runs[index, _START] + 1
    count = 0
    for index in range(run_count):
        root = _root(runs, index)
        if root == index:  # roots come first: a root is the lowest index of its tree
            if areas[index] < area_min or count == blobs.shape[0]:
                areas[index] = -1
            else:
                blobs[count, :] = 0.0
                blobs[count, LABEL] = runs[index, _LABEL]
                blobs[count, X_MIN] = runs[index, _START]
                blobs[count, Y_MIN] = runs[index, _ROW]
                areas[index] = count
                count += 1
        if areas[root] >= 0:
            _add_run(runs, index, blobs, areas[root])
    return count


@njit(cache=True)
def _add_run(runs, index, blobs, slot):
    start = runs[index, _START]
    end = runs[index, _END]
    length = end - start + 1
    blobs[slot, AREA] += length
    blobs[slot, SUM_X] += 0.5 * (start + end) * length
    blobs[slot, SUM_Y] += runs[index, _ROW] * length
    blobs[slot, SUM_U] += runs[index, _SUM_U]
    blobs[slot, SUM_V] += runs[index, _SUM_V]
    blobs[slot, X_MIN] = min(blobs[slot, X_MIN], start)
    blobs[slot, X_MAX] = max(blobs[slot, X_MAX], end)
    blobs[slot, Y_MAX] = runs[index, _ROW]
