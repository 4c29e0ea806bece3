"""One camera's frame as a residual block."""

from __future__ import annotations

import copy
import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.lean import lean
from rhot_app.tracking.kalman.apparent_size import weigh_sizes
from rhot_app.tracking.kalman.association import relabel
from rhot_app.tracking.kalman.covering import leave_out_covered
from rhot_app.tracking.kalman.estimate import Estimate
from rhot_app.tracking.kalman.hiding import judge_fingertips
from rhot_app.tracking.kalman.markers import Cameras, Frame, Outfit, append_markers, place_markers
from rhot_app.tracking.kalman.partial import doubt_partial
from rhot_app.tracking.kalman.rows import Page
from rhot_app.tracking.kalman.share import Share
from rhot_app.tracking.kalman.sizes import measure_sizes
from rhot_app.tracking.kalman.wearing import Wearing
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag

_LOST = int(MarkerFlag.LOST)


class Sighting(NamedTuple):
    """One frame; `flags` (M,) MarkerFlag of its sights."""

    frame: Frame
    flags: NDArray[np.uint16]


class MarkerBlock:
    """The markers that one camera saw in one frame. `t_ns`: the mean time of its sights, or of its middle row;
    `camera`: which; `sights`: how many markers it shows; `shared`: its `Sighting`, for compiled functions."""

    def __init__(self, wearing: Wearing, observations: CameraObservations) -> None:
        count = len(observations.pixels)
        self.observations, self.camera = observations, observations.camera
        sized = not math.isnan(observations.detect_s)  # text datagrams tell no sizes
        self.frame = Frame(np.array([observations.camera]), np.empty(count, np.bool_), observations.pixels,
                           observations.covariances, np.empty(count), np.empty(count, np.int64),
                           observations.diameters if sized else np.zeros(count), np.zeros(count),
                           np.array([1e-9 * observations.row_time_ns]), observations.flags == 0,
                           np.zeros(count, np.bool_), np.zeros(count), np.ones(count))
        self.shared, self._outfit = Share(Sighting(self.frame, observations.flags)), wearing.shared
        after_ns, self.sights = _read(self._outfit, self.shared)
        self.t_ns = observations.t_row0_master_ns + int(after_ns)

    def as_of(self, t_ns: int) -> MarkerBlock:
        """The same frame, told of as of another instant, master ns."""
        other = copy.copy(self)
        other.t_ns, other.frame = t_ns, self.frame._replace(late_s=self.frame.late_s - 1e-9 * (t_ns - self.t_ns))
        other.shared = Share(Sighting(other.frame, self.observations.flags))
        return other

    def associate(self, page: Share) -> int:
        """Ask the hand, carried to this frame's instant, which marker each sight is of, and how much of it it shows;
        returns how many changed. The hand learns how wide its markers are."""
        return int(_associate(self._outfit, self.shared, page))

    def linearise(self, page: Share) -> None:
        """Append the frame's observations; see `ResidualBlock`."""
        _linearise(self._outfit, self.shared, page)


@njit(cache=True)
def _associate(outfit: Share, shared: Share, page: Share) -> int:
    return look_at_frame(outfit.of, shared.of.frame, page.of.estimate)


@lean
def look_at_frame(outfit: Outfit, frame: Frame, estimate: Estimate) -> int:
    """All that `MarkerBlock.associate` does."""
    worn, cameras, places = outfit.worn, outfit.cameras, outfit.places
    place_markers(worn.dh, estimate, places)
    changed = relabel(worn, cameras, frame, estimate, places)
    if changed > 0:
        estimate.untroubled[0] = 0.0
    measure_sizes(worn, cameras, frame, estimate, places)
    doubt_partial(worn, cameras, frame, estimate, places)
    judge_fingertips(worn, cameras, frame, estimate, places, outfit.made)
    leave_out_covered(worn, cameras, frame, estimate, places.points, outfit.made)
    weigh_sizes(worn, cameras, frame, estimate, places)
    return changed


@njit(cache=True)
def _linearise(outfit: Share, shared: Share, page: Share) -> None:
    append_frame(outfit.of, shared.of.frame, page.of)


@lean
def append_frame(outfit: Outfit, frame: Frame, page: Page) -> None:
    """All that `MarkerBlock.linearise` does."""
    place_markers(outfit.worn.dh, page.estimate, outfit.places)
    append_markers(outfit.worn, outfit.cameras, frame, page.estimate, outfit.places, page.rows)


@njit(cache=True)
def _read(outfit: Share, shared: Share) -> tuple[float, int]:
    sighting: Sighting = shared.of
    return read_frame(outfit.of.cameras, sighting.frame, sighting.flags)


@lean
def read_frame(cameras: Cameras, frame: Frame, flags: NDArray[np.uint16]) -> tuple[float, int]:
    """Fill the frame's `seen`, `late_s` and, as the sights say themselves, `label`; returns the mean time of the sights
    after row 0, ns, and how many they are. The middle row is that of the optical axis."""
    total, count, row_time_s = 0.0, 0, frame.row_s[0]
    for m in range(frame.seen.shape[0]):
        frame.label[m] = m
        x, y = frame.pixels[m, 0], frame.pixels[m, 1]
        frame.seen[m] = not flags[m] & _LOST and math.isfinite(x + y)
        if frame.seen[m]:
            frame.late_s[m] = y * row_time_s
            total += frame.late_s[m]
            count += 1
    mean = total / count if count else cameras.intrinsics[frame.camera[0], 3] * row_time_s
    for m in range(frame.seen.shape[0]):
        frame.late_s[m] -= mean
    return 1e9 * mean, count
