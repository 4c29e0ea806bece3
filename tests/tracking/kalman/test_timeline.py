"""Frames that arrive in another order than they were taken."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from known_hand import blocks, difference, empty, filter_of_hand, moving_estimate, settled, twin

from rhot_app.tracking.kalman.estimate import copy_estimate
from rhot_app.tracking.kalman.timeline import BESIDE_NS, LENGTH, TURNS_RAD, WAY_M, Timeline


def follow(frames):
    """The timeline and its filter after the frames, in the order given, from a hand that is known well."""
    hand = filter_of_hand()
    timeline, start = Timeline(hand), moving_estimate()
    hand.start(start.world, start.angles)
    known, last = settled()
    copy_estimate(known, hand.estimate)
    timeline.begin(last.t_ns)
    outcomes = [list(timeline.add(block)) for block in frames]
    return timeline, twin(hand.estimate), outcomes


def frames_to_come():
    """Those after the settled hand's last."""
    return [block for block in blocks() if block.t_ns > settled()[1].t_ns]


def assert_same(a, b):
    """Equal but for a hundredth of what is uncertain."""
    assert (np.abs(difference(a, b)) <= 0.01 * np.sqrt(np.diag(b.covariance)) + 1e-12).all()
    np.testing.assert_allclose(np.sqrt(np.diag(a.covariance)), np.sqrt(np.diag(b.covariance)), rtol=0.01, atol=1e-12)


def test_late_frames_give_the_estimate_of_frames_in_order():
    frames = frames_to_come()
    ordered, expected, _ = follow(frames)
    late = frames.copy()
    late.insert(12, late.pop(7))  # five frames late
    late[20], late[21] = late[21], late[20]
    shuffled, estimate, outcomes = follow(late)
    assert shuffled.t_ns == ordered.t_ns and shuffled.dropped == 0
    assert len(outcomes[12]) == 6 and outcomes[12][0][0] is frames[7]
    assert_same(estimate, expected)


def test_what_comes_too_late_is_dropped_and_counted():
    frames = frames_to_come()
    without, expected, _ = follow([frames[0], *frames[2:LENGTH + 4]])
    timeline, estimate, outcomes = follow([frames[0], *frames[2:LENGTH + 4], frames[1]])
    assert timeline.dropped == 1 and outcomes[-1] == []
    assert without.dropped == 0 and timeline.t_ns == without.t_ns
    assert_same(estimate, expected)


def test_a_new_beginning_forgets_the_past():
    frames = frames_to_come()
    timeline, _, _ = follow(frames[:10])
    timeline.begin(frames[12].t_ns)
    assert list(timeline.add(frames[5])) == [] and timeline.dropped == 1
    assert len(list(timeline.add(frames[13]))) == 1


def test_what_is_remembered_is_whole_and_its_own():
    estimate, other = moving_estimate(), empty()
    for array in estimate:
        array += 1 if array.dtype == np.int64 else 0.01
    copy_estimate(estimate, other)
    for field, source, target in zip(estimate._fields, estimate, other, strict=True):
        np.testing.assert_array_equal(source, target, err_msg=field)
        assert not np.shares_memory(source, target)


@dataclass(frozen=True)
class Glimpse:
    """A block that says nothing."""

    t_ns: int
    camera: int

    def as_of(self, t_ns):
        return replace(self, t_ns=t_ns)


class Recorder:
    """Stands for a filter that everything `turns` by so much, rad: notes what it is told."""

    def __init__(self, turns, speed):
        self.estimate, self.turns, self.told = empty(), turns, []
        self.estimate.velocity[0] = speed

    def update(self, dt, seen):
        self.told.append((round(1e9 * dt), *seen))
        self.estimate.world[0, 3] += dt
        return len(self.told)

    def update_gently(self, dt, seen, most_rad):
        outcome = self.update(dt, seen)
        return outcome if self.turns <= most_rad else None


@pytest.mark.parametrize(("turns", "speed", "since_ns", "camera", "together"), [
    (1.1 * TURNS_RAD, 0.0, 2_000_000, 1, True), (0.9 * TURNS_RAD, 0.0, 2_000_000, 1, False),
    (1.1 * TURNS_RAD, 0.0, 2_000_000, 0, False), (1.1 * TURNS_RAD, 0.0, BESIDE_NS, 1, False),
    (1.1 * TURNS_RAD, 0.9 * WAY_M / 0.002, 2_000_000, 1, True),
    (1.1 * TURNS_RAD, 1.1 * WAY_M / 0.002, 2_000_000, 1, False)])
def test_a_frame_that_turns_the_hand_is_weighed_with_the_one_before(turns, speed, since_ns, camera, together):
    hand = Recorder(turns, speed)
    timeline = Timeline(hand)
    timeline.begin(0)
    one, other = Glimpse(10_000_000, 0), Glimpse(10_000_000 + since_ns, camera)
    list(timeline.add(one))
    (weighed, outcome), = timeline.add(other)
    told = [(10_000_000, one), (since_ns, other)]
    if together:
        told.append((other.t_ns, replace(one, t_ns=other.t_ns), other))
    assert hand.told == told and weighed is other and outcome == len(told)
    assert hand.estimate.world[0, 3] == pytest.approx(1e-9 * other.t_ns)  # from before both of them
    assert timeline.t_ns == other.t_ns
