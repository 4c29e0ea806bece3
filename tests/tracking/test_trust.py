"""What is believed of located markers, one decision at a time."""

import numpy as np
import pytest

from rhot_app.state import Knowledge
from rhot_app.tracking.locate import Places, empty_places
from rhot_app.tracking.trust import Targets, conclude, judge, no_tracks, no_verdicts

NOISE = np.eye(3)[None] * 1e-6


class Memory:
    """One marker's track."""

    def __init__(self) -> None:
        self.tracks, self.verdicts = no_tracks(1), no_verdicts(1)

    def judge(self, t_s, position, covariance=NOISE):
        judge(t_s, Places(np.array([position], float), covariance, np.zeros(1)), self.tracks, self.verdicts)
        return bool(self.verdicts.accepted[0]), bool(self.verdicts.restarted[0])

    def predict(self, t_s, origin=(0.0, 0.0, 0.0)):
        places, targets = empty_places(1), Targets(np.zeros((6, 3)), np.zeros(6, np.uint8))
        self.tracks["published"][0] = origin
        knowledge = conclude(t_s, self.tracks, no_verdicts(1), np.array([-1, 0, -1, -1, -1, -1]), places, targets)
        np.testing.assert_array_equal(targets.positions[1], places.positions[0])
        assert np.isnan(targets.positions[[0, 2, 3, 4, 5]]).all() and targets.knowledge[1] == knowledge[0]
        assert knowledge[0] == (Knowledge.UNKNOWN if np.isnan(places.positions).any() else Knowledge.INFERRED)
        return places.positions[0], places.covariances[0]


def test_a_new_marker_is_believed_and_starts_its_filters():
    memory = Memory()
    assert memory.judge(0.0, [0.1, 0.0, 0.6]) == (True, True)
    assert memory.judge(0.025, [0.11, 0.0, 0.6]) == (True, False)
    assert memory.judge(0.05, [np.nan] * 3) == (False, False)


@pytest.mark.parametrize("fps", [40.0, 120.0])
def test_the_fastest_hand_is_always_believed(fps):
    memory = Memory()
    times = np.arange(0.0, 2.0, 1.0 / fps)
    turn = 2 * np.pi * 4.0 * times
    path = np.column_stack([0.15 * np.sin(turn), 0.05 * np.cos(turn), np.full(len(times), 0.6)])
    assert np.abs(np.gradient(path[:, 0], times)).max() > 3.0
    assert all(memory.judge(t, p)[0] for t, p in zip(times, path, strict=True))


@pytest.mark.parametrize("jump", [(0.3, 0.1, 0.0), (0.0, 0.0, 1.0)])
def test_a_jump_is_believed_when_it_has_lasted(jump):
    memory = Memory()
    for k in range(10):
        memory.judge(0.025 * k, [0.0, 0.0, 0.6])
    there = np.array([0.0, 0.0, 0.6]) + jump
    verdicts = [memory.judge(0.25 + 0.025 * k, there) for k in range(4)]
    assert [believed for believed, _ in verdicts[:2]] == [False, False]
    assert (True, True) in verdicts[1:]
    assert verdicts[-1] == (True, False)


def test_a_glitch_is_forgotten():
    memory = Memory()
    for k in range(10):
        memory.judge(0.025 * k, [0.0, 0.0, 0.6])
    assert memory.judge(0.25, [0.3, 0.0, 0.6]) == (False, False)
    assert memory.judge(0.275, [0.001, 0.0, 0.6]) == (True, False)
    assert memory.judge(0.30, [0.3, 0.0, 0.6]) == (False, False)


def test_noise_that_is_stated_is_no_jump():
    for covariance, expected in ((NOISE, False), (NOISE * 3000.0, True)):
        memory = Memory()
        memory.judge(0.0, [0.0, 0.0, 1.0])
        memory.judge(0.025, [0.0, 0.0, 1.0])
        assert memory.judge(0.05, [0.0, 0.0, 1.2], covariance)[0] is expected


def test_after_half_a_second_any_place_is_believed():
    memory = Memory()
    memory.judge(0.0, [0.0, 0.0, 0.6])
    assert memory.judge(0.6, [0.5, 0.5, 1.5]) == (True, True)


def test_prediction_goes_on_at_constant_velocity_with_growing_doubt_and_ends():
    memory = Memory()
    for k in range(20):
        memory.judge(0.025 * k, [0.02 * k, 0.0, 0.6])
    last = np.array([0.38, 0.0, 0.6])
    near, near_covariance = memory.predict(0.475 + 0.05, last)
    far, far_covariance = memory.predict(0.475 + 0.2, last)
    np.testing.assert_allclose(near, last + np.array([0.04, 0.0, 0.0]), atol=1e-6)
    np.testing.assert_allclose(far, last + np.array([0.16, 0.0, 0.0]), atol=1e-6)
    assert np.trace(far_covariance) > 10 * np.trace(near_covariance) > 0
    assert np.isnan(memory.predict(0.475 + 0.26, last)[0]).all()
    assert np.isnan(Memory().predict(0.0)[0]).all()
