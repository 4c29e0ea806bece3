"""A tracker of SteamVR, by OpenVR: as a background application, without a headset's picture (docs/objects.md)."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import SourceError
from rhot_app.geometry.transforms import best_rotation, rigid
from rhot_app.objects.pose import Validity
from rhot_app.sources.poses.source import UNKNOWN_COVARIANCE, UNKNOWN_POSE, ForeignPose, StreamNoise
from rhot_node.errors import NAME_LIMIT, printable

Array = NDArray[np.float64]

PREDICTION_S = 0.0
"""s: the pose of now. Any other would be the driver's guess, which a filter must not take for a measurement."""

LOOK_NS = 500_000_000
"""ns between two looks for trackers that were switched on or off."""


class SteamVrPoses:
    """A `PoseSource`: the tracker whose serial number or role is `chosen`, or the only one.

    Poses are of OpenVR's raw universe, which a new room set-up does not move. Each is stamped with the time of the
    call, whose delay an alignment finds.
    """

    def __init__(self, chosen: str = "", runtime: Any = None,
                 now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """`runtime`: the module ``openvr``, which is imported when None. Raises SourceError without package, SteamVR,
        or a running SteamVR."""
        self._chosen, self._now_ns = chosen, now_ns
        self._vr = _imported() if runtime is None else runtime
        self._system: Any = _started(self._vr)
        self._poses = (self._vr.TrackedDevicePose_t * self._vr.k_unMaxTrackedDeviceCount)()
        self._trackers: dict[int, tuple[str, str]] = {}  # serial number and role by device index
        self._index: int | None = None
        self._look_ns = now_ns()
        self._noise = StreamNoise()
        self._last_ns, self._ever, self._state, self._closed = -1, False, "", ""
        self._look()

    @property
    def name(self) -> str:
        """With the serial number, once there is one."""
        serial = self._chosen if self._index is None else self._trackers[self._index][0]
        return f"SteamVR {serial}".rstrip()

    @property
    def ended(self) -> bool:
        """Whether SteamVR was closed."""
        return bool(self._closed)

    @property
    def notice(self) -> str:
        """See `PoseSource`."""
        return self._closed or self._missing() or self._state

    def poll(self) -> list[ForeignPose]:
        """The pose of now, or none. A tracker that is not seen gives LOST poses, one by its inertial sensors alone
        PREDICTED ones."""
        if self._system is None or self._asked_to_quit():
            return []
        before_ns = self._now_ns()
        if before_ns - self._look_ns >= LOOK_NS:
            self._look_ns = before_ns
            self._look()
        if self._index is None:
            return []
        before_ns = self._now_ns()
        self._system.getDeviceToAbsoluteTrackingPose(self._vr.TrackingUniverseRawAndUncalibrated, PREDICTION_S,
                                                     self._poses)
        t_ns = (before_ns + self._now_ns()) // 2
        if t_ns <= self._last_ns:
            return []
        self._last_ns = t_ns
        return [self._read(t_ns, self._trackers[self._index][0], self._poses[self._index])]

    def close(self) -> None:
        """Let go of SteamVR."""
        if self._system is not None:
            self._system = None
            self._closed = self._closed or "SteamVR was let go."
            self._vr.shutdown()

    def _read(self, t_ns: int, serial: str, pose: Any) -> ForeignPose:
        result = int(pose.eTrackingResult)
        by_inertia = result in (self._vr.TrackingResult_Running_OutOfRange,
                                self._vr.TrackingResult_Fallback_RotationOnly)
        running = by_inertia or result == self._vr.TrackingResult_Running_OK
        values = np.array([list(row) for row in pose.mDeviceToAbsoluteTracking.m], dtype=np.float64)
        self._state = ""
        if not pose.bDeviceIsConnected:
            self._state = f"The tracker {serial} is switched off or out of its receiver's range. Switch it on."
        elif not (pose.bPoseIsValid and running and np.isfinite(values).all()):
            self._state = f"The tracker {serial} is not tracked. Bring it into view of a base station."
        if self._state:
            validity = Validity.LOST if self._ever else Validity.SEARCHING
            return ForeignPose(t_ns, UNKNOWN_POSE, UNKNOWN_COVARIANCE, validity)
        world_from_body = rigid(best_rotation(values[:, :3]), values[:, 3])  # SteamVR's numbers have 24 bits
        if by_inertia:
            self._state = (f"The tracker {serial} goes by its inertial sensors alone. Bring it into view of a base "
                           "station.")
            return ForeignPose(t_ns, world_from_body, self._noise.covariance, Validity.PREDICTED)
        self._ever = True
        return ForeignPose(t_ns, world_from_body, self._noise.add(t_ns, world_from_body), Validity.TRACKED)

    def _look(self) -> None:
        """Which trackers there are, and which is the chosen one."""
        self._trackers = {}
        for index in range(self._vr.k_unMaxTrackedDeviceCount):
            if int(self._system.getTrackedDeviceClass(index)) == self._vr.TrackedDeviceClass_GenericTracker:
                serial, role = (self._text(index, which) for which in (self._vr.Prop_SerialNumber_String,
                                                                       self._vr.Prop_ControllerType_String))
                self._trackers[index] = serial or f"number {index}", role.removeprefix("vive_tracker_")
        fitting = [index for index, names in self._trackers.items() if not self._chosen or self._chosen in names]
        only = fitting[0] if len(fitting) == 1 else None
        if only != self._index:
            self._index, self._noise, self._state = only, StreamNoise(), ""

    def _missing(self) -> str:
        """Why there is no chosen tracker."""
        if self._index is not None:
            return ""
        if not self._trackers:
            return "SteamVR has no tracker. Switch one on, and pair it in SteamVR."
        there = ", ".join(f"{printable(serial, NAME_LIMIT)} ({printable(role, NAME_LIMIT)})" if role else
                          printable(serial, NAME_LIMIT) for serial, role in self._trackers.values())
        if not self._chosen:
            return f"SteamVR has {len(self._trackers)} trackers: {there}. Choose one by its serial number or role."
        return (f"SteamVR has no tracker {printable(self._chosen, NAME_LIMIT)!r}, or several. Choose one by its serial "
                f"number or role: {there}.")

    def _text(self, index: int, which: Any) -> str:
        try:
            return str(self._system.getStringTrackedDeviceProperty(index, which))
        except self._vr.error_code.OpenVRError:
            return ""

    def _asked_to_quit(self) -> bool:
        """SteamVR ends programs that do not let go of it when it is closed."""
        event = self._vr.VREvent_t()
        while self._system.pollNextEvent(event):
            if int(event.eventType) == self._vr.VREvent_Quit:
                self._system.acknowledgeQuit_Exiting()
                self._closed = "SteamVR was closed. Start it again, then this."
                self.close()
                return True
        return False


def _imported() -> Any:
    try:
        return importlib.import_module("openvr")
    except ImportError as exc:
        raise SourceError("The package openvr is missing. Install it: pip install 'rhot[vive]'.") from exc
    except OSError as exc:  # its library is not for this machine
        raise SourceError(f"The package openvr cannot be used on this machine ({exc}). Use libsurvive, or send poses "
                          "from a machine with SteamVR.") from exc


def _started(vr: Any) -> Any:
    if not vr.isRuntimeInstalled():
        raise SourceError("SteamVR is not installed on this machine. Install it with Steam, or use libsurvive.")
    try:
        return vr.init(vr.VRApplication_Background)
    except vr.error_code.OpenVRError as exc:
        raise SourceError(f"SteamVR does not answer ({type(exc).__name__}). Start SteamVR first; without a headset it "
                          "needs the null driver (docs/objects.md).") from exc
