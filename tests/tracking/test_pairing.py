"""When a state is due and for which instant, with frames that come late, twice, in another order, or not at all."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_rig import EPOCH_NS, LOST, frame

from rhot_app.tracking.pairing import Pairing

MS = 1_000_000
POINTS = np.array([[100.0, 100.0], [200.0, 300.0]])


def seconds(paired) -> float:
    return round((paired.t_ns - EPOCH_NS) * 1e-9, 9)


def shot(camera, t_s, *, arrival=None, pixels=POINTS, flags=(0, 0), row_time_ns=0):
    return frame(camera, t_s, pixels, np.array(flags), t_s + 0.03 if arrival is None else arrival, row_time_ns)


def feed(pairing, frames):
    states = []
    for observations in frames:
        pairing.ingest(observations)
        paired = pairing.due()
        if paired is not None:
            states.append(paired)
    return states


def two_cameras(count, phase=0.3, period=0.025, **kwargs):
    frames = [shot(c, (k + phase * c) * period, **kwargs) for k in range(count) for c in (0, 1)]
    return sorted(frames, key=lambda f: f.t_receive_ns)


def test_the_instant_is_the_earliest_of_the_newest_frames_and_every_track_brackets_it():
    states = feed(Pairing(2, 2), two_cameras(20))
    assert [seconds(s) for s in states[1:4]] == [0.025, 0.05, 0.075]
    assert len(states) == 20
    for state in states[1:]:
        assert (state.flags == 0).all()
        assert np.isfinite(state.pixels).all()


def test_each_marker_counts_at_its_own_row():
    frames = two_cameras(6, row_time_ns=48_000)
    state = feed(Pairing(2, 2), frames)[-1]
    assert seconds(state) == pytest.approx(5 * 0.025 + 100 * 48e-6)  # marker 0 in row 100 of camera 0
    upper_lost = [shot(c, 0.15 + 0.0075 * c, flags=(LOST, 0), row_time_ns=48_000) for c in (0, 1)]
    state = feed(Pairing(2, 2), [*frames, *upper_lost])[-1]
    assert seconds(state) == pytest.approx(0.15 + 300 * 48e-6)
    assert (state.flags[:, 0] == -1).all() and (state.flags[:, 1] == 0).all()


def test_moving_markers_are_interpolated_to_the_instant():
    def position(t):
        return np.array([[100.0 + 900.0 * t, 100.0], [200.0 - 4000.0 * t**2, 300.0]])

    frames = sorted((shot(c, t, pixels=position(t)) for k in range(8) for c in (0, 1)
                     for t in [(k + 0.4 * c) * 0.025]), key=lambda f: f.t_receive_ns)
    for state in feed(Pairing(2, 2), frames)[4:]:
        np.testing.assert_allclose(state.pixels, np.tile(position(seconds(state)), (2, 1, 1)), atol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_late_reordered_and_doubled_frames_never_turn_time_back(seed):
    rng = np.random.default_rng(seed)
    frames = two_cameras(80)
    frames = [shot(f.camera, (f.t_row0_master_ns - EPOCH_NS) * 1e-9,
                   arrival=(f.t_receive_ns - EPOCH_NS) * 1e-9 + rng.exponential(0.02)) for f in frames
              for _ in range(1 + (rng.random() < 0.2))]
    frames.sort(key=lambda f: f.t_receive_ns)
    pairing = Pairing(2, 2)
    states = feed(pairing, frames)
    times = [s.t_ns for s in states]
    assert (np.diff(times) > 0).all()
    assert len(states) > 50


@pytest.mark.parametrize("seed", range(4))
def test_in_whatever_order_frames_come_they_make_the_same_curve(seed):
    def position(k):
        return POINTS + np.array([[900.0, -300.0], [40.0, 7.0]]) * np.sin(20.0 * 0.025 * k)

    def at_the_end(order):
        frames = [shot(0, 0.025 * k, pixels=position(k), arrival=2.0) for k in order]
        return feed(Pairing(2, 2), [*frames, shot(1, 0.49, arrival=2.0)])[-1]

    shuffled = [*np.random.default_rng(seed).permutation(20), 20]
    found, expected = at_the_end([*shuffled, *shuffled[::-1]]), at_the_end(range(21))
    assert found.t_ns == expected.t_ns == EPOCH_NS + 490_000_000 and (expected.flags == 0).all()
    np.testing.assert_array_equal(found.pixels, expected.pixels)


@pytest.mark.parametrize("poison", [np.nan, np.inf, -np.inf, 1e30])
def test_what_is_lost_or_not_a_number_is_no_sample(poison):
    covariances = np.tile(0.01 * np.eye(2), (6, 1, 1))
    covariances[2, 0, 0] = poison if poison != 1e30 else -1.0
    covariances[3, 0, 1] = covariances[3, 1, 0] = 2.0
    pixels = [[1.0, poison], [poison, 1.0], [1.0, 1.0], [1.0, 1.0], [1.0, 1.0], [1.0, 1.0]]
    one = frame(0, 0.0, np.array(pixels), np.array([0, 0, 0, 0, LOST, 0]), 0.03, 0)
    state = feed(Pairing(1, 6), [replace(one, covariances=covariances)])[0]
    assert state.flags[0].tolist() == [-1, -1, -1, -1, -1, 0]


def test_a_late_frame_still_helps_to_interpolate():
    def position(t):
        return np.array([[100.0 + 1e4 * t**2, 100.0], [200.0, 300.0]])

    order = [(0, 0), (1, 0), (0, 1), (1, 1), (0, 3), (1, 3), (0, 2), (1, 2), (0, 4), (1, 4)]
    frames = [shot(c, (k + 0.5 * c) * 0.025, pixels=position((k + 0.5 * c) * 0.025), arrival=1.0 + 0.001 * n)
              for n, (c, k) in enumerate(order)]
    last = feed(Pairing(2, 2), frames)[-1]
    np.testing.assert_allclose(last.pixels[:, 0, 0], position(seconds(last))[0, 0], atol=1e-6)


def test_the_rate_is_the_cameras_and_the_partner_the_nearer_one_whatever_the_phase_does():
    period, drift = 0.025, 2e-3  # one camera runs 0.2 % slow: phases pass through a whole period in 12.5 s
    frames = [shot(0, k * period) for k in range(1000)] + [shot(1, k * period * (1 + drift)) for k in range(998)]
    frames.sort(key=lambda f: f.t_receive_ns)
    states = feed(Pairing(2, 2), frames)
    assert len(states) == pytest.approx(1000, abs=6)
    age = np.array([s.completed_by.t_receive_ns - s.t_ns for s in states[1:]]) * 1e-9 - 0.03
    assert age.max() < 0.7 * period
    assert np.diff([s.t_ns for s in states]).max() < 1.7 * period * 1e9


def test_a_fast_camera_waits_for_the_slow_one():
    frames = sorted([shot(0, k / 40) for k in range(40)] + [shot(1, (k + 0.2) / 120) for k in range(120)],
                    key=lambda f: f.t_receive_ns)
    assert len(feed(Pairing(2, 2), frames)) == pytest.approx(40, abs=2)


def test_a_silent_camera_stops_holding_up_the_others_and_may_come_back():
    both, alone = two_cameras(20), [shot(0, k * 0.025) for k in range(20, 60)]
    back = [shot(c, (k + 0.3 * c) * 0.025) for k in range(60, 80) for c in (0, 1)]
    states = feed(Pairing(2, 2), [*both, *alone, *back])
    times = np.array([seconds(s) for s in states])
    live = np.array([s.live.sum() for s in states])
    assert np.diff(times).max() < 0.26
    assert (live[(times > 0.75) & (times < 1.48)] == 1).all()
    assert (live[times > 1.56] == 2).all() and (live[times < 0.5] == 2).all()
    assert all((s.flags[1] == -1).all() for s in states if s.live.sum() == 1 and seconds(s) > 0.75)


def test_a_camera_that_never_spoke_is_waited_for_only_a_moment():
    states = feed(Pairing(2, 2), [shot(0, k * 0.025) for k in range(40)])
    assert seconds(states[0]) == pytest.approx(0.225)
    assert len(states) == 31 and not states[0].live[1]


def test_a_clock_set_back_or_forwards_starts_its_camera_anew():
    for step in (-5.0, 3.0):
        frames = two_cameras(40)
        moved = [shot(f.camera, (f.t_row0_master_ns - EPOCH_NS) * 1e-9 + step * (k >= 40),
                      arrival=(f.t_receive_ns - EPOCH_NS) * 1e-9) for k, f in enumerate(frames)]
        after = [f for f in two_cameras(80) if f.t_row0_master_ns - EPOCH_NS >= 1e9]
        after = [shot(f.camera, (f.t_row0_master_ns - EPOCH_NS) * 1e-9 + step,
                      arrival=(f.t_receive_ns - EPOCH_NS) * 1e-9) for f in after]
        states = feed(Pairing(2, 2), [*moved, *after])
        assert seconds(states[-1]) == pytest.approx(79 * 0.025 + step, abs=0.03)
        assert np.isfinite(states[-1].pixels).all()
        assert len(states) > 60


def test_a_small_new_estimate_of_the_clock_is_taken_smoothly():
    frames = two_cameras(40)
    moved = [shot(f.camera, (f.t_row0_master_ns - EPOCH_NS) * 1e-9 + (0.0004 if k >= 40 and f.camera else 0.0),
                  arrival=(f.t_receive_ns - EPOCH_NS) * 1e-9) for k, f in enumerate(frames)]
    states = feed(Pairing(2, 2), moved)
    assert len(states) == 40 and all(np.isfinite(s.pixels).all() for s in states[1:])


def test_last_seen_is_the_newest_frame_with_what_it_lost():
    pairing = Pairing(2, 2)
    feed(pairing, [*two_cameras(3), shot(0, 0.075, flags=(LOST, 0), pixels=POINTS + 1.0)])
    pixels, flags = pairing.last_seen()
    assert np.isnan(pixels[0, 0]).all() and flags[0, 0] == LOST
    np.testing.assert_array_equal(pixels[0, 1], POINTS[1] + 1.0)
    np.testing.assert_array_equal(pixels[1], POINTS)


@pytest.mark.parametrize("rate_hz", [5.0, 9.0, 60.0])
def test_cameras_of_any_rate_are_paired(rate_hz):
    period = 1.0 / rate_hz
    states = feed(Pairing(2, 2), two_cameras(30, phase=0.4, period=period))
    assert len(states) == 30
    for state in states[2:]:
        assert (state.flags == 0).all() and np.isfinite(state.pixels).all()
        spread_px = np.sqrt(state.covariances[:, 0, 0, 0])
        assert spread_px[0] < 0.05  # the instant is this camera's own
        assert (spread_px[1] > 10.0) == (rate_hz < 10.0)
