"""A worn marker is believed in company, or when it travels; a lone thing of its colour is stated as ambiguous."""

from __future__ import annotations

import numpy as np
import pytest
from marker_rendering import Canvas, disc

from rhot_node.detect.company import STATED_SPREAD, TRAVEL_FRAMES, TRAVELLED, Company
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.track import lost_observation
from rhot_node.files import resource_path
from rhot_node.markers import MarkerSet, load_markers
from rhot_node.wire.messages import NO_FLAGS, MarkerFlag, MarkerObservation

RHOT6 = load_markers(resource_path("markers", "rhot6.json"))
HAND = {0: (100.0, 180.0), 1: (140.0, 120.0), 2: (170.0, 110.0), 3: (200.0, 120.0), 4: (230.0, 150.0)}
WRIST = 5
Seen = tuple[MarkerObservation, ...]


def mark(index: int, x: float, y: float, diameter: float = 16.0, flags: MarkerFlag = NO_FLAGS) -> MarkerObservation:
    return MarkerObservation(index, x, y, diameter, 1e-3, 0.0, 1e-3, 1.0, flags)


def frame(*there: int, shift: float = 0.0, new: bool = False, others: tuple[MarkerObservation, ...] = ()) -> Seen:
    """The given fingertips of a hand, all moved by `shift` px; and `others`."""
    seen = [lost_observation(index) for index in range(6)]
    for index in there:
        x, y = HAND[index]
        seen[index] = mark(index, x + shift, y, flags=MarkerFlag.ACQUIRED if new else NO_FLAGS)
    for other in others:
        seen[other.index] = other
    return tuple(seen)


def doubted(seen: Seen) -> set[int]:
    return {one.index for one in seen if one.found and one.flags & MarkerFlag.AMBIGUOUS}


def test_five_together_are_a_hand_at_once_and_three_when_they_have_moved() -> None:
    company = Company(RHOT6.markers)
    assert doubted(company.judge(frame(0, 1, 2, 3, 4, new=True))) == set()
    company.forget()
    assert doubted(company.judge(frame(1, 2, 3, new=True))) == {1, 2, 3}
    for _ in range(50):
        assert doubted(company.judge(frame(1, 2, 3))) == {1, 2, 3}
    assert doubted(company.judge(frame(1, 2, 3, shift=1.5))) == set()
    assert doubted(company.judge(frame(1, shift=1.5))) == set()  # vouched for as long as it is tracked
    assert not company.complete


def test_a_lone_thing_is_stated_with_little_quality_and_a_wide_covariance() -> None:
    company = Company(RHOT6.markers)
    company.judge(frame(2, new=True))
    one = company.judge(frame(2))[2]
    assert one.flags == MarkerFlag.AMBIGUOUS and one.quality == 0.5
    assert one.cov_xx == one.cov_yy == pytest.approx(1e-3 + (STATED_SPREAD * 16.0) ** 2)


def test_a_lone_marker_that_travels_is_believed_until_it_is_lost() -> None:
    company = Company(RHOT6.markers)
    company.judge(frame(2, new=True))
    for _ in range(TRAVEL_FRAMES):
        assert doubted(company.judge(frame(2, shift=16.0 * TRAVELLED - 1.0))) == {2}
    smaller = mark(2, HAND[2][0] + 40.0, HAND[2][1], 10.0)
    assert doubted(company.judge(frame(others=(smaller,)))) == {2}  # half hidden, it only seems to move
    afar = frame(2, shift=16.0 * TRAVELLED + 1.0)
    assert doubted(company.judge(afar)) == {2} and doubted(company.judge(frame(2))) == {2}  # there and back: a jump
    assert doubted(company.judge(afar)) == {2} and doubted(company.judge(afar)) == set()
    company.judge(frame())
    assert doubted(company.judge(frame(2, new=True))) == {2}


def test_what_is_far_away_or_of_another_size_is_in_no_company() -> None:
    away, large = mark(WRIST, 900.0, 400.0, 40.0), mark(WRIST, 170.0, 220.0, 200.0)
    for other in (away, large):
        company = Company(RHOT6.markers)
        assert doubted(company.judge(frame(0, 1, 2, 3, 4, others=(other,)))) == {WRIST}
    company = Company(RHOT6.markers)
    assert doubted(company.judge(frame(0, 1, 2, 3, 4, others=(mark(WRIST, 170.0, 220.0, 40.0),)))) == set()
    assert company.complete


def test_what_stays_behind_when_the_hand_moves_is_doubted() -> None:
    company = Company(RHOT6.markers)
    thing = mark(4, *HAND[4])
    for shift in np.arange(0.0, 30.0, 2.0):
        seen = company.judge(frame(0, 1, 2, 3, shift=float(shift), others=(thing,)))
    assert doubted(seen) == {4}


def test_what_comes_out_from_behind_a_finger_is_of_the_hand_once_it_moves_with_it() -> None:
    company = Company(RHOT6.markers)
    for shift in (0.0, 2.0, 4.0):
        company.judge(frame(0, 1, 2, 3, 4, shift=shift))
    company.judge(frame(0, 1, 3, 4, shift=6.0))
    x, y = HAND[2]
    for step, diameter in enumerate((8.0, 10.5, 13.0, 16.0)):
        flags = NO_FLAGS if step else MarkerFlag.ACQUIRED
        company.judge(frame(0, 1, 3, 4, shift=8.0, others=(mark(2, x + 4.0 + step, y, diameter, flags),)))
    for shift in np.arange(8.0, 30.0, 2.0):
        seen = company.judge(frame(0, 1, 2, 3, 4, shift=float(shift)))
    assert doubted(seen) == set()


def test_a_thing_that_a_passing_hand_uncovers_is_left_behind() -> None:
    company = Company(RHOT6.markers)
    for shift in (0.0, 2.0, 4.0):
        company.judge(frame(0, 1, 2, 3, shift=shift))
    x, y = HAND[4]
    for step, diameter in enumerate((8.0, 10.0, 12.0, 14.0, 16.0)):  # its middle moves until it shows whole
        flags = MarkerFlag.ACQUIRED if step == 0 else NO_FLAGS
        thing = mark(4, x - 8.0 + 2.0 * step, y, diameter, flags)
        company.judge(frame(0, 1, 2, 3, shift=4.0 + 2.0 * step, others=(thing,)))
    for shift in np.arange(14.0, 40.0, 2.0):
        seen = company.judge(frame(0, 1, 2, 3, shift=float(shift), others=(mark(4, x, y),)))
    assert doubted(seen) == {4}


@pytest.mark.parametrize("flags", [MarkerFlag.ACQUIRED, MarkerFlag.PARTIAL, MarkerFlag.ACQUIRED | MarkerFlag.PARTIAL])
def test_what_a_known_hand_passes_joins_it_only_when_followed_in_plain_view(flags: MarkerFlag) -> None:
    company = Company(RHOT6.markers)
    for shift in (0.0, 2.0, 4.0):
        company.judge(frame(0, 1, 2, 3, 4, shift=shift))
    thing = mark(WRIST, 170.0, 220.0, 40.0, flags)
    for _ in range(5):
        assert doubted(company.judge(frame(0, 1, 2, 3, 4, shift=4.0, others=(thing,)))) == {WRIST}
    followed = mark(WRIST, 170.0, 220.0, 40.0)
    assert doubted(company.judge(frame(0, 1, 2, 3, 4, shift=4.0, others=(followed,)))) == set()


def test_sets_of_one_or_two_worn_markers_and_free_ones_are_taken_as_they_are() -> None:
    for markers in (RHOT6.markers[:2], tuple(load_markers(resource_path("markers", "trifinger_cube.json")).markers)):
        company = Company(markers)
        seen = tuple(mark(index, 50.0 * index, 40.0) for index in range(len(markers)))
        assert company.judge(seen) is seen and company.complete


def test_the_detector_doubts_a_lone_thing_and_not_a_hand() -> None:
    detector = FastDetector(MarkerSet(markers=RHOT6.markers[:5]))
    canvas = Canvas(320, 240)
    canvas.paint(disc(170.0, 110.0, 8.0), RHOT6.markers[2].display_rgb, (170.0, 110.0), 12.0)
    for _ in range(4):
        assert doubted(detector.detect(canvas.expose())) == {2}
    for index, (x, y) in HAND.items():
        canvas.paint(disc(x, y, 8.0), RHOT6.markers[index].display_rgb, (x, y), 12.0)
    assert doubted(detector.detect(canvas.expose())) == set()
    assert doubted(detector.detect(canvas.expose())) == set()
