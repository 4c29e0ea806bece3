"""What a source of another tracker's poses offers, its noise and its gate, and a file as such a source."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rhot_app.objects.pose import Validity
from rhot_app.objects.stream import PoseMeasurement, PoseStream, noise_of, read_pose_stream
from rhot_app.objects.track import ObjectState, ObjectTrack

Array = NDArray[np.float64]

START_SD_M, START_SD_RAD = 0.2e-3, 3.5e-4
"""m and rad: noise of a stream before its own can be estimated, a Vive's (Niehorster, Li and Lappe 2017: below 0.2 mm
and 0.02 degrees)."""

NOISE_SAMPLES = 128
"""Samples of an estimate of the noise: a median of so many has a relative standard deviation of a tenth."""

UNKNOWN_POSE, UNKNOWN_COVARIANCE = np.full((4, 4), np.nan), np.full((6, 6), np.nan)


@dataclass(frozen=True, slots=True)
class ForeignPose:
    """One pose, in the other tracker's own world.

    `t_master_ns`: by the master's monotonic clock, but for a constant delay that an alignment finds; of a file: its own
    times. `world_from_body` (4, 4) m and `covariance` (6, 6) m^2 and rad^2: translation, then rotation about the body's
    origin, world axes; white noise only. Both are NaN unless `validity` is TRACKED or PREDICTED.
    """

    t_master_ns: int
    world_from_body: Array
    covariance: Array
    validity: Validity


class PoseSource(Protocol):
    """One tracked body of another tracker. Errors at the start are raised by the constructor; later ones are reported
    by `notice`, and nothing is raised."""

    @property
    def name(self) -> str:
        """What it is, for people: "SteamVR LHR-1A2B3C4D"."""
        ...

    @property
    def notice(self) -> str:
        """A sentence about what is wrong now; "" while all is well."""
        ...

    @property
    def ended(self) -> bool:
        """Whether no pose will come any more."""
        ...

    def poll(self) -> list[ForeignPose]:
        """The poses since the last call, in ascending time. Returns at once. All calls in one thread."""
        ...

    def close(self) -> None:
        """End it. May be called twice."""
        ...


class StreamNoise:
    """The covariance (6, 6) of a live stream's samples, from its last NOISE_SAMPLES."""

    def __init__(self) -> None:
        self._samples: deque[tuple[int, Array]] = deque(maxlen=NOISE_SAMPLES)
        self._fresh = 0
        self.covariance: Array = np.diag(np.repeat([START_SD_M**2, START_SD_RAD**2], 3))

    def add(self, t_ns: int, world_from_body: Array) -> Array:
        """Take a sample; the covariance with it."""
        self._samples.append((t_ns, world_from_body))
        self._fresh += 1
        if self._fresh >= NOISE_SAMPLES // 2 and len(self._samples) == NOISE_SAMPLES:
            self._fresh = 0
            self.covariance = noise_of(np.array([pose for _, pose in self._samples]))
        return self.covariance


class PoseGate:
    """Rejects outliers by the innovation gate of tracked objects (`objects.track`), and filters the others."""

    def __init__(self, name: str) -> None:
        self._track = ObjectTrack(name)
        self.offered = self.rejected = 0

    def take(self, pose: ForeignPose) -> bool:
        """Weigh a pose; whether it was accepted. One that is not TRACKED never is, and does not count."""
        if pose.validity is not Validity.TRACKED:
            return False
        accepted = self._track.take(PoseMeasurement(pose.t_master_ns, pose.world_from_body, pose.covariance))
        self.offered += 1
        self.rejected += not accepted
        return accepted

    @property
    def rejected_ratio(self) -> float:
        """Share of the tracked poses that were rejected; 0 of none."""
        return self.rejected / self.offered if self.offered else 0.0

    def state(self, t_master_ns: int) -> ObjectState:
        """The filtered state, in the other tracker's world."""
        return self._track.state(t_master_ns)


class FilePoses:
    """A CSV file (`objects.stream`) as a source: all its poses at the first call."""

    def __init__(self, path: Path) -> None:
        """Raises ObjectError as `read_pose_stream` and `noise_of` do."""
        self.name, self.notice = path.name, ""
        self._stream: PoseStream | None = read_pose_stream(path)
        self._covariance = noise_of(self._stream.poses)

    @property
    def ended(self) -> bool:
        """After the first call."""
        return self._stream is None

    def poll(self) -> list[ForeignPose]:
        """Every sample, at the file's own times."""
        stream, self._stream = self._stream, None
        if stream is None:
            return []
        return [ForeignPose(int(t_ns), pose, self._covariance, Validity.TRACKED)
                for t_ns, pose in zip(stream.t_ns, stream.poses, strict=True)]

    def close(self) -> None:
        """Nothing is open."""
        self._stream = None
