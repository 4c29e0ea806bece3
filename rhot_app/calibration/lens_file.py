"""Reading a lens that another calibration has written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from rhot_app.calibration.lens_start import LensStart
from rhot_app.errors import CalibrationError


def read_lens(path: Path) -> LensStart:
    """The lens in a file of ``rhot calibrate intrinsics``; raises CalibrationError naming file and field."""
    try:
        raw: Any = json.loads(path.read_text())
        lens = np.array([raw["fx"], raw["fy"], raw["cx"], raw["cy"], *raw["distortion"]], float)
        width, height = raw["size"]
    except OSError as exc:
        raise CalibrationError(f"{path}: cannot be read ({exc.strerror}).") from exc
    except (ValueError, KeyError, TypeError) as exc:
        raise CalibrationError(f"{path}: this is no intrinsics file ({exc!r}).") from exc
    return LensStart(lens, (int(width), int(height)))
