"""Qualisys TSV exports (optical motion capture): named points over time. Millimetres there, metres from here on."""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import RecordingError
from rhot_node.files import read_table

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PointTracks:
    """`names` of M points; `times_s` (T,) since the first frame; `positions` (T, M, 3) m, world of the recorder, NaN =
    missing."""

    names: tuple[str, ...]
    times_s: Array
    positions: Array


def read_qualisys(path: Path) -> PointTracks:
    """Read a TSV export with 3-D data. Raises RecordingError naming the file and what is wrong with it."""
    try:
        text = read_table(path).decode()
    except (OSError, UnicodeDecodeError) as exc:
        raise RecordingError(f"{path}: cannot be read as a recording ({exc}).") from exc
    try:
        return _parse(text)
    except (ValueError, IndexError, StopIteration) as exc:
        why = str(exc) or "its header is incomplete"
        raise RecordingError(f"{path}: not a Qualisys TSV export of 3-D points ({why}).") from exc


def _parse(text: str) -> PointTracks:
    lines = text.splitlines()
    names = next(line for line in lines if line.startswith("MARKER_NAMES")).split("\t")[1:]
    names = [name for name in names if name.strip()]
    start = next(k for k, line in enumerate(lines) if line.startswith("Frame\t")) + 1
    width = 2 + 3 * len(names)
    numbers = array("d")  # a table's cells as text take ten times as much
    for number, line in enumerate(lines[start:], start + 1):
        row = line.split("\t")[:width]
        if not line.strip():
            continue
        if len(row) < width:
            raise ValueError(f"line {number} has {len(row)} columns, not {width}")
        numbers.extend(float(cell) if cell.strip() else np.nan for cell in row)
    if not numbers:
        raise ValueError("it holds no frames")
    table = np.array(numbers).reshape(-1, width)
    positions = 1e-3 * table[:, 2:].reshape(len(table), len(names), 3)
    positions[(positions == 0.0).all(axis=2)] = np.nan  # the exporter writes a missing marker as zeros
    return PointTracks(tuple(names), table[:, 1] - table[0, 1], positions)
