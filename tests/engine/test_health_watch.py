"""The engine's health check over a real tracker: silent over a sound rig, and each stale calibration named."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from synthetic_rig import WIDE, Trajectory, Viewing, hand_trajectory, make_rig, observe

from rhot_app.engine.advice import calibration_advice
from rhot_app.engine.observer import HealthWatch
from rhot_app.project import CameraCalibration, CameraPose, DepthSettings, Rig
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag

RIG = make_rig()
STEP_NS = 100_000_000


def said(rig: Rig, frames: Iterable[CameraObservations]) -> set[str]:
    """The sentences of the watch, after any look."""
    tracker, watch = make_tracker(rig), HealthWatch(rig)
    found, due, state = set(), 0, None
    for frame in frames:
        tracker.ingest(frame)
        state = tracker.solve() or state
        if frame.t_receive_ns >= due:
            due = frame.t_receive_ns + STEP_NS
            found |= {advice.text for advice in watch.advice(state, tracker, frame.t_receive_ns)}
    return found


def turned(axis: int, degrees: float) -> Rig:
    half = np.radians(degrees) / 2.0
    vector = [0.0, 0.0, 0.0]
    vector[axis] = float(np.sin(half))
    pose = CameraPose((float(np.cos(half)), *vector), (0.075, 0.0, 0.0))
    return msgspec.structs.replace(RIG, nodes=(RIG.nodes[0], msgspec.structs.replace(RIG.nodes[1], pose=pose)))


@pytest.fixture(scope="module")
def grasp() -> Trajectory:
    return hand_trajectory(RIG, "grasp", 12.0)


@pytest.mark.parametrize("motion", ["grasp", "wave"])
def test_a_sound_rig_is_left_in_peace(motion: str) -> None:
    frames = observe(RIG, WIDE, hand_trajectory(RIG, motion, 25.0), 25.0, Viewing(noise_px=0.15, marker_loss=0.05))
    assert said(RIG, frames) == set()


def test_a_camera_that_was_turned_is_told_until_a_new_run_begins(grasp: Trajectory) -> None:
    rig = msgspec.structs.replace(turned(0, 0.3), calibration=CameraCalibration("board"))
    tracker, watch = make_tracker(rig), HealthWatch(rig)
    found, state, now_ns = [], None, 0
    for frame in observe(RIG, WIDE, grasp, 8.0, Viewing(noise_px=0.1)):
        tracker.ingest(frame)
        state, now_ns = tracker.solve() or state, frame.t_receive_ns
        found += watch.advice(state, tracker, now_ns)
    assert found and all("stereo calibration is stale" in advice.text for advice in found)
    assert {advice.subject for advice in found} == {"calibration"}
    watch.restart()
    assert watch.advice(state, tracker, now_ns + STEP_NS) == []


def test_a_camera_that_is_late_is_told_from_one_that_was_turned() -> None:
    hand = hand_trajectory(RIG, "rest", 20.0)

    def stop_and_go(times: np.ndarray) -> np.ndarray:
        swing = 0.07 * np.sin(2.0 * np.pi * 1.2 * times) * (np.mod(times, 4.0) < 2.0)
        return hand(times) + swing[:, None, None] * np.array([0.0, 1.0, 0.0])
    frames = [replace(frame, t_row0_master_ns=frame.t_row0_master_ns - 8_000_000) if frame.camera else frame
              for frame in observe(RIG, WIDE, stop_and_go, 20.0, Viewing(noise_px=0.1))]
    found = said(RIG, frames)
    assert found and all("times are off" in text and "waving hand" in text for text in found)


def test_a_hand_larger_than_its_file_is_noticed() -> None:
    larger = msgspec.structs.replace(RIG.hand, fingers={name: msgspec.structs.replace(
        finger, bones_mm=tuple(0.85 * bone for bone in finger.bones_mm), marker_mm=0.85 * finger.marker_mm,
        base_mm=tuple(0.85 * value for value in finger.base_mm)) for name, finger in RIG.hand.fingers.items()})
    frames = observe(RIG, WIDE, hand_trajectory(RIG, "spread", 12.0), 12.0, Viewing(noise_px=0.1))
    found = said(msgspec.structs.replace(RIG, hand=larger), frames)
    assert found and all("larger than the hand file" in text for text in found)


def test_faded_and_doubled_colours_are_named_with_marker_and_camera(grasp: Trajectory) -> None:
    frames = observe(RIG, WIDE, grasp, 12.0, Viewing(noise_px=0.1))
    faded = [replace(frame, qualities=np.where(np.arange(6) == 2, 0.3, 0.9)) for frame in frames]
    (text,) = said(RIG, faded)
    assert "colour of middle" in text and "learn the colours" in text
    doubled = [replace(frame, flags=np.where((np.arange(6) == 4) & (frame.camera == 1), MarkerFlag.AMBIGUOUS,
                                             frame.flags).astype(np.uint16)) for frame in frames]
    (text,) = said(RIG, doubled)
    assert "camera 2" in text and "little" in text


def test_an_uncalibrated_rig_is_spared_what_supposes_a_calibration(grasp: Trajectory) -> None:
    rig = msgspec.structs.replace(RIG, depth=DepthSettings(mode="disparity"))
    assert not said(rig, observe(RIG, WIDE, grasp, 6.0, Viewing(noise_px=0.1)))
    (advice,) = calibration_advice(rig)
    assert "Distances are estimates" in advice.text and (advice.level, advice.mender) == ("info", "stereo")
