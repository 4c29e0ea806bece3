"""Rounding errors do not grow over time."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from synthetic_rig import WIDE, Viewing, altered, hand_trajectory, make_rig, observe, run

from rhot_app.tracking.markers.estimator import Estimator

SECONDS, PIXELS = 10.0, 1e-12


@cache
def frames(marker_loss):
    """Ten seconds of a hand that opens and closes."""
    rig = make_rig(bodies=True)
    viewing = replace(Viewing(), marker_loss=marker_loss)
    return rig, observe(rig, WIDE, hand_trajectory(rig, "grasp", SECONDS), SECONDS, viewing)


def perturbed(observations, sign):
    rng = np.random.default_rng(5)

    def change(t_s, camera, pixels, flags):
        pixels += PIXELS * (rng.choice([-1.0, 1.0], pixels.shape) if sign is None else sign)

    return altered(observations, change)


@pytest.mark.parametrize(("marker_loss", "sign"), [(0.0, 1.0), (0.3, None)])
def test_a_least_perturbation_of_all_pixels_moves_no_position(marker_loss, sign):
    """1e-12 px is a few roundings of a pixel's coordinate. 1e-6 m is far below the estimate's standard deviation."""
    rig, observations = frames(marker_loss)
    states, others = run(Estimator(rig), observations), run(Estimator(rig), perturbed(observations, sign))
    assert len(states) == len(others) > 700
    late = [(state, other) for state, other in zip(states, others, strict=True)
            if state.t_master_ns - states[0].t_master_ns > 9e9]
    assert len(late) > 50
    for state, other in late:
        assert state.condition == other.condition
        for name in ("marker_positions", "joint_positions", "fingertip_positions"):
            position, moved = getattr(state, name), getattr(other, name)
            assert np.isfinite(position).all()
            np.testing.assert_allclose(moved, position, rtol=0.0, atol=1e-6)
