"""A camera as other programs state it: the one record that all formats are read into and written from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.exchange.documents import Entry
from rhot_app.errors import CalibrationError
from rhot_app.geometry.camera import full_lens, lens_parameters, rig_intrinsics
from rhot_app.project import Intrinsics
from rhot_node.errors import printable

Array = NDArray[np.float64]

_COEFFICIENTS = (0, 4, 5, 8, 12, 14)
"""How many OpenCV's models have: without distortion, k1 k2 p1 p2, then k3, k4 to k6, s1 to s4, and two tilts."""


@dataclass(frozen=True, slots=True, eq=False)
class ForeignCamera:
    """A camera of another program's file. `camera_from_world` (4, 4) m, in the world that all poses of the file have;
    None where it has no pose."""

    name: str
    lens: Intrinsics
    camera_from_world: Array | None = None

    @property
    def matrix(self) -> Array:
        """(3, 3) px, OpenCV's camera matrix."""
        lens = self.lens
        return np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])

    @property
    def distortion(self) -> Array:
        """(5,) or (8,) OpenCV's coefficients."""
        return np.array(self.lens.distortion)


@dataclass(frozen=True, slots=True)
class Stated:
    """What the user states because some formats do not: the pictures' `size` px, and a unit of length in metres."""

    size: tuple[int, int] | None = None
    unit_m: float | None = None

    def size_of(self, camera: Entry, width: str = "image_width", height: str = "image_height") -> tuple[int, int]:
        """The size that a file has under these keys, or the stated one. Raises CalibrationError."""
        if not camera.has(width) and not camera.has(height):
            if self.size is None:
                raise CalibrationError(f"{camera.file}: the file does not say for which pictures the lens is; give "
                                       "their size with --size, as in --size 640x480.")
            return self.size
        said = camera[width].whole, camera[height].whole
        if self.size not in (None, said):
            raise CalibrationError(f"{camera.file}: the lens is for pictures of {said[0]}x{said[1]} px, not of "
                                   f"{self.size[0]}x{self.size[1]}; leave --size out.")
        return said

    def unit_of(self, length: Entry) -> float:
        """Metres per unit of a length whose file does not say it. Raises CalibrationError."""
        if self.unit_m is None:
            raise CalibrationError(f"{length.file}: the file does not say the unit of {printable(length.place)}; give "
                                   "it with --unit, or with --square-mm where it is the side of the board's square.")
        return self.unit_m

    def refuse_unit(self, document: Entry, program: str) -> None:
        """Raise CalibrationError where a unit is stated for a format that has one."""
        if self.unit_m not in (None, 1.0):
            raise CalibrationError(f"{document.file}: {program} writes metres; leave --unit and --square-mm out.")


def refuse_model(camera: Entry, model: str) -> CalibrationError:
    """The error for a lens model that RHOT does not have."""
    return CalibrationError(
        f"{camera.file}: {printable(camera.place) or 'the lens'} has the model {printable(model)!r}, which RHOT does "
        "not have, and which no other one replaces. RHOT reads a pinhole with OpenCV's radial and tangential "
        "distortion. Calibrate that camera with `rhot calibrate intrinsics`.")


def lens_of(camera: Entry, size: tuple[int, int], focal: Sequence[float] | Array, distortion: Array) -> Intrinsics:
    """A lens of `focal` (fx, fy, cx, cy) px and OpenCV's `distortion` (N,).

    Raises CalibrationError: a model with more coefficients, or a figure that cannot be.
    """
    if len(distortion) not in _COEFFICIENTS:
        raise camera.wrong(f"has {len(distortion)} distortion coefficients; OpenCV's models have 4, 5 or 8.")
    if np.any(distortion[8:]):
        raise refuse_model(camera, "thin prism" if not np.any(distortion[12:]) else "tilted sensor")
    lens = rig_intrinsics(size, full_lens([*focal, *distortion[:8]]))
    try:
        return msgspec.convert(msgspec.to_builtins(lens), Intrinsics)
    except msgspec.ValidationError as exc:
        raise camera.wrong(f"cannot be a lens ({str(exc).replace('`', '')}).") from exc


def focal_of(matrix: Entry) -> tuple[float, float, float, float]:
    """(fx, fy, cx, cy) px of a camera matrix. Raises CalibrationError: it is none, or has a skew."""
    m = matrix.matrix(3, 3)
    if m[0, 1] != 0.0:
        raise matrix.wrong(f"has a skew of {m[0, 1]:g} px, which RHOT's lenses do not have.")
    if not np.array_equal(m[[1, 2, 2, 2], [0, 0, 1, 2]], (0.0, 0.0, 0.0, 1.0)):
        raise matrix.wrong("is no camera matrix: fx, 0, cx; 0, fy, cy; 0, 0, 1 is one.")
    return float(m[0, 0]), float(m[1, 1]), float(m[0, 2]), float(m[1, 2])


def radial_tangential(camera: ForeignCamera, program: str) -> Array:
    """(4,) k1, k2, p1, p2, for programs that have no more. Raises CalibrationError where the lens has others."""
    lens = lens_parameters(camera.lens)
    if np.any(lens[8:]):
        raise CalibrationError(f"{camera.name}: its lens has k3 or a wide lens's k4 to k6, and {program} has k1, k2, "
                               "p1 and p2 alone. Choose another format.")
    return lens[4:8]
