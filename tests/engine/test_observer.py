"""What the engine says of two hands in one word."""

from dataclasses import replace

import pytest
from test_engine_codec import make_state

from rhot_app.engine.advice import start_pose_advice
from rhot_app.engine.observer import condition_of
from rhot_app.state import Condition

TRACKING, PARTIAL, LOST, SEARCHING = Condition.TRACKING, Condition.PARTIAL, Condition.LOST, Condition.SEARCHING


@pytest.mark.parametrize(("hand", "other", "word"), [
    (TRACKING, None, TRACKING), (LOST, None, LOST), (TRACKING, TRACKING, TRACKING), (TRACKING, PARTIAL, PARTIAL),
    (TRACKING, LOST, PARTIAL), (LOST, TRACKING, PARTIAL), (SEARCHING, PARTIAL, PARTIAL), (LOST, LOST, LOST),
    (SEARCHING, SEARCHING, SEARCHING), (SEARCHING, LOST, LOST)])
def test_two_hands_are_all_there_only_when_both_are(hand, other, word):
    state = make_state()
    both = None if other is None else replace(state, condition=other)
    assert condition_of(replace(state, condition=hand, other=both)) is word


def test_a_hand_that_contours_have_not_found_is_told_to_take_the_pose_that_is_shown():
    state = make_state()
    (advice,) = start_pose_advice(replace(state, condition=SEARCHING, other=replace(state, condition=LOST)))
    assert "Take the pose" in advice.text and "white" in advice.text
    for told in (None, replace(state, condition=PARTIAL),
                 replace(state, condition=LOST, other=replace(state, condition=TRACKING))):
        assert start_pose_advice(told) == []
