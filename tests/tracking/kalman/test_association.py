"""Which marker a sight is of."""

import pytest
from known_hand import MARKERS, WEARING, filter_of_hand, next_frame, twin
from places import places_of

from rhot_app.tracking.kalman.association import relabel
from rhot_app.tracking.kalman.estimate import copy_estimate


def carried():
    estimate, block = next_frame()
    return estimate, block.frame


def renamed(estimate, frame):
    changed = relabel(WEARING.worn, WEARING.cameras, frame, estimate, places_of(WEARING.worn, estimate))
    return changed, frame.label.tolist()


def test_nothing_is_renamed_when_all_is_well():
    assert renamed(*carried()) == (0, list(range(MARKERS)))


def test_names_that_were_exchanged_are_put_right():
    estimate, frame = carried()
    frame.pixels[[1, 2]] = frame.pixels[[2, 1]]
    frame.late_s[[1, 2]] = frame.late_s[[2, 1]]
    assert renamed(estimate, frame) == (2, [0, 2, 1, 3, 4, 5])


def test_a_sight_with_the_name_of_a_hidden_marker_is_of_the_one_that_lies_there():
    """The middle finger's paint passes for the ring finger's, which is hidden."""
    estimate, frame = carried()
    frame.pixels[3], frame.late_s[3] = frame.pixels[2], frame.late_s[2]
    frame.seen[2] = False
    changed, labels = renamed(estimate, frame)
    assert changed == 1 and labels[3] == 2


def test_a_sight_that_is_of_no_marker_keeps_its_name():
    estimate, frame = carried()
    frame.pixels[3] += (90.0, -60.0)
    assert renamed(estimate, frame) == (0, list(range(MARKERS)))


def test_a_hand_that_jumps_as_a_whole_keeps_its_names():
    estimate, frame = carried()
    frame.pixels[:] += (25.0, 10.0)
    assert renamed(estimate, frame) == (0, list(range(MARKERS)))


@pytest.mark.parametrize("trouble", ["none", "names exchanged", "one elsewhere"])
def test_a_sight_that_is_not_what_it_says_troubles_the_hand(trouble):
    hand, (estimate, block) = filter_of_hand(), next_frame()
    copy_estimate(twin(estimate), hand.estimate)
    if trouble == "names exchanged":
        block.frame.pixels[[1, 2]], block.frame.late_s[[1, 2]] = block.frame.pixels[[2, 1]], block.frame.late_s[[2, 1]]
    elif trouble == "one elsewhere":
        block.frame.pixels[3] += (90.0, -60.0)
    hand.estimate.untroubled[0] = 7.0
    hand.update(0.0, [block])
    assert hand.estimate.untroubled[0] == (7.0 if trouble == "none" else 0.0)
