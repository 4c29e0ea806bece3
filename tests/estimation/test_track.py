"""The life of a track, and its filter in master time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from linear_motion import ConstantVelocity

from rhot_app.estimation.track import LOST_NS, PREDICTED_NS, SESSION_NS, WRONG_NS, Life, TrackFilter, comes_late

BEGUN_NS = 86_400 * 10**9


def test_a_track_that_nothing_has_shown_is_neither_alive_nor_was():
    life = Life()
    assert not life.alive and not life.ever and life.lost(0) and life.wrong(0) and life.predicted(0)


def test_a_track_lives_by_accepted_observations_and_ends_without_them():
    life = Life()
    life.begin(BEGUN_NS)
    life.observe(BEGUN_NS + LOST_NS)
    assert not life.lost(BEGUN_NS + 2 * LOST_NS) and life.lost(BEGUN_NS + 2 * LOST_NS + 1)
    assert life.predicted(BEGUN_NS + LOST_NS + PREDICTED_NS + 1)
    life.observe(BEGUN_NS)  # a late frame takes nothing back
    assert life.accepted_ns == BEGUN_NS + LOST_NS
    life.end()
    assert life.ever and not life.alive


def test_rejected_observations_do_not_keep_a_track():
    life = Life()
    life.begin(BEGUN_NS)
    life.observe(BEGUN_NS + LOST_NS + 1, accepted=False, plausible=False)
    assert life.lost(BEGUN_NS + LOST_NS + 1)
    life.begin(BEGUN_NS)
    life.observe(BEGUN_NS + WRONG_NS + 1, plausible=False)  # a few of many
    assert life.wrong(BEGUN_NS + WRONG_NS + 1) and not life.lost(BEGUN_NS + WRONG_NS + 1)


def test_slow_cameras_have_more_time():
    life = Life()
    life.begin(BEGUN_NS)
    assert not life.lost(BEGUN_NS + 2 * LOST_NS, period_ns=LOST_NS)
    assert not life.wrong(BEGUN_NS + 2 * WRONG_NS, period_ns=WRONG_NS)


@given(st.integers(-3 * SESSION_NS, 3 * SESSION_NS))
def test_only_a_frame_of_the_same_session_comes_late(back_ns: int):
    assert comes_late(BEGUN_NS - back_ns, BEGUN_NS) == (0 <= back_ns < SESSION_NS)


@given(st.integers(-10**9, 10**12))
def test_times_go_to_the_filter_and_back(after_ns: int):
    track = TrackFilter(ConstantVelocity(), BEGUN_NS)
    assert abs(track.time_ns(track.seconds(BEGUN_NS + after_ns)) - BEGUN_NS - after_ns) <= 1


def test_a_filter_predicts_at_master_times():
    track = TrackFilter(ConstantVelocity())
    state = np.zeros(2)
    state[1] = 1.0
    track.begin(BEGUN_NS, state, np.eye(2))
    assert track.newest_ns == BEGUN_NS and track.forgot(BEGUN_NS - 1) and not track.forgot(BEGUN_NS)
    assert track.predict_ns(BEGUN_NS + 10**9)[0][0] == pytest.approx(1.0)
