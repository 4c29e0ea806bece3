"""The filter takes observation kinds that it was not written for: image lines, landmarks and contacts of a hand."""

from functools import cache

import numpy as np
import pytest
from hand_states import assert_jacobian, make_process, markers, moving_state, natural_state, points_of, world_of
from other_residuals import Contact, ImageLine, Landmark, Pinhole
from scipy.stats import chi2

from rhot_app.estimation.filter import IteratedFilter, update
from rhot_app.hand.motion.hand_state import POSE, TANGENT
from rhot_app.hand.skeleton import JOINTS
from rhot_app.tracking.markers.marker_residual import MarkerFrame
from rhot_app.tracking.tracker import CameraObservations

PHALANGES = [(first, first + 1) for finger in range(5) for first in range(1 + 4 * finger, 4 + 4 * finger)]
TIPS = [4 + 4 * finger for finger in range(5)]
CAMERAS = [Pinhole(np.hstack([np.eye(3), [[-x], [0.0], [0.0]]])) for x in (0.0, 0.075)]
PALM_SD = 0.01, 0.1
ANGLE_SHARE = 0.25
LINE_SD_PX, CONTACT_SD_M = 1.0, 2e-3
LANDMARK = 1e-6 * np.array([[4.0, 1.0, 0.0], [1.0, 4.0, 0.0], [0.0, 0.0, 16.0]])
TRIALS = 60


def joints_of(state):
    return points_of(markers().model.dh, state)


def lines(truth, rng, noise=1.0):
    """The phalanges of all fingers in both cameras."""
    dh, out = markers().model.dh, []
    for camera in CAMERAS:
        pixels, _ = camera.project(joints_of(truth))
        for ends in PHALANGES:
            line = ImageLine.through(pixels[list(ends)], dh, camera, ends, LINE_SD_PX)
            # A line has two numbers: it errs by one at either joint. Turned and moved that much, it still is a line.
            away = noise * rng.normal(0.0, LINE_SD_PX, 2)
            ends_seen = pixels[list(ends)] + away[:, None] * line.normal
            out.append(ImageLine.through(ends_seen, dh, camera, ends, LINE_SD_PX))
    return out


def landmarks(truth, rng, noise=1.0):
    """All 21 joints, with Student's t of four degrees of freedom for noise."""
    root, out = np.linalg.cholesky(LANDMARK), []
    for joint, place in enumerate(joints_of(truth)[:len(JOINTS)]):
        away = noise * root @ rng.normal(size=3) / np.sqrt(rng.chisquare(4.0) / 4.0)
        out.append(Landmark(markers().model.dh, joint, place + away, LANDMARK))
    return out


def contacts(truth, rng, noise=1.0):
    """Every fingertip on a plane of its own."""
    out = []
    for tip in TIPS:
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        offset = normal @ joints_of(truth)[tip] + noise * rng.normal(0.0, CONTACT_SD_M)
        out.append(Contact(markers().model.dh, tip, normal, offset, CONTACT_SD_M))
    return out


KINDS = {"lines": [lines], "landmarks": [landmarks], "contacts": [contacts], "all": [lines, landmarks, contacts]}


@pytest.mark.parametrize("kind", ["lines", "landmarks", "contacts"])
def test_the_new_rows_have_the_right_jacobians(kind):
    rng = np.random.default_rng(1)
    process, state, truth = make_process(), moving_state(rng), natural_state(rng)
    for residual in KINDS[kind][0](truth, rng):
        largest = np.abs(residual.linearise(state).jacobian).max()
        assert_jacobian(process, residual, state, rtol=1e-4, atol=1e-5 * max(largest, 1.0))


def prior_of(process, truth, rng):
    """A prior from which the truth may well be drawn: the palm about right, the angles to a share of their spread."""
    _, covariance = process.start(world_of(truth), process.mean, PALM_SD)
    covariance[TANGENT.angles, TANGENT.angles] *= ANGLE_SHARE**2
    step = np.zeros(process.size)
    step[TANGENT.pose] = rng.multivariate_normal(np.zeros(POSE), covariance[TANGENT.pose, TANGENT.pose])
    return process.retract(truth, step), covariance


@cache
def trials(kind):
    """Of each trial: the truth, the prior and the filter's knot."""
    rng, process, out = np.random.default_rng(2), make_process(), []
    for _ in range(TRIALS):
        truth = natural_state(rng)
        prior = prior_of(process, truth, rng)
        estimate = IteratedFilter(process)
        estimate.start(0.0, *prior)
        residuals = [residual for observe in KINDS[kind] for residual in observe(truth, rng)]
        out.append((truth, prior, estimate.add(0.0, residuals)))
    return process, out


def rms_mm(errors):
    return 1e3 * float(np.sqrt(np.mean(np.square(errors))))


@pytest.mark.parametrize(("kind", "share"), [("lines", 0.4), ("landmarks", 0.2), ("contacts", 0.8), ("all", 0.15)])
def test_the_estimate_is_nearer_to_the_truth_than_the_prior(kind, share):
    """Fingertips, over all trials."""
    _, done = trials(kind)
    before = rms_mm([joints_of(prior[0])[TIPS] - joints_of(truth)[TIPS] for truth, prior, _ in done])
    after = rms_mm([joints_of(knot.state)[TIPS] - joints_of(truth)[TIPS] for truth, _, knot in done])
    assert after < share * before


@pytest.mark.parametrize("kind", list(KINDS))
def test_the_errors_are_consistent_with_the_stated_covariance(kind):
    """Squared errors of the pose by the stated covariance are chi squared of 27; curvature may add a little."""
    process, done = trials(kind)
    squares = []
    for truth, _, knot in done:
        error = process.difference(truth, knot.state)[TANGENT.pose]
        squares.append(error @ np.linalg.solve(knot.covariance[TANGENT.pose, TANGENT.pose], error))
    assert 0.85 < np.mean(squares) / POSE < 1.35
    assert np.mean(np.array(squares) < chi2.ppf(0.99, POSE)) > 0.85


def test_kinds_mix_with_the_markers_of_a_frame_in_any_order():
    """One update of all of them is better than that of the markers alone."""
    rng, process = np.random.default_rng(4), make_process()
    alone, together = [], []
    for _ in range(20):
        truth = natural_state(rng)
        prior = prior_of(process, truth, rng)
        frame = seen_by_markers(truth, rng)
        others = [*contacts(truth, rng), *landmarks(truth, rng)]
        few, one, other = (update(process, 0.0, prior, residuals) for residuals in
                           ([frame], [frame, *others], [*others[::-1], frame]))
        np.testing.assert_allclose(process.difference(one.state, other.state), 0.0, atol=1e-6)
        alone.append(joints_of(few.state) - joints_of(truth))
        together.append(joints_of(one.state) - joints_of(truth))
    assert rms_mm(together) < 0.5 * rms_mm(alone)


def seen_by_markers(truth, rng):
    """One camera's frame of the markers."""
    def frame(pixels):
        count = len(pixels)
        return MarkerFrame(markers(), CameraObservations(
            0, 10**15, 0, 1e-5, 10**15, 0.0, 0.0, pixels, np.tile(0.01 * np.eye(2), (count, 1, 1)),
            np.full(count, 16.0), np.ones(count), np.zeros(count, np.uint16)))

    pixels = frame(np.full((6, 2), 240.0)).expected(truth)
    return frame(pixels + rng.normal(0.0, 0.1, pixels.shape))
