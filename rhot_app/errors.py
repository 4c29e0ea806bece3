"""Every error the master raises on purpose. A message says what was wrong, in which file or node, and what to do."""

from __future__ import annotations

import argparse
import importlib
import math
from pathlib import Path
from typing import Any


class RhotError(Exception):
    """Root of all errors of this package; commands print it and exit with code 2: nothing came of it."""


class RigError(RhotError):
    """A rig, hand or motion file is missing, unreadable, or says something that cannot be."""


class ObjectError(RhotError):
    """An object file or a pose stream is unreadable or says something that cannot be, or no image shows the object."""


class TrackingError(RhotError):
    """A tracker was asked for what it cannot know yet, or its input is none of its rig's."""


class SourceError(RhotError):
    """A port is taken or a node cannot be reached."""


class PairingError(RhotError):
    """A node could not be paired: nobody answers, the code is wrong, or somebody stands between."""


class RecordingError(RhotError):
    """A log cannot be read or written."""


class SimulatorError(RhotError):
    """The digital twin cannot do what was asked."""


class EngineError(RhotError):
    """The engine cannot be started, reached, or refused a command."""


class CalibrationError(RhotError):
    """A calibration cannot begin or end: its input is missing, unreadable, or does not determine the answer."""


def require(package: str, what: str, extra: str = "export") -> Any:
    """The module of an optional package. Raises ExportError that names `what` needs it, and the extra that has it."""
    try:
        return importlib.import_module(package)
    except ImportError as exc:
        raise ExportError(f"{what} needs the package {package.split('.')[0]!r}, which cannot be imported ({exc}). "
                          f"Install it with: pip install 'rhot[{extra}]'") from exc


def input_file(text: str) -> Path:
    """Type of a command's argument that names a file to read, for argparse. What cannot be opened is refused here,
    before the command loads anything that takes time. Raises RhotError."""
    path = Path(text)
    try:
        path.stat()
        if path.is_file():  # what reads it refuses a pipe or a folder
            path.open("rb").close()
    except FileNotFoundError as exc:
        raise RhotError(f"{path}: no such file. Is the name right?") from exc
    except OSError as exc:
        raise RhotError(f"{path}: cannot be read ({exc.strerror}).") from exc
    except ValueError as exc:
        raise RhotError(f"{path}: cannot be read (a file's name has no NUL).") from exc
    return path


def finite(text: str) -> float:
    """Type of a command's argument that is a number, for argparse: not NaN, which passes many a limit, nor infinite."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text} is not a finite number")
    return value


def positive_number(text: str) -> float:
    """Type of a command's argument that is a number above 0, for argparse."""
    value = finite(text)
    if not 0.0 < value < 1e6:
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value


def not_negative(text: str) -> float:
    """Type of a command's argument that is a number, 0 or above, for argparse."""
    value = finite(text)
    if not 0.0 <= value < 1e6:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 0 on")
    return value


def whole(text: str) -> int:
    """Type of a command's argument that is a whole number, for argparse: of at most 32 bits, so that it fits wherever
    numbers are counted."""
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text} is not a whole number") from None
    if abs(value) >= 2**32:
        raise argparse.ArgumentTypeError(f"{text} is too large")
    return value


def refuse_existing(path: Path, error: type[RhotError], option: str = "--out", *, force: bool) -> None:
    """Raise `error` when something stands at `path`, which `option` named, unless it is to be written over."""
    if path.exists() and not force:
        raise error(f"{path} exists already; choose another {option}, or write over it with --force.")


def count(text: str) -> int:
    """Type of a command's argument that is a whole number, 0 or above, for argparse."""
    value = whole(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is not a whole number from 0 on")
    return value


def positive_count(text: str) -> int:
    """Type of a command's argument that is a whole number above 0, for argparse."""
    value = whole(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a whole number above 0")
    return value


_losses: dict[str, str] = {}  # by file


def note_loss(path: str, sentence: str) -> None:
    """Something came of `path`, but not all that was asked for: the command says so at its end and exits with code 3.
    """
    _losses[path] = sentence


def take_losses() -> list[str]:
    """What was noted since the last call."""
    sentences = list(_losses.values())
    _losses.clear()
    return sentences


class ExportError(RhotError):
    """A recording cannot be exported as asked: a format, an option, a missing package or the disk stands against it."""


class OutputError(RhotError):
    """A live stream to another program cannot be what was asked, opened, or written to."""


class CertificateError(RhotError):
    """A certificate cannot be made or read: a recording, a statement about it, or the disk is in the way."""
