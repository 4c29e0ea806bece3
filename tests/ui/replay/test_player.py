"""The player: which state is shown while it plays, steps, repeats and stands still."""

from __future__ import annotations

import numpy as np
import pytest

from rhot_app.ui.replay.session import Player, time_text


@pytest.fixture
def player():
    """Ten seconds, ten states a second, none between 4 and 8 s."""
    times = np.arange(0.0, 10.05, 0.1)
    return Player(times[(times <= 4.0) | (times >= 8.0)])


def test_it_plays_in_time_and_stops_at_the_end(player):
    player.play(100.0)
    player.advance(101.25)
    assert player.position_s == pytest.approx(1.25) and player.number == 12
    player.set_speed(4.0, 101.25)
    player.advance(102.25)
    assert player.position_s == pytest.approx(5.25)
    player.advance(200.0)
    assert player.at_end and not player.playing and player.number == 61
    player.toggle(300.0)
    assert player.playing and player.position_s == 0.0


def test_a_change_of_speed_moves_nothing(player):
    player.play(0.0)
    player.set_speed(0.1, 2.0)
    assert player.position_s == pytest.approx(2.0)
    player.advance(4.0)
    assert player.position_s == pytest.approx(2.2)


def test_a_hand_is_not_shown_where_the_recording_has_none(player):
    player.seek(4.9)
    assert player.shown == 40
    player.seek(6.0)
    assert player.shown is None and player.number == 40


def test_steps_go_from_state_to_state_and_pause(player):
    player.play(0.0)
    player.advance(0.33)
    player.step(1)
    assert not player.playing and player.position_s == pytest.approx(0.4)
    player.step(-2)
    assert player.position_s == pytest.approx(0.2)
    player.seek(4.0)
    player.step(1)
    assert player.position_s == pytest.approx(8.0)
    player.step(1000)
    assert player.at_end
    player.step(-1000)
    assert player.position_s == 0.0


def test_a_range_is_repeated(player):
    player.seek(1.0)
    player.begin_loop()
    player.seek(2.0)
    player.end_loop()
    assert player.loop == (1.0, 2.0)
    player.seek(1.5)
    player.play(0.0)
    player.advance(0.75)
    assert player.position_s == pytest.approx(1.25)
    player.seek(3.0)
    player.advance(1.0)
    assert player.position_s == pytest.approx(3.25), "who goes past the range is not called back"
    player.clear_loop()
    player.seek(1.9)
    player.advance(1.5)
    assert player.position_s == pytest.approx(2.4)


def test_ends_of_a_range_may_be_set_in_any_order(player):
    player.seek(9.0)
    player.end_loop()
    assert player.loop == (0.0, 9.0)
    player.seek(9.5)
    player.begin_loop()
    assert player.loop == (9.5, player.duration_s)
    player.end_loop()
    assert player.loop == (0.0, 9.5)


def test_a_range_that_ends_with_the_recording_is_repeated(player):
    player.seek(9.0)
    player.begin_loop()
    player.play(0.0)
    player.advance(1.5)
    assert player.playing and player.position_s == pytest.approx(9.5)


@pytest.mark.parametrize(("seconds", "text"), [(0.0, "0:00.00"), (59.999, "1:00.00"), (62.345, "1:02.34")])
def test_times_are_told_in_minutes(seconds, text):
    assert time_text(seconds) == text
