"""SteamVR's trackers through a fake of its package: which one, when, how valid, and what is said."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from fake_openvr import Device, FakeOpenVr

from rhot_app.errors import SourceError
from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.pose import Validity
from rhot_app.sources.poses.steamvr import LOOK_NS, SteamVrPoses


class Clock:
    """Goes on by a microsecond with every look at it."""

    def __init__(self) -> None:
        self.now_ns = 10**12

    def __call__(self) -> int:
        self.now_ns += 1000
        return self.now_ns


def test_poses_are_of_now_by_the_masters_clock_and_in_the_raw_universe() -> None:
    pose = rigid(exp_so3([0.3, -0.2, 0.5]), [1.0, 2.0, -0.5])
    runtime, clock = FakeOpenVr(Device("LHR-1", "vive_tracker_waist", world_from_body=pose)), Clock()
    source = SteamVrPoses("", runtime, clock)
    before_ns = clock.now_ns
    (found,) = source.poll()
    assert before_ns < found.t_master_ns < clock.now_ns
    np.testing.assert_allclose(found.world_from_body, pose, atol=1e-6)
    assert found.validity is Validity.TRACKED and (np.diag(found.covariance) > 0.0).all()
    assert (runtime.application, runtime.predicted_s, runtime.universe) == (
        FakeOpenVr.VRApplication_Background, 0.0, FakeOpenVr.TrackingUniverseRawAndUncalibrated)
    assert source.name == "SteamVR LHR-1" and not source.notice and not source.ended
    (later,) = source.poll()
    assert later.t_master_ns > found.t_master_ns
    source.close()
    source.close()
    assert runtime.shutdowns == 1 and source.ended and source.poll() == []


@pytest.mark.parametrize("chosen", ["LHR-2", "waist", "vive_tracker_waist"])
def test_a_tracker_is_chosen_by_serial_number_or_role(chosen: str) -> None:
    pose = rigid(np.eye(3), [0.0, 0.0, 3.0])
    runtime = FakeOpenVr(Device("LHR-1", "vive_tracker_left_foot"),
                         Device("LHR-2", "vive_tracker_waist", world_from_body=pose))
    source = SteamVrPoses(chosen.removeprefix("vive_tracker_"), runtime, Clock())
    assert source.poll()[0].world_from_body[2, 3] == pytest.approx(3.0)


@pytest.mark.parametrize(("devices", "chosen", "says"), [
    ((), "", "no tracker"), ((), "LHR-1", "no tracker"), ((Device("LHR-1"),), "LHR-7", "LHR-1"),
    ((Device("LHR-1", "vive_tracker_chest"), Device("LHR-2")), "", r"LHR-1 \(chest\), LHR-2")])
def test_without_the_tracker_there_is_a_sentence_and_no_pose(devices, chosen, says) -> None:
    source = SteamVrPoses(chosen, FakeOpenVr(*devices), Clock())
    assert source.poll() == [] and not source.ended
    with pytest.raises(AssertionError, match=says):
        raise AssertionError(source.notice)


def test_a_tracker_that_is_switched_on_later_is_found() -> None:
    runtime, clock = FakeOpenVr(), Clock()
    source = SteamVrPoses("", runtime, clock)
    assert source.poll() == [] and source.notice
    runtime.devices.append(Device("LHR-1"))
    clock.now_ns += LOOK_NS
    assert source.poll()[0].validity is Validity.TRACKED and not source.notice


@pytest.mark.parametrize(("change", "validity", "says"), [
    ({"valid": False}, Validity.LOST, "not tracked"), ({"result": 100}, Validity.LOST, "not tracked"),
    ({"connected": False}, Validity.LOST, "switched off"),
    ({"world_from_body": np.full((4, 4), np.nan)}, Validity.LOST, "not tracked"),
    ({"result": 201}, Validity.PREDICTED, "inertial"), ({"result": 300}, Validity.PREDICTED, "inertial")])
def test_a_tracker_that_is_not_tracked_says_so_and_returns(change, validity, says) -> None:
    device = Device("LHR-1")
    source = SteamVrPoses("", FakeOpenVr(device), Clock())
    source.poll()
    before = {name: getattr(device, name) for name in change}
    for name, value in change.items():
        setattr(device, name, value)
    (pose,) = source.poll()
    assert pose.validity is validity and says in source.notice
    assert np.isnan(pose.world_from_body).all() == (validity is Validity.LOST)
    for name, value in before.items():
        setattr(device, name, value)
    assert source.poll()[0].validity is Validity.TRACKED and not source.notice


def test_one_that_was_never_tracked_is_searched_for() -> None:
    source = SteamVrPoses("", FakeOpenVr(Device("LHR-1", valid=False)), Clock())
    assert source.poll()[0].validity is Validity.SEARCHING


def test_steamvr_that_closes_is_let_go_of() -> None:
    runtime = FakeOpenVr(Device("LHR-1"))
    source = SteamVrPoses("", runtime, Clock())
    runtime.events = [100, FakeOpenVr.VREvent_Quit]
    assert source.poll() == [] and source.ended and "closed" in source.notice
    assert runtime.acknowledged == runtime.shutdowns == 1


def test_what_is_missing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "openvr", None)
    with pytest.raises(SourceError, match="rhot\\[vive\\]"):
        SteamVrPoses()
    with pytest.raises(SourceError, match="not installed"):
        SteamVrPoses("", FakeOpenVr(installed=False))
    with pytest.raises(SourceError, match="Start SteamVR first"):
        SteamVrPoses("", FakeOpenVr(running=False))
    monkeypatch.setitem(sys.modules, "openvr", FakeOpenVr(Device("LHR-9")))
    assert SteamVrPoses().name == "SteamVR LHR-9"
