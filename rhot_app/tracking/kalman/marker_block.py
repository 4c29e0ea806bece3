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
from rhot_app.tracking.kalman.hiding import judge_fingertips
from rhot_app.tracking.kalman.markers import Cameras, Frame, Outfit, append_markers, place_markers
from rhot_app.tracking.kalman.partial import doubt_partial
from rhot_app.tracking.kalman.rows import Page
from rhot_app.tracking.kalman.share import Share
from rhot_app.tracking.kalman.sizes import measure_sizes
from rhot_app.tracking.kalman.wearing import Wearing
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag

Array = NDArray[np.float64]
Flags = NDArray[np.uint16]

_LOST = int(MarkerFlag.LOST)


class Sighting(NamedTuple):
    """One frame; `flags` (M,) MarkerFlag of its sights."""

    frame: Frame
    flags: Flags


class MarkerBlock:
    """The markers that one camera saw in one frame. `t_ns`: the mean time of its sights, or of its middle row;
    `camera`: which; `sights`: how many markers it shows; `shared`: its `Sighting`, for compiled functions."""

    def __init__(self, wearing: Wearing, observations: CameraObservations) -> None:
        self.observations, self.camera, self._outfit = observations, observations.camera, wearing.shared
        sized = not math.isnan(observations.detect_s)  # text datagrams tell no sizes
        self.shared, after_ns, self.sights = _sighting_of(
            self._outfit, observations.camera, 1e-9 * observations.row_time_ns, sized, observations.pixels,
            observations.covariances, observations.diameters, observations.flags)
        self.t_ns = observations.t_row0_master_ns + int(after_ns)

    @property
    def frame(self) -> Frame:
        """The frame's arrays themselves."""
        frame: Frame = _frame_of(self.shared)
        return frame

    def as_of(self, t_ns: int) -> MarkerBlock:
        """The same frame, told of as of another instant, master ns."""
        other = copy.copy(self)
        other.t_ns, other.shared = t_ns, _told_later(self.shared, 1e-9 * (t_ns - self.t_ns))
        return other

    def enter(self, page: Share) -> None:
        """Ask the hand, carried to this frame's instant, which marker each sight is of, and how much of it it shows;
        append the frame's observations. The hand learns how wide its markers are. See `ResidualBlock`."""
        _enter(self._outfit, self.shared, page)

    def linearise(self, page: Share) -> None:
        """Append the frame's observations; see `ResidualBlock`."""
        _linearise(self._outfit, self.shared, page)


@njit(cache=True)
def _enter(outfit: Share, shared: Share, page: Share) -> None:
    enter_frame(outfit.of, shared.of.frame, page.of)


@lean
def enter_frame(outfit: Outfit, frame: Frame, page: Page) -> None:
    """All that `MarkerBlock.enter` does."""
    worn, cameras, places, estimate = outfit.worn, outfit.cameras, outfit.places, page.estimate
    place_markers(worn.dh, estimate, places)
    if relabel(worn, cameras, frame, estimate, places) > 0:
        estimate.untroubled[0] = 0.0
    measure_sizes(worn, cameras, frame, estimate, places)
    doubt_partial(worn, cameras, frame, estimate, places)
    judge_fingertips(worn, cameras, frame, estimate, places, outfit.made)
    leave_out_covered(worn, cameras, frame, estimate, places.points, outfit.made)
    if weigh_sizes(worn, cameras, frame, estimate, places):
        place_markers(worn.dh, estimate, places)
    append_markers(worn, cameras, frame, estimate, places, page.rows)


@njit(cache=True)
def _linearise(outfit: Share, shared: Share, page: Share) -> None:
    append_frame(outfit.of, shared.of.frame, page.of)


@lean
def append_frame(outfit: Outfit, frame: Frame, page: Page) -> None:
    """All that `MarkerBlock.linearise` does."""
    place_markers(outfit.worn.dh, page.estimate, outfit.places)
    append_markers(outfit.worn, outfit.cameras, frame, page.estimate, outfit.places, page.rows)


@njit(cache=True)
def _sighting_of(outfit: Share, camera: int, row_s: float, sized: bool, pixels: Array, covariances: Array,
                 diameters: Array, flags: Flags) -> tuple[Share, float, int]:
    """A shared `Sighting`, and what `read_frame` returns of it; one call, because making so many arrays in Python takes
    three times as long."""
    count = len(pixels)
    widths = diameters if sized else np.zeros(count)
    frame = Frame(np.full(1, camera), np.empty(count, np.bool_), pixels, covariances, np.empty(count),
                  np.empty(count, np.int64), widths, np.zeros(count), np.full(1, row_s), flags == 0,
                  np.zeros(count, np.bool_), np.zeros(count), np.ones(count))
    after_ns, seen = read_frame(outfit.of.cameras, frame, flags)
    return Share(Sighting(frame, flags)), after_ns, seen


@njit(cache=True)
def _frame_of(shared: Share) -> Frame:
    frame: Frame = shared.of.frame
    return frame


@njit(cache=True)
def _told_later(shared: Share, later_s: float) -> Share:
    """The same `Sighting`, its times told as of so much later."""
    one: Frame = shared.of.frame
    frame = Frame(one.camera, one.seen, one.pixels, one.covariances, one.late_s - later_s, one.label, one.widths,
                  one.sizes, one.row_s, one.plain, one.covered, one.doubt, one.own)
    return Share(Sighting(frame, shared.of.flags))


@lean
def read_frame(cameras: Cameras, frame: Frame, flags: Flags) -> tuple[float, int]:
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
