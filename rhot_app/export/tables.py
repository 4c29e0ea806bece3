"""Tables: CSV and Parquet with one row per state, and NPZ with the arrays themselves. Columns: docs/export.md."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.export.plan import Plan, require
from rhot_app.export.states import ARRAYS, OBJECT_ARRAYS, HandStates, ObjectStates
from rhot_app.hand.skeleton import ANGLES, FINGERS, JOINTS
from rhot_app.project import OTHER_HAND

Column = NDArray[Any]

_OF_FINGERTIPS = "distances", "distance_sd", "contacts"
"""What an object's state says of a hand."""

ROW_GROUP = 4096  # states in a row group of a Parquet file

_AXES = "x", "y", "z"
_TURN = "_qw", "_qx", "_qy", "_qz"
_TWIST = "x", "y", "z", "rx", "ry", "rz"


def columns(states: HandStates, scale: float, first_ns: int | None,
            wall_clock_offset_ns: int | None = None) -> Iterator[tuple[str, Column]]:
    """The columns of a table, each (N,), by name; `scale` is the unit of length per metre, 1000 or 1.

    `first_ns`: where `time_s` is 0; None: at the first of these states. `wall_clock_offset_ns`: ns since 1970 less the
    master's clock; without it there is no column of wall clock time.
    """
    unit = "mm" if scale == 1000.0 else "m"
    begin = states.t_master_ns[:1] if first_ns is None else first_ns
    yield "time_s", 1e-9 * (states.t_master_ns - begin)
    yield "t_master_ns", states.t_master_ns
    if wall_clock_offset_ns is not None:
        yield "t_unix_ns", states.t_master_ns + wall_clock_offset_ns
    yield "sequence", states.sequence
    yield "condition", np.array(states.conditions, dtype=object)
    for index, marker in enumerate(states.marker_ids):
        name = f"marker_{marker}"
        yield from _point(name, states.marker_positions[:, index], scale, unit)
        yield from _point(f"{name}_raw", states.marker_raw_positions[:, index], scale, unit)
        yield from _covariance(name, states.marker_covariances[:, index], scale, unit)
        yield f"{name}_epipolar_error_px", states.epipolar_error_px[:, index]
        yield f"{name}_knowledge", states.marker_knowledge[:, index]
    yield from _hand("", states, scale, unit)
    if states.other is not None:
        yield f"{OTHER_HAND}condition", np.array(states.other.conditions, dtype=object)
        yield from _hand(OTHER_HAND, states.other, scale, unit)
    for one in states.objects:
        yield from _object(one, scale, unit)
        yield from _fingertips("", one, scale, unit)
    for one in states.other.objects if states.other is not None else ():
        yield from _fingertips(OTHER_HAND, one, scale, unit)


def _object(one: ObjectStates, scale: float, unit: str) -> Iterator[tuple[str, Column]]:
    name = f"object_{one.name}"
    yield f"{name}_validity", np.array(one.validities, dtype=object)
    yield from _point(name, one.world_from_object[:, :3, 3], scale, unit)
    for index, part in enumerate(quaternion_from_rotation(one.world_from_object[:, :3, :3]).T):
        yield f"{name}_q{'wxyz'[index]}", part
    yield from _pose_covariance(name, one.covariance, scale, unit)


def _fingertips(prefix: str, one: ObjectStates, scale: float, unit: str) -> Iterator[tuple[str, Column]]:
    """How far a hand's fingertips are from an object."""
    for index, finger in enumerate(FINGERS):
        name = f"object_{one.name}_{prefix}{finger}"
        yield f"{name}_distance_{unit}", scale * one.distances[:, index]
        yield f"{name}_distance_sd_{unit}", scale * one.distance_sd[:, index]
        yield f"{name}_contact", one.contacts[:, index]


def _pose_covariance(name: str, covariances: Column, scale: float, unit: str) -> Iterator[tuple[str, Column]]:
    for i, j in combinations_with_replacement(range(6), 2):
        factor, of = ((scale * scale, f"{unit}2"), (scale, f"{unit}_rad"), (1.0, "rad2"))[(i > 2) + (j > 2)]
        yield f"{name}_cov_{_TWIST[i]}_{_TWIST[j]}_{of}", factor * covariances[:, i, j]


def _hand(prefix: str, states: HandStates, scale: float, unit: str) -> Iterator[tuple[str, Column]]:
    for index, joint in enumerate(JOINTS):
        name = f"{prefix}joint_{joint}"
        yield from _point(name, states.joint_positions[:, index], scale, unit)
        yield from _covariance(name, states.joint_covariances[:, index], scale, unit)
        yield f"{name}_knowledge", states.joint_knowledge[:, index]
    for index, finger in enumerate(FINGERS):
        name = f"{prefix}fingertip_{finger}"
        yield from _point(name, states.fingertip_positions[:, index], scale, unit)
        yield from _covariance(name, states.fingertip_covariances[:, index], scale, unit)
    for index, angle in enumerate(ANGLES):
        yield f"{prefix}angle_{angle}_deg", np.degrees(states.angles[:, index])
        yield f"{prefix}angle_{angle}_sd_deg", np.degrees(states.angle_sd[:, index])
        yield f"{prefix}angle_{angle}_knowledge", states.angle_knowledge[:, index]
    yield from _point(f"{prefix}palm", states.world_from_palm[:, :3, 3], scale, unit)
    for index, part in enumerate(quaternion_from_rotation(states.world_from_palm[:, :3, :3]).T):
        yield f"{prefix}palm_q{'wxyz'[index]}", part
    yield from _pose_covariance(f"{prefix}palm", states.palm_covariance, scale, unit)
    yield f"{prefix}palm_knowledge", states.palm_knowledge
    yield f"{prefix}hand_scale", states.hand_scale
    yield f"{prefix}hand_scale_sd", states.hand_scale_sd


def _point(name: str, positions: Column, scale: float, unit: str) -> Iterator[tuple[str, Column]]:
    for index, axis in enumerate(_AXES):
        yield f"{name}_{axis}_{unit}", scale * positions[:, index]


def _covariance(name: str, covariances: Column, scale: float, unit: str) -> Iterator[tuple[str, Column]]:
    for i, j in combinations_with_replacement(range(3), 2):
        yield f"{name}_cov_{_AXES[i]}{_AXES[j]}_{unit}2", scale * scale * covariances[:, i, j]


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
            self._parts.setdefault(f"{prefix}object_{name}", []).append(_scaled_object(name, kept, self._plan.scale))

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
    """An array in the file's unit of length; the palm's covariance has it in its translations."""
    if scale == 1.0 or not (name.endswith(("_positions", "_covariances")) or name in ("world_from_palm",
                                                                                      "palm_covariance")):
        return column
    if name.endswith("_positions"):
        return column * np.float32(scale)
    if name.endswith("_covariances"):
        return column * np.float32(scale * scale)
    out = column.copy()
    if name == "world_from_palm":
        out[:, :3, 3] *= np.float32(scale)
        return out
    per = np.where(np.arange(6) < 3, scale, 1.0).astype(np.float32)
    return out * per[:, None] * per


def _scaled_object(name: str, column: Column, scale: float) -> Column:
    """An array (N, K, ...) of objects in the file's unit of length."""
    if scale == 1.0 or name in ("validity", "contacts"):
        return column
    if name in ("distances", "distance_sd"):
        return column * np.float32(scale)
    out = column.copy()
    if name == "world_from_object":
        out[..., :3, 3] *= np.float32(scale)
        return out
    per = np.where(np.arange(6) < 3, scale, 1.0).astype(np.float32)
    return out * per if name == "velocity" else out * per[:, None] * per


def _store(archive: zipfile.ZipFile, name: str, array: Column) -> None:
    with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
        np.lib.format.write_array(file, array, allow_pickle=False)
