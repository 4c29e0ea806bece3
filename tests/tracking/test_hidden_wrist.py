"""A hand whose wrist is out of sight: its fingertips are where they are seen, the rest is doubted more and more."""

from __future__ import annotations

import numpy as np
import pytest
from grasping_hand import GRASP, MEASURED, RIG, UNKNOWN, VIEWING
from synthetic_rig import WIDE, altered, hidden, observe, run, seconds

from rhot_app.state import HandState, Knowledge
from rhot_app.tracking.scene import make_tracker

WRIST = 5


def states_without_wrist(since_s: float, until_s: float, tips: int, length_s: float = 3.0) -> list[HandState]:
    """What the tracker says when only the first `tips` fingertips are seen from `since_s` to `until_s`."""
    frames = observe(RIG, WIDE, GRASP, length_s, VIEWING)
    return run(make_tracker(RIG), altered(frames, hidden(slice(tips, None), since_s, until_s)))


def tip_errors_m(state: HandState, tips: int, knowledge: Knowledge = Knowledge.MEASURED) -> np.ndarray:
    assert (state.marker_knowledge[:tips] == knowledge).all()
    return np.linalg.norm(state.fingertip_positions - GRASP(np.array([seconds(state)]))[0, :5], axis=1)[:tips]


@pytest.mark.parametrize("tips", [1, 3, 5])
def test_measured_fingertips_stay_where_they_are_seen(tips: int) -> None:
    states = [s for s in states_without_wrist(1.0, 9.0, tips) if seconds(s) > 1.05]
    assert states[-1].marker_knowledge[WRIST] == UNKNOWN
    assert max(tip_errors_m(s, tips).max() for s in states) < 5e-3
    assert all(np.isfinite(s.joint_positions).all() for s in states)


def test_the_doubt_about_the_rest_grows() -> None:
    states = states_without_wrist(1.0, 9.0, tips=5)
    soon, late = (next(s for s in states if seconds(s) > t) for t in (1.4, 1.9))
    assert (soon.angle_knowledge == Knowledge.INFERRED).all() and soon.joint_knowledge[0] == Knowledge.GUESSED
    assert (late.angle_knowledge == Knowledge.GUESSED).all() and (late.joint_knowledge == Knowledge.GUESSED).all()
    few = next(s for s in states_without_wrist(1.0, 9.0, tips=3) if seconds(s) > 1.4)
    assert (few.angle_knowledge == Knowledge.GUESSED).all() and (few.joint_knowledge == Knowledge.GUESSED).all()


@pytest.mark.parametrize(("tips", "joints"), [(2, Knowledge.UNKNOWN), (5, Knowledge.GUESSED)])
def test_fingertips_are_told_before_the_wrist_was_ever_seen(tips: int, joints: Knowledge) -> None:
    last = states_without_wrist(-1.0, 9.0, tips, 0.5)[-1]
    # Two markers that were never seen with a third may be two things.
    assert tip_errors_m(last, tips, Knowledge.INFERRED if tips < 3 else MEASURED).max() < 3e-3
    assert np.isfinite(last.fingertip_positions[:, 0]).sum() == (tips if joints == Knowledge.UNKNOWN else 5)
    assert (last.joint_knowledge == joints).all()


def test_the_hand_is_found_again_with_its_wrist() -> None:
    """Two tips let the palm drift far away; nothing of that must be left once the wrist is back."""
    always, again = states_without_wrist(9.0, 9.0, 5)[-1], states_without_wrist(0.5, 2.5, 2)[-1]
    assert (again.marker_knowledge == MEASURED).all()
    assert np.linalg.norm(again.joint_positions - always.joint_positions, axis=1).max() < 0.02
    assert (again.angle_knowledge == Knowledge.INFERRED).all()
