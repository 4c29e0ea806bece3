"""Tracks: order of samples, and interpolation against numpy's polynomials."""

import numpy as np
import pytest

from rhot_app.tracking import tracks
from rhot_node.wire.messages import MarkerFlag

MS = 1_000_000
PARTIAL = int(MarkerFlag.PARTIAL)
ACQUIRED = int(MarkerFlag.ACQUIRED)


class Track:
    """One track (K, ...) and its count."""

    def __init__(self, length: int = tracks.LENGTH) -> None:
        self.times = np.zeros(length, np.int64)
        self.pixels = np.zeros((length, 2))
        self.covariances = np.zeros((length, 2, 2))
        self.flags = np.zeros(length, np.uint16)
        self.count = 0
        self.period_ms = 25.0

    def add(self, t_ms: float, x: float, y: float = 0.0, flag: int = 0, sigma: float = 0.1) -> None:
        self.count = tracks.insert(self.times, self.pixels, self.covariances, self.flags, self.count,
                                   round(t_ms * MS), x, y, np.eye(2) * sigma**2, flag)

    def at(self, t_ms: float):
        pixel, covariance = np.full(2, np.nan), np.full((2, 2), np.nan)
        flag = tracks.interpolate(self.times, self.pixels, self.covariances, self.flags, self.count,
                                  tracks.longest_gap_ns(round(self.period_ms * MS)), round(t_ms * MS),
                                  pixel, covariance)
        return flag, pixel, covariance


def filled(times, curve=lambda t: t, **kwargs) -> Track:
    track = Track()
    for t in times:
        track.add(t, curve(t), -2.0 * curve(t), **kwargs)
    return track


def test_samples_are_kept_in_order_of_time_however_they_arrive():
    rng = np.random.default_rng(0)
    track = Track(8)
    times = rng.permutation(np.arange(20)) * 25
    for t in times:
        track.add(t, float(t))
        track.add(t, 1e6)  # the same time again
        held = track.times[:track.count]
        assert (np.diff(held) > 0).all()
        np.testing.assert_array_equal(track.pixels[:track.count, 0] * MS, held)
    assert track.count == 8
    assert track.times[-1] == 19 * 25 * MS
    before = track.times.copy()
    track.add(-1.0, 5.0)
    np.testing.assert_array_equal(track.times, before)


@pytest.mark.parametrize("times", [(0, 25, 50, 75), (0, 24, 51, 75), (0, 50, 75, 100)])
@pytest.mark.parametrize("newest", [True, False])
def test_a_cubic_motion_is_met_exactly(times, newest):
    def curve(t):
        return 3.0 + 2.0 * t - 0.05 * t**2 + 0.0004 * t**3

    track = filled(times if newest else (*times, times[-1] + 25), curve)
    for t in np.linspace(times[-2] + 1, times[-1], 7):
        flag, pixel, _ = track.at(t)
        assert flag == 0
        np.testing.assert_allclose(pixel, [curve(t), -2.0 * curve(t)], atol=1e-6)


def test_covariance_is_that_of_the_weighted_samples():
    times = np.array([0.0, 25.0, 50.0, 75.0])
    _, _, covariance = filled(times, sigma=0.2).at(65.0)
    weights = [np.prod([(65.0 - u) / (t - u) for u in times if u != t]) for t in times]
    np.testing.assert_allclose(covariance, 0.04 * np.square(weights).sum() * np.eye(2), rtol=1e-9)


def test_an_instant_at_a_sample_is_the_sample():
    track = filled((0, 25, 50), lambda t: t**2, flag=PARTIAL)
    flag, pixel, covariance = track.at(25.0)
    assert flag == PARTIAL and pixel[0] == 625.0 and covariance[0, 0] == pytest.approx(0.01)
    single = filled((40,))
    assert single.at(40.0)[0] == 0 and single.at(41.0)[0] == -1 and single.at(39.0)[0] == -1


def test_nothing_is_interpolated_over_a_long_gap_or_beyond_the_ends():
    track = filled((0, 25, 50, 160, 185))
    assert track.at(100.0)[0] == -1
    assert track.at(-1.0)[0] == -1
    assert track.at(186.0)[0] == -1
    assert track.at(170.0)[0] == 0


@pytest.mark.parametrize(("period_ms", "gap_ms", "tracked"), [
    (40.0, 100.0, True), (40.0, 101.0, False), (125.0, 312.0, True), (125.0, 313.0, False), (400.0, 599.0, True),
    (400.0, 601.0, False)])
def test_a_slow_camera_may_leave_longer_gaps(period_ms, gap_ms, tracked):
    track = filled((0.0, gap_ms))
    track.period_ms = period_ms
    assert (track.at(0.5 * gap_ms)[0] == 0) is tracked


def test_over_a_long_gap_the_covariance_holds_what_acceleration_does():
    acceleration = tracks.ACCELERATION_PX * 1e-6  # px/ms^2
    track = filled((0.0, 100.0, 300.0), lambda t: 0.5 * acceleration * t**2)
    track.period_ms = 125.0
    for t_ms in (100.001, 150.0, 200.0, 299.0):
        flag, pixel, covariance = track.at(t_ms)
        missed = pixel[0] - 0.5 * acceleration * t_ms**2
        assert flag == 0 and missed == pytest.approx(0.5 * acceleration * (t_ms - 100.0) * (300.0 - t_ms), abs=0.01)
        assert covariance[0, 0] == pytest.approx(missed**2 + 0.01, rel=0.02, abs=0.006)
        assert covariance[1, 1] == pytest.approx(covariance[0, 0]) and covariance[0, 1] == 0.0
    assert track.at(50.0)[2][0, 0] < 0.01  # not over a gap that every camera may leave


def test_uneven_spacing_falls_back_to_a_line():
    def curve(t):
        return t**2

    flag, pixel, covariance = filled((0, 90, 100, 190), curve).at(95.0)
    assert flag == 0 and pixel[0] == pytest.approx(0.5 * (90**2 + 100**2))
    assert covariance[0, 0] == pytest.approx(0.005)


def test_doubtful_samples_do_not_bend_the_curve_and_are_reported():
    track = Track()
    for t, x, flag in ((0, 300.0, PARTIAL), (25, 25.0, 0), (50, 50.0, 0), (75, 75.0, 0)):
        track.add(t, x, flag=flag)
    flag, pixel, _ = track.at(60.0)
    assert flag == 0 and pixel[0] == pytest.approx(60.0)
    assert track.at(10.0)[0] == PARTIAL


def test_no_curve_crosses_the_start_of_a_track():
    track = Track()
    for t, x, flag in ((0, 500.0, 0), (25, 500.0, 0), (50, 50.0, ACQUIRED), (75, 75.0, 0), (100, 100.0, 0)):
        track.add(t, x, flag=flag)
    assert track.at(40.0)[0] == -1
    assert track.at(50.0)[1][0] == 50.0
    for t in (60.0, 80.0):
        assert track.at(t)[1][0] == pytest.approx(t)


def ingest(pixels, flags=None, covariances=None):
    count = len(pixels)
    shape = (count, tracks.LENGTH)
    track = (np.zeros(shape, np.int64), np.zeros((*shape, 2)), np.zeros((*shape, 2, 2)), np.zeros(shape, np.uint16),
             np.zeros(count, np.int64))
    newest = np.zeros(count, np.int64)
    taken = tracks.ingest_frame(*track, newest, 1000, 48_000, True, 0.01, np.asarray(pixels, float),
                                np.tile(np.eye(2), (count, 1, 1)) if covariances is None else covariances,
                                np.zeros(count, np.uint16) if flags is None else flags)
    return taken, newest, track


def test_each_marker_has_its_own_rows_time():
    taken, newest, _ = ingest([[10.0, 0.0], [10.0, 100.5]])
    assert taken == 2 and newest.tolist() == [1000, 1000 + round(100.5 * 48_000)]


@pytest.mark.parametrize("poison", [np.nan, np.inf, -np.inf, 1e30])
def test_what_is_lost_or_not_a_number_is_no_sample(poison):
    covariances = np.tile(np.eye(2), (5, 1, 1))
    covariances[2, 0, 0] = poison if poison != 1e30 else -1.0
    covariances[3, 0, 1] = covariances[3, 1, 0] = 2.0
    flags = np.array([0, 0, 0, 0, 1], np.uint16)
    pixels = [[1.0, poison], [poison, 1.0], [1.0, 1.0], [1.0, 1.0], [1.0, 1.0]]
    taken, newest, track = ingest(pixels, flags, covariances)
    assert taken == 0 and (newest == -1).all() and not track[4].any()
