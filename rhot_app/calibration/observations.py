"""What the cameras saw over some seconds, as plain arrays: the input of every calibration from a moving hand.

Fed frame by frame (`ObservationCollector`), by a live source or from a log (`recorded_observations`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

# -- rolling-shutter time ----------------------------------------------------------------------------------------------

def row_times_ns(t_row0_ns: int, row_time_ns: int, rows: NDArray[np.float64]) -> NDArray[np.int64]:
    """Mid-exposure times of image rows (...,) px, ns on the clock of `t_row0_ns`: t_row0 + y * row_time.

    Raw (distorted) rows: the sensor knows no lens. NaN rows (lost markers) get the time of row 0.
    """
    offsets = np.where(np.isfinite(rows), rows, 0.0) * row_time_ns
    return np.asarray(t_row0_ns + np.rint(offsets).astype(np.int64), dtype=np.int64)


# -- observations as arrays --------------------------------------------------------------------------------------------

Array = NDArray[np.float64]
Times = NDArray[np.int64]
Mask = NDArray[np.bool_]


class FrameOfMarkers(Protocol):
    """What a collector needs of one frame; `rhot_app.tracking.tracker.CameraObservations` is one."""

    @property
    def camera(self) -> int:
        """Index into the rig's nodes."""
        ...

    @property
    def t_row0_master_ns(self) -> int:
        """Mid-exposure of row 0, the node's `time_offset_s` added."""
        ...

    @property
    def row_time_ns(self) -> int:
        """From row to row, as the node says."""
        ...

    @property
    def clock_bound_s(self) -> float:
        """Half-width of the clock offset's error."""
        ...

    @property
    def pixels(self) -> Array:
        """(M, 2) raw px, NaN when lost."""
        ...

    @property
    def covariances(self) -> Array:
        """(M, 2, 2) px^2."""
        ...

    @property
    def diameters(self) -> Array:
        """(M,) px."""
        ...

    @property
    def qualities(self) -> Array:
        """(M,) 0..1."""
        ...

    @property
    def flags(self) -> NDArray[np.uint16]:
        """(M,) MarkerFlag."""
        ...


@dataclass(frozen=True, slots=True)
class CameraTable:
    """F frames of one camera in the order of their times, M markers in the rig's order.

    `t_row0_ns` (F,) master time of row 0's mid-exposure, the rig's `time_offset_s` added; `row_time_ns` (F,) as the
    node says; `clock_bound_s` (F,). `pixels` (F, M, 2) raw px, NaN when lost; `covariances` (F, M, 2, 2) px^2;
    `diameters` (F, M) px; `qualities` (F, M); `flags` (F, M) MarkerFlag.
    """

    name: str
    t_row0_ns: Times
    row_time_ns: Times
    clock_bound_s: Array
    pixels: Array
    covariances: Array
    diameters: Array
    qualities: Array
    flags: NDArray[np.uint16]

    @property
    def times_ns(self) -> Times:
        """(F, M) master time at which each marker's own row was exposed; row 0's where it is lost."""
        return np.array([row_times_ns(int(t), int(row), pixels[:, 1])
                         for t, row, pixels in zip(self.t_row0_ns, self.row_time_ns, self.pixels, strict=True)],
                        dtype=np.int64).reshape(self.flags.shape)

    @property
    def rate_hz(self) -> float:
        """Frames per second, by the median interval; 0 with less than two frames."""
        return 1e9 / float(np.median(np.diff(self.t_row0_ns))) if len(self.t_row0_ns) > 1 else 0.0


@dataclass(frozen=True, slots=True)
class ObservationTable:
    """All frames of all cameras; `cameras` in the order of the rig's nodes."""

    marker_ids: tuple[str, ...]
    cameras: tuple[CameraTable, ...]

    @property
    def duration_s(self) -> float:
        """From the first frame of any camera to the last, s; 0 without frames."""
        times = np.concatenate([camera.t_row0_ns for camera in self.cameras])
        return 1e-9 * float(times.max() - times.min()) if len(times) else 0.0


class ObservationCollector:
    """Gathers frames in any order; `table` sorts them. Frames of another number of markers are not taken."""

    def __init__(self, camera_names: tuple[str, ...], marker_ids: tuple[str, ...]) -> None:
        self._names = camera_names
        self._marker_ids = marker_ids
        self._frames: tuple[list[FrameOfMarkers], ...] = tuple([] for _ in camera_names)

    def add(self, frame: FrameOfMarkers) -> None:
        """Take one frame in."""
        if len(frame.pixels) == len(self._marker_ids):
            self._frames[frame.camera].append(frame)

    @property
    def counts(self) -> tuple[int, ...]:
        """Frames so far, per camera."""
        return tuple(len(frames) for frames in self._frames)

    def table(self) -> ObservationTable:
        """Everything so far."""
        return ObservationTable(self._marker_ids, tuple(self._camera(name, frames) for name, frames
                                                        in zip(self._names, self._frames, strict=True)))

    def _camera(self, name: str, frames: list[FrameOfMarkers]) -> CameraTable:
        ordered = sorted(frames, key=lambda frame: frame.t_row0_master_ns)
        shape = len(ordered), len(self._marker_ids)
        return CameraTable(
            name=name,
            t_row0_ns=np.array([frame.t_row0_master_ns for frame in ordered], dtype=np.int64),
            row_time_ns=np.array([frame.row_time_ns for frame in ordered], dtype=np.int64),
            clock_bound_s=np.array([frame.clock_bound_s for frame in ordered], dtype=np.float64),
            pixels=np.array([frame.pixels for frame in ordered], dtype=np.float64).reshape(*shape, 2),
            covariances=np.array([frame.covariances for frame in ordered], dtype=np.float64).reshape(*shape, 2, 2),
            diameters=np.array([frame.diameters for frame in ordered], dtype=np.float64).reshape(shape),
            qualities=np.array([frame.qualities for frame in ordered], dtype=np.float64).reshape(shape),
            flags=np.array([frame.flags for frame in ordered], dtype=np.uint16).reshape(shape))


@dataclass(frozen=True, slots=True)
class InstantTable:
    """All cameras brought to common instants, and the markers located there, as the tracker does it.

    T instants, C cameras, M markers. `t_ns` (T,) master time. `pixels` (T, C, M, 2) raw px interpolated to the
    instant, NaN where a camera does not tell; `pixel_covariances` (T, C, M, 2, 2) px^2. `positions` (T, M, 3) m, rig
    frame, triangulated and not filtered, NaN where not located; `position_covariances` (T, M, 3, 3) m^2; `measured`
    (T, M): seen beyond doubt by two cameras; `errors_px` (T, M) rms reprojection error.
    """

    marker_ids: tuple[str, ...]
    camera_names: tuple[str, ...]
    t_ns: Times
    pixels: Array
    pixel_covariances: Array
    positions: Array
    position_covariances: Array
    measured: Mask
    errors_px: Array

    @property
    def times_s(self) -> Array:
        """(T,) s since the first instant."""
        return np.asarray(1e-9 * (self.t_ns - self.t_ns[:1]), dtype=np.float64)
