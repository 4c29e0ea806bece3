"""The engine measures a hand's bones while landmarks of two cameras track it, offers them once, and changes nothing."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from landmark_detector import (
    EPOCH_NS,
    LandmarkErrors,
    detected_landmarks,
    landmark_rig,
    moving_hand,
)

from rhot_app.engine.rig_watch import BONES_JUDGE_NS, BonesWatch
from rhot_app.engine.status import Advice
from rhot_app.hand.skeleton import FINGERS
from rhot_app.project import Rig, parse_rig
from rhot_app.state import HandState
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraObservations

FPS, SECONDS = 30.0, 6.0
RIG = landmark_rig()
HAND = moving_hand(RIG, "grasp", SECONDS, FPS, 3, 0.15)
ERRORS = LandmarkErrors(anatomy=1e-3)
STATUS_NS = 100_000_000


def states_of(rig: Rig, frames: list[CameraObservations]) -> list[HandState]:
    """One for each of the engine's statuses."""
    tracker, states, due = make_tracker(rig), [], 0
    for frame in frames:
        tracker.ingest(frame)
        state = tracker.solve()
        if state is not None and state.t_master_ns >= due:
            states.append(state)
            due = state.t_master_ns + STATUS_NS
    return states


@pytest.fixture(scope="module")
def states() -> list[HandState]:
    return states_of(RIG, detected_landmarks(RIG, HAND, 1, ERRORS))


def told(watch: BonesWatch, states: list[HandState]) -> list[list[Advice]]:
    return [watch.advice(state, state.t_master_ns) for state in states]


def with_bones(rig: Rig, answer: dict) -> Rig:
    return parse_rig(msgspec.json.encode(answer["document"]), "the rig with measured bones")


def test_bones_that_differ_are_offered_once_with_their_spread(states: list[HandState]) -> None:
    watch = BonesWatch(RIG)
    sentences = told(watch, states)
    first = next(k for k, one in enumerate(sentences) if one)
    assert 1e-9 * (states[first].t_master_ns - EPOCH_NS) < 5.5, "after a few seconds"
    assert all(one == sentences[-1] for one in sentences[first:]), "in the same words"
    ((advice,),) = {tuple(one) for one in sentences[first:]}
    assert advice.mender == "measured" and "bones" in advice.text and "mm" in advice.text and advice.level == "info"
    answer = watch.measured()
    msgspec.json.encode(answer)
    assert answer["known"] and answer["grade"] != "poor" and len(answer["rows"]) == 6
    assert all("±" in after for _, _, after in answer["rows"])
    found = np.array([with_bones(RIG, answer).hand.fingers[name].bones_mm for name in FINGERS])
    assert np.sqrt(np.mean((found - 1e3 * HAND.model.bones) ** 2)) < 3.0
    later = [replace(state, sequence=state.sequence + 10_000,
                     t_master_ns=state.t_master_ns + 10 * BONES_JUDGE_NS) for state in states]
    assert not any(told(watch, later)), "it was shown"
    watch.restart()
    assert watch.measured() == {"known": False}
    assert not any(told(watch, states)), "the same hand again"


def test_a_rig_that_has_these_bones_is_left_in_peace(states: list[HandState]) -> None:
    watch = BonesWatch(RIG)
    told(watch, states)
    own = with_bones(RIG, watch.measured())
    again = BonesWatch(own)
    assert not any(told(again, states)) and again.measured()["known"], "the menu still shows them"
    others = states_of(own, detected_landmarks(own, HAND, 2, ERRORS))
    assert not any(told(BonesWatch(own), others)), "by other landmarks"


def slipping(state: HandState, rng: np.random.Generator) -> HandState:
    """The same hand, half as large in every other look."""
    return replace(state, marker_raw_positions=rng.choice([0.5, 1.0]) * state.marker_raw_positions)


@pytest.mark.parametrize("bad", ["one camera of two", "a rig of one camera", "too few instants", "slipping scale",
                                 "no landmarks"])
def test_what_does_not_show_the_bones_is_never_offered(bad: str, states: list[HandState]) -> None:
    rig, rng = RIG, np.random.default_rng(1)
    seen = [slipping(state, rng) for state in states]
    if bad == "one camera of two":
        seen = states_of(RIG, [frame for frame in detected_landmarks(RIG, HAND, 1, ERRORS) if frame.camera == 0])
    elif bad == "a rig of one camera":
        rig, seen = landmark_rig(1), states
    elif bad == "too few instants":
        seen = states[:25]
    elif bad == "no landmarks":
        markers = tuple(msgspec.structs.replace(one, role=None) for one in RIG.markers.markers)
        rig, seen = msgspec.structs.replace(RIG, markers=msgspec.structs.replace(RIG.markers, markers=markers)), states
    watch = BonesWatch(rig)
    assert not any(told(watch, seen))
    answer = watch.measured()
    assert not answer["known"] or answer["grade"] == "poor"
