"""The cursor and the buttons of the 3-D mouse, from states of a hand whose every part is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mouse_states import REST, SPREAD, hand_state, lost

from rhot_app.mouse.pointer import GROUND_M, POLE_M, Mouse, MouseSettings, palm_on_plane


def rested(settings: MouseSettings | None = None, **how) -> Mouse:
    """A mouse whose hand has been at rest."""
    mouse = Mouse(settings)
    for number in range(REST):
        mouse.feed(hand_state(number, **how))
    return mouse


def test_ten_states_a_second_suffice_for_a_resting_pose() -> None:
    """As many images as Rehg's mouse had."""
    mouse = Mouse()
    states = [mouse.feed(hand_state(number)) for number in range(0, 61, 10)]
    assert states[0].cursor is None and states[-1].cursor == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def test_a_hand_that_jumps_is_not_at_rest() -> None:
    """As one that was found wrongly at first."""
    mouse = Mouse()
    for number in range(REST + 5):
        state = mouse.feed(hand_state(number, (0.05, 0.03, 0.0) if number < 5 else (0.0, 0.0, 0.0)))
    assert state.cursor == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def test_a_hand_that_drifts_or_is_guessed_gives_no_origin() -> None:
    drifting, guessed = Mouse(), Mouse()
    for number in range(3 * REST):
        assert drifting.feed(hand_state(number, (1e-3 * number, 0.0, 0.0))).cursor is None
        state = guessed.feed(hand_state(number, unseen=("wrist",)))
        assert state.cursor is None and not state.observed and "palm" in state.needs[0]


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_palm_moves_the_cursor_over_the_ground_only(side: str) -> None:
    mouse = rested(side=side)
    state = mouse.feed(hand_state(REST, (0.02, -0.03, 0.0), side=side))
    assert state.cursor == pytest.approx([0.06, -0.09, 0.0], abs=1e-9)
    assert not state.pressed and not state.needs and state.observed


def test_the_index_finger_changes_the_height_only() -> None:
    mouse = rested()
    before, after = hand_state(REST), hand_state(REST + 1, index_mcp_flexion=5.0)
    lift = after.fingertip_positions[1, 2] - before.fingertip_positions[1, 2]
    assert lift > 0.01
    assert mouse.feed(after).cursor == pytest.approx([0.0, 0.0, MouseSettings().height_gain * lift], abs=1e-9)
    assert mouse.feed(hand_state(REST + 2, index_mcp_flexion=60.0)).cursor == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def test_the_cursor_stays_over_the_ground() -> None:
    mouse = rested(MouseSettings(height_from="palm"))
    far = mouse.feed(hand_state(REST, (9.0, -9.0, 9.0))).cursor
    assert far == pytest.approx([0.5 * GROUND_M[0], -0.5 * GROUND_M[1], POLE_M])


def test_the_palm_alone_suffices() -> None:
    unseen = ("index_tip", "thumb_tip", "little_tip")
    mouse = rested(MouseSettings(height_from="palm"), unseen=unseen)
    state = mouse.feed(hand_state(REST, (0.01, 0.0, 0.02), unseen=unseen))
    assert state.cursor == pytest.approx([0.03, 0.0, 0.12], abs=1e-9)
    assert len(state.needs) == 2 and "thumb" in state.needs[0] and "little" in state.needs[1]


def test_without_the_index_fingertip_the_height_stays_with_a_sentence() -> None:
    mouse = rested()
    height = mouse.feed(hand_state(REST, index_mcp_flexion=10.0)).cursor[2]
    state = mouse.feed(hand_state(REST + 1, (0.01, 0.0, 0.0), unseen=("index_tip",)))
    assert state.cursor == pytest.approx([0.03, 0.0, height], abs=1e-9)
    assert any("index fingertip" in sentence for sentence in state.needs) and not state.observed


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("button", ["thumb", "little"])
def test_a_spread_finger_presses_its_button_until_it_returns(button: str, side: str) -> None:
    mouse = rested(side=side)
    assert mouse.feed(hand_state(REST, side=side, **SPREAD[button])).pressed == {button}
    assert not mouse.feed(hand_state(REST + 1, side=side)).pressed


@pytest.mark.parametrize("button", ["thumb", "little"])
def test_a_button_has_hysteresis(button: str) -> None:
    mouse, full = rested(), SPREAD[button]
    (name, value), = full.items()
    between = {name: 0.45 * value}
    assert not mouse.feed(hand_state(REST, **between)).pressed
    assert mouse.feed(hand_state(REST + 1, **full)).pressed
    assert mouse.feed(hand_state(REST + 2, **between)).pressed


def test_a_guessed_or_uncertain_finger_presses_nothing() -> None:
    mouse, spread = rested(), SPREAD["thumb"]
    assert not mouse.feed(hand_state(REST, unseen=("thumb_tip",), **spread)).pressed
    assert not mouse.feed(hand_state(REST + 1, tip_sd_m=0.02, **spread)).pressed
    assert mouse.feed(hand_state(REST + 2, tip_sd_m=0.001, **spread)).pressed
    assert mouse.feed(hand_state(REST + 3, unseen=("thumb_tip",))).pressed, "a guess released the button"


def test_a_lost_hand_releases_the_buttons_and_the_cursor_stays() -> None:
    mouse = rested()
    before = mouse.feed(hand_state(REST, (0.02, 0.0, 0.0), **SPREAD["thumb"]))
    state = mouse.feed(lost(REST + 1))
    assert before.pressed and not state.pressed
    assert state.cursor == pytest.approx(before.cursor)
    assert "No hand is tracked" in state.needs[0]


def test_a_new_resting_pose_moves_the_origin() -> None:
    mouse = rested()
    mouse.rest()
    assert mouse.feed(hand_state(REST, (0.05, 0.02, 0.0))).cursor is None
    for number in range(REST + 1, 2 * REST + 1):
        state = mouse.feed(hand_state(number, (0.05, 0.02, 0.0)))
    assert state.cursor == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def test_a_known_table_defines_the_plane() -> None:
    tilted = [replace(state, world_from_palm=state.world_from_palm @ tilt(0.3)) for state in
              (hand_state(number) for number in range(REST))]
    mouse = Mouse(up=np.array([0.0, 0.0, 1.0]))
    for state in tilted:
        mouse.feed(state)
    moved = hand_state(REST, (0.01, 0.02, 0.5))
    moved = replace(moved, world_from_palm=moved.world_from_palm @ tilt(0.3))
    assert mouse.feed(moved).cursor[:2] == pytest.approx([0.03, 0.06], abs=1e-9)


def tilt(angle: float) -> np.ndarray:
    """Turn about the palm's y axis."""
    out = np.eye(4)
    out[:3, :3] = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    return out


def test_with_one_camera_the_palm_is_projected_to_the_table_along_the_line_of_sight() -> None:
    """The covariance is long along the line of sight; a palm that was put too far along it comes back."""
    sight = np.array([0.0, np.sqrt(0.5), -np.sqrt(0.5)])
    state = hand_state(0, tuple(0.03 * sight))
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = 1e-8 * np.eye(3) + 1e-3 * np.outer(sight, sight)
    state = replace(state, palm_covariance=covariance)
    found = palm_on_plane(state, np.zeros(3), np.array([0.0, 0.0, 1.0]))
    assert found == pytest.approx([0.0, 0.0, 0.0], abs=1e-5)
    state = replace(state, palm_covariance=np.full((6, 6), np.nan))
    plain = palm_on_plane(state, np.zeros(3), np.array([0.0, 0.0, 1.0]))
    assert plain == pytest.approx([0.0, 0.03 * np.sqrt(0.5), 0.0])
