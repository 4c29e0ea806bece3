"""Poses of an object that another tracker measured, from a CSV file, as a track.

The file begins with the header ``t,x,y,z,qw,qx,qy,qz``: seconds, metres, and a unit quaternion, one sample a line in
the order of time.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import ObjectError
from rhot_app.estimation.quantiles import normal_isf
from rhot_app.estimation.se3 import rotation_from_quaternion, rotation_vector
from rhot_app.objects.motion import START_SPEED, TWIST, PoseResidual, state_of
from rhot_app.objects.pose import Mode
from rhot_app.objects.state import ObjectState
from rhot_app.objects.track import GATE_6, Gated, ObjectTrack
from rhot_node.errors import printable
from rhot_node.files import read_table, why

Array = NDArray[np.float64]

HEADER = "t", "x", "y", "z", "qw", "qx", "qy", "qz"

FARTHEST_M, LATEST_S, UNIT_ERROR = 1e3, 1e9, 0.1
"""m from the origin (as in a rig file), s, and how far a unit quaternion's length is from 1: beyond, a line is a
mistake."""

SAMPLES = 8
"""Samples that an estimate of the noise needs: four third differences or more."""

_TO_SD = 1.0 / (normal_isf(0.25) * math.sqrt(1.0 + 9.0 + 9.0 + 1.0))
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
    """Read and check a file of poses; raises ObjectError as `read_samples`, and when there is no sample."""
    rows = read_samples(path, HEADER, ObjectError)
    if not len(rows):
        raise ObjectError(f"{path}: there is no sample behind the header. Is the file complete?")
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3, 3], poses[:, :3, :3] = rows[:, 1:4], rotation_from_quaternion(rows[:, 4:])
    return PoseStream(np.rint(1e9 * rows[:, 0]).astype(np.int64), poses)


def noise_of(poses: Array) -> Array:
    """(6, 6) covariance of the white noise of `poses` (N, 4, 4), m^2 and rad^2, with one variance for three axes.

    From the median absolute third difference, which a motion of slowly varying acceleration leaves alone and jumps do
    not move. At least the resolution of the file. Raises ObjectError for fewer than SAMPLES samples.
    """
    if len(poses) < SAMPLES:
        raise ObjectError(f"the pose stream has {len(poses)} samples; its noise needs {SAMPLES} or "
                          "more. Give a longer recording.")
    turns = np.array([rotation_vector(b, a) for a, b in pairwise(poses)])
    variances = []
    for differences in (np.diff(poses[:, :3, 3], n=3, axis=0), np.diff(turns, n=2, axis=0)):
        sd = _TO_SD * float(np.median(np.abs(differences)))
        steps = np.abs(differences)[np.abs(differences) > 1e-12]
        resolution = float(steps.min()) if len(steps) else 1e-6
        variances.append(sd**2 + resolution**2 / 12.0)  # rounding is uniform
    return np.diag(np.repeat(variances, 3))


def track_stream(name: str, stream: PoseStream, covariance: Array | None = None) -> list[tuple[ObjectState, bool]]:
    """The state after every sample, and if it was accepted. `covariance`: of a sample; None: `noise_of`."""
    covariance = noise_of(stream.poses) if covariance is None else covariance
    track, found = ObjectTrack(name), []
    for t_ns, pose in zip(stream.t_ns.tolist(), stream.poses, strict=True):
        accepted = track.take(PoseMeasurement(t_ns, pose, covariance))
        found.append((track.state(t_ns), accepted))
    return found


def read_samples(path: Path, columns: Sequence[str], error: type[Exception]) -> Array:
    """(N, len(columns)) numbers of a CSV file whose first line names `columns`, in any order: t, s, x, y, z, m, and
    qw, qx, qy, qz of poses.

    Lines that repeat the time before are left out. Raises `error` that names the file, the line, what is wrong and what
    to do.
    """
    try:
        text = read_table(path).decode("utf-8-sig")
    except FileNotFoundError as exc:
        raise error(f"{path}: no such file.") from exc
    except UnicodeDecodeError as exc:
        raise error(f"{path}: this is no text. Give a CSV file with the header {','.join(columns)}.") from exc
    except (OSError, ValueError) as exc:
        raise error(f"{path}: cannot be read ({why(exc)}).") from exc
    try:
        lines = iter(list(csv.reader(text.splitlines())))
    except csv.Error as exc:
        raise error(f"{path}: this is no table ({exc}). Give a CSV file with the header {','.join(columns)}.") from exc
    header = [cell.strip() for cell in next(lines, [])]
    if any(header.count(name) != 1 for name in columns):
        raise error(f"{path}, line 1: the header is {printable(','.join(header), 80)!r}. Let the first line be "
                    f"{','.join(columns)}.")
    rows: list[list[float]] = []
    for number, cells in enumerate(lines, 2):
        if any(cell.strip() for cell in cells):
            where = f"{path}, line {number}"
            row = _numbers(where, cells, header, columns, error)
            if rows and row[0] < rows[-1][0]:
                raise error(f"{where}: the time {row[0]:g} s is before that of the line above. Sort the lines by time.")
            if not rows or row[0] > rows[-1][0]:
                rows.append(row)
    return np.array(rows).reshape(-1, len(columns))


def _numbers(where: str, cells: list[str], header: list[str], columns: Sequence[str], error: type[Exception]
             ) -> list[float]:
    if len(cells) != len(header):
        raise error(f"{where}: {len(cells)} values where {len(header)} belong. Remove or complete the line.")
    numbers = []
    for column in columns:
        cell = cells[header.index(column)]
        try:
            numbers.append(float(cell))
        except ValueError:
            numbers.append(math.nan)
        if not math.isfinite(numbers[-1]):
            raise error(f"{where}: {column} is {printable(cell, 40)!r}, which is no number. Remove or correct the "
                        "line.")
    if abs(numbers[0]) > LATEST_S or max(map(abs, numbers[1:4])) > FARTHEST_M:
        raise error(f"{where}: a time or place beyond all bounds ({numbers[0]:g} s; {numbers[1]:g}, {numbers[2]:g}, "
                    f"{numbers[3]:g} m). Give seconds and metres.")
    if numbers[4:] and abs(math.hypot(*numbers[4:]) - 1.0) > UNIT_ERROR:
        raise error(f"{where}: the quaternion has the length {math.hypot(*numbers[4:]):.3g}, not 1. Give qw, qx, qy, "
                    "qz of a rotation.")
    return numbers
