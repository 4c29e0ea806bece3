"""What every tracker takes and gives, so that the engine need not know which one runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.observations import EdgeFrame, ImageFrame, SliceRequest
from rhot_app.calibration.check.camera_calibration import KNOWN_EXACTLY, CalibrationAccuracy
from rhot_app.diagnostics import Diagnostics, Part
from rhot_app.estimation.residual import Residual
from rhot_app.objects.observations import MeasuredPose, ObjectFrame
from rhot_app.state import HandState, SeenContour

if TYPE_CHECKING:
    from rhot_app.barehand.key_frames import KeyFrames

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Candidates:
    """K further observations of one frame, each of an object of a marker's colour.

    `markers` (K,): index in the rig of the marker that each may be. The other columns are as in `CameraObservations`.
    """

    markers: NDArray[np.intp]
    pixels: Array
    covariances: Array
    diameters: Array
    qualities: Array
    flags: NDArray[np.uint16]

    def of(self, markers: NDArray[np.intp]) -> Candidates | None:
        """The candidates of `markers`, ascending indices, renumbered by their place in it; None if there are none."""
        chosen = np.isin(self.markers, markers)
        if not chosen.any():
            return None
        renumbered = np.searchsorted(markers, self.markers[chosen])
        return Candidates(renumbered, self.pixels[chosen], self.covariances[chosen], self.diameters[chosen],
                          self.qualities[chosen], self.flags[chosen])


@dataclass(frozen=True, slots=True)
class CameraObservations:
    """One frame of one camera, in master time. M markers in the rig's order.

    `camera`: index into the rig's nodes. `t_row0_master_ns`: mid-exposure of row 0; a marker at raw pixel row y was
    seen at `t_row0_master_ns + y * row_time_ns`. `clock_bound_s`: half-width of the clock offset's error.
    `t_row0_node_ns`: the node's own stamp of the frame, 0 when it gives none.
    """

    camera: int
    t_row0_master_ns: int
    row_time_ns: int
    clock_bound_s: float
    t_receive_ns: int
    detect_s: float  # frame available to datagram sent, on the node
    network_s: float  # datagram sent to kernel receive, by the clock model; may be negative within the bound
    pixels: Array  # (M, 2) raw px, NaN when lost
    covariances: Array  # (M, 2, 2) px^2
    diameters: Array  # (M,) px
    qualities: Array  # (M,)
    flags: NDArray[np.uint16]  # (M,) MarkerFlag
    further: Candidates | None = None  # other candidates than those above
    t_row0_node_ns: int = 0

    def of(self, markers: NDArray[np.intp]) -> CameraObservations:
        """The frame with `markers` only, ascending indices."""
        if len(markers) == len(self.pixels):
            return self
        return replace(self, pixels=self.pixels[markers], covariances=self.covariances[markers],
                       diameters=self.diameters[markers], qualities=self.qualities[markers], flags=self.flags[markers],
                       further=None if self.further is None else self.further.of(markers))


class HandFrame:
    """An observation of a hand of a kind that the trackers do not know: residuals on the hand's state."""

    def __init__(self, camera: int, t_ns: int, hand: int = 0) -> None:
        """`camera`: its index in the rig. `t_ns`: master time. `hand`: 0 the rig's hand, 1 its other one."""
        self.camera, self.t_ns, self.hand = camera, t_ns, hand

    def residuals(self, state: Array) -> Sequence[Residual]:
        """Those of a hand predicted to be in `state` (`hand.motion.hand_state`)."""
        raise NotImplementedError


CameraFrame = CameraObservations | ObjectFrame | ImageFrame | HandFrame
"""What a source delivers: markers, fiducial tags, edges or foreground of one camera's frame, its picture, a pose of
another tracker, or what another kind observes."""


class Tracker:
    """Fed with every frame as it arrives, asked for a state when one may be due. One thread only.

    A tracker overrides what it handles. The defaults here ignore objects and images, and smooth nothing.
    """

    smooths: ClassVar[bool] = False
    """Whether its states use the whole recording; they come late, by `states` and `finish` only."""

    diagnostics: Diagnostics
    """What it fails over and warns of."""

    by_calibration: CalibrationAccuracy = KNOWN_EXACTLY
    """What the calibration of the rig adds to the error of every place, as the rig says."""

    objects_on_exact_cameras: frozenset[str] = frozenset()
    """Names of the objects that have that error, too: those of colour markers, whose lengths do not show how far they
    are, and articulated ones, whose estimate takes the cameras to be where the rig says."""

    key_frames: KeyFrames | None = None
    """The frames that tell most of a bare hand's shape; None for a tracker without contours. Any thread may read."""

    def ingest(self, frame: CameraFrame) -> None:
        """Take one frame in; of kinds that do not concern it, nothing. Cheap: called for every datagram even when
        flooded."""
        raise NotImplementedError

    def reset(self) -> None:
        """Forget everything: a new session, or a node's clock was set."""
        raise NotImplementedError

    def solve(self) -> HandState | None:
        """The state at the newest instant that is due and not yet published, or None. Its covariances are conditional
        on the calibration, as those that are compared with each other have to be."""
        return None

    def stands(self, state: HandState) -> bool:
        """Whether its last state still holds: it has not lost the hand since."""
        return True

    def states(self) -> Iterator[HandState]:
        """All states that are due, to be published: the error of the calibration is in their covariances."""
        state = self.solve()
        if state is not None:
            yield self.published(state)

    def published(self, state: HandState) -> HandState:
        """The state with the error of the calibration in the covariances of its places. Objects of
        tags have the cameras' turns in their own estimate instead."""
        own, other = with_calibration_error(state, self.published_error(self.by_calibration)), state.other
        objects = tuple(replace(one, covariance=_of_pose(one.world_from_object, one.covariance, self.by_calibration))
                        if one.name in self.objects_on_exact_cameras else one for one in state.objects)
        return replace(own, objects=objects, other=None if other is None else self.published(other))

    def published_error(self, stated: CalibrationAccuracy) -> CalibrationAccuracy:
        """What the calibration adds to the error of every place of the last state: what the rig has `stated`, and what
        the tracker has found."""
        return stated

    def finish(self) -> Iterator[HandState]:
        """A recording is over: the rest of the states."""
        return iter(())

    def newest_frames(self) -> tuple[CameraObservations | None, ...]:
        """Each camera's newest frame, None before its first. May be called by another thread."""
        return ()

    def requests(self) -> list[SliceRequest]:
        """What the nodes shall search in their images now; asked for after every `solve`."""
        return []

    def seen(self) -> list[SeenContour]:
        """What is seen of a bare hand: the newest image of each camera and hand. Any thread may ask."""
        return []

    def warm_up(self) -> None:
        """Have everything compiled that frames like those of the start do not reach, then forget."""

    def wait(self) -> None:
        """Wait until searches on other threads have ended. A replay calls it; live, nobody waits."""


def with_calibration_error(state: HandState, error: CalibrationAccuracy) -> HandState:
    """The state with `error` in the covariances of all places of its hand."""
    if error.sd_m == error.turned_m == 0.0:
        return state
    return replace(
        state, marker_covariances=state.marker_covariances + error.covariances(state.marker_positions),
        joint_covariances=state.joint_covariances + error.covariances(state.joint_positions),
        fingertip_covariances=state.fingertip_covariances + error.covariances(state.fingertip_positions),
        palm_covariance=_of_pose(state.world_from_palm, state.palm_covariance, error))


def _of_pose(pose: Array, covariance: Array, error: CalibrationAccuracy) -> Array:
    out = covariance.copy()
    out[:3, :3] += error.covariances(pose[:3, 3])
    return out


def may_be_due(frame: CameraFrame) -> bool:
    """Whether a tracker may have a state after this frame."""
    return isinstance(frame, CameraObservations | EdgeFrame)


def frame_part(diagnostics: Diagnostics, tracker: Tracker, frame: CameraFrame, cameras: Sequence[str]) -> Part:
    """A context for what `tracker` makes of one frame: an exception loses the frame, and is counted by its camera."""
    name = (f"a pose of {frame.name}" if isinstance(frame, MeasuredPose)
            else f"a frame of camera {cameras[frame.camera]}")
    return diagnostics.part(name, tracker.reset, among="frames")


def states_after(tracker: Tracker, frame: CameraFrame) -> list[HandState]:
    """The states after one frame of a recording, if the frame completes any; nothing is left for later."""
    tracker.ingest(frame)
    tracker.wait()
    tracker.requests()  # nobody searches again
    return list(tracker.states()) if may_be_due(frame) else []
