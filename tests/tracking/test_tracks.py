"""Tracks of one marker in one camera: interpolation against numpy's polynomials."""

import numpy as np
import pytest

from rhot_app.tracking.pairing import ACCELERATION_PX, Samples, interpolate, longest_gap_ns
from rhot_node.wire.messages import MarkerFlag

MS = 1_000_000
PARTIAL = int(MarkerFlag.PARTIAL)
ACQUIRED = int(MarkerFlag.ACQUIRED)


class Track:
    """Samples of one marker in one camera."""

    def __init__(self) -> None:
        self.samples: list[tuple[int, tuple[float, float], np.ndarray, int]] = []
        self.period_ms = 25.0

    def add(self, t_ms: float, x: float, y: float = 0.0, flag: int = 0, sigma: float = 0.1) -> None:
        self.samples.append((round(t_ms * MS), (x, y), np.eye(2) * sigma**2, flag))

    def at(self, t_ms: float):
        pixel, covariance = np.full(2, np.nan), np.full((2, 2), np.nan)
        times, pixels, covariances, flags = zip(*self.samples, strict=True)
        samples = Samples(np.array(times), np.array(pixels), np.array(covariances), np.array(flags, np.uint16))
        flag = interpolate(samples, longest_gap_ns(round(self.period_ms * MS)), round(t_ms * MS), pixel, covariance)
        return flag, pixel, covariance


def filled(times, curve=lambda t: t, **kwargs) -> Track:
    track = Track()
    for t in times:
        track.add(t, curve(t), -2.0 * curve(t), **kwargs)
    return track


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
    (40.0, 100.0, True), (40.0, 101.0, False), (125.0, 312.0, True), (125.0, 313.0, False), (400.0, 499.0, True),
    (400.0, 501.0, False)])
def test_a_slow_camera_may_leave_longer_gaps(period_ms, gap_ms, tracked):
    track = filled((0.0, gap_ms))
    track.period_ms = period_ms
    assert (track.at(0.5 * gap_ms)[0] == 0) is tracked


def test_over_a_long_gap_the_covariance_holds_what_acceleration_does():
    acceleration = ACCELERATION_PX * 1e-6  # px/ms^2
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
