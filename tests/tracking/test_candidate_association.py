"""Which candidate is the marker: joint assignment by Mahalanobis distance, rays that meet, and a hand's reach."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from grasping_hand import INFERRED, MEASURED, REST, RIG
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment
from synthetic_rig import LOST, WIDE, Viewing, observe, run, seconds, still_trajectory

from rhot_app.geometry.camera import CameraModel
from rhot_app.project import with_tracker
from rhot_app.state import HandState
from rhot_app.tracking.association import GATE, MarkerAssociation, assign
from rhot_app.tracking.rig_arrays import compile_rig
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraObservations, Candidates
from rhot_app.tracking.trust import POSITION_SD_M
from rhot_node.wire.messages import MarkerFlag

MODELS = [CameraModel.from_rig(node.intrinsics, node.pose) for node in RIG.nodes]
AMBIGUOUS, ACQUIRED = int(MarkerFlag.AMBIGUOUS), int(MarkerFlag.ACQUIRED)


def with_further(frame: CameraObservations, markers: list[int], points_m: np.ndarray, *,
                 first: bool = False) -> CameraObservations:
    """The frame with things at `points_m` as further candidates; `first`: the node reports them before the marker."""
    pixels = MODELS[frame.camera].project(points_m)
    count = len(markers)
    own = frame.pixels.copy()
    if first:
        pixels, own[markers] = own[markers].copy(), pixels
    further = Candidates(np.array(markers), pixels, np.tile(1e-3 * np.eye(2), (count, 1, 1)), np.full(count, 16.0),
                         np.ones(count), np.zeros(count, np.uint16))
    return replace(frame, pixels=own, further=further)


KNOWN = {"classic": MEASURED, "estimator": INFERRED}  # a blob is paint that nobody measured


@given(st.integers(0, 2**31), st.integers(1, 6), st.integers(0, 9))
def test_the_assignment_is_the_cheapest_of_all(seed: int, markers: int, candidates: int) -> None:
    rng = np.random.default_rng(seed)
    predicted, pixels = rng.uniform(0, 20, (markers, 2)), rng.uniform(0, 20, (candidates, 2))
    root = rng.normal(size=(markers + candidates, 2, 2))
    covariances = root @ root.transpose(0, 2, 1) + 0.1 * np.eye(2)
    chosen, costs = assign(predicted, covariances[:markers], pixels, covariances[markers:],
                           np.zeros((markers, candidates)))
    for m in range(markers):
        totals = covariances[m] + covariances[markers:]
        smallest = min((np.linalg.det(total) for total in totals), default=1.0)
        for n, total in enumerate(totals):
            offset = pixels[n] - predicted[m]
            distance = offset @ np.linalg.inv(total) @ offset
            expected = distance + np.log(np.linalg.det(total) / smallest) if distance < GATE else 1e9
            assert costs[m, n] == pytest.approx(expected, rel=1e-9, abs=1e-9)
    paid = sum(GATE if n < 0 else costs[m, n] for m, n in enumerate(chosen))
    capped = np.hstack([costs, np.full((markers, markers), GATE)])
    rows, columns = linear_sum_assignment(capped)
    assert paid == pytest.approx(capped[rows, columns].sum())
    taken = chosen[chosen >= 0]
    assert len(set(taken.tolist())) == len(taken)


def test_markers_that_swap_names_are_told_apart_by_all_of_them_together() -> None:
    predicted = np.array([[100.0, 100.0], [104.0, 100.0]])
    pixels = np.array([[103.0, 100.0], [107.0, 100.0]])  # the first is nearer to the second marker
    chosen, _ = assign(predicted, np.tile(4.0 * np.eye(2), (2, 1, 1)), pixels, np.zeros((2, 2, 2)), np.zeros((2, 2)))
    assert chosen.tolist() == [0, 1]
    excluded = np.array([[np.inf, 0.0], [0.0, np.inf]])
    chosen, _ = assign(predicted, np.tile(4.0 * np.eye(2), (2, 1, 1)), pixels, np.zeros((2, 2, 2)), excluded)
    assert chosen.tolist() == [1, 0]


THING = REST[1] + np.array([0.2, -0.15, 0.5])  # of the index marker's colour, half a metre behind the hand


@pytest.mark.parametrize("kind", ["classic", "estimator"])
@pytest.mark.parametrize("first", [False, True])
def test_a_thing_behind_the_hand_is_not_the_marker(kind: str, first: bool) -> None:
    frames = [with_further(frame, [1], THING[None], first=first)
              for frame in observe(RIG, WIDE, still_trajectory(REST), 1.0, Viewing())]
    states = [state for state in run(make_tracker(with_tracker(RIG, kind)), frames) if seconds(state) > 0.3]
    assert all(state.marker_knowledge[1] == KNOWN[kind] for state in states)
    assert max(np.linalg.norm(state.marker_positions[1] - REST[1]) for state in states) < 2e-3


DECOYS = {  # of which marker's colour, and where, in m, from the marker
    "behind an index finger": (1, (0.2, -0.15, 0.5)), "beside an index finger": (1, (0.2, 0.05, 0.05)),
    "before a ring finger": (3, (0.1, 0.1, -0.15)), "behind the wrist": (5, (0.2, -0.15, 0.5)),
    "beside the wrist": (5, (0.15, 0.1, 0.0))}


def beside_things(kind: str, decoy: str, seed: int = 7) -> list[HandState]:
    """States of a still hand, one of whose markers is hidden for a second while two things have its colour."""
    marker, offset = DECOYS[decoy]
    thing = REST[marker] + np.array(offset)
    things = np.stack([thing, thing + np.array([-0.4, 0.0, 0.1])])
    frames = []
    for frame in observe(RIG, WIDE, still_trajectory(REST), 2.5, Viewing(seed=seed)):
        t_s = 1e-9 * frame.t_row0_master_ns - 5e5
        both = with_further(frame, [marker, marker], things)
        if 1.0 <= t_s < 2.0:  # hidden: the node reports the things, one of them as the best candidate
            pixels = both.pixels.copy()
            pixels[marker] = both.further.pixels[0]
            both = replace(both, pixels=pixels, further=both.further.of(np.arange(6)))
        frames.append(both)
    return run(make_tracker(with_tracker(RIG, kind)), frames)


@pytest.mark.parametrize("kind", ["classic", "estimator"])
@pytest.mark.parametrize("decoy", DECOYS)
def test_a_thing_does_not_take_the_place_of_a_hidden_marker(kind: str, decoy: str) -> None:
    states, marker = beside_things(kind, decoy), DECOYS[decoy][0]
    hidden = [state for state in states if 1.1 < seconds(state) < 1.95]
    others = [m for m in range(6) if m != marker]
    assert hidden and all(state.marker_knowledge[marker] != MEASURED for state in hidden)
    assert all((state.marker_knowledge[others] == KNOWN[kind]).all() for state in hidden)
    assert max(np.linalg.norm(state.marker_positions[others] - REST[others], axis=1).max() for state in hidden) < 5e-3
    assert states[-1].marker_knowledge[marker] in (KNOWN[kind], INFERRED)  # two candidates are near
    assert np.linalg.norm(states[-1].marker_positions[marker] - REST[marker]) < 2e-3


@pytest.mark.parametrize("seed", range(8, 12))
def test_no_noise_makes_a_thing_a_hidden_marker(seed: int) -> None:
    states = beside_things("estimator", "behind an index finger", seed)
    hidden = [state for state in states if 1.1 < seconds(state) < 1.95]
    assert max(np.linalg.norm(np.delete(state.marker_positions - REST, 1, axis=0), axis=1).max()
               for state in hidden) < 5e-3


VARIANCES = np.full(len(REST), POSITION_SD_M**2)


def association_of_a_still_hand() -> tuple[MarkerAssociation, CameraObservations]:
    return MarkerAssociation(compile_rig(RIG)), observe(RIG, WIDE, still_trajectory(REST), 0.1, Viewing())[0]


def test_a_second_candidate_as_near_makes_the_marker_ambiguous() -> None:
    association, frame = association_of_a_still_hand()
    beside = REST[2] + np.array([0.002, 0.0, 0.0])
    seen = association.select(with_further(frame, [2], beside[None]), REST, VARIANCES)
    assert [bool(flags & AMBIGUOUS) for flags in seen.flags] == [False, False, True, False, False, False]
    assert seen.further is None


def test_going_over_to_another_candidate_begins_another_track() -> None:
    association, frame = association_of_a_still_hand()
    here = association.select(with_further(frame, [1], THING[None]), REST, VARIANCES)
    assert not here.flags[1] & ACQUIRED
    moved = REST.copy()
    moved[1] = THING
    later = replace(frame, t_row0_master_ns=frame.t_row0_master_ns + 25_000_000)
    there = association.select(with_further(later, [1], THING[None]), moved, VARIANCES)
    assert there.flags[1] & ACQUIRED
    assert np.abs(there.pixels[1] - MODELS[frame.camera].project(THING[None])[0]).max() < 1e-9


def test_what_no_candidate_explains_is_lost_until_it_may_be_there() -> None:
    association, frame = association_of_a_still_hand()
    only_things = with_further(frame, [1], THING[None], first=True)
    only_things = replace(only_things, further=replace(only_things.further, pixels=MODELS[frame.camera].project(
        THING[None] + np.array([0.1, 0.1, 0.0]))))
    seen = association.select(only_things, REST, VARIANCES)
    assert seen.flags[1] == LOST and np.isnan(seen.pixels[1]).all()
    assert (seen.flags[[0, 2, 3, 4, 5]] == 0).all()


def test_a_frame_without_further_candidates_passes_as_it_is() -> None:
    association, frame = association_of_a_still_hand()
    assert association.select(frame, REST, VARIANCES) is frame
