"""Which marker a sight is of."""

from known_hand import MARKERS, WEARING, next_frame

from rhot_app.tracking.kalman.association import relabel


def carried():
    estimate, block = next_frame()
    return estimate, block.frame


def renamed(estimate, frame):
    return relabel(WEARING.worn, WEARING.cameras, frame, estimate), frame.label.tolist()


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
