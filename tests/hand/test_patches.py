"""A fingertip's marker is where its paint is, and hands are solved for it there."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from hand_samples import random_pose
from shipped_markers import RHOT6

from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandModel, neutral_pose
from rhot_app.hand.places import patch_of, place_of, segment_axis, with_markers
from rhot_app.hand.skeleton import FINGERS, HandPose
from rhot_app.hand.solvers.finger_ik import solve_fingers
from rhot_app.hand.solvers.methods import Method, make_problem, solve
from rhot_app.hand.solvers.palm_fit import fit_palm
from rhot_node.markers import Marker, MarkerSet


def worn(patch: str, **fields: object) -> MarkerSet:
    """rhot6 with another patch on its fingertips."""
    shape = {"shape": "disc", "radius_mm": None} if patch in ("nail", "pulp") else {}
    return msgspec.structs.replace(RHOT6, markers=tuple(
        msgspec.structs.replace(m, patch=patch, **shape, **fields) if m.role != "wrist" else m for m in RHOT6.markers))


def height(model: HandModel, marker: Marker) -> tuple[float, float]:
    """How far a fingertip's place is along the bone from the last joint, and out of a straight finger's back, m."""
    finger = FINGERS.index(marker.id)
    pose = HandPose(np.eye(4), np.zeros(21))
    points = forward(with_markers(model, MarkerSet((marker,))), pose)
    last, tip = points.joints[3 + 4 * finger:5 + 4 * finger]
    along = (tip - last) / np.linalg.norm(tip - last)
    off = points.marker_centres[finger] - last
    return float(off @ along), float(np.linalg.norm(off - (off @ along) * along)) * np.sign(off[2])


def test_a_nail_is_on_the_back_and_a_dot_on_the_pulp(model):
    for nail, dot, whole in zip(worn("nail", length_mm=11.0).markers, worn("pulp", length_mm=8.0).markers,
                                RHOT6.markers, strict=True):
        if nail.id in ("thumb", "wrist"):  # a thumb's back is not up
            continue
        finger = FINGERS.index(nail.id)
        radius, bone = model.radii[finger, 2], model.bones[finger, 2]
        along, up = height(model, nail)
        assert up == pytest.approx(0.8 * radius, abs=0.1 * radius) and along == pytest.approx(bone - 0.0085)
        along, up = height(model, dot)
        assert up == pytest.approx(-0.93 * radius, abs=0.05 * radius) and along == pytest.approx(model.marker[finger])
        for around in (whole, msgspec.structs.replace(whole, patch="ring", length_mm=8.0, gap_deg=60.0)):
            assert height(model, around) == pytest.approx((model.marker[finger], 0.0), abs=1e-12)


def test_the_place_is_where_the_middle_of_the_patch_is_seen_from_several_sides(right_hand):
    """Against rays: the patch's surface, its outward normals, the centroid of its image in parallel projection."""
    nail = worn("nail", length_mm=11.0).markers[1]
    patch, (axis, half_axis) = patch_of(nail, right_hand, 1), segment_axis(right_hand, 1)
    place = place_of(nail, right_hand).point
    height_m = float(np.linalg.norm(place[1:]))
    x, y = np.meshgrid(np.linspace(-1, 1, 401), np.linspace(-1, 1, 401))
    inside = np.abs(x) ** patch.corners + np.abs(y) ** patch.corners <= 1.0
    x, y = patch.middle + patch.half * x[inside], patch.half_across * y[inside]
    beyond = np.sign(x - axis) * np.maximum(np.abs(x - axis) - half_axis, 0.0)
    z = np.sqrt(right_hand.radii[1, 2] ** 2 - beyond**2 - y**2)
    for turn in (np.array([0.2, 0.0]), np.array([-0.2, 0.0]), np.array([0.0, 0.25]), np.array([0.0, -0.25])):
        seen = 1.0 + turn[0] * beyond / z + turn[1] * y / z  # area towards the line of sight (turn, 1)
        centroid = np.array([np.average(x - turn[0] * z, weights=seen), np.average(y - turn[1] * z, weights=seen)])
        expected = np.array([place[0], 0.0]) - turn * height_m
        assert centroid == pytest.approx(expected, abs=2.5e-4)  # of a rim that is not quite plane


@pytest.mark.parametrize("patch", ["nail", "pulp"])
def test_fingers_are_solved_for_markers_beside_the_bone(model, patch):
    model = with_markers(model, worn(patch, length_mm=10.0))
    rng = np.random.default_rng(3)
    low, high = model.limits.T
    met = []
    for _ in range(60):
        pose = random_pose(model, rng)
        targets = forward(model, pose).marker_centres
        solution = solve_fingers(model, neutral_pose(pose.world_from_palm), targets)
        assert (solution.angles >= low - 1e-4).all() and (solution.angles <= high + 1e-4).all()
        reached = forward(model, HandPose(pose.world_from_palm, solution.angles))
        met.append(np.linalg.norm(reached.marker_centres - targets, axis=1))
        np.testing.assert_allclose(met[-1], solution.residuals, atol=1e-9)
    assert (np.array(met) <= 1e-4).mean() > 0.97


@pytest.mark.parametrize("method", [Method.LEVENBERG, Method.CLOSED_FORM])
def test_other_methods_meet_markers_beside_the_bone(model, method):
    model = with_markers(model, worn("nail", length_mm=10.0))
    pose = HandPose(np.eye(4), np.clip(neutral_pose().angles + 0.2, *model.limits.T))
    targets = forward(model, pose).marker_centres
    angles = solve(method, make_problem(model, pose, targets)).angles
    met = forward(model, HandPose(np.eye(4), angles)).marker_centres
    np.testing.assert_allclose(met[1:], targets[1:], atol=1e-6)


def test_a_palm_is_found_under_painted_nails(right_hand):
    model = with_markers(right_hand, worn("nail"))
    points = forward(model, neutral_pose())
    fit = fit_palm(model, points.joints[0], points.marker_centres, None, 0.0)
    assert fit is not None
    found = forward(model, fit.pose)
    assert np.linalg.norm(found.marker_centres - points.marker_centres, axis=1).max() < 2e-3
    wrong = fit_palm(right_hand, points.joints[0], points.marker_centres, None, 0.0)
    assert wrong is not None
    assert (np.abs(fit.pose.angles - neutral_pose().angles).mean()
            < np.abs(wrong.pose.angles - neutral_pose().angles).mean()), "taking nails for whole tips bends fingers"


def test_whole_segments_leave_the_model_as_it_is(right_hand):
    painted = with_markers(right_hand, RHOT6)
    np.testing.assert_array_equal(painted.dh.point_offset, right_hand.dh.point_offset)
    np.testing.assert_array_equal(painted.chain, right_hand.chain)
    assert not painted.chain_bend.any()
