"""What the arguments of ``rhot calibrate stereo`` mean; every mistake is a sentence."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.errors import CalibrationError

if TYPE_CHECKING:
    from rhot_app.calibration.stereo.calibrate import KnownLengths


def files_of(args: argparse.Namespace) -> dict[str, list[Path]]:
    """The pictures of each camera, left and right first."""
    patterns = {name: pattern for name, pattern in (("left", args.left), ("right", args.right)) if pattern}
    for text in args.camera:
        name, pattern = _split(text, "--camera", "NAME=PATTERN")
        if name in patterns:
            raise CalibrationError(f"--camera {text}: the pictures of {name} are given twice.")
        patterns[name] = pattern
    if len(patterns) < 2:
        raise CalibrationError("Pictures of at least two cameras are needed: --left PATTERN --right PATTERN, or "
                               "--camera NAME=PATTERN for each.")
    from rhot_app.calibration.lens.views import matching_files

    found = {name: matching_files(pattern) for name, pattern in patterns.items()}
    for name, paths in found.items():
        if not paths:
            raise CalibrationError(f"{name}: no file matches {patterns[name]!r}. Put the pattern in quotes and see "
                                   "that the folder is right.")
    return found


def named_paths(texts: list[str], option: str, names: list[str]) -> dict[str, Path]:
    """NAME=FILE arguments as a table; raises CalibrationError for a name that is no camera."""
    table = {}
    for text in texts:
        name, path = _split(text, option, "NAME=FILE")
        if name not in names:
            raise CalibrationError(f"{option} {text}: there are no pictures of {name!r}; the cameras are "
                                   f"{', '.join(names)}.")
        table[name] = Path(path)
    return table


def known_lengths(args: argparse.Namespace, names: list[str]) -> KnownLengths:
    """The baseline by hand and the ruler."""
    import numpy as np

    from rhot_app.calibration.depth.ruler import RulerReading
    from rhot_app.calibration.stereo.calibrate import KnownLengths

    for option, value in (("--baseline-mm", args.baseline_mm), ("--ruler-mm", args.ruler_mm)):
        if value is not None and not 0.0 < value < 1e5:
            raise CalibrationError(f"{option} {value:g}: a length in millimetres is needed.")
    baseline = None if args.baseline_mm is None else args.baseline_mm * 1e-3
    if args.ruler_mm is None and not args.ruler:
        return KnownLengths(baseline)
    if args.ruler_mm is None or len(args.ruler) < 2:
        raise CalibrationError("A ruler needs its length, --ruler-mm, and its ends in the pictures of two cameras: "
                               "--ruler left=x,y,x,y --ruler right=x,y,x,y.")
    ends = np.full((len(names), 2, 2), np.nan)
    for text in args.ruler:
        name, numbers = _split(text, "--ruler", "NAME=x,y,x,y")
        try:
            values = [float(number) for number in numbers.split(",")]
        except ValueError:
            values = []
        if name not in names or len(values) != 4 or not np.all(np.isfinite(values)):
            raise CalibrationError(f"--ruler {text}: a camera and the ends' positions in its picture are needed, such "
                                   f"as {names[0]}=120.5,80,410,95.")
        ends[names.index(name)] = np.reshape(values, (2, 2))
    return KnownLengths(baseline, RulerReading(args.ruler_mm * 1e-3, ends))


def _split(text: str, option: str, form: str) -> tuple[str, str]:
    name, _, rest = text.partition("=")
    if not name or not rest:
        raise CalibrationError(f"{option} {text}: write it as {form}.")
    return name, rest
