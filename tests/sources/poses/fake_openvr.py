"""A runtime module in the place of ``openvr``: its structures and constants, and devices that a test moves."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np


class Matrix(ctypes.Structure):
    """HmdMatrix34_t."""

    _fields_ = (("m", (ctypes.c_float * 4) * 3),)


class Pose(ctypes.Structure):
    """TrackedDevicePose_t."""

    _fields_ = (("mDeviceToAbsoluteTracking", Matrix), ("vVelocity", ctypes.c_float * 3),
                ("vAngularVelocity", ctypes.c_float * 3), ("eTrackingResult", ctypes.c_int),
                ("bPoseIsValid", ctypes.c_bool), ("bDeviceIsConnected", ctypes.c_bool))


class Event(ctypes.Structure):
    """VREvent_t."""

    _fields_ = (("eventType", ctypes.c_uint32),)


class OpenVRError(Exception):
    """Of the package's error module."""


class NoServerError(OpenVRError):
    """SteamVR does not run."""


@dataclass
class Device:
    """One device of the fake."""

    serial: str
    role: str = ""
    kind: int = 3
    world_from_body: np.ndarray = field(default_factory=lambda: np.eye(4))
    result: int = 200
    valid: bool = True
    connected: bool = True


class FakeOpenVr:
    """The module and its IVRSystem at once."""

    k_unMaxTrackedDeviceCount = 64  # noqa: N815 - the package's names, as all below
    VRApplication_Background, TrackingUniverseRawAndUncalibrated, TrackedDeviceClass_GenericTracker = 3, 2, 3
    TrackingResult_Running_OK, TrackingResult_Running_OutOfRange = 200, 201
    TrackingResult_Fallback_RotationOnly = 300
    Prop_SerialNumber_String, Prop_ControllerType_String = 1002, 7000
    VREvent_Quit = 700
    TrackedDevicePose_t, VREvent_t = Pose, Event
    error_code = SimpleNamespace(OpenVRError=OpenVRError)

    def __init__(self, *devices: Device, installed: bool = True, running: bool = True) -> None:
        self.devices = [Device("HMD", kind=1), *devices]
        self.installed, self.running = installed, running
        self.events: list[int] = []
        self.application = self.predicted_s = self.universe = None
        self.shutdowns = self.acknowledged = 0

    def isRuntimeInstalled(self):  # noqa: N802
        return self.installed

    def init(self, application):
        if not self.running:
            raise NoServerError
        self.application = application
        return self

    def shutdown(self):
        self.shutdowns += 1

    def getTrackedDeviceClass(self, index):  # noqa: N802
        return self.devices[index].kind if index < len(self.devices) else 0

    def getStringTrackedDeviceProperty(self, index, which):  # noqa: N802
        device = self.devices[index]
        text = device.serial if which == self.Prop_SerialNumber_String else device.role
        if not text:
            raise OpenVRError("unknown property")
        return text

    def getDeviceToAbsoluteTrackingPose(self, universe, predicted_s, poses):  # noqa: N802
        self.universe, self.predicted_s = universe, predicted_s
        for pose, device in zip(poses, self.devices, strict=False):
            for row in range(3):
                for column in range(4):
                    pose.mDeviceToAbsoluteTracking.m[row][column] = device.world_from_body[row, column]
            pose.eTrackingResult, pose.bPoseIsValid = device.result, device.valid
            pose.bDeviceIsConnected = device.connected

    def pollNextEvent(self, event):  # noqa: N802
        if not self.events:
            return False
        event.eventType = self.events.pop(0)
        return True

    def acknowledgeQuit_Exiting(self):  # noqa: N802
        self.acknowledged += 1
