"""An alignment as a file (``rhot-alignment``): where another tracker's world is in the rig, with its covariance.

docs/alignment.md describes the format.
"""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from rhot_app.errors import CalibrationError
from rhot_app.estimation.se3 import quaternion_from_rotation, rotation_from_quaternion
from rhot_app.geometry.transforms import rigid
from rhot_app.project import Metres
from rhot_node.files import read_document, write_document

if TYPE_CHECKING:
    from rhot_app.objects.alignment.report import AlignmentSolution

Array = NDArray[np.float64]

FORMAT: Final = "rhot-alignment"
VERSION: Final = 1

Positive = Annotated[float, Meta(gt=0)]
NotNegative = Annotated[float, Meta(ge=0)]
Share = Annotated[float, Meta(ge=0, le=1)]
Numbers = Annotated[tuple[float, ...], Meta(min_length=10, max_length=13)]


class RigidTransform(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Unit quaternion wxyz and translation in metres."""

    rotation_wxyz: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    translation_m: tuple[Metres, Metres, Metres] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        norm = sum(q * q for q in self.rotation_wxyz)
        if not 0.998 < norm < 1.002:
            raise ValueError(f"rotation_wxyz is not a unit quaternion (its squared norm is {norm:.4f})")

    @property
    def matrix(self) -> Array:
        """(4, 4)."""
        return rigid(rotation_from_quaternion(self.rotation_wxyz), self.translation_m)


class Alignment(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where another tracker's world is in the rig.

    `time_offset_s` is added to the other tracker's times. `covariance`: 10 rows in the order of
    `rhot_app.objects.alignment.fit.TRANSLATION`, or 13, of which the last three are not used. `noise_m`: standard
    deviation of an axis' residual.
    """

    rig_from_foreign: RigidTransform
    tracker_from_body: RigidTransform
    time_offset_s: Annotated[float, Meta(ge=-1e6, le=1e6)]
    covariance: Annotated[tuple[Numbers, ...], Meta(min_length=10, max_length=13)]
    noise_m: Positive
    rms_m: NotNegative | None = None
    inlier_ratio: Share | None = None
    calibrated: str = ""
    format: Literal["rhot-alignment"] = FORMAT
    version: Literal[1] = VERSION

    def __post_init__(self) -> None:
        size = len(self.covariance)
        if size not in (10, 13) or any(len(row) != size for row in self.covariance):
            raise ValueError("covariance is not of 10 or 13 rows of as many numbers")
        matrix = np.array(self.covariance)
        if not np.allclose(matrix, matrix.T, rtol=1e-6, atol=1e-15) or (np.diag(matrix) < 0.0).any():
            raise ValueError("covariance is not symmetric, or a variance is negative")


def to_alignment(solution: AlignmentSolution, created: str | None = None) -> Alignment:
    """What is kept of a calibration that was solved at `created`, ISO 8601; None: now."""
    fit = solution.fit
    covariance = 0.5 * (solution.covariance + solution.covariance.T)
    return Alignment(_transform(fit.rig_from_foreign), _transform(fit.tracker_from_body), fit.offset_s,
                     tuple(tuple(map(float, row)) for row in covariance), fit.noise_m, fit.rms_m, fit.inlier_ratio,
                     created or datetime.now(UTC).isoformat(timespec="seconds"))


def alignment_path(rig_path: Path) -> Path:
    """Where the alignment of a rig lies: ``desk.alignment.json`` beside ``desk.json`` or ``desk.rig.json``."""
    return rig_path.with_name(f"{rig_path.name.removesuffix('.json').removesuffix('.rig')}.alignment.json")


def load_alignment(path: Path) -> Alignment:
    """Read and validate a file; raises CalibrationError naming file and field."""
    return read_document(path, Alignment, format_name=FORMAT, version=VERSION, error=CalibrationError)


def save_alignment(path: Path, alignment: Alignment) -> None:
    """Write it atomically. Raises CalibrationError when the folder cannot be written."""
    try:
        write_document(path, alignment)
    except OSError as exc:
        raise CalibrationError(f"{path}: cannot be written ({exc.strerror}); nothing was changed.") from exc


def _transform(matrix: Array) -> RigidTransform:
    w, x, y, z = map(float, quaternion_from_rotation(matrix[:3, :3]))
    a, b, c = map(float, matrix[:3, 3])
    return RigidTransform((w, x, y, z), (a, b, c))
