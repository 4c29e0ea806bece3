"""The figures of merit on states whose errors are known by construction."""

from __future__ import annotations

import numpy as np
import pytest

from rhot_app.evaluation.score import TrueSamples, count_swaps, score, state_ages
from rhot_app.filters.jitter import scatter
from rhot_app.hand.skeleton import ANGLES, JOINTS, TIP_ROLES
from rhot_app.state import UNESTIMATED, Condition, HandState, Knowledge

ROLES = [*TIP_ROLES, "wrist"]
IDS = ("thumb", "index", "middle", "ring", "little", "wrist")


def make_state(k: int, truth: np.ndarray, offset_mm: float, knowledge: int = Knowledge.MEASURED) -> HandState:
    position = truth + np.array([offset_mm * 1e-3, 0.0, 0.0])
    return HandState(
        sequence=k, t_master_ns=25_000_000 * k, t_receive_ns=25_000_000 * k + 30_000_000, condition=Condition.TRACKING,
        marker_ids=IDS, marker_positions=position, marker_raw_positions=position,
        marker_covariances=np.zeros((6, 3, 3)), marker_knowledge=np.full(6, knowledge, np.uint8),
        camera_names=("left", "right"), camera_pixels=np.zeros((2, 6, 2)), camera_flags=np.zeros((2, 6), np.uint16),
        joint_positions=np.zeros((len(JOINTS), 3)), joint_knowledge=np.zeros(len(JOINTS), np.uint8),
        fingertip_positions=position[:5] + np.array([0.0, 1e-3, 0.0]), angles=np.full(len(ANGLES), 0.1),
        angle_knowledge=np.zeros(len(ANGLES), np.uint8), world_from_palm=np.eye(4), palm_knowledge=Knowledge.GUESSED,
        epipolar_error_px=np.zeros(6), **UNESTIMATED, latency_s={"receive_to_state": 0.002})


@pytest.fixture
def truth() -> np.ndarray:
    return np.array([[0.02 * k, 0.0, 0.6] for k in range(6)])


def run(states: list[HandState], truth: np.ndarray, visible: float = 1.0) -> dict:
    n = len(states)
    return score(states, TrueSamples(np.tile(truth, (n, 1, 1)), np.zeros((n, len(ANGLES))),
                                     np.full((n, 6), visible)), ROLES)


def test_known_offsets_come_out_as_they_went_in(truth: np.ndarray) -> None:
    figures = run([make_state(k, truth, 2.0) for k in range(41)], truth)
    assert figures["marker_rms_mm"] == pytest.approx(2.0)
    assert figures["wrist_rms_mm"] == pytest.approx(2.0)
    assert figures["fingertip_rms_mm"] == pytest.approx(np.sqrt(5.0))
    assert figures["joint_rms_deg"] == pytest.approx(np.degrees(0.1))
    assert figures["measured_fraction"] == 1.0
    assert figures["state_rate_hz"] == pytest.approx(40.0)
    assert figures["state_age_ms"]["p50"] == pytest.approx(32.0)
    assert figures["marker_jitter_unfiltered_mm_each"]["thumb"] == pytest.approx(0.0, abs=1e-9)
    assert figures["swaps"] == 0


def test_only_measured_samples_count_towards_errors(truth: np.ndarray) -> None:
    states = [make_state(k, truth, 1.0) for k in range(10)]
    states += [make_state(10 + k, truth, 50.0, Knowledge.INFERRED) for k in range(10)]
    figures = run(states, truth)
    assert figures["marker_rms_mm"] == pytest.approx(1.0)
    assert figures["measured_fraction"] == pytest.approx(0.5)


def test_hidden_samples_do_not_lower_the_measured_fraction(truth: np.ndarray) -> None:
    figures = run([make_state(k, truth, 0.0, Knowledge.UNKNOWN) for k in range(5)], truth, visible=0.3)
    assert figures["measured_fraction"] is None
    assert figures["marker_rms_mm"] is None


def test_swap_needs_three_states_in_a_row(truth: np.ndarray) -> None:
    positions = np.tile(truth, (10, 1, 1))
    positions[2:4, 0] = truth[1]
    assert count_swaps(positions, np.tile(truth, (10, 1, 1))) == 0
    positions[4, 0] = truth[1]
    assert count_swaps(positions, np.tile(truth, (10, 1, 1))) == 1


def test_jitter_ignores_bias() -> None:
    rng = np.random.default_rng(1)
    errors = rng.normal(0.0, 0.3e-3, (20000, 3)) + 5e-3
    assert scatter(errors) == pytest.approx(0.3e-3 * np.sqrt(3.0), rel=0.02)


def test_age_of_the_last_state_is_unknown(truth: np.ndarray) -> None:
    ages = state_ages([make_state(k, truth, 0.0) for k in range(3)])
    assert ages[:2] == pytest.approx(0.032)
    assert np.isnan(ages[2])
