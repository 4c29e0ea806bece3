"""A thumb that is taken to bend backwards."""

import numpy as np
import pytest
from known_hand import WEARING, moving_estimate

from rhot_app.hand.kinematics import forward, jacobian
from rhot_app.hand.skeleton import ANGLE_SLICES, JOINTS, HandPose
from rhot_app.tracking.kalman.elbow import BACKWARDS_RAD, bent_backwards, unbend
from rhot_app.tracking.kalman.estimate import ANGLES, FREE, PLACED, POSE

MODEL, USUAL, LIMITS = WEARING.model, WEARING.habits.usual, WEARING.limits
THUMB = ANGLE_SLICES[0]
MCP, IP = 3, 4


def with_thumb(flexion, mcp, ip):
    estimate = moving_estimate()
    estimate.angles[[1, MCP, IP]] = flexion, mcp, ip
    return estimate


def joints(estimate):
    """(5, 3) m thumb tip's marker, and the others'."""
    return forward(MODEL, HandPose(estimate.world, estimate.angles)).marker_centres


@pytest.mark.parametrize(("flexion", "mcp", "ip"), [(0.09, -0.1, -0.1), (0.3, -0.15, -0.15), (0.3, -0.02, -0.2),
                                                    (0.5, -0.15, -0.05)])
def test_a_thumb_that_bends_backwards_is_bent_forwards_with_its_tip_in_place(flexion, mcp, ip):
    estimate = with_thumb(flexion, mcp, ip)
    before, others, world = joints(estimate), estimate.angles[THUMB.stop:].copy(), estimate.world.copy()
    assert bent_backwards(estimate)
    assert unbend(estimate, WEARING)
    assert estimate.angles[[MCP, IP]].sum() > BACKWARDS_RAD and not bent_backwards(estimate)
    np.testing.assert_allclose(joints(estimate), before, atol=1e-4)
    np.testing.assert_array_equal(estimate.angles[THUMB.stop:], others)
    np.testing.assert_array_equal(estimate.world, world)
    assert (estimate.angles >= LIMITS[:, 0]).all() and (estimate.angles <= LIMITS[:, 1]).all()


def of_tip(estimate):
    """(3, 27) m: how the thumb tip's marker goes with the pose."""
    return jacobian(MODEL, HandPose(estimate.world, estimate.angles))[len(JOINTS)]


@pytest.mark.parametrize(("flexion", "mcp", "ip"), [(0.3, -0.15, -0.15), (0.5, -0.15, -0.05)])
def test_its_tip_stays_as_well_known_as_it_was(flexion, mcp, ip):
    """Fingertips are known to half a millimetre where joints and palm are not; so is the thumb's, however it bends."""
    estimate = with_thumb(flexion, mcp, ip)
    pose, lever = slice(POSE), of_tip(estimate)
    seen = estimate.covariance[pose, pose] @ lever.T
    estimate.covariance[pose, pose] -= seen @ np.linalg.solve(lever @ seen + 25e-8 * np.eye(3), seen.T)
    before = lever @ estimate.covariance[pose, pose] @ lever.T
    estimate.unseen[:] = 0.0
    assert unbend(estimate, WEARING)
    lever, covariance = of_tip(estimate), estimate.covariance[pose, pose]
    np.testing.assert_allclose(lever @ covariance @ lever.T, before, atol=3e-8)
    assert np.linalg.eigvalsh(covariance)[0] > -1e-12
    thumb = slice(ANGLES + THUMB.start, ANGLES + THUMB.stop)
    unseen = np.linalg.svd(lever[:, thumb])[2][3:]  # what the joints do without moving the tip
    free, usual = unseen @ covariance[thumb, thumb] @ unseen.T, unseen @ USUAL[thumb, thumb] @ unseen.T
    assert np.trace(free) > 0.2 * np.trace(usual)


@pytest.mark.parametrize(("mcp", "ip"), [(0.26, 0.26), (0.5, -0.1), (0.0, 0.0), (-0.4 * BACKWARDS_RAD,) * 2])
def test_a_thumb_that_hardly_bends_backwards_is_not_looked_at(mcp, ip):
    assert not bent_backwards(with_thumb(0.09, mcp, ip))


@pytest.mark.parametrize("thumb", [None, (-0.43, -0.17, -0.2)], ids=["natural", "at the end of its range"])
def test_a_thumb_that_has_no_better_way_to_bend_is_left_alone(thumb):
    """Bent forwards, the second one's root would have to go back beyond its limit."""
    estimate = moving_estimate() if thumb is None else with_thumb(*thumb)
    if thumb is None:
        estimate.angles[:] = WEARING.habits.mean
    assert bent_backwards(estimate) == (thumb is not None)
    angles, covariance = estimate.angles.copy(), estimate.covariance.copy()
    assert not unbend(estimate, WEARING)
    np.testing.assert_array_equal(estimate.angles, angles)
    np.testing.assert_array_equal(estimate.covariance, covariance)


@pytest.mark.parametrize(("short_of_end_deg", "bends"), [(0.0, True), (1.5, False)])
def test_a_thumb_at_the_end_of_its_way_back_rather_bends_forwards(short_of_end_deg, bends):
    """Either way it would be about as natural; but at the end it is not where it would go."""
    mcp, ip = LIMITS[THUMB][3:, 0] + np.radians(short_of_end_deg)
    estimate = with_thumb(-0.1, mcp, ip)
    before = joints(estimate)
    assert bent_backwards(estimate) and unbend(estimate, WEARING) == bends
    assert bent_backwards(estimate) != bends
    np.testing.assert_allclose(joints(estimate), before, atol=1e-4)


@pytest.mark.parametrize(("seen_s", "held"), [(0.2, FREE), (0.0, PLACED)], ids=["by one camera", "a hand that is held"])
def test_of_a_thumb_that_two_cameras_do_not_locate_nothing_is_known_afterwards(seen_s, held):
    estimate = with_thumb(0.3, -0.15, -0.15)
    estimate.unseen[:], estimate.held[0] = 0.0, held
    estimate.unseen[1] = seen_s
    assert unbend(estimate, WEARING)
    thumb = slice(ANGLES + THUMB.start, ANGLES + THUMB.stop)
    np.testing.assert_array_equal(estimate.covariance[thumb, thumb], USUAL[thumb, thumb])
    assert not estimate.covariance[thumb, ANGLES + THUMB.stop:POSE].any()
