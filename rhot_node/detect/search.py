"""Full-frame search: every blob of every marker colour in one pass over the chroma planes.

Runs of equal label per row are joined with those of the row above by union-find into area, sums and box: no mask is
written. Eight pixels at a time are passed over when all lie in a box of the chroma plane that is nobody's: grey and
what is nearly grey, skin and wood, which is what most of a picture is like.

`FastDetector` searches with `ColourGate`, and whoever shows or judges the colours asks the same object: what is drawn
as the mask is what the detector computes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.detect.colour import Table, acquisition_table
from rhot_node.detect.image import GREY, YuvImage, rows_of, table_of
from rhot_node.markers import Marker, MarkerSet

AREA_MIN = 6  # chroma pixels; smaller blobs are specks (a marker of 5.5 px across)
RUNS_MAX = 16384  # more runs than this is noise or foliage, not markers; the rest of the frame is not searched
BLOBS_MAX = 512
DULL_REACH = 60  # grey levels on either side of grey that the box of nobody's colours may reach

WORD = np.uint64().nbytes  # pixels
_BYTES = range(WORD)
_ONES = np.uint64(sum(1 << 8 * k for k in _BYTES))
_TOPS = np.uint64(sum(1 << 8 * k + 7 for k in _BYTES))
_NO_WORDS = np.zeros((0, 0), dtype=np.uint64)

Labels = NDArray[np.uint8]


class Blob(NamedTuple):
    """A blob of one marker's colour: 1 + the marker's index, area, and the sums of places and of chroma (minus 128)
    over its pixels; its box. Chroma pixels."""

    label: float
    area: float
    sum_x: float
    sum_y: float
    sum_u: float
    sum_v: float
    x_min: float
    x_max: float
    y_min: float
    y_max: float

    @property
    def centroid(self) -> tuple[float, float]:
        """(x, y)."""
        return self.sum_x / self.area, self.sum_y / self.area

    @property
    def compactness(self) -> float:
        """Share of its box that it fills."""
        return self.area / ((self.x_max - self.x_min + 1.0) * (self.y_max - self.y_min + 1.0))

    def touches_border(self, shape: tuple[int, ...]) -> bool:
        """Whether its box touches the border of planes of this `shape` (H/2, W/2)."""
        return (self.x_min <= 0.0 or self.y_min <= 0.0
                or self.x_max >= shape[1] - 1.0 or self.y_max >= shape[0] - 1.0)

    def off_hue(self, hue_rad: float) -> float:
        """Angle of its chroma from a hue, rad, -pi to pi."""
        return math.remainder(math.atan2(self.sum_v, self.sum_u) - hue_rad, math.tau)

    def merit(self, marker: Marker, shape: tuple[int, ...]) -> float:
        """Score as a marker; higher is likelier: area * compactness * match of the hue, half of it at the border."""
        match = math.exp(-(self.off_hue(marker.chroma.hue_rad) / math.radians(marker.chroma.hue_tolerance_deg)) ** 2)
        return self.area * self.compactness * match * (0.5 if self.touches_border(shape) else 1.0)


_RUN = np.dtype([(name, np.int32) for name in ("label", "start", "end", "row", "sum_u", "sum_v", "parent")])


class _Words(NamedTuple):
    """Planes by words of eight pixels, (H/2, W/16) or empty, and scratch (W/16,): is a pixel of a word not dull?"""

    u: NDArray[np.uint64]
    v: NDArray[np.uint64]
    bright: NDArray[np.uint64]


class _Gate(NamedTuple):
    """Labels of chroma pairs (256, 256), lowest and highest luma of each marker (M, 2), labels that are wanted
    (M + 1,), and the box that is nobody's: least and greatest U and V (4,)."""

    table: Table
    luma_limits: NDArray[np.uint8]
    wanted: NDArray[np.bool_]
    dull: NDArray[np.uint64]


class ColourGate:
    """The colours of one marker set: hue sectors, magnitude and luma gates, and the search for their blobs.

    Holds buffers, so that a frame allocates nothing: one thread only.
    """

    def __init__(self, markers: MarkerSet) -> None:
        self.table: Table = acquisition_table(markers)
        self.luma_limits = np.array([(mark.chroma.luma_min, mark.chroma.luma_max) for mark in markers.markers],
                                    dtype=np.uint8)
        self._gate = _Gate(self.table, self.luma_limits, np.zeros(len(markers.markers) + 1, dtype=np.bool_),
                           np.array(dull_box(self.table), dtype=np.uint64))
        self._indices: list[int] | range = range(0)  # of the markers that are wanted
        self._bright = np.zeros(0, dtype=np.uint64)
        self._runs = np.zeros(RUNS_MAX, dtype=_RUN)
        self._slots = np.zeros(RUNS_MAX, dtype=np.int32)
        self._blobs = np.zeros(BLOBS_MAX, dtype=table_of(Blob))
        self._rows = rows_of(self._blobs)

    def labels(self, image: YuvImage) -> Labels:
        """(H/2, W/2) for every chroma pixel 1 + the index of the marker it is taken for, 0 for none."""
        out = np.empty(image.u.shape, dtype=np.uint8)
        _label_plane(image, self.table, self.luma_limits, out)
        return out

    def blobs(self, image: YuvImage, indices: list[int] | range, area_min: int = AREA_MIN,
              step: int = 1, first: int = 0) -> list[Blob]:
        """The blobs of the markers `indices`.

        A blob has at least `area_min` chroma pixels. Every `step`-th chroma row from `first` on stands for the others.
        """
        if indices != self._indices:
            self._indices = indices
            self._gate.wanted[:] = False
            for index in indices:
                self._gate.wanted[index + 1] = True
        words_u = words_v = _NO_WORDS
        if image.u.shape[1] % WORD == 0 and image.u.strides[1] == image.v.strides[1] == 1:
            words_u, words_v = image.u.view(np.uint64), image.v.view(np.uint64)
            if len(self._bright) != words_u.shape[1]:
                self._bright = np.zeros(words_u.shape[1], dtype=np.uint64)
        runs = label_runs(image, _Words(words_u, words_v, self._bright), self._gate, step, first, self._runs)
        count = gather_blobs(self._runs, runs, area_min, step, self._slots, self._blobs)
        return [Blob._make(row) for row in self._rows[:count].tolist()]


def dull_box(table: Table) -> tuple[int, int, int, int]:
    """The largest box of U and V round grey, (u_min, u_max, v_min, v_max), in which nothing is labelled.

    Empty (u_min 1, u_max 0) when grey itself has a label.
    """
    best, box = 0, (1, 0, 1, 0)
    for u_min in range(GREY - DULL_REACH, GREY + 1):
        labelled = np.zeros(len(table), np.bool_)
        for u_max in range(u_min, GREY + DULL_REACH):
            labelled |= table[u_max] != 0
            if u_max < GREY or labelled[GREY]:
                continue
            places = np.flatnonzero(labelled)
            v_min = max(int(places[places < GREY].max(initial=-1)) + 1, GREY - DULL_REACH)
            v_max = min(int(places[places > GREY].min(initial=len(table))), GREY + DULL_REACH) - 1
            size = (u_max - u_min + 1) * (v_max - v_min + 1)
            if size > best:
                best, box = size, (u_min, u_max, v_min, v_max)
    return box


@njit(cache=True)
def _label_at(y, u, v, row, column, table, luma_limits):
    """1 + the index of the marker that a chroma pixel is taken for, 0 for none: hue and magnitude, then luma."""
    label = np.int64(table[u[row, column], v[row, column]])
    if label != 0:
        luma = y[2 * row, 2 * column]
        if luma < luma_limits[label - 1, 0] or luma > luma_limits[label - 1, 1]:
            return 0
    return label


@njit(cache=True)
def _label_plane(image, table, luma_limits, out):
    """Write the label of every chroma pixel to `out`."""
    y, u, v = image
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            out[row, column] = _label_at(y, u, v, row, column, table, luma_limits)


@njit(cache=True)
def _outside(word, low, span):
    """Sets the top bit of every byte of `word` that is not within low..low + span; span is below 128. All by bytes."""
    away = ((word | _TOPS) - (low & ~_TOPS)) ^ ((word ^ ~low) & _TOPS)  # word - low, byte by byte
    return ((away & ~_TOPS) + (~_TOPS - span)) | away


@njit(cache=True)
def _mark_bright(words, row, dull):
    """Write for every word of a row whether a pixel of it lies outside the box `dull`."""
    low_u, span_u = dull[0] * _ONES, (dull[1] - dull[0]) * _ONES
    low_v, span_v = dull[2] * _ONES, (dull[3] - dull[2]) * _ONES
    u, v, bright = words.u[row], words.v[row], words.bright
    for k in range(bright.shape[0]):
        bright[k] = (_outside(u[k], low_u, span_u) | _outside(v[k], low_v, span_v)) & _TOPS


@njit(cache=True)
def label_runs(image, words, gate, step, first_row, runs):
    """Fill `runs` with the runs of equal wanted label, each joined to its neighbours above; return how many.

    Every `step`-th row from `first_row` on is searched. Words that are all in the gate's dull box are passed over.
    """
    y, u, v = image
    table, luma_limits, wanted, dull = gate
    bright = words.bright
    height, width = u.shape
    by_words = words.u.shape[1] > 0 and dull[0] <= dull[1]
    block = WORD if by_words else width
    count = above_start = above_end = np.int64(0)
    for row in range(first_row, height, step):
        row_start = count
        current = 0
        if by_words:
            _mark_bright(words, row, dull)
        for first in range(0, width, block):
            if by_words and bright[first // WORD] == 0:
                current = 0
                continue
            for column in range(first, first + block):
                label = _label_at(y, u, v, row, column, table, luma_limits)
                if not wanted[label]:
                    current = 0
                    continue
                if label != current:
                    if count == runs.shape[0]:
                        return count
                    _start_run(runs[count], count, label, row, column)
                    count += 1
                    current = label
                run = runs[count - 1]
                run.end = column
                run.sum_u += np.int32(u[row, column]) - GREY
                run.sum_v += np.int32(v[row, column]) - GREY
        _join_rows(runs, above_start, above_end, row_start, count, step)
        above_start, above_end = row_start, count
    return count


@njit(cache=True)
def _start_run(run, number, label, row, column):
    run.label = label
    run.start = column
    run.row = row
    run.sum_u = 0
    run.sum_v = 0
    run.parent = number


@njit(cache=True)
def _join_rows(runs, above, above_end, here, here_end, reach):
    """Union runs of two searched rows that touch (for neighbours: 8-connected) and have the same label."""
    for number in range(here, here_end):
        run = runs[number]
        while above < above_end and runs[above].end + reach < run.start:
            above += 1
        other = above
        while other < above_end and runs[other].start <= run.end + reach:
            if runs[other].label == run.label:
                first = _root(runs, other)
                second = _root(runs, number)
                runs[max(first, second)].parent = min(first, second)
            other += 1


@njit(cache=True)
def _root(runs, index):
    while runs[index].parent != index:
        runs[index].parent = runs[runs[index].parent].parent
        index = runs[index].parent
    return index


@njit(cache=True)
def gather_blobs(runs, run_count, area_min, step, slots, blobs):
    """Sum joined runs into `blobs`; keep those of at least `area_min` pixels, return how many."""
    areas = slots[:run_count]
    areas[:] = 0
    for index in range(run_count):
        areas[_root(runs, index)] += step * (runs[index].end - runs[index].start + 1)
    count = 0
    for index in range(run_count):
        root = _root(runs, index)
        if root == index:  # roots come first: a root is the lowest index of its tree
            if areas[index] < area_min or count == blobs.shape[0]:
                areas[index] = -1
            else:
                _start_blob(blobs[count], runs[index])
                areas[index] = count
                count += 1
        if areas[root] >= 0:
            _add_run(blobs[areas[root]], runs[index], step)
    return count


@njit(cache=True)
def _start_blob(blob, run):
    blob.label = run.label
    blob.area = blob.sum_x = blob.sum_y = blob.sum_u = blob.sum_v = blob.x_max = blob.y_max = 0.0
    blob.x_min = run.start
    blob.y_min = run.row


@njit(cache=True)
def _add_run(blob, run, step):
    area = step * (run.end - run.start + 1)
    blob.area += area
    blob.sum_x += 0.5 * (run.start + run.end) * area
    blob.sum_y += (run.row + 0.5 * (step - 1)) * area
    blob.sum_u += step * run.sum_u
    blob.sum_v += step * run.sum_v
    blob.x_min = min(blob.x_min, run.start)
    blob.x_max = max(blob.x_max, run.end)
    blob.y_max = run.row + step - 1
