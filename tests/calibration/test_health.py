"""The health monitor alone: rigid distances, little to go by, times that step back, and its cost."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from landmark_detector import landmark_rig
from patience import quickest
from synthetic_rig import make_rig

from rhot_app.calibration.check.health import HealthMonitor, HealthSample
from rhot_app.project import CameraCalibration, Rig
from rhot_node.wire.messages import MarkerFlag

MARKERS = 6


def rig_with_palm_markers() -> Rig:
    rig = make_rig()
    roles = ("palm_1", "palm_2", "middle_tip", "ring_tip", "little_tip", "wrist")
    markers = tuple(msgspec.structs.replace(marker, role=role)
                    for marker, role in zip(rig.markers.markers, roles, strict=True))
    return msgspec.structs.replace(rig, markers=msgspec.structs.replace(rig.markers, markers=markers))


def sample(k: int, positions: np.ndarray, error_px: float = 0.1) -> HealthSample:
    return HealthSample(t_ns=10**15 + k * 100_000_000, positions=positions, measured=np.ones(MARKERS, bool),
                        errors_px=np.full(MARKERS, error_px), qualities=np.ones((2, MARKERS)),
                        flags=np.zeros((2, MARKERS), np.uint16))


def places(rng: np.random.Generator, apart_m: float = 0.04) -> np.ndarray:
    """A hand somewhere, its first two markers `apart_m` from each other."""
    points = np.array([[0.0, 0.0, 0.6], [apart_m, 0.0, 0.6], [0.1, 0.0, 0.6], [0.1, 0.02, 0.6], [0.1, 0.04, 0.6],
                       [0.05, 0.05, 0.6]])
    return points + rng.normal(0.0, 0.02, 3) + rng.normal(0.0, 3e-4, points.shape)


def test_a_marker_that_slipped_is_noticed_and_goes_once_it_is_back() -> None:
    rng, monitor = np.random.default_rng(1), HealthMonitor(rig_with_palm_markers())
    seen = []
    for k in range(800):
        monitor.feed(sample(k, places(rng, 0.047 if 250 <= k < 500 else 0.04)))
        seen.append([found.finding.code for found in monitor.findings()])
    assert not any(seen[:250]) and seen[400] == ["rigid_drift"] and seen[-1] == []


def test_little_is_no_reason_to_speak() -> None:
    rng, monitor = np.random.default_rng(1), HealthMonitor(rig_with_palm_markers())
    assert monitor.findings() == ()
    for k in range(20):
        monitor.feed(sample(k, places(rng), 3.0))
    assert monitor.findings() == ()
    for k in range(20, 60):
        monitor.feed(sample(k, places(rng), 3.0))
    (found,) = monitor.findings()
    assert found.mender == "stereo" and not found.finding.grade.rank < 2
    assert found.finding.code == "stale_geometry"


@pytest.mark.parametrize(("method", "said"), [(None, "no stereo"), ("outdated", "ntrinsics"), ("board", "stale")])
def test_only_a_calibration_that_was_made_is_called_stale(method: str | None, said: str) -> None:
    record = None if method is None else CameraCalibration(method)
    rig = msgspec.structs.replace(rig_with_palm_markers(), calibration=record)
    rng, monitor = np.random.default_rng(1), HealthMonitor(rig)
    for k in range(60):
        monitor.feed(sample(k, places(rng), 3.0))
    (found,) = monitor.findings()
    assert said in found.finding.cause and ("stale" in found.finding.sentence) == (method == "board")


def codes_after(change: Callable[[int, HealthSample], HealthSample]) -> list[str]:
    """What is found after ten seconds of a hand that moves fast in every other second."""
    rng, monitor = np.random.default_rng(1), HealthMonitor(rig_with_palm_markers())
    hand = places(rng)
    for k in range(120):
        hand = hand + rng.normal(0.0, 1e-4, hand.shape)
        hand[:, 0] += 0.06 * (-1) ** k if k // 10 % 2 else 0.0
        monitor.feed(change(k, sample(k, hand)))
    return [found.finding.code for found in monitor.findings()]


def stretched(one: HealthSample) -> HealthSample:
    """The middle finger's tip 40 cm from the wrist."""
    positions = one.positions.copy()
    positions[2] = positions[5] + [0.4, 0.0, 0.0]
    return replace(one, positions=positions)


@pytest.mark.parametrize(("change", "code"), [
    (lambda k, one: replace(one, errors_px=np.full(MARKERS, 3.0 if k // 10 % 2 else 0.1)), "late_camera"),
    (lambda k, one: stretched(one), "reach"),
    (lambda k, one: replace(one, qualities=np.full((2, MARKERS), 0.05)), "weak_colour"),
    (lambda k, one: replace(one, flags=np.full((2, MARKERS), MarkerFlag.AMBIGUOUS, np.uint16)), "doubled_colour")])
def test_each_doubt_about_a_running_rig_is_said(change: Callable[[int, HealthSample], HealthSample],
                                                code: str) -> None:
    assert codes_after(lambda k, one: one) == []
    assert codes_after(change) == [code]


def test_landmarks_say_nothing_of_the_calibration() -> None:
    """They err by pixels, each by itself, with the best calibration."""
    rig = landmark_rig()
    monitor, rng, count = HealthMonitor(rig), np.random.default_rng(3), len(rig.markers.ids)
    for k in range(400):
        positions = 0.05 * rng.normal(size=(count, 3)) + (0.0, 0.0, 0.6)
        monitor.feed(HealthSample(t_ns=k * 100_000_000, positions=positions, measured=np.ones(count, np.bool_),
                                  errors_px=np.full(count, 3.0), qualities=np.full((2, count), 0.1),
                                  flags=np.zeros((2, count), np.uint16)))
    assert monitor.findings() == ()


def test_times_that_step_back_begin_anew() -> None:
    rng, monitor = np.random.default_rng(1), HealthMonitor(rig_with_palm_markers())
    for k in range(200, 300):
        monitor.feed(sample(k, places(rng), 3.0))
    assert monitor.findings()
    monitor.feed(sample(0, places(rng), 0.1))
    assert monitor.findings() == ()


@pytest.mark.parametrize("nothing", ["positions", "errors"])
def test_what_is_not_known_says_nothing(nothing: str) -> None:
    monitor = HealthMonitor(rig_with_palm_markers())
    unknown = np.full((MARKERS, 3), np.nan)
    for k in range(100):
        monitor.feed(sample(k, unknown if nothing == "positions" else places(np.random.default_rng(k)), float("nan")))
    assert monitor.findings() == ()


def test_it_costs_next_to_nothing() -> None:
    rng, monitor = np.random.default_rng(1), HealthMonitor(rig_with_palm_markers())
    samples = [sample(k, places(rng)) for k in range(300)]
    tenths = (samples[k:k + 30] for k in range(0, 300, 30))
    assert quickest(lambda: [monitor.feed(one) for one in next(tenths)], times=10,
                    clock=time.process_time) < 30 * 1e-3  # 50 µs each when idle
    assert quickest(monitor.findings, 0.05, clock=time.process_time) < 0.05
