"""Picking, moving, putting down and undoing; and the target test's arithmetic."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rhot_app.mouse.pick_scene import Ball, PickScene
from rhot_app.mouse.pointer import MouseState
from rhot_app.mouse.target_test import EFFECTIVE, TargetTest
from rhot_app.state import Condition

BALL = Ball("ball", (0.1, 0.0, 0.03), 0.03, (1, 2, 3))


def mouse(cursor, *pressed: str, t_s: float = 0.0) -> MouseState:
    return MouseState(round(1e9 * t_s), Condition.TRACKING, None if cursor is None else np.array(cursor, float),
                      frozenset(pressed))


def moved(scene: PickScene) -> None:
    """Carry the ball from its place to another one."""
    for state in (mouse((0.1, 0.0, 0.05)), mouse((0.1, 0.0, 0.05), "thumb"), mouse((0.0, 0.1, 0.15), "thumb"),
                  mouse((0.0, 0.1, 0.15))):
        scene.feed(state)


def held() -> PickScene:
    """The ball is held where it lay."""
    scene = PickScene((BALL,))
    scene.feed(mouse((0.1, 0.0, 0.05)))
    scene.feed(mouse((0.1, 0.0, 0.05), "thumb"))
    return scene


def test_a_ball_follows_the_cursor_while_the_thumb_holds_it() -> None:
    scene = PickScene((BALL,))
    moved(scene)
    assert scene.held is None
    assert scene.balls[0].centre == pytest.approx((0.0, 0.1, 0.13))


def test_only_near_balls_are_selected_and_a_thumb_spread_before_picks_nothing() -> None:
    scene = PickScene((BALL,))
    scene.feed(mouse((0.0, 0.0, 0.1), "thumb"))
    assert scene.selected is None
    scene.feed(mouse((0.1, 0.0, 0.03), "thumb"))
    assert scene.selected == 0 and scene.held is None


def test_a_ball_stays_above_the_ground() -> None:
    scene = held()
    scene.feed(mouse((0.1, 0.0, 0.0), "thumb"))
    assert scene.balls[0].centre[2] == pytest.approx(BALL.radius_m)


def test_the_little_finger_puts_a_ball_on_the_ground() -> None:
    scene = PickScene((BALL,))
    moved(scene)
    scene.feed(mouse((0.0, 0.1, 0.15), "little"))
    assert scene.balls[0].centre == pytest.approx((0.0, 0.1, 0.03))


def test_moves_are_undone_in_order_with_a_sentence_when_there_is_none() -> None:
    scene = PickScene((BALL,))
    assert "nothing to undo" in scene.undo()
    moved(scene)
    after = scene.balls[0]
    scene.feed(mouse((0.0, 0.1, 0.15), "little"))
    assert "back" in scene.undo() and scene.balls[0] == after
    assert "back" in scene.undo() and scene.balls[0] == BALL
    assert "nothing to undo" in scene.undo() and scene.balls[0] == BALL


def test_the_move_of_a_held_ball_cannot_be_undone() -> None:
    scene = PickScene((BALL,))
    moved(scene)
    scene.feed(mouse((0.0, 0.1, 0.15), "thumb"))
    assert "Let go" in scene.undo()
    assert scene.held == 0


def test_a_lost_hand_releases_the_ball_and_the_move_can_be_undone() -> None:
    scene = held()
    scene.feed(mouse((0.0, 0.0, 0.1), "thumb"))
    scene.feed(mouse((0.0, 0.0, 0.1)))  # what `Mouse` says of a hand that was lost
    assert scene.held is None
    scene.undo()
    assert scene.balls[0] == BALL


def test_throughput_of_clicks_with_a_known_spread() -> None:
    """Every way is clicked in half a second, in turn 5 mm short and 5 mm too far along it."""
    test, t_s = TargetTest(), 0.0
    before = test.targets[test.order[0]]
    while (wanted := test.wanted) is not None:
        way = test.targets[wanted] - before
        off = 0.0 if t_s == 0.0 else 0.005 * (-1.0) ** round(2.0 * t_s) * way / np.linalg.norm(way)
        before = test.targets[wanted]
        test.feed(mouse((*(before + off), 0.0), t_s=t_s))
        test.feed(mouse((*(before + off), 0.0), "thumb", t_s=t_s))
        t_s += 0.5
    found = test.result()
    beyond = 0.005 * (-1.0) ** np.arange(1, 10)
    assert found is not None and found.clicks == 9 and found.missed == 0
    assert found.movement_s == pytest.approx(0.5)
    assert found.effective_width_m == pytest.approx(EFFECTIVE * beyond.std(ddof=1))
    straight = np.linalg.norm(np.diff(test.targets[test.order], axis=0), axis=1).mean()
    assert found.bits_per_s == pytest.approx(math.log2(straight / found.effective_width_m + 1.0) / 0.5, rel=0.02)


def test_clicks_outside_the_target_are_missed() -> None:
    test, t_s = TargetTest(), 0.0
    while (wanted := test.wanted) is not None:
        t_s += 1.0
        for pressed in ((), ("thumb",)):
            test.feed(mouse((*(test.targets[wanted] + 0.03), 0.0), *pressed, t_s=t_s))
    found = test.result()
    assert found is not None and found.missed == found.clicks


def test_an_interruption_releases_a_held_ball_where_it_is() -> None:
    scene = held()
    scene.feed(mouse((0.0, 0.0, 0.1), "thumb"))
    scene.interrupt()
    left = scene.balls[0]
    assert scene.held is None and left.centre == pytest.approx((0.0, 0.0, 0.08))
    scene.feed(mouse((0.01, 0.0, 0.08), "thumb"))  # spread all the while
    scene.feed(mouse((-0.1, 0.1, 0.2), "thumb"))
    assert scene.balls[0] == left
    assert "back" in scene.undo() and scene.balls[0] == BALL
