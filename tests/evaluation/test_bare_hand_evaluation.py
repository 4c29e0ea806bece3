"""The evaluation without markers: a tracker of known noise gets known figures, and is given nothing but pictures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from fake_bare_hand import FakeBareHand

from rhot_app.evaluation import bare_hand
from rhot_app.evaluation.bare_hand import CASES, Case, figures_of, run_sequence
from rhot_app.evaluation.bare_hand_table import bare_hand_fields, bare_hand_table
from rhot_app.simulator.bare_hand.sequence import (
    BareHandFrame,
    BareHandOptions,
    BareHandSequence,
    bare_hand_rig,
    bare_hand_sequence,
)

SECONDS = 3.0


class Unrendered(BareHandSequence):
    """A sequence whose pictures are grey."""

    def frames(self) -> Iterator[BareHandFrame]:
        """As of the real one, at no cost."""
        grey = np.full((4, 4, 3), 128, np.uint8)
        for times in self.times_ns:
            lost = [any(c == k and a <= 1e-9 * t < b for c, a, b in self.options.lost) for k, t in enumerate(times)]
            yield BareHandFrame(tuple(None if gone else grey for gone in lost), times,
                                self.truth_at(sum(times) // len(times)))


def sequence(case: Case, seed: int = 1) -> BareHandSequence:
    options = replace(case.options, lost=tuple((camera, *bare_hand.LOSS_S) for camera in case.lost))
    made = bare_hand_sequence(bare_hand_rig(), "rest", SECONDS, 30.0, seed, options)
    return Unrendered(**{name: getattr(made, name) for name in made.__dataclass_fields__})


def run(case: Case, **options: float) -> tuple[bare_hand.EvaluatedRun, FakeBareHand]:
    filmed = sequence(case)
    tracker = FakeBareHand(filmed.truth_at, **options)  # type: ignore[arg-type]
    return run_sequence(case, filmed, lambda rig, case: tracker), tracker


def test_known_noise_gets_known_figures() -> None:
    result, _ = run(CASES[0], joint_sd=2e-3, angle_sd=0.05)
    figures = figures_of([result])
    mean_of_norm = 2.0 * 2.0 * np.sqrt(2.0 / np.pi)  # of a normal vector in three dimensions of 2 mm each
    assert figures["joint_mm_median"] == pytest.approx(mean_of_norm, rel=0.05)
    assert figures["angle_deg_median"] == pytest.approx(np.degrees(0.05 * np.sqrt(2.0 / np.pi)), rel=0.1)
    assert figures["within_3_sd"] == pytest.approx(0.9973, abs=0.01)
    assert figures["lost_part"] == 0.0 and figures["start_s_median"] == 0.0


def test_one_that_is_twenty_millimetres_off_has_lost_the_hand() -> None:
    figures = figures_of([run(CASES[0], joint_sd=30e-3)[0]])
    assert figures["lost_part"] == 1.0 and figures["started"] == 0.0


@pytest.mark.parametrize(("age_s", "lost"), [(0.06, 0.0), (0.08, 1.0)])
def test_live_a_state_may_be_two_pictures_old(age_s: float, lost: float) -> None:
    """It is judged by the truth at its own time."""
    case = next(case for case in CASES if case.live)
    assert case.start == "shown"
    assert figures_of([run(case, finds_after=20, age_s=age_s)[0]])["lost_part"] == lost


def test_a_shown_start_is_timed_from_the_whole_hand_in_view() -> None:
    case = next(case for case in CASES if case.start == "shown")
    result, tracker = run(case, finds_after=60)
    assert tracker.given is None, "the rig says what is shown"
    first = np.argmax([sequence(case).truth_at(t[0]).in_view for t in sequence(case).times_ns])
    assert 0 < first < 60, "the hand is not there at first"
    assert result.start_s == pytest.approx((60 - first) / 30.0, abs=0.07)
    never, _ = run(case)
    assert np.isnan(never.start_s) and figures_of([never])["lost_part"] == 1.0


def test_lost_pictures_are_none_and_frames_without_any_are_lost() -> None:
    both = next(case for case in CASES if case.lost == (0, 1))
    result, tracker = run(both)
    gaps = sum(all(image is None for image in images) for images in tracker.seen)
    assert gaps == 15
    assert figures_of([result])["lost_part"] == pytest.approx(15 / result.judged.sum(), abs=0.02)
    one = next(case for case in CASES if case.lost == (1,))
    result, tracker = run(one)
    assert sum(images[1] is None and images[0] is not None for images in tracker.seen) == 15
    assert figures_of([result])["lost_part"] == 0.0


def test_a_random_start_is_near_the_true_pose_and_another_for_each_seed() -> None:
    case = next(case for case in CASES if case.name == "random start")
    poses = []
    for seed in (1, 2):
        filmed = sequence(case, seed)
        tracker = FakeBareHand(filmed.truth_at)
        run_sequence(case, filmed, lambda rig, case, tracker=tracker: tracker)  # type: ignore[misc]
        assert tracker.given is not None
        pose, t_ns = tracker.given
        poses.append(pose.world_from_palm[:3, 3] - filmed.truth_at(t_ns).world_from_palm[:3, 3])
    assert all(1e-3 < np.linalg.norm(off) < 0.08 for off in poses) and np.abs(poses[0] - poses[1]).max() > 1e-3


def test_a_tracker_gets_pictures_times_and_a_rig_that_is_not_the_true_one() -> None:
    case = Case("wrong", BareHandOptions(length_sd=0.05, radius_sd=0.08, calibration_deg=0.2, calibration_mm=1.0))
    filmed, given = sequence(case), []
    tracker = FakeBareHand(filmed.truth_at)
    run_sequence(case, filmed, lambda rig, case: given.append(rig) or tracker)  # type: ignore[func-returns-value]
    (rig,) = given
    assert rig.nodes[1].pose != filmed.rig.nodes[1].pose and rig.hand != filmed.model.anatomy
    assert rig.hand == filmed.rig.hand, "it knows a mean hand"
    assert all(isinstance(image, np.ndarray) for images in tracker.seen for image in images)


def test_one_camera_alone_sees_one_picture_of_a_rig_of_one() -> None:
    case = next(case for case in CASES if case.cameras == 1)
    result, tracker = run(case)
    assert {len(images) for images in tracker.seen} == {1}
    assert figures_of([result])["image_px_median"] is not None


def test_table_and_fields_name_every_case_and_the_published_figures() -> None:
    found = [(case, [run(case)[0]]) for case in CASES[:2]]
    text, fields = bare_hand_table(found), bare_hand_fields(found, SECONDS)
    for case in CASES[:2]:
        assert case.name in text and case.name in fields["cases"]  # type: ignore[operator]
    for words in ("Leap Motion Controller 2", "5.2 mm", "14.8 deg", "11 mm", "38 ms", "22.5 deg", "Sensors 2025",
                  "bioRxiv 2022"):
        assert words in text
    assert max(map(len, text.splitlines())) <= 160
