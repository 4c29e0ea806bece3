"""Tables: CSV and Parquet with one row per state, and NPZ with the arrays themselves. Columns: docs/export.md."""

from __future__ import annotations

import zipfile
from typing import Any

import numpy as np

from rhot_app.errors import require
from rhot_app.export.plan import Format, Plan
from rhot_app.export.states import ARRAYS, OBJECT_ARRAYS, Column, HandStates, columns
from rhot_app.hand.skeleton import ANGLES, FINGERS, JOINTS
from rhot_app.project import OTHER_HAND

_OF_FINGERTIPS = "distances", "distance_sd", "contacts"
"""What an object's state says of a hand."""

ROW_GROUP = 4096  # states in a row group of a Parquet file

_TURN = "_qw", "_qx", "_qy", "_qz"


class CsvWriter:
    """One line of names, then one line per state; what is unknown is an empty cell. Names with commas or quotes are
    quoted."""

    def __init__(self, plan: Plan) -> None:
        self.notes: list[str] = []
        self._plan = plan
        self._file = plan.path.open("w", encoding="utf-8", newline="")
        self._line = ""

    def add(self, states: HandStates) -> None:
        """Write these rows."""
        table = list(columns(states, self._plan.scale, self._plan.first_ns, self._plan.wall_clock_offset_ns))
        if not self._line:
            self._file.write(",".join(_quoted(name) for name, _ in table) + "\n")
            self._line = ",".join(_cell(name, column, self._plan.scale) for name, column in table) + "\n"
        rows = zip(*(column.tolist() for _, column in table), strict=True)
        self._file.write("".join([self._line % row for row in rows]).replace("nan", ""))

    def finish(self) -> None:
        """All rows are on their way to the disk."""
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if set(name) & set(',"') else name


def _cell(name: str, column: Column, scale: float) -> str:
    """How a column's numbers are written: lengths to 0.1 µm, angles to 0.0001 degree, times to the nanosecond."""
    if column.dtype == object:
        return "%s"
    if column.dtype.kind in "iu":
        return "%d"
    if name == "time_s":
        return "%.9f"
    if "_cov_" in name or "_sd" in name:
        return "%.6g"
    if name.endswith("_m"):
        return "%.7f"
    return "%.7f" if name.endswith(_TURN) or "hand_scale" in name else "%.4f"


class ParquetWriter:
    """The columns of a CSV file, 32-bit floats; what is unknown is NaN."""

    def __init__(self, plan: Plan) -> None:
        self.notes: list[str] = []
        self._arrow = require("pyarrow", "a Parquet file")
        self._parquet = require("pyarrow.parquet", "a Parquet file")
        self._plan = plan
        self._waiting: list[Any] = []
        self._rows = 0
        self._writer: Any = None

    def add(self, states: HandStates) -> None:
        """Take these rows; some thousand are written at a time."""
        arrays = {name: self._column(name, column)
                  for name, column in columns(states, self._plan.scale, self._plan.first_ns,
                                              self._plan.wall_clock_offset_ns)}
        self._waiting.append(self._arrow.table(arrays))
        self._rows += len(states)
        if self._rows >= ROW_GROUP:
            self._write()

    def _column(self, name: str, column: Column) -> Any:
        if column.dtype == object:
            return self._arrow.array(column, type=self._arrow.string())
        wide = column.dtype.kind != "f" or name == "time_s"
        return self._arrow.array(column if wide else column.astype(np.float32))

    def _write(self) -> None:
        table = self._arrow.concat_tables(self._waiting)
        if self._writer is None:
            schema = table.schema.with_metadata({f"rhot.{key}": value for key, value in self._plan.about().items()})
            self._writer = self._parquet.ParquetWriter(self._plan.path, schema, compression="zstd")
        self._writer.write_table(table.replace_schema_metadata(self._writer.schema.metadata))
        self._waiting, self._rows = [], 0

    def finish(self) -> None:
        """Write the last rows and the footer."""
        if self._waiting:
            self._write()
        self.close()

    def close(self) -> None:
        """Close the file."""
        if self._writer is not None:
            self._writer.close()


class NpzWriter:
    """The arrays of `HandStates`, 32-bit floats, by their names; the other hand's begin with ``other_``. Those of
    K objects begin with ``object_`` and have the shape (N, K, ...)."""

    def __init__(self, plan: Plan) -> None:
        self.notes: list[str] = []
        self._plan = plan
        self._parts: dict[str, list[Column]] = {}
        self._ids: tuple[str, ...] = ()
        self._objects: tuple[str, ...] = ()

    def add(self, states: HandStates) -> None:
        """Keep these states."""
        self._ids = states.marker_ids
        self._keep("", states)
        if states.other is not None:
            self._keep(OTHER_HAND, states.other)

    def _keep(self, prefix: str, states: HandStates) -> None:
        for name in ARRAYS:
            if prefix and (name in ("sequence", "t_master_ns", "epipolar_error_px") or name.startswith("marker_")):
                continue  # the first hand's arrays have the markers of both
            column = getattr(states, name)
            kept = column.astype(np.float32) if column.dtype.kind == "f" else column
            self._parts.setdefault(prefix + name, []).append(_scaled(name, kept, self._plan.scale))
        for name in OBJECT_ARRAYS if states.objects else ():
            if prefix and name not in _OF_FINGERTIPS:
                continue
            self._objects = tuple(one.name for one in states.objects)
            column = np.stack([getattr(one, name) for one in states.objects], axis=1)
            kept = column.astype(np.float32) if column.dtype.kind == "f" else column
            self._parts.setdefault(f"{prefix}object_{name}", []).append(_scaled(name, kept, self._plan.scale))

    def finish(self) -> None:
        """Write the archive, one array at a time."""
        names = {"marker_ids": self._ids, "joint_names": JOINTS, "angle_names": ANGLES, "finger_names": FINGERS}
        if self._objects:
            names["object_names"] = self._objects
        with zipfile.ZipFile(self._plan.path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            times = np.concatenate(self._parts["t_master_ns"])
            _store(archive, "times_s", 1e-9 * (times - self._plan.first_ns))
            for name in list(self._parts):
                _store(archive, name, np.concatenate(self._parts.pop(name)))
            for name, words in names.items():
                _store(archive, name, np.array(words))
            for name, word in self._plan.about().items():
                _store(archive, f"about_{name}", np.array(word))

    def close(self) -> None:
        """Let go of the states."""
        self._parts.clear()


def _scaled(name: str, column: Column, scale: float) -> Column:
    """An array (N, ...) in the file's unit of length. Poses have it in their translations; twists and the covariances
    of poses in their first three numbers."""
    if scale == 1.0:
        return column
    if name.endswith(("_positions", "distances", "distance_sd")):
        return column * np.float32(scale)
    if name.endswith("_covariances"):
        return column * np.float32(scale * scale)
    per = np.where(np.arange(6) < 3, scale, 1.0).astype(np.float32)
    if name == "velocity":
        return column * per
    if name in ("palm_covariance", "covariance"):
        return column * per[:, None] * per
    if name in ("world_from_palm", "world_from_object"):
        column = column.copy()
        column[..., :3, 3] *= np.float32(scale)
    return column


def _store(archive: zipfile.ZipFile, name: str, array: Column) -> None:
    with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
        np.lib.format.write_array(file, array, allow_pickle=False)


FORMATS = (
    Format("csv", "CSV: a table", CsvWriter, (".csv",), "mm", says_knowledge=True),
    Format("npz", "NPZ: NumPy's arrays", NpzWriter, (".npz",), "m", says_knowledge=True),
    Format("parquet", "Parquet: a table for analysis", ParquetWriter, (".parquet",), "mm", says_knowledge=True))
