"""The tracked objects in the scene: each object's mesh, its shape, or its tags, at its pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import RigError
from rhot_app.objects.object_file import BoxShape, CylinderShape, ObjectModel, SphereShape
from rhot_app.objects.shape import load_mesh
from rhot_app.objects.state import ObjectState, Validity
from rhot_app.project import Rig, RigObject
from rhot_app.ui.models.palette import Scheme, rgb_of
from rhot_app.ui.scene.frames import to_display
from rhot_app.ui.scene.mesh_item import MeshItem
from rhot_app.ui.scene.meshes import Faces, hull_of_spheres, repeat_faces, sphere

Array = NDArray[np.float64]

SECTORS = 40
MARKER_M = 0.004  # radius of the balls that stand for an object of markers
_OPAQUE, _UNSURE = 255, 110  # tracked; ambiguous or predicted
_BOX = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_BOX_FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6],
                       [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]], np.uint32)


class ObjectActors:
    """The items of a rig's objects; `items` are to be added to the view."""

    def __init__(self, rig: Rig, scheme: Scheme, opacity: float = 1.0) -> None:
        self._colour, self._opacity = rgb_of(scheme.accent), opacity
        self._bodies = [surface_of(one) for one in rig.objects if one.model is not None]
        self.items = tuple(MeshItem(faces) for _, _, faces in self._bodies)
        for item in self.items:
            item.setDepthValue(2)
        self.hide()

    def hide(self) -> None:
        """Show nothing until the next pose."""
        for item in self.items:
            item.setVisible(False)

    def pose(self, objects: tuple[ObjectState, ...]) -> None:
        """Show those that have a pose: what is ambiguous or predicted is translucent and hatched."""
        self.hide()
        for item, (points, normals, _), one in zip(self.items, self._bodies, objects, strict=False):
            if not one.tracked:
                continue
            rotation, origin = one.world_from_object[:3, :3], one.world_from_object[:3, 3]
            sure = one.validity is Validity.TRACKED
            alpha = round(self._opacity * (_OPAQUE if sure else _UNSURE))
            colours = np.tile(np.array([*self._colour, alpha], np.uint8), (len(points), 1))
            item.set_vertices(to_display(points @ rotation.T + origin), to_display(normals @ rotation.T), colours,
                              np.full(len(points), not sure))
            item.setVisible(True)


def surface_of(one: RigObject) -> tuple[Array, Array, Faces]:
    """What is drawn of an object: vertices (V, 3) m and normals (V, 3), object frame, and triangles (F, 3).

    Its mesh, if it can be read; else its shape; else its tags, or a ball for each marker.
    """
    model = one.model
    assert model is not None
    if model.mesh is not None and one.folder is not None:
        try:
            mesh = load_mesh(one.folder / model.mesh.file, model.mesh.unit)
        except RigError:  # the engine has said so
            pass
        else:
            return _flat(mesh.vertices, mesh.faces.astype(np.uint32))
    match model.shape:
        case BoxShape(sides_mm=sides):
            return _flat(1e-3 * np.array(sides) * _BOX, _BOX_FACES)
        case SphereShape(diameter_mm=diameter):
            ball = sphere(SECTORS, SECTORS // 4)
            return 0.5e-3 * diameter * ball.vertices, ball.normals, ball.faces
        case CylinderShape(diameter_mm=diameter, length_mm=length):
            return _flat(*_cylinder(0.5e-3 * diameter, 1e-3 * length))
    return _tags_of(model) if model.fiducials else _balls_of(model)


def _flat(vertices: Array, faces: Faces) -> tuple[Array, Array, Faces]:
    """A surface with the normals of its faces."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    apart = np.arange(3 * len(faces), dtype=np.uint32).reshape(-1, 3)
    return corners.reshape(-1, 3), np.repeat(normals, 3, axis=0), apart


def _cylinder(radius_m: float, length_m: float) -> tuple[Array, Faces]:
    around = np.linspace(0.0, 2.0 * np.pi, SECTORS, endpoint=False)
    ring = np.column_stack([radius_m * np.cos(around), radius_m * np.sin(around), np.zeros(SECTORS)])
    half = np.array([0.0, 0.0, 0.5 * length_m])
    faces = []
    for k in range(SECTORS):
        j = (k + 1) % SECTORS
        faces += [(k, j, SECTORS + j), (k, SECTORS + j, SECTORS + k), (j, k, 2 * SECTORS),
                  (SECTORS + k, SECTORS + j, 2 * SECTORS + 1)]
    return np.concatenate([ring - half, ring + half, [-half, half]]), np.array(faces, np.uint32)


def _tags_of(model: ObjectModel) -> tuple[Array, Array, Faces]:
    corners = np.concatenate([tag.corners() for tag in model.fiducials])
    halves = np.array([[0, 2, 1], [0, 3, 2]], np.uint32)
    return _flat(corners, repeat_faces(halves, 4, len(model.fiducials)))


def _balls_of(model: ObjectModel) -> tuple[Array, Array, Faces]:
    centres = 1e-3 * np.array([marker.position_mm for marker in model.markers])
    hull = hull_of_spheres(centres, np.full(len(centres), MARKER_M))
    return hull.vertices, hull.normals, hull.faces
