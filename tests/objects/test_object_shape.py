"""Signed distances to primitives and meshes agree with other ways to compute them; wrong files are refused."""

from __future__ import annotations

import builtins
import os
import time

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from patience import quickest
from shapes_oracle import box_distance, box_mesh, star, surface_distance, winding_number

from rhot_app.errors import RigError
from rhot_app.objects.shape import Box, Cylinder, Mesh, Sphere, load_mesh

trimesh = pytest.importorskip("trimesh")

LENGTHS = st.floats(0.006, 0.4)
PLACES = st.tuples(*[st.floats(-0.5, 0.5)] * 3)


@given(sides=st.tuples(LENGTHS, LENGTHS, LENGTHS), place=PLACES)
def test_the_distance_to_a_box_equals_brute_force(sides, place):
    point = np.array(place)
    distance, normal = Box(sides).signed_distance(point[None])
    assert abs(abs(distance[0]) - box_distance(point, sides)) < 1e-12
    assert (distance[0] < 0.0) == bool((np.abs(point) < 0.5 * np.array(sides)).all())
    assert abs(np.linalg.norm(normal) - 1.0) < 1e-9
    surface = point - distance[0] * normal[0]
    assert box_distance(surface, sides) < 1e-9


@given(sides=st.tuples(LENGTHS, LENGTHS, LENGTHS), place=PLACES)
def test_a_mesh_of_a_box_is_the_box(sides, place):
    point = np.array([place])
    np.testing.assert_allclose(Mesh(*box_mesh(sides)).signed_distance(point)[0], Box(sides).signed_distance(point)[0],
                               atol=1e-9)


@example(radius=0.1, length=0.2, place=(0.0, 1e-310, 0.0))
@example(radius=0.1, length=0.2, place=(0.0, 1e-160, 0.0))
@given(radius=st.floats(0.005, 0.2), length=LENGTHS, place=PLACES)
def test_the_nearest_point_of_round_shapes_lies_on_them(radius, length, place):
    point = np.array([place])
    distance, normal = Sphere(radius).signed_distance(point)
    assert abs(np.linalg.norm(point - distance[:, None] * normal) - radius) < 1e-9
    distance, normal = Cylinder(radius, length).signed_distance(point)
    x, y, z = (point - distance[:, None] * normal)[0]
    on_side, on_lid = abs(np.hypot(x, y) - radius) < 1e-9, abs(abs(z) - 0.5 * length) < 1e-9
    assert (on_side and abs(z) < 0.5 * length + 1e-9) or (on_lid and np.hypot(x, y) < radius + 1e-9)
    assert (distance[0] < 0.0) == (np.hypot(*point[0, :2]) < radius and abs(point[0, 2]) < 0.5 * length)


@pytest.mark.parametrize("seed", range(3))
def test_the_distance_to_a_mesh_equals_brute_force(seed):
    """Distance by all triangles, sign by the winding number; also beside corners and edges."""
    rng = np.random.default_rng(seed)
    vertices, faces = star(rng, rings=8, around=10)
    triangles = vertices[faces]
    corners = vertices[:30] * rng.uniform(0.8, 1.2, (30, 1))
    edges = triangles[:30, :2].mean(axis=1) * rng.uniform(0.8, 1.2, (30, 1))
    points = np.vstack([rng.uniform(-0.08, 0.08, (40, 3)), corners, edges])
    distance, normal = Mesh(vertices, faces).signed_distance(points)
    for point, found in zip(points, distance, strict=True):
        assert abs(abs(found) - surface_distance(point, triangles)) < 1e-12
        assert (found < 0.0) == (winding_number(point, triangles) > 0.5)
    away, _ = Mesh(vertices, faces).signed_distance(points - distance[:, None] * normal)
    assert np.abs(away).max() < 1e-9


@pytest.mark.parametrize("shape", [Box((0.06, 0.04, 0.1)), Sphere(0.03), Cylinder(0.03, 0.08),
                                   Mesh(*star(np.random.default_rng(5)))])
def test_the_normal_is_the_gradient(shape):
    points = np.random.default_rng(1).uniform(-0.08, 0.08, (200, 3))
    _, normal = shape.signed_distance(points)
    slopes = np.stack([(shape.signed_distance(points + step)[0] - shape.signed_distance(points - step)[0]) / 2e-7
                       for step in 1e-7 * np.eye(3)], axis=1)
    differs = np.abs(slopes - normal).max(axis=1) > 1e-5
    assert differs.mean() < 0.02  # beside the medial axis the nearest point jumps


def test_a_mesh_turned_inside_out_is_turned_back():
    vertices, faces = box_mesh((0.1, 0.1, 0.1))
    assert Mesh(vertices, faces[:, ::-1]).signed_distance(np.zeros((1, 3)))[0][0] == pytest.approx(-0.05)


def test_on_the_surface_the_normal_is_outward():
    vertices, faces = box_mesh((0.1, 0.1, 0.1))
    distance, normal = Mesh(vertices, faces).signed_distance(np.array([[0.05, 0.01, 0.02], [0.05, 0.05, 0.05]]))
    np.testing.assert_allclose(distance, 0.0, atol=1e-15)
    np.testing.assert_allclose(normal, [[1.0, 0.0, 0.0], np.full(3, 3**-0.5)], atol=1e-9)


@pytest.mark.parametrize("shape", [Box((0.1, 0.1, 0.1)), Sphere(0.05), Cylinder(0.05, 0.1),
                                   Mesh(*box_mesh((0.1, 0.1, 0.1)))])
def test_unknown_points_have_unknown_distances(shape):
    distance, _ = shape.signed_distance(np.array([[np.nan, 0.0, 0.0], [0.06, 0.0, 0.0]]))
    assert np.isnan(distance[0]) and distance[1] == pytest.approx(0.01)


@pytest.mark.parametrize("suffix", ["stl", "obj", "glb"])
def test_files_are_read_in_their_unit(tmp_path, suffix):
    path = tmp_path / f"box.{suffix}"
    trimesh.Trimesh(*box_mesh((60.0, 40.0, 100.0))).export(path)
    mesh = load_mesh(path, "mm")
    np.testing.assert_allclose(mesh.size_m, [0.06, 0.04, 0.1], atol=1e-8)
    assert len(mesh.vertices) == 8  # those of the faces are merged
    with pytest.raises(RigError, match=r"100 m if its unit is m.*Give the unit cm or mm"):
        load_mesh(path, "m")
    trimesh.Trimesh(*box_mesh((0.06, 0.04, 0.1))).export(path)
    assert load_mesh(path, "m").size_m[2] == pytest.approx(0.1)
    with pytest.raises(RigError, match="Give the unit m"):
        load_mesh(path, "mm")


def test_a_fine_mesh_is_searched_in_groups(monkeypatch):
    """Sixteen times the triangles take four times as long, not sixteen, and there is a most."""
    points, times = np.random.default_rng(3).normal(0.0, 0.06, (500, 3)), []
    for subdivisions in (3, 5):
        sphere = trimesh.creation.icosphere(subdivisions=subdivisions, radius=0.05)
        mesh = Mesh(np.asarray(sphere.vertices), np.asarray(sphere.faces))
        mesh.signed_distance(points[:1])
        times.append(quickest(lambda mesh=mesh: mesh.signed_distance(points), clock=time.process_time))
    assert times[1] < 9.0 * times[0]
    monkeypatch.setattr("rhot_app.objects.shape.FACES_MAX", 11)
    with pytest.raises(RigError, match="12 faces; at most 11"):
        Mesh(*box_mesh((0.1, 0.1, 0.1)))


def test_only_what_a_gltf_file_needs_is_read_beside_it(tmp_path):
    """A material of an OBJ file is not opened, and a glTF file names files of its own folder only."""
    os.mkfifo(tmp_path / "box.mtl")
    box = trimesh.Trimesh(*box_mesh((60.0, 40.0, 100.0)))
    (tmp_path / "box.obj").write_text("mtllib box.mtl\nusemtl a\n" + box.export(file_type="obj"))
    assert len(load_mesh(tmp_path / "box.obj", "mm").faces) == 12
    for name, data in box.export(file_type="gltf").items():
        (tmp_path / name).write_bytes(data)
    assert len(load_mesh(tmp_path / "model.gltf", "mm").faces) == 12
    text = (tmp_path / "model.gltf").read_text()
    for other in ("../gltf_buffer_0.bin", "box.mtl"):
        (tmp_path / "other.gltf").write_text(text.replace("gltf_buffer_0.bin", other))
        with pytest.raises(RigError, match=r"other\.gltf"):
            load_mesh(tmp_path / "other.gltf", "mm")


def test_wrong_files_end_with_a_sentence(tmp_path, monkeypatch):
    path = tmp_path / "box.stl"
    with pytest.raises(RigError, match="cannot be read"):
        load_mesh(path, "mm")
    path.write_bytes(b"solid nothing\n\xff")
    with pytest.raises(RigError, match=r"box\.stl"):
        load_mesh(path, "mm")
    with pytest.raises(RigError, match="unit"):
        load_mesh(path, "ft")
    with pytest.raises(RigError, match="Export it as"):
        load_mesh(tmp_path / "box.blend", "mm")
    vertices, faces = box_mesh((60.0, 40.0, 100.0))
    trimesh.Trimesh(vertices, faces[1:]).export(path)
    with pytest.raises(RigError, match="not closed"):
        load_mesh(path, "mm")
    real = builtins.__import__

    def without(name, *rest):
        if name == "trimesh":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(RigError, match="pip install trimesh"):
        load_mesh(path, "mm")


@pytest.mark.parametrize("make", [lambda: Box((60.0, 40.0, 100.0)), lambda: Sphere(0.001), lambda: Sphere(float("nan")),
                                  lambda: Cylinder(0.01, 2.0), lambda: Box((-0.1, 0.1, 0.1))])
def test_sizes_that_no_hand_holds_are_refused(make):
    with pytest.raises(RigError, match="largest side"):
        make()
