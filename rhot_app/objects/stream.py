"""Poses of an object that another tracker measured, from a CSV file, as a track.

The file begins with the header ``t,x,y,z,qw,qx,qy,qz``: seconds, metres, and a unit quaternion, one sample a line in
the order of time.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import ObjectError
from rhot_app.estimation.se3 import rotation_from_quaternion, rotation_vector
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.motion import START_SPEED, TWIST, PoseResidual, state_of
from rhot_app.objects.pose import Mode
from rhot_app.objects.state import ObjectState
from rhot_app.objects.track import GATE_6, Gated, ObjectTrack
from rhot_node.errors import printable
from rhot_node.files import read_table, why

Array = NDArray[np.float64]

HEADER = "t", "x", "y", "z", "qw", "qx", "qy", "qz"

FARTHEST_M = 1000.0
"""m: a position farther from the origin is a mistake (as in a rig file)."""

SAMPLES = 8
"""Samples that an estimate of the noise needs: four third differences or more."""

_TO_SD = 1.0 / (0.6744897501960817 * math.sqrt(20.0))
"""Standard deviation of white noise over the median absolute third difference (1, -3, 3, -1) of Gaussian samples."""


@dataclass(frozen=True, slots=True)
class PoseStream:
    """N samples: times `t_ns` (N,), ascending, and `poses` (N, 4, 4) world_from_object, m, in the file's own frame."""

    t_ns: NDArray[np.int64]
    poses: Array


class PoseMeasurement:
    """One sample with its `covariance` (6, 6) m^2 and rad^2; implements `track.Measurement`."""

    def __init__(self, t_ns: int, world_from_object: Array, covariance: Array) -> None:
        self.t_ns, self._pose, self._covariance = t_ns, world_from_object, covariance

    def modes(self) -> list[Mode]:
        """The pose itself, with an unknown velocity."""
        covariance = np.diag(np.repeat([0.0, 0.0, *np.square(START_SPEED)], 3))
        covariance[:TWIST, :TWIST] = self._covariance
        return [Mode(state_of(self._pose), covariance, 0.0, 1, 0.0)]

    def gate(self, state: Array, covariance: Array) -> Gated:
        """The sample, if its innovation is within GATE_6."""
        residual = PoseResidual(self._pose, self._covariance)
        error = residual.linearise(state).error
        total = covariance[:TWIST, :TWIST] + self._covariance
        squared = float(error @ np.linalg.solve(total, error))
        return Gated(residual if squared <= GATE_6 else None, squared + float(np.linalg.slogdet(total)[1]))

    def pair(self, state: Array, prediction: tuple[Array, Array]) -> None:
        """A measured pose has no second one."""
        return


def read_pose_stream(path: Path) -> PoseStream:
    """Read and check a file. Raises ObjectError that names the file, the line, what is wrong and what to do."""
    try:
        data = read_table(path)
    except FileNotFoundError as exc:
        raise ObjectError(f"{path}: no such file.") from exc
    except (OSError, ValueError) as exc:
        raise ObjectError(f"{path}: cannot be read ({why(exc)}).") from exc
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as exc:
        raise ObjectError(f"{path}: this is no text. Give a CSV file with the header {','.join(HEADER)}.") from exc
    samples = list(_samples(path, text))
    if not samples:
        raise ObjectError(f"{path}: there is no sample behind the header. Is the file complete?")
    return PoseStream(np.array([t_ns for t_ns, _ in samples]), np.array([pose for _, pose in samples]))


def noise_of(stream: PoseStream) -> Array:
    """(6, 6) covariance of a sample's white noise, m^2 and rad^2, one variance for the three axes of each.

    From the median absolute third difference, which a motion of slowly varying acceleration leaves alone and jumps do
    not move. At least the resolution of the file. Raises ObjectError for fewer than SAMPLES samples.
    """
    if len(stream.t_ns) < SAMPLES:
        raise ObjectError(f"the pose stream has {len(stream.t_ns)} samples; its noise needs {SAMPLES} or "
                          "more. Give a longer recording.")
    turns = np.array([rotation_vector(b, a) for a, b in zip(stream.poses, stream.poses[1:], strict=False)])
    variances = []
    for differences in (np.diff(stream.poses[:, :3, 3], n=3, axis=0), np.diff(turns, n=2, axis=0)):
        sd = _TO_SD * float(np.median(np.abs(differences)))
        steps = np.abs(differences)[np.abs(differences) > 1e-12]
        resolution = float(steps.min()) if len(steps) else 1e-6
        variances.append(sd**2 + resolution**2 / 12.0)  # rounding is uniform
    return np.diag(np.repeat(variances, 3))


def track_stream(name: str, stream: PoseStream, covariance: Array | None = None) -> list[tuple[ObjectState, bool]]:
    """The state after every sample, and if it was accepted. `covariance`: of a sample; None: `noise_of`."""
    covariance = noise_of(stream) if covariance is None else covariance
    track, found = ObjectTrack(name), []
    for t_ns, pose in zip(stream.t_ns.tolist(), stream.poses, strict=True):
        accepted = track.take(PoseMeasurement(t_ns, pose, covariance))
        found.append((track.state(t_ns), accepted))
    return found


def _samples(path: Path, text: str) -> Iterator[tuple[int, Array]]:
    """(time, ns; pose) of every line behind the header; blank lines are passed over."""
    before_ns: int | None = None
    lines = enumerate(csv.reader(text.splitlines()), 1)
    _, header = next(lines, (1, []))
    if tuple(cell.strip() for cell in header) != HEADER:
        raise ObjectError(f"{path}, line 1: the header is {printable(','.join(header), 80)!r}. Let the first line be "
                          f"{','.join(HEADER)}.")
    for number, cells in lines:
        if not any(cell.strip() for cell in cells):
            continue
        t_ns, pose = _sample(f"{path}, line {number}", cells)
        if before_ns is not None and t_ns <= before_ns:
            raise ObjectError(f"{path}, line {number}: the time {cells[0].strip()} s is not after that of the line "
                              "before. Sort the lines by time and remove doubled ones.")
        before_ns = t_ns
        yield t_ns, pose


def _sample(where: str, cells: list[str]) -> tuple[int, Array]:
    if len(cells) != len(HEADER):
        raise ObjectError(f"{where}: {len(cells)} values where {len(HEADER)} belong. Remove or complete the line.")
    numbers = []
    for column, cell in zip(HEADER, cells, strict=True):
        try:
            number = float(cell)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise ObjectError(f"{where}: {column} is {printable(cell, 40)!r}, which is no number. Remove or correct "
                              "the line.")
        numbers.append(number)
    t_s, x, y, z, *quaternion = numbers
    if abs(t_s) > 1e9 or max(abs(x), abs(y), abs(z)) > FARTHEST_M:
        raise ObjectError(f"{where}: a time or place beyond all bounds ({t_s:g} s; {x:g}, {y:g}, {z:g} m). Give "
                          "seconds and metres.")
    if not 0.9 < math.hypot(*quaternion) < 1.1:
        raise ObjectError(f"{where}: the quaternion has the length {math.hypot(*quaternion):.3g}, not 1. Give qw, qx, "
                          "qy, qz of a rotation.")
    return round(1e9 * t_s), rigid(rotation_from_quaternion(quaternion), (x, y, z))
