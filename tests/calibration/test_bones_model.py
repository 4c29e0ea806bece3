"""The hand behind the calibration of bones: derivatives, the prior, noise, rigid bodies, places by their names."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from bones_twin import RICH, base_hand, free_movement, person, record

from rhot_app.calibration.hand import marker_places as hand_prior
from rhot_app.calibration.hand.bones_collector import find_slip, rigid_bodies, rigid_pairs
from rhot_app.calibration.hand.bundle_model import Poses, expected, in_segments, linearise
from rhot_app.calibration.hand.fit import choose_instants
from rhot_app.calibration.hand.marker_places import tracks_of
from rhot_app.calibration.hand.shape import MARKERS, HandUnknowns
from rhot_app.calibration.time.tracks import _smooth_all, smooth
from rhot_app.errors import CalibrationError
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import FINGERS, HandPose


def some_hand(seed: int = 0) -> tuple[HandUnknowns, np.ndarray, Poses]:
    """A hand unlike the base hand in a few poses."""
    rng = np.random.default_rng(seed)
    unknowns = HandUnknowns(base_hand(), RICH)
    vector = rng.multivariate_normal(unknowns.prior.mean, 0.25 * unknowns.prior.covariance)
    _, poses = free_movement(base_hand(), 3.0, 1.0, seed)
    return unknowns, vector, poses


def test_derivatives_are_those_of_finite_differences() -> None:
    unknowns, vector, poses = some_hand()
    at = linearise(unknowns, vector, poses)
    assert at.points.shape == (len(poses.angles), len(RICH), 3)
    rng, step = np.random.default_rng(7), 1e-6
    for _ in range(12):  # directions in which everything changes at once: no column can be wrong unseen
        way, turn = rng.normal(size=unknowns.size), rng.normal(size=(len(poses.angles), 27))
        there, back = (expected(unknowns, vector + sign * step * way, poses) for sign in (1, -1))
        np.testing.assert_allclose(at.per_shape @ way, (there - back) / (2 * step), atol=1e-7)
        there, back = (expected(unknowns, vector, poses.moved(sign * step * turn)) for sign in (1, -1))
        moved = np.einsum("fmip,fp->fmi", at.per_pose, turn)
        np.testing.assert_allclose(moved, (there - back) / (2 * step), atol=1e-7)


def test_the_vector_is_the_hand_that_its_file_describes() -> None:
    unknowns, vector, poses = some_hand(1)
    model = build_model(unknowns.anatomy(vector))
    tips = [k for k, place in enumerate(RICH) if place.painted]
    vector[MARKERS:unknowns.slides].reshape(-1, 3)[tips, 1:] = 0.0  # a hand file knows markers on the bone only
    for k, angles in enumerate(poses.angles):
        centres = forward(model, HandPose(poses.world[k], angles)).marker_centres
        np.testing.assert_allclose(expected(unknowns, vector, poses)[k, tips], centres, atol=5e-5)


def test_a_hand_file_says_what_it_did_before() -> None:
    base = msgspec.structs.replace(base_hand("left"), name="mine")
    unknowns = HandUnknowns(base, RICH)
    again = unknowns.anatomy(unknowns.prior.mean)
    assert (again.name, again.side) == ("mine", "left")
    for finger in FINGERS:
        old, new = base.fingers[finger], again.fingers[finger]
        np.testing.assert_allclose(new.bones_mm, old.bones_mm, atol=0.01)
        np.testing.assert_allclose(new.base_rotation_deg, old.base_rotation_deg, atol=0.01)
        np.testing.assert_allclose(new.base_mm, old.base_mm, atol=0.01)
        assert new.marker_mm == pytest.approx(old.marker_mm, abs=0.01) and new.limits_deg == old.limits_deg


def test_the_prior_scatters_as_adults_do() -> None:
    unknowns = HandUnknowns(base_hand(), RICH)
    whole = np.sqrt(np.diag(unknowns.prior.covariance)[:15]) * 1e3
    assert whole[3] == pytest.approx(4.94, abs=0.05)  # index proximal, Buryanov and Kotiuk 2010
    assert whole[7] == pytest.approx(3.00, abs=0.05)  # middle medial
    fixed = np.sqrt(np.diag(unknowns.prior.fixed_size)[:15]) * 1e3
    assert (fixed < whole).all()
    correlation = unknowns.prior.covariance[3, 6] / (whole[3] * whole[6] * 1e-6)
    assert 0.2 < correlation < 0.8  # big hands have all bones longer
    np.testing.assert_allclose(1e3 * hand_prior.BONES_M, [base_hand().fingers[f].bones_mm for f in FINGERS])


def test_residuals_are_told_along_the_markers_own_bone() -> None:
    unknowns, vector, poses = some_hand(2)
    moved = vector.copy()
    moved[MARKERS + 3 * 7 + 2] += 1e-3  # one marker higher above its bone
    off = expected(unknowns, moved, poses) - expected(unknowns, vector, poses)
    local = in_segments(unknowns, vector, poses, off)
    np.testing.assert_allclose(local[:, 7], np.tile([0.0, 0.0, 1e-3], (len(local), 1)), atol=1e-9)
    assert np.abs(np.delete(local, 7, axis=1)).max() < 1e-12


def test_smoothing_tells_the_noise_and_halves_it() -> None:
    rng = np.random.default_rng(3)
    times = np.arange(3000) / 60.0
    true = 0.1 * np.stack([np.sin(2 * times), np.cos(3 * times), np.sin(times)], axis=1)[:, None]
    noisy = true + rng.normal(0, 0.4e-3, true.shape)
    noisy[rng.random(3000) < 0.05] = np.nan
    smoothed = smooth(times, noisy)
    assert smoothed.raw_noise_m == pytest.approx(0.4e-3, rel=0.1)
    left = np.nanstd(smoothed.positions - true)
    assert left == pytest.approx(smoothed.noise_m, rel=0.15) and left < 0.25e-3
    slow = smooth(times[::4], noisy[::4])
    assert slow.noise_m == slow.raw_noise_m == pytest.approx(0.4e-3, rel=0.25)
    np.testing.assert_array_equal(slow.positions, noisy[::4])


def test_a_fast_finger_is_not_smoothed_away() -> None:
    rng = np.random.default_rng(4)
    times = np.arange(3000) / 100.0
    true = 0.01 * np.stack([np.sin(45 * times), np.cos(45 * times), np.sin(9 * times)], axis=1)[:, None]
    smoothed = smooth(times, true + rng.normal(0, 0.02e-3, true.shape))
    assert np.nanstd(smoothed.positions - true) < 0.03e-3 < np.nanstd(_smooth_all(true, 10)[0] - true)
    assert smoothed.apart <= 3


def test_rigid_markers_are_found_and_grouped() -> None:
    tracks = record(person(4), RICH, 4, seconds=20.0)
    pairs = rigid_pairs(tracks.positions, 0.4e-3)
    assert rigid_bodies(pairs, len(RICH)) == [(0, 1, 2)]
    true = np.linalg.norm(np.nanmedian(tracks.positions[:, 0] - tracks.positions[:, 1], axis=0))
    assert any((pair.first, pair.second) == (0, 1) for pair in pairs) and true > 0


def test_a_slip_is_found_with_its_time() -> None:
    tracks = record(person(5), RICH, 5, seconds=30.0)
    assert find_slip(tracks.times_s, tracks.positions, 0, 1) is None
    slipped = tracks.positions.copy()
    apart = slipped[:, 1] - slipped[:, 0]
    late = tracks.times_s > 18.0
    slipped[late, 1] += 3e-3 * (apart / np.linalg.norm(apart, axis=1, keepdims=True))[late]
    slip = find_slip(tracks.times_s, slipped, 0, 1)
    assert slip is not None
    assert slip.at_s == pytest.approx(18.0, abs=1.0)
    assert slip.after_m - slip.before_m == pytest.approx(3e-3, abs=3e-4)


def test_instants_are_as_different_as_possible() -> None:
    tracks = record(person(6), RICH, 6, seconds=30.0)
    positions = tracks.positions.copy()
    positions[:600] = positions[0]  # ten seconds of rest
    chosen = choose_instants(positions, 100)
    assert len(chosen) == 100 and (np.diff(chosen) > 0).all()
    assert (chosen < 600).sum() < 15


@pytest.mark.parametrize(("word", "place"), [
    ("index_tip", (1, 2)), ("ring_distal", (3, 2)), ("thumb_metacarpal", (0, 0)), ("little_medial", (4, 1)),
    ("palm_7", (-1, -1)), ("hand_top", (-1, -1)), ("wrist", (-1, -1)),
])
def test_places_are_read_from_names(word: str, place: tuple[int, int]) -> None:
    (found,) = tracks_of(np.zeros(1), np.zeros((1, 2, 3)), ["pillow", "m"], {"m": word}).places
    assert (found.finger, found.segment) == place and found.painted == (word == "wrist")


def test_a_middle_marker_finds_its_bone() -> None:
    tip = np.zeros((50, 3))
    names = ["index_tip", "index_middle"]
    for distance, segment in ((0.026, 1), (0.057, 0)):
        middle = tip + np.array([distance, 0.0, 0.0])
        places = tracks_of(np.arange(50.0), np.stack([tip, middle], axis=1), names).places
        assert places[1].segment == segment


@pytest.mark.parametrize(("roles", "words"), [
    ({"nobody": "index_tip"}, "there is no marker 'nobody'"), ({"m": "nose"}, "'nose' is no place on the hand"),
    ({}, "none of the markers"),
])
def test_wrong_roles_are_named(roles: dict[str, str], words: str) -> None:
    with pytest.raises(CalibrationError, match=words):
        tracks_of(np.zeros(1), np.zeros((1, 1, 3)), ["m"], roles)
