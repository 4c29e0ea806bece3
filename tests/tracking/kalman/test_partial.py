"""Markers of which one camera sees less than the other: when their sights are doubted, and when they are left out."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from modelled_hand import model_rig, moving, sights
from places import places_of

from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.model import neutral_pose
from rhot_app.simulator.motion import FACING
from rhot_app.tracking.kalman.estimate import LOOK_AGE, LOOK_WIDTH, empty_estimate
from rhot_app.tracking.kalman.marker_block import MarkerBlock
from rhot_app.tracking.kalman.markers import project_marker
from rhot_app.tracking.kalman.partial import (
    AGREE,
    BAND_SHIFT,
    CALM_S,
    LESS,
    MISS_PX,
    OWN,
    SHIFT,
    View,
    disagreement,
    doubt_partial,
)
from rhot_app.tracking.kalman.sighted import FRESH_S
from rhot_app.tracking.kalman.sizes import measure_sizes
from rhot_app.tracking.kalman.wearing import compile_wearing
from rhot_node.wire.messages import MarkerFlag

RIG = model_rig()
CAMERAS = [CameraModel.from_rig(node.intrinsics, node.pose) for node in RIG.nodes]
COUNT, INDEX, WRIST = len(RIG.markers.markers), 1, 5
WIDTH_M = 0.016


def with_a_band():
    """The rig's markers are points; its wrist's shall be a band here."""
    wearing = compile_wearing(RIG)
    half_axes = wearing.worn.half_axes.copy()
    half_axes[WRIST] = 0.011, 0.031, 0.021
    return replace(wearing, worn=wearing.worn._replace(half_axes=half_axes))


WEARING = with_a_band()


def hand():
    estimate = empty_estimate(2, COUNT)
    estimate.world[:3, :3], estimate.world[:3, 3] = FACING, (0.03, 0.08, 0.6)
    estimate.angles[:] = neutral_pose().angles
    estimate.unseen[:] = 0.0
    return estimate


def seen(estimate, camera, shares=(), shift=(0.0, 0.0), flag=0, late_s=0.0):
    """What a camera sees of the hand `late_s` later: all markers equally wide, but for the `shares` of the areas of
    some, which are seen elsewhere by `shift`, px."""
    points = places_of(WEARING.worn, estimate).points
    pixels, slope, area, flags = np.empty((COUNT, 2)), np.empty((2, 3)), np.ones(COUNT), np.zeros(COUNT, np.uint16)
    px_per_m = np.empty(COUNT)
    for m in range(COUNT):
        project_marker(points[m] + late_s * estimate.velocity[:3], estimate.world, WEARING.worn.half_axes[m],
                       WEARING.cameras.pose[camera], WEARING.cameras.intrinsics[camera], pixels[m], slope)
        px_per_m[m] = np.sqrt(np.linalg.norm(np.cross(*slope)))
    for m, share in dict(shares).items():
        area[m], flags[m] = share, flag
        pixels[m] += shift
    frame = sights(RIG, moving(), 0.1)[camera]
    return MarkerBlock(WEARING, replace(
        frame, camera=camera, pixels=pixels, row_time_ns=0, flags=flags,
        covariances=np.tile(0.05**2 * np.eye(2), (COUNT, 1, 1)), diameters=WIDTH_M * np.sqrt(area) * px_per_m))


def judged(block, estimate):
    """Standard deviations (M,) of the doubt, px, and which markers are left out."""
    places = places_of(WEARING.worn, estimate)
    measure_sizes(WEARING.worn, WEARING.cameras, block.frame, estimate, places)
    doubt_partial(WEARING.worn, WEARING.cameras, block.frame, estimate, places)
    return np.sqrt(block.frame.doubt), np.flatnonzero(block.frame.covered).tolist()


@pytest.mark.parametrize("camera", [0, 1])
def test_what_both_cameras_show_whole_is_not_doubted(camera):
    estimate = hand()
    for which in (camera, 1 - camera, camera):
        doubt, left_out = judged(seen(estimate, which, {INDEX: 1.0 - 0.9 * AGREE}), estimate)
        assert not doubt.any() and left_out == []


def test_the_smaller_of_two_sights_is_doubted_by_as_much_as_its_middle_may_have_moved():
    estimate = hand()
    judged(seen(estimate, 0), estimate)
    doubt, left_out = judged(seen(estimate, 1, {INDEX: 0.8, WRIST: 0.8}), estimate)
    assert np.flatnonzero(doubt).tolist() == [INDEX, WRIST] and left_out == []
    radius_px = 0.5 * WIDTH_M * np.sqrt(0.8) * CAMERAS[1].intrinsics[0] / 0.6
    assert doubt[INDEX] == pytest.approx(SHIFT * radius_px * np.sqrt(0.2**2 - AGREE**2), rel=0.2)
    assert doubt[WRIST] == pytest.approx(BAND_SHIFT / SHIFT * doubt[INDEX], rel=0.2)  # bands are longer than wide
    doubt, _ = judged(seen(estimate, 0), estimate)
    assert not doubt.any()


def test_a_smaller_sight_whose_ray_misses_the_other_is_left_out():
    across = (0.0, 4.0)
    for shares, shift, expected in (({WRIST: 1.0 - 2.0 * LESS}, across, [WRIST]), ({WRIST: 1.0}, across, []),
                                    ({WRIST: 1.0 - 2.0 * LESS}, (4.0, 0.0), []),  # along the line: another distance
                                    ({WRIST: 1.0 - 2.0 * LESS}, (0.0, 1.2 * MISS_PX), [])):
        estimate = hand()
        judged(seen(estimate, 0), estimate)
        assert judged(seen(estimate, 1, shares, shift), estimate)[1] == expected


def test_a_hand_in_motion_is_where_it_is_seen_by_both_at_their_own_times():
    for speed, expected in ((1.0, []), (0.0, [INDEX])):  # the second one is told that the hand stands still
        estimate = hand()
        estimate.world[:3, :3] = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]]) @ estimate.world[:3, :3]
        estimate.velocity[:2] = 0.0, 1.0
        first = seen(estimate, 0, late_s=-0.012)
        second = seen(estimate, 1, {INDEX: 1.0 - 2.0 * LESS})
        estimate.velocity[1] = speed
        judged(first, estimate)
        estimate.looks[:, :, LOOK_AGE] += 0.012
        assert judged(second, estimate)[1] == expected


@pytest.mark.parametrize("reason", ["flag", "stale", "unsized"])
def test_what_is_no_standard_raises_no_doubt(reason):
    estimate = hand()
    standard = seen(estimate, 0, {INDEX: 1.5}, flag=int(MarkerFlag.AMBIGUOUS) if reason == "flag" else 0)
    if reason == "unsized":
        standard = MarkerBlock(WEARING, replace(standard.observations, detect_s=float("nan")))
    judged(standard, estimate)
    assert estimate.looks[0, INDEX, LOOK_WIDTH] == pytest.approx(1.5**0.5 * WIDTH_M if reason == "stale" else 0.0)
    estimate.looks[:, :, LOOK_AGE] += 1.1 * FRESH_S if reason == "stale" else 0.0
    doubt, left_out = judged(seen(estimate, 1), estimate)
    assert not doubt.any() and left_out == []


ABREAST = np.array([[[900.0, 0.0, 60.0], [0.0, 900.0, 20.0]], [[900.0, 0.0, -60.0], [0.0, 900.0, 20.0]]])  # px/m


@pytest.mark.parametrize(("other", "flag", "away_s", "calm_s", "own"), [
    ({}, 0, 0.0, 1.1 * CALM_S, OWN), ({INDEX: 0.5}, int(MarkerFlag.EDGE), 0.0, 1.1 * CALM_S, 1.0),
    ({}, 0, 1.1 * FRESH_S, 1.1 * CALM_S, 1.0), ({}, 0, 0.0, 0.9 * CALM_S, 1.0)],
    ids=["in plain view", "one flagged", "seen before", "after trouble"])
def test_half_of_the_noise_is_both_cameras_while_both_see_the_whole_hand(other, flag, away_s, calm_s, own):
    estimate = hand()
    estimate.untroubled[0] = calm_s
    first = seen(estimate, 0, other, flag=flag)
    judged(first, estimate)
    assert (first.frame.own == 1.0).all()  # nobody else has seen anything yet
    estimate.looks[:, :, LOOK_AGE] += away_s
    second = seen(estimate, 1)
    judged(second, estimate)
    assert (second.frame.own == own).all()


@given(arrays(float, (2, 2, 3), elements=st.floats(-50.0, 50.0)), arrays(float, 3, elements=st.floats(-0.05, 0.05)))
def test_no_place_of_the_marker_is_a_disagreement(turned, off):
    one, other = (View(slope @ off, slope) for slope in ABREAST + turned)
    assert disagreement(one, other) == pytest.approx(0.0, abs=1e-6)


def test_sights_that_no_place_explains_disagree_by_how_far_they_must_move():
    up, down = np.array([0.3, 1.0]), np.array([-0.2, -1.0])
    assert disagreement(View(up, ABREAST[0]), View(down, ABREAST[1])) == pytest.approx(np.sqrt(2.0))
