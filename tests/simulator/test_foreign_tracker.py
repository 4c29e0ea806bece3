"""The simulated rig's foreign tracker: rigid on the fingertip, 37 ms late, in a world of its own, the same by seed."""

from __future__ import annotations

import sys
import time

import numpy as np
import pytest
from patience import eventually

from rhot_app.estimation.se3 import rotation_from_quaternion
from rhot_app.geometry.transforms import inverse, rigid
from rhot_app.objects.alignment.motion_stream import MotionStream
from rhot_app.objects.alignment.report import FAIR_M, LASTING_M, REACH_M, calibrate_alignment, coverage_of_motion
from rhot_app.simulator.film.scene_objects import make_object
from rhot_app.simulator.nodes.live import TwinServer
from rhot_app.simulator.nodes.live_scene import DELAY_S, NOISE_M, RATE_HZ, ForeignTracker, world_from_body
from rhot_app.simulator.nodes.remote import TrackerRequest
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.simulator.scene.scene_description import BoardShow, HandShow
from rhot_app.sources.poses.open_source import open_source

TIMES_S = np.arange(5.0, 25.0, 1.0 / RATE_HZ)


@pytest.fixture(scope="module")
def scene():
    return make_scene(twin_defaults(), seed=3)


def poses_of(rows):
    return np.array([rigid(rotation_from_quaternion(row[3:]), row[:3]) for row in rows])


def test_it_reports_the_fingertips_pose_of_37_ms_ago(scene) -> None:
    shown, marker = make_object(HandShow("roam"), scene), scene.markers.ids.index("index")
    tracker = ForeignTracker(scene.seed)
    reported = poses_of(tracker.rows(shown, marker, TIMES_S))
    true = world_from_body(shown, marker, TIMES_S - DELAY_S)
    back = inverse(tracker.foreign_from_rig) @ reported @ inverse(tracker.body_from_tracker)
    error = np.linalg.norm(back[:, :3, 3] - true[:, :3, 3], axis=1)
    assert 0.5 * NOISE_M < np.sqrt(np.mean(error**2)) < 3.0 * NOISE_M
    np.testing.assert_allclose(true[:, :3, 3], shown.thing.marker_positions(*shown.source.sample(TIMES_S - DELAY_S))[
        :, marker], atol=1e-12)
    again = poses_of(ForeignTracker(scene.seed).rows(shown, marker, TIMES_S))
    np.testing.assert_array_equal(again, reported)
    assert not np.allclose(ForeignTracker(4).foreign_from_rig, tracker.foreign_from_rig)


def test_the_motion_for_it_shows_all_that_an_alignment_needs(scene) -> None:
    shown, marker = make_object(HandShow("roam"), scene), scene.markers.ids.index("index")
    tracker = ForeignTracker(scene.seed)
    reported, true = poses_of(tracker.rows(shown, marker, TIMES_S)), world_from_body(shown, marker, TIMES_S)
    coverage = coverage_of_motion(reported[:, :3, :3], true[:, :3, 3], np.gradient(true[:, :3, 3], TIMES_S, axis=0))
    assert coverage.turn[0] > LASTING_M / FAIR_M
    assert np.linalg.norm(coverage.spread_m[1:]) > LASTING_M * REACH_M / FAIR_M and coverage.speed_m_s > 0.25
    report = calibrate_alignment(MotionStream.of_poses(TIMES_S, reported), MotionStream(TIMES_S, true[:, :3, 3]))
    assert report.verdict.acceptable
    assert report.fit.offset_s == pytest.approx(-DELAY_S, abs=1e-4)
    moved = report.fit.rig_from_foreign @ tracker.foreign_from_rig @ np.append(true[0, :3, 3], 1.0)
    np.testing.assert_allclose(moved[:3], true[0, :3, 3], atol=0.2e-3)


def test_on_another_thing_it_sits_at_its_origin(scene) -> None:
    shown = make_object(BoardShow(), scene)
    assert ForeignTracker(1).rows(shown, 0, TIMES_S[:5]).shape == (5, 7)
    np.testing.assert_array_equal(world_from_body(shown, 0, TIMES_S[:2]), shown.source.sample(TIMES_S[:2])[0])


def test_its_program_prints_what_the_twin_says_and_ends_with_it(scene, tmp_path) -> None:
    shown, tracker, asked = make_object(HandShow("roam"), scene), ForeignTracker(scene.seed), []

    def perform(request):
        assert isinstance(request, TrackerRequest)
        asked.append(request.since_ns)
        times_ns = [t_ns for t_ns in range(0, time.monotonic_ns(), 10_000_000)[-50:] if t_ns > request.since_ns]
        rows = tracker.rows(shown, 0, 1e-9 * np.array(times_ns, dtype=np.float64))
        return {"poses": list(zip(times_ns, rows.tolist(), strict=True))}

    server = TwinServer(tmp_path, perform)
    server.start()
    source, poses = open_source(f"run:{sys.executable} -m rhot_app.simulator.nodes.tracker {tmp_path}"), []
    eventually(lambda: poses.extend(source.poll()) or len(poses) > 30)
    assert source.name.endswith("SIM-1") and source.unreadable == 0
    steps_ns = np.diff([pose.t_master_ns for pose in poses])
    assert np.median(steps_ns) == pytest.approx(1e7, rel=0.05) and max(asked) > 0
    server.close()
    eventually(lambda: source.poll() is not None and source.ended)
    assert "gave no answer" in source.notice
    source.close()
