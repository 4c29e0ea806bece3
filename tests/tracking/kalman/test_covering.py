"""Paint that fingers come to lie before: when a sight of it is left out, how large it is known to be, and its bias."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from modelled_hand import model_rig, moving, sights
from places import places_of
from scipy.spatial.transform import Rotation

from rhot_app.hand.model import neutral_pose
from rhot_app.project import Rig
from rhot_app.simulator.motion import FACING
from rhot_app.tracking.kalman.covering import (
    COVERED,
    LEARNT,
    STRAYS_M_S,
    leave_out_covered,
    set_bias_variance,
)
from rhot_app.tracking.kalman.estimate import BIAS, empty_estimate
from rhot_app.tracking.kalman.marker_block import MarkerBlock
from rhot_app.tracking.kalman.markers import project_marker
from rhot_app.tracking.kalman.rows import Page, empty_rows
from rhot_app.tracking.kalman.share import Share
from rhot_app.tracking.kalman.sighted import FRESH_S, KEPT_S
from rhot_app.tracking.kalman.sizes import measure_sizes
from rhot_app.tracking.kalman.wearing import compile_wearing
from rhot_node.wire.messages import MarkerFlag

INDEX_KNUCKLE, LITTLE_KNUCKLE = 6, 7
WIDTH_M = 0.022
JUST_COVERED, JUST_SHOWN = 0.98 * COVERED**0.5, 1.02 * COVERED**0.5  # of the known width


def painted_rig() -> Rig:
    """Knuckles wear paint of no known shape, as in the file."""
    rig = model_rig("rhot8")
    markers = tuple(msgspec.structs.replace(marker, shape="blob" if marker.id.endswith("knuckle") else "disc")
                    for marker in rig.markers.markers)
    return msgspec.structs.replace(rig, markers=msgspec.structs.replace(rig.markers, markers=markers))


RIG = painted_rig()
WEARING = compile_wearing(RIG)
COUNT = len(WEARING.roles)
MADE = WEARING.bias_variance


def known_hand(turn_deg=0.0):
    """A hand that faces the cameras, but for a turn, whose markers were all seen just now; it knows how wide its paint
    is."""
    estimate = empty_estimate(2, COUNT)
    estimate.world[:3, :3] = Rotation.from_rotvec([0.0, np.radians(turn_deg), 0.0]).as_matrix() @ FACING
    estimate.world[:3, 3] = 0.03, 0.08, 0.6
    estimate.angles[:] = neutral_pose().angles
    estimate.unseen[:] = 0.0
    estimate.width[:] = np.where(WEARING.worn.palmar, WIDTH_M, 0.0)
    estimate.bias_variance[:] = MADE
    estimate.covariance[:] = 1e-6 * np.eye(len(estimate.covariance))
    return estimate


def seen_by(camera, estimate, widths_m, flags=0, marker=INDEX_KNUCKLE):
    """One camera's frame of the hand, in which each marker looks as wide as `widths_m`; `flags` of one marker."""
    frame = sights(RIG, moving(markers="rhot8"), 0.1)[camera]
    rows = np.zeros(COUNT, np.uint16)
    rows[marker] = flags
    pixel, slope, px_per_m = np.empty(2), np.empty((2, 3)), np.empty(COUNT)
    for m, point in enumerate(points_of(estimate)):
        project_marker(point, estimate.world, WEARING.worn.half_axes[m], WEARING.cameras.pose[camera],
                       WEARING.cameras.intrinsics[camera], pixel, slope)
        px_per_m[m] = np.sqrt(np.linalg.norm(np.cross(*slope)))
    return MarkerBlock(WEARING, replace(frame, camera=camera, flags=rows,
                                        diameters=np.broadcast_to(widths_m, COUNT) * px_per_m))


def points_of(estimate):
    """(M, 3) m where the knuckles are; of the others anything."""
    return estimate.world[:3, 3] + WEARING.worn.dh.point_offset @ estimate.world[:3, :3].T


def covered_in(block, estimate):
    places = places_of(WEARING.worn, estimate)
    measure_sizes(WEARING.worn, WEARING.cameras, block.frame, estimate, places)
    leave_out_covered(WEARING.worn, WEARING.cameras, block.frame, estimate, places.points, MADE)
    return np.flatnonzero(block.frame.covered).tolist()


@pytest.mark.parametrize("camera", [0, 1])
def test_paint_that_shows_too_little_is_covered_and_no_other_marker_is(camera):
    widths = np.full(COUNT, 0.1 * WIDTH_M)
    widths[INDEX_KNUCKLE], widths[LITTLE_KNUCKLE] = JUST_COVERED * WIDTH_M, JUST_SHOWN * WIDTH_M
    estimate = known_hand()
    assert covered_in(seen_by(camera, estimate, widths), estimate) == [INDEX_KNUCKLE]


def test_covered_paint_makes_no_rows():
    estimate = known_hand()
    block = seen_by(0, estimate, JUST_COVERED * WIDTH_M)
    rows = empty_rows(BIAS + 3 * COUNT)
    page = Share(Page(estimate, rows))
    for append in (block.enter, block.linearise, block.enter):  # a frame may be weighed again
        rows.used[:] = 0
        append(page)
        assert rows.source[:rows.used[1], 2].tolist() == list(range(INDEX_KNUCKLE))


def test_a_hand_farther_away_has_smaller_paint_that_is_not_covered():
    estimate = known_hand()
    block = seen_by(0, estimate, WIDTH_M)
    smaller = replace(block.observations, diameters=0.5 * block.observations.diameters)
    assert covered_in(MarkerBlock(WEARING, smaller), estimate) == [INDEX_KNUCKLE, LITTLE_KNUCKLE]
    far = known_hand()
    far.world[:3, 3] *= 2.0
    far.width[:] *= 1.02  # the knuckles are not at the palm's origin
    assert covered_in(MarkerBlock(WEARING, smaller), far) == []


def test_flat_paint_that_turns_away_is_not_covered():
    """It shows less by the cosine; how it is turned to its line of sight."""
    estimate = known_hand(turn_deg=50.0)
    share = np.cos(np.radians(50.0)) ** 0.5
    assert covered_in(seen_by(0, estimate, 0.97 * share * WIDTH_M), estimate) == []
    assert covered_in(seen_by(0, estimate, 0.7 * share * WIDTH_M), estimate) == [INDEX_KNUCKLE, LITTLE_KNUCKLE]


def test_size_is_learnt_at_once_then_slowly_and_only_from_plain_sights():
    estimate = known_hand()
    estimate.width[INDEX_KNUCKLE] = 0.0
    assert covered_in(seen_by(0, estimate, WIDTH_M), estimate) == []
    assert estimate.width[INDEX_KNUCKLE] == pytest.approx(WIDTH_M)
    covered_in(seen_by(1, estimate, 1.5 * WIDTH_M), estimate)
    assert estimate.width[INDEX_KNUCKLE] == pytest.approx((1.0 + 0.5 * LEARNT) * WIDTH_M)
    before, doubtful = estimate.width.copy(), np.where(np.arange(COUNT) == INDEX_KNUCKLE, 2.0, 0.9) * WIDTH_M
    for flag in (MarkerFlag.AMBIGUOUS, MarkerFlag.PARTIAL, MarkerFlag.REFERENCE):
        covered_in(seen_by(0, estimate, doubtful, flag), estimate)
    np.testing.assert_array_equal(estimate.width, before)


def test_text_datagrams_tell_no_sizes():
    estimate = known_hand()
    unsized = replace(seen_by(0, estimate, 0.1 * WIDTH_M).observations, detect_s=float("nan"))
    assert covered_in(MarkerBlock(WEARING, unsized), estimate) == []
    np.testing.assert_array_equal(estimate.width, known_hand().width)


def test_bias_of_paint_that_was_away_may_have_grown_and_is_as_ever_when_it_shows():
    estimate = known_hand()
    whole, covered = (seen_by(0, estimate, share * WIDTH_M) for share in (1.0, JUST_COVERED))
    for away, grown in ((0.9 * FRESH_S, 0.0), (1.0, 1.0), (2.0, 2.0), (KEPT_S, 0.0)):
        estimate.unseen[:, INDEX_KNUCKLE] = away
        covered_in(covered, estimate)
        assert estimate.bias_variance[INDEX_KNUCKLE] == pytest.approx(MADE[INDEX_KNUCKLE] + (STRAYS_M_S * grown) ** 2)
    estimate.unseen[:, INDEX_KNUCKLE] = 2.0
    covered_in(covered, estimate)
    covered_in(whole, estimate)
    np.testing.assert_array_equal(estimate.bias_variance, MADE)


def test_a_bias_of_another_size_keeps_what_is_known_of_it_and_of_all_else():
    rng = np.random.default_rng(1)
    estimate = known_hand()
    mixing = rng.normal(size=estimate.covariance.shape)
    estimate.covariance[:], estimate.bias[:] = mixing @ mixing.T, rng.normal(size=(COUNT, 3))
    before, bias, place = estimate.covariance.copy(), estimate.bias.copy(), BIAS + 3 * INDEX_KNUCKLE
    own = np.arange(place, place + 3)
    set_bias_variance(estimate, INDEX_KNUCKLE, MADE[INDEX_KNUCKLE] + 4.0)
    expected = before.copy()
    expected[own, own] += 4.0
    np.testing.assert_allclose(estimate.covariance, expected)
    np.testing.assert_array_equal(estimate.bias, bias)
    share = np.ones(len(before))
    share[own] = np.sqrt(MADE[INDEX_KNUCKLE] / (MADE[INDEX_KNUCKLE] + 4.0))
    set_bias_variance(estimate, INDEX_KNUCKLE, MADE[INDEX_KNUCKLE])
    np.testing.assert_allclose(estimate.covariance, share[:, None] * expected * share)
    np.testing.assert_allclose(estimate.bias[INDEX_KNUCKLE], share[place] * bias[INDEX_KNUCKLE])
    others = np.arange(COUNT) != INDEX_KNUCKLE
    np.testing.assert_array_equal(estimate.bias[others], bias[others])
