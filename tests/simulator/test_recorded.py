"""Fitting the hand to recordings: a hand that is known comes back; real files fit; foreign files are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shipped_rig import RIGHT_MODEL as MODEL

from rhot_app.errors import SimulatorError
from rhot_app.hand.kinematics import forward
from rhot_app.hand.skeleton import HandPose
from rhot_app.simulator.scene.motion import FACING
from rhot_app.simulator.scene.motion_file import load_motion
from rhot_app.simulator.scene.recorded import Landmarks, fit_poses, read_landmarks

DATA = Path(__file__).parents[3] / "shared" / "data" / "hand_motion"
CENTRE = np.array([0.0375, 0.0, 0.6])


def recording_of_our_own_hand(missing: float) -> tuple[Landmarks, np.ndarray]:
    """Tip and middle of every finger and a triad on the back, from a known motion."""
    times = np.arange(0.0, 0.8, 0.01)
    transforms, angles = load_motion("grasp", MODEL, CENTRE, seed=3).sample(times)
    ends = np.array([pair for k in range(5) for pair in ((3 + 4 * k, 4 + 4 * k), (1 + 4 * k, 2 + 4 * k))])
    fraction = np.tile([0.75, 0.5], 5)
    joints = np.array([forward(MODEL, HandPose(t, a)).joints for t, a in zip(transforms, angles, strict=True)])
    points = (1 - fraction[:, None]) * joints[:, ends[:, 0]] + fraction[:, None] * joints[:, ends[:, 1]]
    back = np.array([[0.03, 0.01, 0.03], [0.05, -0.02, 0.03], [0.06, 0.02, 0.025]])
    rigid = (transforms[:, :3, :3] @ back.T).transpose(0, 2, 1) + transforms[:, None, :3, 3]
    rng = np.random.default_rng(1)
    points = points + rng.normal(0.0, 2e-4, points.shape)
    points[rng.random(points.shape[:2]) < missing] = np.nan
    return Landmarks(times, points, rigid, ends, fraction), joints


def test_a_known_hand_comes_back_although_markers_are_missing() -> None:
    landmarks, joints = recording_of_our_own_hand(missing=0.1)
    fit = fit_poses(landmarks, MODEL)
    assert fit.rms_m < 1.5e-3
    fitted = np.array([forward(MODEL, HandPose(t, a)).joints
                       for t, a in zip(fit.world_from_palm, fit.angles, strict=True)])
    tips = [4, 8, 12, 16, 20]
    assert np.sqrt(np.mean((fitted - joints)[:, tips] ** 2) * 3) < 4e-3
    assert (fit.angles >= MODEL.limits[:, 0]).all() and (fit.angles <= MODEL.limits[:, 1]).all()


@pytest.mark.parametrize("name", ["pinch.csv", "HandSplay-110fps.csv"])
def test_a_recording_becomes_a_motion_before_the_cameras(name: str) -> None:
    if not (DATA / name).exists():
        pytest.skip(f"{DATA / name} is not here")
    landmarks = read_landmarks(DATA / name, MODEL)
    step = max(1, len(landmarks.times_s) // 150)
    thin = Landmarks(landmarks.times_s[::step], landmarks.points[::step], landmarks.rigid[::step], landmarks.ends,
                     landmarks.fraction)
    assert fit_poses(thin, MODEL).rms_m < 12e-3
    motion = load_motion(str(DATA / name), MODEL, CENTRE, seed=0)
    transforms, _ = motion.sample(np.linspace(0.0, motion.period_s, 200))
    tips = (transforms @ np.array([0.085, 0.0, 0.0, 1.0]))[:, :3]
    assert np.allclose(tips.mean(axis=0), CENTRE, atol=0.01)
    assert (np.einsum("nij,ij->n", transforms[:, :3, :3], FACING) > 1.0).all()  # within 90 degrees of facing us


def test_qualisys_columns_and_gaps_are_understood() -> None:
    path = DATA / "qualisys_hand_30s.tsv"
    if not path.exists():
        pytest.skip(f"{path} is not here")
    landmarks = read_landmarks(path, MODEL)
    assert landmarks.points.shape[1:] == (10, 3) and landmarks.rigid.shape[1:] == (3, 3)
    assert np.isnan(landmarks.points[:, 0, 0]).mean() == pytest.approx(0.058, abs=0.005)
    assert np.allclose(np.diff(landmarks.times_s), 0.01)
    assert 0.05 < np.nanmedian(np.linalg.norm(landmarks.points[:, 2] - landmarks.points[:, 3], axis=1)) < 0.07


@pytest.mark.parametrize(("suffix", "text"), [
    (".tsv", "hello"), (".csv", "a,b\n1,2\n"), (".csv", ""),
    (".tsv", "MARKER_NAMES\ta\nFrame\tTime\ta X\ta Y\ta Z\n1\t0\t1\t2\tx\n"),
])
def test_a_foreign_file_is_refused_by_name(suffix: str, text: str, tmp_path: Path) -> None:
    path = tmp_path / f"foreign{suffix}"
    path.write_text(text)
    with pytest.raises(SimulatorError, match="foreign"):
        read_landmarks(path, MODEL)
