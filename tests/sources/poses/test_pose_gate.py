"""A recorded tracker through the common interface: its own noise, and jumps that are rejected."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rhot_app.objects.pose import Validity
from rhot_app.sources.poses.open_source import open_source
from rhot_app.sources.poses.source import (
    START_SD_M,
    UNKNOWN_COVARIANCE,
    UNKNOWN_POSE,
    ForeignPose,
    PoseGate,
    StreamNoise,
)

STILL = Path(__file__).parents[4] / "shared" / "data" / "vive" / "tracker_stationary.csv"
needs_vive = pytest.mark.skipif(not STILL.is_file(), reason=f"{STILL} is not there")


@needs_vive
def test_a_real_tracker_at_rest_keeps_its_samples_and_loses_its_jumps() -> None:
    source = open_source(str(STILL))
    poses = source.poll()[:1500]
    assert source.ended and source.poll() == []
    rng = np.random.default_rng(3)
    jumps = rng.random(len(poses)) < 0.02
    jumps[:20] = False
    gate, accepted = PoseGate("vive"), []
    for pose, jump in zip(poses, jumps, strict=True):
        moved = pose.world_from_body.copy()
        if jump:
            direction = rng.normal(size=3)
            moved[:3, 3] += 0.1 * direction / np.linalg.norm(direction)
        accepted.append(gate.take(ForeignPose(pose.t_master_ns, moved, pose.covariance, pose.validity)))
    accepted = np.array(accepted)
    sd = np.sqrt(np.diag(poses[0].covariance))
    print(f"{len(poses)} samples: white noise {1e3 * sd[0]:.4f} mm, {np.degrees(sd[3]):.4f} degrees; {jumps.sum()} "
          f"jumps, {accepted[jumps].sum()} accepted; {(~accepted[~jumps]).sum()} others rejected")
    assert not accepted[jumps].any() and accepted[~jumps].mean() > 0.98
    assert 1e-7 < sd[0] < 0.09e-3
    assert gate.rejected_ratio == pytest.approx(1.0 - accepted.mean())
    state = gate.state(poses[-1].t_master_ns)
    assert np.linalg.norm(state.world_from_object[:3, 3] - poses[-1].world_from_body[:3, 3]) < 2e-3


@needs_vive
def test_a_live_streams_noise_becomes_its_own() -> None:
    poses, noise = open_source(str(STILL)).poll(), StreamNoise()
    assert np.sqrt(noise.covariance[0, 0]) == pytest.approx(START_SD_M)
    for pose in poses[:600]:
        noise.add(pose.t_master_ns, pose.world_from_body)
    assert 0.2 < np.sqrt(noise.covariance[0, 0] / poses[0].covariance[0, 0]) < 5.0


def test_poses_that_are_not_tracked_are_not_taken_and_do_not_count() -> None:
    gate = PoseGate("tracker")
    covariance = np.diag(np.repeat([1e-8, 1e-8], 3))
    assert gate.take(ForeignPose(0, np.eye(4), covariance, Validity.TRACKED))
    assert not gate.take(ForeignPose(10**6, np.eye(4), covariance, Validity.PREDICTED))
    assert not gate.take(ForeignPose(2 * 10**6, UNKNOWN_POSE, UNKNOWN_COVARIANCE, Validity.LOST))
    assert gate.offered == 1 and gate.rejected_ratio == 0.0
