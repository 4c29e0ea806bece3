"""A ring buffer of time-stamped rows for a plot, with gaps and a text form; the range of the plot's axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Series:
    """The last `capacity` rows of `len(names)` columns. A pause longer than `gap_s` becomes a row of NaN.

    Times are master monotonic ns; a row older than the last one is ignored.
    """

    def __init__(self, names: tuple[str, ...], capacity: int = 900, gap_s: float = 1.0) -> None:
        self.names = names
        self._gap_ns = round(gap_s * 1e9)
        self._times = np.zeros(capacity, dtype=np.int64)
        self._rows = np.full((capacity, len(names)), np.nan)
        self._count = 0

    def __len__(self) -> int:
        return min(self._count, len(self._times))

    def clear(self) -> None:
        """Forget every row."""
        self._count = 0

    def append(self, t_ns: int, row: Array) -> None:
        """Add one row (columns,); NaN where there is no value."""
        if self._count:
            last = int(self._times[(self._count - 1) % len(self._times)])
            if t_ns <= last:
                return
            if t_ns - last > self._gap_ns:
                self._put(last + 1, np.full(len(self.names), np.nan))
        self._put(t_ns, row)

    def _put(self, t_ns: int, row: Array) -> None:
        slot = self._count % len(self._times)
        self._times[slot] = t_ns
        self._rows[slot] = row
        self._count += 1

    def window(self, now_ns: int, span_s: float) -> tuple[Array, Array]:
        """Rows of the last `span_s` seconds, oldest first: seconds from now (n,), all <= 0, and values (n, columns)."""
        n = len(self)
        order = np.arange(self._count - n, self._count) % len(self._times)
        seconds = (self._times[order] - now_ns) * 1e-9
        inside = seconds >= -span_s
        return np.asarray(seconds[inside], dtype=np.float64), self._rows[order][inside]


class RecordedSeries(Series):
    """All rows of a recording, to be looked at from any instant of it. A pause longer than `gap_s` is a row of NaN."""

    def __init__(self, names: tuple[str, ...], times_ns: NDArray[np.int64], rows: Array, gap_s: float = 1.0) -> None:
        """`times_ns` (n,) grow; `rows` (n, columns)."""
        super().__init__(names, capacity=1)
        pauses = np.flatnonzero(np.diff(times_ns) > 1e9 * gap_s) + 1
        self._times = np.insert(times_ns, pauses, times_ns[pauses - 1] + 1)
        self._rows = np.insert(rows, pauses, np.nan, axis=0)
        self._count = len(self._times)

    def window(self, now_ns: int, span_s: float) -> tuple[Array, Array]:
        """Rows of the `span_s` seconds before `now_ns`: seconds from then (n,), all <= 0, and values (n, columns)."""
        begin, end = np.searchsorted(self._times, [now_ns - round(1e9 * span_s), now_ns + 1])
        return np.asarray((self._times[begin:end] - now_ns) * 1e-9), self._rows[begin:end]


def to_csv(seconds: Array, rows: Array, names: tuple[str, ...], unit: str) -> str:
    """Comma-separated text with a heading; times in s before now, an empty field where there is no value."""
    head = ",".join(["time [s]", *(f"{name} [{unit}]" if unit else name for name in names)])
    lines = [head]
    for t, row in zip(seconds, rows, strict=True):
        lines.append(",".join([f"{t:.3f}", *("" if np.isnan(value) else f"{value:.6g}" for value in row)]))
    return "\n".join(lines) + "\n"


# -- range of a plot's axis --------------------------------------------------------------------------------------------

_USUAL_PERCENT = 90.0
_ROOM = 1.6  # times the usual: what stays below is drawn whole
_STEPS = np.array([1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0])


@dataclass(frozen=True, slots=True)
class Peak:
    """A run of values above the axis: when its highest one was, s, and how high."""

    second: float
    value: float


def usual_top(values: Array) -> float:
    """The greatest of `values` (any shape), or 1.6 times their 90th percentile where that is less; NaN without any."""
    known = values[np.isfinite(values)]
    if not len(known):
        return float("nan")
    return float(min(known.max(), max(_ROOM * np.percentile(known, _USUAL_PERCENT), 0.0)))


def round_top(top: float, least: float) -> float:
    """A round number a little above `top`, and at least `least`."""
    if not np.isfinite(top) or top <= 0:
        return least
    scale = 10.0 ** np.floor(np.log10(top))
    step = _STEPS[np.searchsorted(_STEPS, 1.05 * top / scale).clip(max=len(_STEPS) - 1)]
    return float(max(scale * step, least))


def peaks_above(seconds: Array, values: Array, top: float) -> list[Peak]:
    """One peak for each run of `values` (n,) above `top`; a gap or a value below ends a run."""
    above = np.flatnonzero(np.nan_to_num(values, nan=-np.inf) > top)
    if not len(above):
        return []
    runs = np.split(above, np.flatnonzero(np.diff(above) > 1) + 1)
    highest = [run[np.argmax(values[run])] for run in runs]
    return [Peak(float(seconds[k]), float(values[k])) for k in highest]
