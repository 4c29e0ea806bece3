"""Motions are smooth, human, inside the cameras' view, and differ by seed only in sway."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shipped_rig import RIGHT_MODEL as MODEL

from rhot_app.errors import RigError
from rhot_app.hand.kinematics import forward
from rhot_app.hand.skeleton import ANGLES, HandPose
from rhot_app.simulator.scene.motion import FACING
from rhot_app.simulator.scene.motion_file import load_motion, motion_names
from rhot_node.files import resource_path

CENTRE = np.array([0.0375, 0.0, 0.6])


def test_the_named_motions_are_there() -> None:
    expected = {"still", "rest", "wave", "grasp", "pinch", "point", "spread", "fast", "sweep", "cross", "tap", "roam"}
    assert expected <= set(motion_names())


@pytest.mark.parametrize("name", motion_names())
def test_markers_stay_in_view_of_both_wide_cameras_at_each_distance(name: str) -> None:
    focal = 320.0 / np.tan(np.radians(31.1))
    for distance in (0.4, 0.6, 1.0) if name not in ("fast", "roam", "brisk") else (0.6, 1.0):
        motion = load_motion(name, MODEL, np.array([0.0375, 0.0, distance]), seed=2)
        transforms, angles = motion.sample(np.arange(0.0, max(8.0, motion.period_s), 0.05))
        points = np.array([[*forward(MODEL, HandPose(t, a)).marker_centres, t[:3, 3]]
                           for t, a in zip(transforms, angles, strict=True)])
        for camera_x in (0.0, 0.075):
            px = focal * (points[..., 0] - camera_x) / points[..., 2]
            py = focal * points[..., 1] / points[..., 2]
            assert np.abs(px).max() < 320 - 25 * 0.6 / distance, (name, distance)
            assert np.abs(py).max() < 240 - 25 * 0.6 / distance, (name, distance)


@pytest.mark.parametrize("name", motion_names())
def test_poses_are_smooth_and_within_limits(name: str) -> None:
    motion = load_motion(name, MODEL, CENTRE, seed=1)
    step = 1e-3
    times = np.arange(0.0, motion.period_s + 0.5, step)
    values = motion.curve(np.mod(times, motion.period_s))
    acceleration = np.diff(values, 2, axis=0) / step**2
    jumps = np.abs(np.diff(acceleration, axis=0)).max(axis=0)
    assert (jumps <= 0.08 * np.abs(acceleration).max(axis=0) + 0.5).all()
    transforms, angles = motion.sample(times[::10])
    assert (angles >= MODEL.limits[:, 0]).all() and (angles <= MODEL.limits[:, 1]).all()
    rotations = transforms[:, :3, :3]
    assert np.allclose(rotations @ rotations.transpose(0, 2, 1), np.eye(3), atol=1e-12)


def test_fast_peaks_at_two_metres_per_second() -> None:
    motion = load_motion("fast", MODEL, CENTRE, seed=1)
    times = np.arange(0.0, 4.0, 1e-3)
    positions = motion.sample(times)[0][:, :3, 3]
    speed = np.linalg.norm(np.gradient(positions, 1e-3, axis=0), axis=1)
    assert speed.max() == pytest.approx(2.0, abs=0.1)


def test_sweep_moves_every_joint_far_and_takes_about_a_minute() -> None:
    motion = load_motion("sweep", MODEL, CENTRE, seed=1)
    assert 50.0 < motion.period_s < 70.0
    times = np.arange(0.0, motion.period_s, 0.05)
    transforms, angles = motion.sample(times)
    swing = np.degrees(np.ptp(angles, axis=0))
    for name, degrees in zip(ANGLES, swing, strict=True):
        least = 6.0 if name == "middle_mcp_abduction" else 15.0
        assert degrees > (least if "abduction" in name else 40.0), name
    turns = Rotation.from_matrix(transforms[:, :3, :3] @ FACING.T).as_rotvec(degrees=True)
    assert (np.ptp(turns, axis=0) > 35.0).all()


def test_still_is_still_and_faces_the_cameras() -> None:
    motion = load_motion("still", MODEL, CENTRE, seed=5)
    transforms, angles = motion.sample(np.linspace(0.0, 20.0, 50))
    assert np.ptp(transforms, axis=0).max() < 1e-12 and np.ptp(angles, axis=0).max() < 1e-12
    assert np.allclose(transforms[0, :3, :3], FACING)
    points = forward(MODEL, HandPose(transforms[0], angles[0]))
    assert points.joints[:, 1].min() < transforms[0, 1, 3] - 0.1  # fingers up: image y falls


def test_seeds_differ_in_sway_by_what_the_file_says() -> None:
    times = np.linspace(0.0, 200.0, 4000)
    a, b = (load_motion("rest", MODEL, CENTRE, seed=s) for s in (1, 2))
    again = load_motion("rest", MODEL, CENTRE, seed=1)
    assert np.array_equal(a.sample(times)[0], again.sample(times)[0])
    assert not np.allclose(a.sample(times)[0], b.sample(times)[0])
    assert a.sway(times)[:, :3].std() == pytest.approx(2e-3, rel=0.1)


@pytest.mark.parametrize(("change", "message"), [
    ({"keys": [{"t_s": 0.0, "angles_deg": {"nose": 1}}]}, "nose"),
    ({"keys": [{"t_s": 1.0}, {"t_s": 0.5}]}, "increase"),
    ({"keys": []}, "keys"),
    ({"version": 2}, "version"),
    ({"period_s": "long"}, "period_s"),
])
def test_a_wrong_motion_file_is_refused_by_field(change: dict, message: str, tmp_path: Path) -> None:
    document = json.loads(resource_path("motions", "wave.json").read_text()) | change
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(document))
    with pytest.raises(RigError, match=message):
        load_motion(str(path), MODEL, CENTRE, seed=0)


def test_base_angles_hold_where_a_key_names_no_other() -> None:
    motion = load_motion("still", MODEL, CENTRE, seed=0)
    document = json.loads(resource_path("motions", "still.json").read_text())
    for name, degrees in document["base_deg"].items():
        assert np.degrees(motion.pose(0.3).angles[ANGLES.index(name)]) == pytest.approx(degrees)
