"""Which picture of one camera belongs to which of the others, by the numbers in their names."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rhot_app.calibration.stereo_views import Dropped
from rhot_app.calibration.views import in_natural_order
from rhot_app.errors import CalibrationError

Key = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class FileShot:
    """The pictures of one moment, one per camera, None where a camera has none; `name` is what they share."""

    name: str
    files: tuple[Path | None, ...]


@dataclass(frozen=True, slots=True)
class FileShots:
    """All moments in order, the pictures without partner, and whether the numbers in the names said what belongs
    together (`by_number`) or only the order of the names did."""

    shots: tuple[FileShot, ...]
    alone: tuple[Dropped, ...]
    by_number: bool


def match_files(files: Mapping[str, Sequence[Path]]) -> FileShots:
    """Put the pictures of all cameras together.

    `files` per camera's name. Pictures belong together when the numbers in their names are the same, leaving out
    numbers that never change; without such numbers lists of the same length are taken in order. Raises CalibrationError
    when neither works.
    """
    for name, those in files.items():
        if not those:
            raise CalibrationError(f"{name}: there are no pictures. Give a pattern in quotes, such as 'left*.jpg'.")
    keys = {name: _keys(those) for name, those in files.items()}
    shared = _common(list(keys.values()))
    if len(shared) >= max(1, min(len(those) for those in files.values()) // 2):
        return _by_number(files, keys, shared)
    lengths = {name: len(those) for name, those in files.items()}
    if len(set(lengths.values())) != 1:
        counts = ", ".join(f"{name} {count}" for name, count in lengths.items())
        raise CalibrationError(f"The lists have different lengths ({counts}) and the file names have no common "
                               "numbers: it cannot be told which pictures belong together. Number them alike, such as "
                               "left07.jpg and right07.jpg.")
    ordered = [in_natural_order(those) for those in files.values()]
    return FileShots(tuple(FileShot("/".join(path.stem for path in row), tuple(row))
                           for row in zip(*ordered, strict=True)), (), False)


def _keys(files: Sequence[Path]) -> dict[Key, Path] | None:
    """Each file under the numbers in its name that change within the list; None when they do not tell files apart."""
    numbers = [tuple(int(number) for number in re.findall(r"\d+", path.stem)) for path in files]
    if len({len(each) for each in numbers}) != 1:
        return None
    columns = list(zip(*numbers, strict=True))
    telling = [column for column in columns if len(set(column)) > 1] or columns[-1:]
    keys = list(zip(*telling, strict=True))
    if len(set(keys)) != len(files) or not keys:
        return None
    return dict(zip(keys, files, strict=True))


def _common(keys: Sequence[dict[Key, Path] | None]) -> set[Key]:
    """The numbers that at least two cameras have."""
    every = [set(each) for each in keys if each is not None]
    if len(every) != len(keys):
        return set()
    return {key for those in every for key in those if sum(key in other for other in every) >= 2}


def _by_number(files: Mapping[str, Sequence[Path]], keys: Mapping[str, dict[Key, Path] | None],
               shared: set[Key]) -> FileShots:
    tables = [keys[name] or {} for name in files]
    shots = tuple(FileShot("-".join(str(number) for number in key), tuple(table.get(key) for table in tables))
                  for key in sorted(shared))
    alone = [Dropped(path.name, "no other camera has a picture of this number", "no_partner")
             for table in tables for key, path in table.items() if key not in shared]
    return FileShots(shots, tuple(alone), True)
