"""Fingertips that others hide in part: how much of them is missing, and what that says of where their middles are."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from painted_fingertips import COUNT, INDEX, WEARING, WRIST, hand, looked_at, opened, placed, seen, silhouette_m2
from scipy.spatial.transform import Rotation

from rhot_app.simulator.motion import FACING
from rhot_app.tracking.kalman.estimate import BIAS, LOOK_AGE, LOOK_HIDDEN, LOOK_VARIANCE
from rhot_app.tracking.kalman.hiding import (
    FASTEST_M_S,
    MOVED,
    PLACED_BY,
    PLAIN_PX,
    SHIFT,
    VARIED,
    VARIES,
    VARIES_PER_M_S,
    part_shown,
    slightly_moved,
)
from rhot_app.tracking.kalman.sighted import FRESH_S
from rhot_app.tracking.known import TOLD, empty_sheet, fill_known
from rhot_node.wire.messages import MarkerFlag


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3), st.floats(0.0, 1.2))
def test_a_fingertip_shows_as_much_as_its_silhouette(turn, bent):
    estimate = hand(bent)
    estimate.world[:3, :3] = Rotation.from_rotvec(turn).as_matrix() @ FACING
    camera, places = WEARING.cameras.pose[0], placed(estimate)
    parts = [part_shown(WEARING.worn, places, camera, m) for m in range(COUNT)]
    eye = -camera[:, :3].T @ camera[:, 3]
    for finger in range(5):
        radius = WEARING.model.radii[finger, 2]
        largest = np.pi * radius**2 * (1.0 + WEARING.worn.slender[finger])
        assert parts[finger] * largest == pytest.approx(silhouette_m2(estimate, finger, eye), rel=2e-3)
    assert parts[WRIST] == 1.0 and WEARING.worn.slender[WRIST] < 0.0


@pytest.mark.parametrize("bent", [0.0, 0.9])
def test_what_is_missing_moves_the_middle_for_all_cameras(bent):
    estimate = looked_at(bent)
    width_m = estimate.width[INDEX]
    off = opened(seen(estimate, 0, {INDEX: 0.5}), estimate)
    eye = -WEARING.cameras.pose[0, :, :3].T @ WEARING.cameras.pose[0, :, 3]
    radius = np.sqrt(0.5 * silhouette_m2(estimate, INDEX, eye) / np.pi)
    assert off[INDEX] == pytest.approx(SHIFT * radius * np.sqrt(0.5**3 - VARIES**3), rel=0.03)
    assert off[[0, 2, 3, 4, WRIST]].max() == 0.0
    assert opened(seen(estimate, 1, {INDEX: 0.8}), estimate)[INDEX] > 0.9 * off[INDEX]  # the worst of both counts
    assert estimate.width[INDEX] == pytest.approx(width_m)  # what is hidden teaches no size
    opened(seen(estimate, 0), estimate)
    assert opened(seen(estimate, 1), estimate).max() == 0.0


def test_what_hides_too_little_to_be_doubted_is_told():
    """A fingertip that shows a twentieth less than it has may do so in plain view, or be hidden by as much."""
    estimate = looked_at()
    radius = 0.5 * estimate.width[INDEX]
    assert slightly_moved(estimate, INDEX) < (0.02 * radius) ** 2
    assert opened(seen(estimate, 0, {INDEX: 0.95}), estimate)[INDEX] == 0.0
    hidden = estimate.looks[0, INDEX, LOOK_HIDDEN]
    assert hidden == pytest.approx(0.05, abs=0.01)
    assert slightly_moved(estimate, INDEX) == pytest.approx((MOVED * radius) ** 2 * hidden**3, rel=1e-2)
    opened(seen(estimate, 0, {INDEX: 0.5}), estimate)  # all but so much of it is a bias then
    assert slightly_moved(estimate, INDEX) == pytest.approx((MOVED * radius) ** 2 * VARIES**3, rel=1e-2)
    estimate.looks[0, :, LOOK_AGE] = 1.1 * FRESH_S
    assert slightly_moved(estimate, INDEX) < (0.02 * radius) ** 2


def test_what_another_camera_saw_long_ago_no_longer_counts():
    estimate = looked_at()
    opened(seen(estimate, 1, {INDEX: 0.5}), estimate)
    estimate.looks[1, :, LOOK_AGE] = 1.1 * FRESH_S
    assert opened(seen(estimate, 0), estimate).max() == 0.0


def test_areas_vary_more_of_a_hand_that_hurries():
    for speed, share in ((0.0, 1.0 - 0.8 * VARIES), (1.0, 1.0 - VARIES - 0.8 * VARIES_PER_M_S),
                         (10.0, 1.0 - VARIES - 0.8 * VARIES_PER_M_S * FASTEST_M_S)):
        estimate = looked_at()
        estimate.velocity[0] = speed
        assert opened(seen(estimate, 0, {INDEX: share}), estimate).max() == 0.0
        estimate.velocity[0] = 0.0
        hidden = opened(seen(estimate, 0, {INDEX: share}), estimate)[INDEX]
        assert (hidden > 0.0) == (share < 1.0 - VARIES)


def test_one_camera_alone_does_not_know_how_much_there_is():
    estimate = looked_at()
    estimate.unseen[1, PLACED_BY - 1:] = 1.0
    assert opened(seen(estimate, 0, {INDEX: 0.5}), estimate).max() == 0.0
    estimate.unseen[1, PLACED_BY - 1] = 0.0
    assert opened(seen(estimate, 0, {INDEX: 0.5}), estimate)[INDEX] > 1e-3


def test_sizes_are_learnt_of_plain_view_and_of_growth_faster():
    estimate = looked_at()
    true = estimate.width.copy()
    for factor in (0.8, 1.04):
        estimate.width[:] = factor * true
        for _ in range(30):
            opened(seen(estimate, 0), estimate)
        left = abs(estimate.width[INDEX] / true[INDEX] - 1.0) / abs(factor - 1.0)
        assert left < 0.1 if factor < 1.0 else 0.5 < left < 0.9
    estimate.width[INDEX] = 1.04 * true[INDEX]
    opened(seen(estimate, 0, {INDEX: 0.95}, MarkerFlag.PARTIAL), estimate)
    assert estimate.width[INDEX] == 1.04 * true[INDEX]


def test_how_much_sizes_vary_is_learnt_with_them():
    estimate = looked_at()
    assert 0.5 * VARIED**2 < estimate.width_varies[INDEX] < VARIED**2
    for k in range(300):
        opened(seen(estimate, 0, dict.fromkeys(range(5), 0.97 if k % 2 else 1.0)), estimate)
    steps = 0.5 * np.log(0.97) / 2.0  # half of the way from one width to the other, and as much beside the largest
    assert np.sqrt(estimate.width_varies[INDEX]) == pytest.approx(np.hypot(steps, steps), rel=0.15)
    before = estimate.width_varies.copy()
    opened(seen(estimate, 0, {INDEX: 0.6}), estimate)
    assert estimate.width_varies[INDEX] == before[INDEX]  # what is hidden is no variation


@pytest.mark.parametrize(("share", "flag", "cautious"), [(1.0, 0, False), (0.5, 0, True), (1.3, 0, True),
                                                        (0.99, MarkerFlag.AMBIGUOUS, True)])
def test_a_node_may_be_less_cautious_about_what_is_in_plain_view(share, flag, cautious):
    for stated_px in (0.05, 0.8):
        estimate = looked_at()
        block = seen(estimate, 0, {INDEX: share}, flag)
        block.frame.covariances[:] = stated_px**2 * np.eye(2)
        opened(block, estimate)
        counts = 1.0 if cautious else min(1.0, (PLAIN_PX / stated_px) ** 2)
        assert block.frame.own[INDEX] == pytest.approx(counts)
        assert block.frame.own[WRIST] == 1.0


def test_what_hides_a_fingertip_is_told_of_it():
    """Beside what paint and light do, which is told to be less than the filter works with."""
    told, column = [], BIAS + 3 * INDEX
    for hiding_m in (0.0, 2e-3):
        estimate = looked_at()
        estimate.looks[:, :, LOOK_VARIANCE] = 0.04**2
        bias = WEARING.bias_variance[INDEX] + hiding_m**2
        estimate.bias_variance[INDEX] = bias
        np.fill_diagonal(estimate.covariance, 1e-6)
        estimate.covariance[0, 0] = estimate.covariance[column, column] = bias
        estimate.covariance[0, column] = estimate.covariance[column, 0] = -0.999 * bias  # a place as good as its marker
        out = np.empty((TOLD, TOLD))
        fill_known(estimate, WEARING.cameras, WEARING.paint_variance, WEARING.bias_variance, empty_sheet(COUNT), out)
        told.append(out[0, 0])
    assert told[0] < 0.5 * WEARING.bias_variance[INDEX]
    assert told[1] == pytest.approx(2e-3**2, rel=0.05)
