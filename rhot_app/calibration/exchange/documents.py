"""YAML and TOML files of other programs as plain Python values, and the parts of them that calibrations consist of.

YAML is read event by event: no tag makes an object, and anchors, whose aliases can unfold without end, are refused.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import CalibrationError
from rhot_app.geometry.transforms import best_rotation, rigid
from rhot_node.errors import printable
from rhot_node.files import read_input, why

Array = NDArray[np.float64]

BYTES_MAX: Final = 1 << 20
"""Of a file: OpenCV's, with all corners of a hundred views, has half of it."""

DEPTH_MAX: Final = 16
"""Lists and tables within each other."""

PARTS_MAX: Final = 100
"""Of a dotted TOML name."""

ROTATION_TOLERANCE: Final = 1e-3
"""Largest element of R R^T - I of what is taken for a rotation: files print three digits and more."""

_KEYS = re.compile(r"[\n\r,=\[\]{}#]")  # what a dotted name ends at
_OPENCV_HEAD = "%YAML:1.0"
"""The directive of OpenCV's files, which is none of YAML's."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A part of a document: the `file` that it is in, its `place` there for messages, and its `value`."""

    file: Path
    place: str
    value: Any

    def has(self, key: str) -> bool:
        """Whether this is a table with that key."""
        return isinstance(self.value, dict) and self.value.get(key) is not None

    def __getitem__(self, key: str) -> Entry:
        """The part under a key. Raises CalibrationError where it is missing."""
        place = f"{self.place}.{key}" if self.place else key
        if not self.has(key):
            raise CalibrationError(f"{self.file}: {printable(place)} is missing.")
        return Entry(self.file, place, self.value[key])

    def wrong(self, what: str) -> CalibrationError:
        """The error that says what is wrong with this part."""
        return CalibrationError(f"{self.file}: {printable(self.place) or 'it'} {what}")

    @property
    def text(self) -> str:
        """A word, or a number that stands for one. Raises CalibrationError."""
        if not isinstance(self.value, str | int):
            raise self.wrong("is no text.")
        return str(self.value)

    @property
    def whole(self) -> int:
        """A whole number. Raises CalibrationError."""
        if not isinstance(self.value, int) or isinstance(self.value, bool):
            raise self.wrong("is no whole number.")
        return self.value

    def numbers(self, *counts: int) -> Array:
        """(N,) the numbers of a list, or of a matrix row by row; N one of `counts` where they are given.
        Raises CalibrationError."""
        flat = list(_leaves(self._data()))
        if not all(isinstance(one, int | float) and not isinstance(one, bool) and math.isfinite(one) for one in flat):
            raise self.wrong("has something else than finite numbers.")
        if isinstance(self.value, dict) and self["rows"].whole * self["cols"].whole != len(flat):
            raise self.wrong(f"has {len(flat)} numbers, not {self['rows'].whole} x {self['cols'].whole}.")
        if counts and len(flat) not in counts:
            raise self.wrong(f"has {len(flat)} numbers, not {' or '.join(map(str, counts))}.")
        return np.array(flat, np.float64)

    def matrix(self, rows: int, cols: int) -> Array:
        """(rows, cols) of OpenCV's or ROS's table of rows, cols and data, or of a list. Raises CalibrationError."""
        if isinstance(self.value, dict) and (self["rows"].whole, self["cols"].whole) != (rows, cols):
            raise self.wrong(f"is {self['rows'].whole}x{self['cols'].whole}, not {rows}x{cols}.")
        return self.numbers(rows * cols).reshape(rows, cols)

    def rotation(self) -> Array:
        """(3, 3) the rotation nearest to a matrix. Raises CalibrationError where it is none."""
        return self._nearest(self.matrix(3, 3))

    def transform(self) -> Array:
        """(4, 4) a rigid transform. Raises CalibrationError."""
        matrix = self.matrix(4, 4)
        if not np.allclose(matrix[3], (0.0, 0.0, 0.0, 1.0), atol=1e-9):
            raise self.wrong("is no rigid transform: its last row is not 0, 0, 0, 1.")
        return rigid(self._nearest(matrix[:3, :3]), matrix[:3, 3])

    def _nearest(self, matrix: Array) -> Array:
        off = np.abs(matrix @ matrix.T - np.eye(3)).max()
        if not (off < ROTATION_TOLERANCE and np.linalg.det(matrix) > 0.0):
            raise self.wrong("is no rotation.")
        return best_rotation(matrix)

    def _data(self) -> Any:
        return self["data"].value if isinstance(self.value, dict) else self.value


def _leaves(value: Any) -> Iterator[Any]:
    """What is no list, in order; lists are at most `DEPTH_MAX` deep."""
    if not isinstance(value, list):
        yield value
        return
    for one in value:
        yield from _leaves(one)


def read_table(path: Path) -> Entry:
    """A file's table: TOML where its name ends so, else YAML, of which JSON is a part.

    Raises CalibrationError: it cannot be read, is too large, no text, no table, or uses what is refused.
    """
    try:
        text = read_input(path, BYTES_MAX).decode()
    except UnicodeDecodeError as exc:
        raise CalibrationError(f"{path}: this is no text, so no calibration in YAML or TOML.") from exc
    except (OSError, ValueError) as exc:
        raise CalibrationError(f"{path}: cannot be read ({why(exc)}).") from exc
    if text.lstrip("\ufeff \n").startswith("<"):
        raise CalibrationError(f"{path}: this is XML, which is not read. Have OpenCV write it as .yml.")
    value = _toml(text, path) if path.suffix.lower() == ".toml" else _yaml(text, path)
    if not isinstance(value, dict):
        raise CalibrationError(f"{path}: this is no calibration: a table of names and values is needed.")
    return Entry(path, "", value)


def _toml(text: str, path: Path) -> Any:
    if max(part.count(".") for part in _KEYS.split(text)) > PARTS_MAX:  # tomllib takes the square of their number
        raise CalibrationError(f"{path}: a name has more than {PARTS_MAX} parts, so this is no calibration.")
    try:
        return tomllib.loads(text)
    except RecursionError as exc:
        raise CalibrationError(f"{path}: lists and tables are nested too deeply.") from exc
    except ValueError as exc:
        raise CalibrationError(f"{path}: not valid TOML ({printable(str(exc))}).") from exc


def _yaml(text: str, path: Path) -> Any:
    import yaml

    if text.startswith(_OPENCV_HEAD):
        text = text.partition("\n")[2]
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    open_parts: list[list[Any]] = [[]]  # the document's, then those of each list and table around the event
    try:
        for event in yaml.parse(text, Loader=loader):
            if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None) is not None:
                raise CalibrationError(f"{path}: anchors and aliases (& and *) are not read; write the values out.")
            if isinstance(event, yaml.CollectionStartEvent):
                if len(open_parts) > DEPTH_MAX:
                    raise CalibrationError(f"{path}: lists and tables are nested deeper than {DEPTH_MAX}.")
                open_parts.append([])
            elif isinstance(event, yaml.ScalarEvent):
                open_parts[-1].append(_scalar(event.value) if event.implicit[0] else event.value)
            elif isinstance(event, yaml.CollectionEndEvent):
                parts = open_parts.pop()
                open_parts[-1].append(_table(parts, path) if isinstance(event, yaml.MappingEndEvent) else parts)
    except yaml.YAMLError as exc:
        mark = getattr(exc, "problem_mark", None)
        where = "" if mark is None else f"line {mark.line + 1}: "
        what = printable(" ".join(str(getattr(exc, "problem", None) or exc).split()))[:80]
        raise CalibrationError(f"{path}: none of the files that are read: those of OpenCV, ROS and Kalibr are YAML, "
                               f"which this is not ({where}{what}); those of anipose and caliscope end in .toml."
                               ) from exc
    if len(open_parts[0]) != 1:
        raise CalibrationError(f"{path}: one document is needed, it has {len(open_parts[0])}.")
    return open_parts[0][0]


def _table(parts: list[Any], path: Path) -> dict[str, Any]:
    """Keys and values in turn as a table."""
    table: dict[str, Any] = {}
    for key, value in zip(parts[::2], parts[1::2], strict=True):
        if isinstance(key, dict | list) or str(key) in table:
            raise CalibrationError(f"{path}: the key {printable(str(key))[:40]} is there twice, or is no name.")
        table[str(key)] = value
    return table


def _scalar(text: str) -> Any:
    """A plain scalar: a number where it is one, also 1e-05, which YAML 1.1 calls text; OpenCV writes .Nan and .Inf."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    if text.lower().lstrip("-+") in (".nan", ".inf"):
        return math.nan
    return None if text.lower() in ("", "~", "null") else {"true": True, "false": False}.get(text.lower(), text)


def listed(values: Array) -> str:
    """Numbers (N,) as a list of YAML and TOML, each as exactly as it is."""
    return f"[{', '.join(repr(float(value)) for value in values)}]"
