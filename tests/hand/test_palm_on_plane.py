"""A palm that slides on a plane, as a residual, and a hand whose joints are held."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from shipped_rig import RIGHT_MODEL as MODEL

from rhot_app.estimation.se3 import exp_so3
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.model import with_locked
from rhot_app.hand.motion.hand_process import FASTEST, PALM_SPREAD, SLOWEST, HandProcess
from rhot_app.hand.motion.palm_on_plane import HEIGHT_SD_M, TILT_SD_RAD, PalmOnPlane
from rhot_app.hand.skeleton import ANGLES
from rhot_app.project import PalmPlane, TrackerSettings

PLANE = PalmOnPlane(PalmPlane((0.3, -2.0, 0.7), 0.2))


def process() -> HandProcess:
    dh: DhArrays = MODEL.dh._replace(point_row=MODEL.dh.point_row[:0], point_offset=MODEL.dh.point_offset[:0])
    prior = MODEL.pose_prior
    return HandProcess(dh, MODEL.limits, prior.mean, np.linalg.inv(prior.information), PALM_SPREAD, SLOWEST, FASTEST,
                       np.zeros((2, 3, 3)), 1.0)


def world(turn: np.ndarray, place: np.ndarray) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = turn, place
    return out


def test_its_jacobian_is_that_of_finite_differences() -> None:
    own, rng = process(), np.random.default_rng(1)
    turn = exp_so3(rng.normal(size=3))
    state, _ = own.start(world(turn, rng.normal(size=3)), MODEL.pose_prior.mean, (0.1, 0.1))
    rows, step = PLANE.linearise(state), 1e-6
    for column in range(own.size):
        moved = own.retract(state, step * np.eye(own.size)[column])
        slope = -(PLANE.linearise(moved).error - rows.error) / step  # the error is observed less predicted
        assert slope == pytest.approx(rows.jacobian[:, column], abs=1e-5), column


def test_a_palm_on_the_plane_has_no_error_however_it_is_turned() -> None:
    own = process()
    for turn in PLANE.turns(7):
        state, _ = own.start(world(turn, 0.2 * PLANE.normal + np.cross(PLANE.normal, [0.1, 0.4, 0.2])),
                             MODEL.pose_prior.mean, (0.1, 0.1))
        assert PLANE.linearise(state).error == pytest.approx(np.zeros(3), abs=1e-12)


def test_a_covariance_is_narrowed_across_the_plane_and_not_along_it() -> None:
    wide = np.eye(27)
    narrow = PLANE.narrowed(wide)
    along = np.cross(PLANE.normal, [1.0, 0.0, 0.0])
    along /= np.linalg.norm(along)
    assert PLANE.normal @ narrow[:3, :3] @ PLANE.normal == pytest.approx(HEIGHT_SD_M**2, rel=1e-3)
    assert along @ narrow[3:6, 3:6] @ along == pytest.approx(TILT_SD_RAD**2, rel=1e-2)
    assert along @ narrow[:3, :3] @ along == pytest.approx(1.0)
    assert PLANE.normal @ narrow[3:6, 3:6] @ PLANE.normal == pytest.approx(1.0)


def test_a_ray_meets_the_plane_before_it_and_never_behind() -> None:
    met = PLANE.met_by(np.zeros(3), PLANE.normal + 0.1)
    assert met is not None and PLANE.normal @ met == pytest.approx(0.2)
    assert PLANE.met_by(np.zeros(3), -PLANE.normal) is None


def test_held_joints_are_expected_where_they_are_held() -> None:
    held = with_locked(MODEL, {"middle_pip_flexion": 70.0, "ring_mcp_flexion": -5.0})
    mean, covariance = np.degrees(held.pose_prior.mean), np.linalg.inv(held.pose_prior.information)
    for name, value in (("middle_pip_flexion", 70.0), ("ring_mcp_flexion", -5.0)):
        assert mean[ANGLES.index(name)] == pytest.approx(value, abs=1.0)
        assert np.degrees(np.sqrt(covariance[ANGLES.index(name), ANGLES.index(name)])) <= 2.0
    about = with_locked(MODEL, {"index_mcp_flexion": (40.0, 6.0)})
    covariance = np.linalg.inv(about.pose_prior.information)[6, 6]
    assert ANGLES[6] == "index_mcp_flexion" and not about.locked
    assert np.degrees(about.pose_prior.mean[6]) == pytest.approx(40.0, abs=3.0)
    assert 4.0 < np.degrees(np.sqrt(covariance)) < 6.0
    assert with_locked(MODEL, {}).pose_prior.mean == pytest.approx(MODEL.pose_prior.mean)


@pytest.mark.parametrize("tracker", ['{"locked_deg": {"middle_pip": 3.0}}', '{"palm_plane": {"normal": [0, 0, 0], '
                                     '"distance_m": 0.1}}'])
def test_what_cannot_be_held_is_refused(tracker: str) -> None:
    with pytest.raises(msgspec.ValidationError, match=r"joint angle|normal"):
        msgspec.json.decode(tracker, type=TrackerSettings)
