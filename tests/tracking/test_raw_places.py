"""Where sights alone have the markers."""

from dataclasses import replace

import numpy as np
import pytest
from modelled_hand import model_rig, moving, sights
from places import places_of

from rhot_app.geometry.camera import undistort_point
from rhot_app.geometry.triangulate import triangulate
from rhot_app.tracking.kalman.markers import Cameras, project_marker
from rhot_app.tracking.kalman.wearing import compile_wearing
from rhot_app.tracking.locate import GATE_FLOOR_PX
from rhot_app.tracking.make import make_tracker
from rhot_app.tracking.raw_places import RawPlaces, locate_raw
from rhot_app.tracking.sights import Seen

NOW_NS, FRESH_NS = 10**9, 30_000_000
SD_PX = 0.05


def hand_before(cameras=2, speed_m_s=0.0):
    """A tracked hand that moves along x and turns as fast, what it wears, and where its markers are."""
    rig = model_rig(cameras=cameras)
    tracker = make_tracker(rig)
    for frame in sights(rig, moving("rest"), 0.5):
        tracker.ingest(frame)
        tracker.solve()
    estimate, wearing = tracker._hand.estimate, compile_wearing(rig)
    estimate.velocity[:], estimate.bias[:] = 0.0, 0.0
    estimate.velocity[0], estimate.velocity[4] = speed_m_s, 5.0 * speed_m_s
    return estimate, wearing, places_of(wearing.worn, estimate)


def seen_of(estimate, wearing, places, offsets_m, ages_s):
    """Each camera's last sights, `ages_s` (C,) old, of markers that are `offsets_m` (M, 3) off the hand's."""
    shape = len(ages_s), len(places.points)
    seen = Seen(np.empty(shape, np.int64), np.empty((*shape, 2)), np.tile(SD_PX**2 * np.eye(2), (*shape, 1, 1)),
                np.zeros(shape, np.bool_), np.full(shape[0], FRESH_NS))
    slope = np.empty((2, 3))
    for c, age_s in enumerate(ages_s):
        seen.times[c] = NOW_NS - round(1e9 * age_s)
        for m, point in enumerate(places.points):
            was = point + offsets_m[m] - age_s * places.jacobian[m] @ estimate.velocity
            assert project_marker(was, estimate.world, wearing.worn.half_axes[m], wearing.cameras.pose[c],
                                  wearing.cameras.intrinsics[c], seen.pixels[c, m], slope)
    return seen


def located(estimate, wearing, places, seen):
    count = len(places.points)
    out = RawPlaces(np.empty((count, 3)), np.empty((count, 3, 3)), np.empty(count))
    locate_raw(wearing.worn.half_axes, wearing.cameras, estimate, places, 0, NOW_NS, seen, out)
    return out


@pytest.mark.parametrize("off_m", [0.0, 0.03, 0.2])
def test_markers_are_where_sights_meet_however_far_from_the_hand_that_is(off_m):
    hand = hand_before()
    offsets = np.full((len(hand[2].points), 3), off_m)
    out = located(*hand, seen_of(*hand, offsets, (0.0, 0.0)))
    np.testing.assert_allclose(out.positions, hand[2].points + offsets, atol=1e-6)
    assert out.errors.max() < 0.01


def test_sights_are_carried_along_as_the_hand_moves():
    hand = hand_before(speed_m_s=0.5)
    out = located(*hand, seen_of(*hand, np.zeros((len(hand[2].points), 3)), (0.0, 0.015)))
    np.testing.assert_allclose(out.positions, hand[2].points, atol=3e-4)


def test_place_and_covariance_are_those_of_triangulation():
    estimate, wearing, places = hand_before()
    rng = np.random.default_rng(3)
    seen = seen_of(estimate, wearing, places, np.zeros((len(places.points), 3)), (0.0, 0.0))
    seen.pixels[:] += SD_PX * rng.normal(size=seen.pixels.shape)
    out, focal = located(estimate, wearing, places, seen), wearing.cameras.intrinsics[:, :2].copy()
    for m in range(len(places.points)):
        rays, covariances = np.empty((2, 2)), np.empty((2, 2, 2))
        for c in range(2):
            x, y, *slope = undistort_point(*seen.pixels[c, m], wearing.cameras.intrinsics[c])
            rays[c], slope = (x, y), np.array(slope).reshape(2, 2)
            covariances[c] = slope @ seen.covariances[c, m] @ slope.T
        position, covariance = np.empty(3), np.empty((3, 3))
        error, _ = triangulate(rays, covariances, wearing.cameras.pose, focal, np.ones(2, bool), position, covariance)
        np.testing.assert_allclose(out.positions[m], position, atol=1e-6)
        np.testing.assert_allclose(out.covariances[m], covariance, rtol=1e-3, atol=1e-10)
        assert out.errors[m] == pytest.approx(error, abs=1e-3)


def test_a_marker_that_one_camera_has_just_seen_is_nowhere():
    hand = hand_before()
    seen = seen_of(*hand, np.zeros((len(hand[2].points), 3)), (0.0, 0.0))
    seen.times[1, 2] -= FRESH_NS + 1
    seen.times[0, 4] = -1
    out = located(*hand, seen)
    expected = np.isin(np.arange(len(out.errors)), (2, 4))
    for found in (out.positions[:, 0], out.covariances[:, 0, 0], out.errors):
        np.testing.assert_array_equal(np.isnan(found), expected)


def test_rays_that_miss_each_other_meet_nowhere_and_it_is_told_by_how_much():
    hand = hand_before()
    seen = seen_of(*hand, np.zeros((len(hand[2].points), 3)), (0.0, 0.0))
    seen.pixels[0, 1, 1] += 4.0 * GATE_FLOOR_PX
    out = located(*hand, seen)
    assert np.isnan(out.positions[1]).all() and np.isnan(out.covariances[1]).all()
    assert out.errors[1] == pytest.approx(2.0 * GATE_FLOOR_PX, rel=0.05)
    assert np.isfinite(out.positions[[0, 2, 3, 4, 5]]).all()


@pytest.mark.parametrize("camera", [0, 1, 2])
@pytest.mark.parametrize("off_px", [(100.0, 0.0), (-100.0, 0.0), (0.0, 20.0), (np.nan, 0.0)])
def test_of_three_cameras_the_one_that_is_wrong_is_given_up(camera, off_px):
    hand = hand_before(cameras=3)
    seen = seen_of(*hand, np.zeros((len(hand[2].points), 3)), (0.0, 0.0, 0.0))
    seen.pixels[camera, 1] += off_px
    out = located(*hand, seen)
    np.testing.assert_allclose(out.positions, hand[2].points, atol=1e-5)
    assert out.errors.max() < 0.01


@pytest.mark.parametrize("covariance", [[[1.0, 1.0], [1.0, 1.0]], [[1.0, 1.1], [1.1, 1.0]]])
def test_a_sight_whose_covariance_is_none_is_not_used(covariance):
    hand = hand_before()
    seen = seen_of(*hand, np.zeros((len(hand[2].points), 3)), (0.0, 0.0))
    seen.covariances[0, 3] = covariance
    out = located(*hand, seen)
    np.testing.assert_array_equal(np.isnan(out.errors), np.arange(len(out.errors)) == 3)


def test_rays_that_are_as_good_as_parallel_meet_nowhere():
    estimate, wearing, places = hand_before()
    same = Cameras(np.repeat(wearing.cameras.pose[:1], 2, axis=0), np.repeat(wearing.cameras.intrinsics[:1], 2, axis=0))
    same.pose[1, 0, 3] -= 1e-4
    hand = estimate, replace(wearing, cameras=same), places
    out = located(*hand, seen_of(*hand, np.zeros((len(places.points), 3)), (0.0, 0.0)))
    assert np.isnan(out.positions).all() and np.isnan(out.covariances).all()
