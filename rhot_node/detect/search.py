"""Full-frame search: every blob of every marker colour in one pass over the chroma planes.

Runs of equal label per row are joined with those of the row above by union-find into area, sums and box: no mask is
written. Eight pixels at a time are passed over when all lie in a box of the chroma plane that is nobody's: grey and
what is nearly grey, skin and wood, which is what most of a picture is like.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.colour import Table
from rhot_node.detect.image import Plane

RUNS_MAX = 16384  # more runs than this is noise or foliage, not markers; the rest of the frame is not searched
BLOBS_MAX = 512
WORD = 8  # pixels
ROOM, ROOM_SIGMA = (-10.0, 8.0), 16.0  # grey levels: the chroma (cb, cr) of rooms, mostly, and how far it spreads
BOX_HALF_MOST, BOX_STEP = 60, 3  # grey levels on either side of grey that the box of nobody's colours may reach

# Columns of a blob row; positions and areas in chroma pixels.
LABEL, AREA, SUM_X, SUM_Y, SUM_U, SUM_V, X_MIN, X_MAX, Y_MIN, Y_MAX = range(10)
BLOB_COLUMNS = 10
# Columns of a run.
_LABEL, _START, _END, _ROW, _SUM_U, _SUM_V, _PARENT = range(7)

_ONES = np.uint64(0x0101010101010101)
_TOPS = np.uint64(0x8080808080808080)
_NO_WORDS = np.zeros((0, 0), dtype=np.uint64)


class Searcher:
    """Owns the buffers of the search so that a frame allocates nothing."""

    def __init__(self, table: Table, luma_limits: NDArray[np.uint8]) -> None:
        """`table`: acquisition table; `luma_limits`: (M, 2) lowest and highest luma of each marker."""
        self._table = table
        self._luma_limits = luma_limits
        self._dull = np.array([dull_box(table)], dtype=np.uint64)
        self._bright = np.zeros(0, dtype=np.uint64)
        self._runs = np.zeros((RUNS_MAX, 7), dtype=np.int32)
        self._slots = np.zeros(RUNS_MAX, dtype=np.int32)
        self._blobs = np.zeros((BLOBS_MAX, BLOB_COLUMNS), dtype=np.float64)

    def find(self, y: Plane, u: Plane, v: Plane, wanted: NDArray[np.bool_], area_min: int, *,
             step: int = 1, first: int = 0) -> NDArray[np.float64]:
        """(N, 10) blobs of the wanted labels with at least `area_min` chroma pixels; a view, valid until the next.

        Every `step`-th row from `first` on is searched and stands for the others.
        """
        words_u = words_v = _NO_WORDS
        if u.shape[1] % WORD == 0 and u.strides[1] == v.strides[1] == 1:
            words_u, words_v = u.view(np.uint64), v.view(np.uint64)
            if len(self._bright) != words_u.shape[1]:
                self._bright = np.zeros(words_u.shape[1], dtype=np.uint64)
        runs = label_runs(y, u, v, words_u, words_v, self._bright, self._dull, self._table, wanted, self._luma_limits,
                          step, first, self._runs)
        count = gather_blobs(self._runs, runs, area_min, step, self._slots, self._blobs)
        return self._blobs[:count]


def dull_box(table: Table) -> tuple[int, int, int, int]:
    """U and V of a box, (u_min, u_max, v_min, v_max), in which nothing is labelled: that which most of a room is in.

    It holds grey (128, 128) unless that has a label: then it is empty (u_min 1, u_max 0).
    """
    u, v = np.meshgrid(np.arange(256.0), np.arange(256.0), indexing="ij")
    often = np.exp(-0.5 * ((u - 128.0 - ROOM[0]) ** 2 + (v - 128.0 - ROOM[1]) ** 2) / ROOM_SIGMA**2)
    weight = np.pad(np.cumsum(np.cumsum(often, axis=0), axis=1), ((1, 0), (1, 0)))
    best, box = 0.0, (1, 0, 1, 0)
    for u_min in range(128 - BOX_HALF_MOST, 129, BOX_STEP):
        taken = np.cumsum(table[u_min:129 + BOX_HALF_MOST] != 0, axis=0) > 0
        for u_max in range(128, 128 + BOX_HALF_MOST, BOX_STEP):
            labelled = np.flatnonzero(taken[u_max - u_min])
            v_min = int(max(labelled[labelled <= 128].max(initial=-1) + 1, 128 - BOX_HALF_MOST))
            v_max = int(min(labelled[labelled >= 128].min(initial=256) - 1, 127 + BOX_HALF_MOST))
            if v_min > v_max:
                continue
            share = (weight[u_max + 1, v_max + 1] - weight[u_min, v_max + 1]
                     - weight[u_max + 1, v_min] + weight[u_min, v_min])
            if share > best:
                best, box = share, (u_min, u_max, v_min, v_max)
    return box


@njit(cache=True)
def label_at(y, u, v, row, column, table, luma_limits):
    """1 + the index of the marker that a chroma pixel is taken for, 0 for none: hue and magnitude, then luma."""
    label = np.int64(table[u[row, column], v[row, column]])
    if label != 0:
        luma = y[2 * row, 2 * column]
        if luma < luma_limits[label - 1, 0] or luma > luma_limits[label - 1, 1]:
            return 0
    return label


@njit(cache=True)
def _outside(word, low, span):
    """Sets the top bit of every byte of `word` that is not within low..low + span; span is below 128. All by bytes."""
    away = ((word | _TOPS) - (low & ~_TOPS)) ^ ((word ^ ~low) & _TOPS)  # word - low, byte by byte
    return ((away & ~_TOPS) + (~_TOPS - span)) | away


@njit(cache=True)
def _mark_bright(words_u, words_v, row, dull, bright):
    """Write for every word of a row whether a pixel of it lies outside the box `dull`."""
    low_u, span_u = dull[0, 0] * _ONES, (dull[0, 1] - dull[0, 0]) * _ONES
    low_v, span_v = dull[0, 2] * _ONES, (dull[0, 3] - dull[0, 2]) * _ONES
    for k in range(words_u.shape[1]):
        bright[k] = (_outside(words_u[row, k], low_u, span_u) | _outside(words_v[row, k], low_v, span_v)) & _TOPS


@njit(cache=True)
def label_runs(y, u, v, words_u, words_v, bright, dull, table, wanted, luma_limits, step, first_row, runs):
    """Fill `runs` with the runs of equal wanted label, each joined to its neighbours above; return how many.

    Every `step`-th row from `first_row` on is searched.
    Words that are all in the box `dull` (1, 4) are passed over; `words_u` and `words_v` (H/2, W/16) may be empty.
    Scratch: `bright` (W/16,).
    """
    height, width = u.shape
    by_words = words_u.shape[1] > 0 and dull[0, 0] <= dull[0, 1]
    block = WORD if by_words else width
    count = above_start = above_end = np.int64(0)
    for row in range(first_row, height, step):
        row_start = count
        current = 0
        if by_words:
            _mark_bright(words_u, words_v, row, dull, bright)
        for first in range(0, width, block):
            if by_words and bright[first // WORD] == 0:
                current = 0
                continue
            for column in range(first, first + block):
                label = label_at(y, u, v, row, column, table, luma_limits)
                if not wanted[label]:
                    current = 0
                    continue
                if label != current:
                    if count == runs.shape[0]:
                        return count
                    _start_run(runs, count, label, row, column)
                    count += 1
                    current = label
                runs[count - 1, _END] = column
                runs[count - 1, _SUM_U] += np.int32(u[row, column]) - 128
                runs[count - 1, _SUM_V] += np.int32(v[row, column]) - 128
        _join_rows(runs, above_start, above_end, row_start, count, step)
        above_start, above_end = row_start, count
    return count


@njit(cache=True)
def _start_run(runs, count, label, row, column):
    runs[count, _LABEL] = label
    runs[count, _START] = column
    runs[count, _ROW] = row
    runs[count, _SUM_U] = 0
    runs[count, _SUM_V] = 0
    runs[count, _PARENT] = count


@njit(cache=True)
def _join_rows(runs, above, above_end, here, here_end, reach):
    """Union runs of two looked-at rows that touch (for neighbours: 8-connected) and have the same label."""
    for run in range(here, here_end):
        while above < above_end and runs[above, _END] + reach < runs[run, _START]:
            above += 1
        other = above
        while other < above_end and runs[other, _START] <= runs[run, _END] + reach:
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
def gather_blobs(runs, run_count, area_min, step, slots, blobs):
    """Sum joined runs into `blobs`; keep those of at least `area_min` pixels, return how many."""
    areas = slots[:run_count]
    areas[:] = 0
    for index in range(run_count):
        areas[_root(runs, index)] += step * (runs[index, _END] - runs[index, _START] + 1)
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
            _add_run(runs, index, step, blobs, areas[root])
    return count


@njit(cache=True)
def _add_run(runs, index, step, blobs, slot):
    start = runs[index, _START]
    end = runs[index, _END]
    area = step * (end - start + 1)
    blobs[slot, AREA] += area
    blobs[slot, SUM_X] += 0.5 * (start + end) * area
    blobs[slot, SUM_Y] += (runs[index, _ROW] + 0.5 * (step - 1)) * area
    blobs[slot, SUM_U] += step * runs[index, _SUM_U]
    blobs[slot, SUM_V] += step * runs[index, _SUM_V]
    blobs[slot, X_MIN] = min(blobs[slot, X_MIN], start)
    blobs[slot, X_MAX] = max(blobs[slot, X_MAX], end)
    blobs[slot, Y_MAX] = runs[index, _ROW] + step - 1
