"""Meshes and frames of the scene, without OpenGL."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fake_engine import FakeEngine, synthetic_rig

from rhot_app.project import CameraPose
from rhot_app.state import Knowledge
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.scene import frames as stage
from rhot_app.ui.scene.ellipsoid_mesh import EllipsoidChoice, EllipsoidMesh
from rhot_app.ui.scene.frames import (
    DISPLAY_FROM_RIG,
    camera_like,
    camera_like_state,
    frustum_lines,
    rotation_of,
    to_display,
)
from rhot_app.ui.scene.hand_actors import MarkerMesh
from rhot_app.ui.scene.hand_mesh import HandMesh, SkeletonMesh, palm_hull
from rhot_app.ui.scene.meshes import capsule_template, elliptic_band, pose_capsules, sphere
from rhot_node.files import resource_path
from rhot_node.markers import load_markers


@pytest.fixture(scope="module")
def engine():
    return FakeEngine(clock=lambda: 0.0)


def outward(vertices, normals, faces):
    """Share of triangles that turn the same way as their corners' normals."""
    corners = vertices[faces]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(facing, axis=1)
    dots = np.einsum("fi,fi->f", facing, normals[faces].mean(axis=1))
    return (dots[area > 1e-12] > 0).mean()


def test_up_in_the_rig_is_up_in_the_scene():
    assert np.linalg.det(DISPLAY_FROM_RIG) == pytest.approx(1.0)
    assert to_display(np.array([0.0, -1.0, 0.0])).tolist() == [0.0, 0.0, 1.0]
    assert to_display(np.array([0.1, 0.0, 2.0])).tolist() == [0.1, 2.0, 0.0]


def test_a_frustum_opens_along_the_cameras_axis():
    node = synthetic_rig().nodes[1]
    lines = frustum_lines(node.intrinsics, node.pose, 0.1)
    assert len(lines) == 20
    assert lines[0] == pytest.approx(to_display(np.array([0.075, 0.0, 0.0])))
    assert lines[1::2][:4, 1] == pytest.approx([0.1] * 4)
    turned = frustum_lines(node.intrinsics, CameraPose(rotation_wxyz=(np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)), 0.1)
    assert turned[1::2][:4, 0] == pytest.approx([0.1] * 4)  # a camera turned about y by 90 deg looks along x
    assert rotation_of((1.0, 0.0, 0.0, 0.0)) == pytest.approx(np.eye(3))


@pytest.mark.parametrize("mesh", [sphere(), elliptic_band(0.03, 0.02, 0.02)], ids=["sphere", "band"])
def test_triangles_look_outward(mesh):
    assert outward(mesh.vertices, mesh.normals, mesh.faces) == 1.0
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0)


def test_a_capsule_runs_from_end_to_end():
    template = capsule_template()
    vertices, normals = pose_capsules(template, np.array([[0.0, 0.0, 0.0]]), np.array([[0.1, 0.0, 0.0]]),
                                      np.array([[0.01, 0.02]]))
    assert vertices[:, 0].min() == pytest.approx(-0.01) and vertices[:, 0].max() == pytest.approx(0.12)
    assert outward(vertices, normals, template.faces) == 1.0


def test_the_palm_is_closed_and_as_large_as_the_anatomy(engine):
    hull = palm_hull(engine.rig.hand)
    edges = np.sort(hull.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert np.ptp(hull.vertices[:, 1]) > 0.06 and np.ptp(hull.vertices[:, 0]) > 0.08


def test_the_skin_covers_the_joints(engine):
    state = engine.state(2.0)
    posed = HandMesh(engine.rig.hand).pose(state)
    low, high = posed.vertices.min(axis=0), posed.vertices.max(axis=0)
    joints = to_display(state.joint_positions)
    assert (joints >= low - 4e-3).all() and (joints <= high + 4e-3).all()  # the tips end under the paint
    assert np.isfinite(posed.vertices).all()


def test_a_bone_is_as_known_as_its_less_known_end(engine):
    joints = np.full(21, Knowledge.MEASURED, np.uint8)
    joints[7], joints[12] = Knowledge.INFERRED, Knowledge.GUESSED  # index DIP, middle tip
    state = replace(engine.state(2.0), joint_knowledge=joints, palm_knowledge=Knowledge.GUESSED)
    skin = HandMesh(engine.rig.hand).pose(state)
    count = len(capsule_template(12, 3).directions)
    segments = skin.knowledge[:15 * count].reshape(15, count)
    assert (segments == segments[:, :1]).all()
    inferred, guessed = int(Knowledge.INFERRED), int(Knowledge.GUESSED)
    assert segments[:, 0].tolist() == [0, 0, 0, 0, inferred, inferred, 0, 0, guessed, 0, 0, 0, 0, 0, 0]
    assert (skin.knowledge[15 * count:] == guessed).all()
    bones = SkeletonMesh().pose(state).knowledge.reshape(36, -1)[:, 0]  # 15 bones, 5 rays, 16 balls
    assert bones[:15].tolist() == segments[:, 0].tolist() and not bones[15:20].any()
    assert bones[20:].tolist().count(inferred) == 1


def test_what_is_unknown_is_not_drawn_and_nothing_is_nan(engine):
    state = engine.state(2.0)
    joints = state.joint_positions.copy()
    joints[5:9] = np.nan
    positions = state.marker_positions.copy()
    positions[1] = np.nan
    blank = replace(state, joint_positions=joints, marker_positions=positions,
                    marker_covariances=np.full((6, 3, 3), np.nan), world_from_palm=np.full((4, 4), np.nan))
    rig = engine.rig
    ellipsoids = EllipsoidMesh(rig.markers, DARK).pose(blank, EllipsoidChoice())
    posers = (HandMesh(rig.hand), SkeletonMesh(), MarkerMesh(rig.markers, rig.hand))
    for posed in (*(mesh.pose(blank) for mesh in posers), ellipsoids):
        assert np.isfinite(posed.vertices).all() and np.isfinite(posed.normals).all()
    index = HandMesh(rig.hand).pose(blank).vertices.reshape(-1, 3)
    count = len(capsule_template(12, 3).directions)
    assert np.ptp(index[3 * count:4 * count], axis=0).max() == 0.0  # the first segment of the index finger


def test_markers_lie_where_they_were_measured_in_their_own_colours(engine):
    state = engine.state(2.0)
    mesh = MarkerMesh(engine.rig.markers, engine.rig.hand)
    posed = mesh.pose(state)
    thumb = (mesh.colours[:, :3] == engine.rig.markers.markers[0].display_rgb).all(axis=1)
    middle = 0.5 * (posed.vertices[thumb].min(axis=0) + posed.vertices[thumb].max(axis=0))
    assert middle == pytest.approx(to_display(state.marker_positions[0]), abs=1e-3)


def test_a_nail_is_drawn_flat_where_it_is_painted(engine):
    state = engine.state(2.0)
    nails = MarkerMesh(load_markers(resource_path("markers", "nails6.json")), engine.rig.hand)
    drawn = nails.pose(state).vertices[(nails.colours[:, :3] == engine.rig.markers.markers[1].display_rgb).all(axis=1)]
    off = np.linalg.norm(drawn - to_display(state.marker_positions[1]), axis=1)
    assert off.max() == pytest.approx(0.0055, abs=0.0015), "half of the nail's length"
    assert off.min() < 0.005, "and narrower"


def spans(mesh, state, choice):
    """(27, 3) m: how far each ellipsoid reaches along the scene's axes; 16 joints, 5 tips, 6 markers."""
    posed = mesh.pose(state, choice)
    assert np.linalg.norm(posed.normals, axis=1) == pytest.approx(1.0)
    return np.ptp(posed.vertices.reshape(27, -1, 3), axis=1)


@pytest.fixture
def estimated(engine):
    """A state whose places are all known to 1, 2 and 3 mm along x, y and z of the rig."""
    known = np.diag([1e-6, 4e-6, 9e-6])
    return replace(engine.state(2.0), marker_covariances=np.tile(known, (6, 1, 1)),
                   joint_covariances=np.tile(known, (21, 1, 1)), fingertip_covariances=np.tile(known, (5, 1, 1)))


def test_ellipsoids_show_three_sigma(engine, estimated):
    mesh = EllipsoidMesh(engine.rig.markers, DARK)
    found = spans(mesh, estimated, EllipsoidChoice())
    assert found[[0, 20, 26]] == pytest.approx(np.tile([0.006, 0.018, 0.012], (3, 1)), rel=0.06)
    assert found[21:26].max() == 0.0, "a painted fingertip has one ellipsoid, not two that flicker"
    assert not mesh.cut


def test_ellipsoids_can_be_chosen_and_are_cut_where_they_hide_everything(engine, estimated):
    mesh = EllipsoidMesh(engine.rig.markers, DARK)
    only = spans(mesh, estimated, EllipsoidChoice(joints=False, fingertips=False))
    assert only[:21].max() == 0.0 and (only[21:].min(axis=1) > 0.005).all()
    larger = spans(mesh, estimated, EllipsoidChoice(factor=10))
    assert larger[0] == pytest.approx([0.06, 0.12, 0.12], rel=0.06) and mesh.cut
    unknown = spans(mesh, replace(estimated, joint_covariances=np.full((21, 3, 3), np.nan)), EllipsoidChoice())
    assert unknown[:16].max() == 0.0 and unknown[16:21].min() > 0.0


def test_the_floor_has_ticks_in_millimetres():
    texts = [label.text for label in stage.tick_labels()]
    assert {"-400", "400", "1000", "x [mm]", "z [mm]", "up [mm]"} <= set(texts)
    assert "-0" not in texts


def test_a_rig_on_a_table_stands_on_the_floor_with_z_up(engine):
    state = replace(engine.state(2.0), joint_positions=np.tile([0.1, -0.2, 0.3], (21, 1)))
    shown = camera_like_state(state, "z")
    assert to_display(shown.joint_positions)[0] == pytest.approx([0.1, 0.3, 0.3 + stage.FLOOR_M])
    palm = shown.world_from_palm
    assert np.linalg.det(palm[:3, :3]) == pytest.approx(1.0)
    up_in_palm = state.world_from_palm[:3, :3].T @ [0.0, 0.0, 1.0]
    assert to_display(palm[:3, :3] @ up_in_palm) == pytest.approx([0.0, 0.0, 1.0])
    spread = np.trace(shown.marker_covariances[0])
    assert spread == pytest.approx(np.trace(state.marker_covariances[0]))
    assert shown.fingertip_positions == pytest.approx(camera_like(state.fingertip_positions, "z"))
    assert camera_like_state(state, "-y") is state


def test_cameras_over_a_table_and_its_axes_are_drawn_alike(engine):
    node = engine.rig.nodes[1]
    over = CameraPose(rotation_wxyz=(0.0, 1.0, 0.0, 0.0), translation_m=(0.0, 0.0, 0.4))  # straight down
    lines = frustum_lines(node.intrinsics, over, 0.1, "z")
    assert lines[0] == pytest.approx([0.0, 0.5, 0.4 + stage.FLOOR_M])
    assert lines[1][2] == pytest.approx(0.3 + stage.FLOOR_M)
    axes, _ = stage.axis_lines(on_table=True)
    assert axes[5] - axes[4] == pytest.approx([0.0, 0.0, 0.08])
    texts = [label.text for label in stage.tick_labels(on_table=True)]
    assert {"-500", "500", "y [mm]", "up [mm]"} <= set(texts)
