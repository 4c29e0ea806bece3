"""The hand as one posed mesh: palm hull, finger capsules, and the thin skeleton inside them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.skeleton import FINGERS, JOINTS
from rhot_app.state import HandState, Knowledge
from rhot_app.ui.models.palette import Scheme, rgb_of
from rhot_app.ui.scene.frames import to_display
from rhot_app.ui.scene.meshes import Faces, Mesh, capsule_template, hull_of_spheres, pose_capsules, repeat_faces

Array = NDArray[np.float64]
Codes = NDArray[np.uint8]

BONES: tuple[tuple[int, int], ...] = tuple((1 + 4 * f + k, 2 + 4 * f + k) for f in range(5) for k in range(3))
"""Joint numbers of the 15 finger segments, in finger order."""

RAYS: tuple[tuple[int, int], ...] = tuple((0, 1 + 4 * f) for f in range(5))
"""Joint numbers of the five lines from the wrist to each finger's base."""

TIPS: tuple[int, ...] = tuple(4 + 4 * f for f in range(5))
"""Joint numbers of the fingertips; they get no ball, it would stick out of the skin."""

_UNDER_PAINT_M = 0.003
"""The skin of a fingertip ends so much before the tip, so that it does not stick out of the painted marker."""

_LAST_BONE = 0.7  # of its length is drawn in the skeleton, for the same reason
_SKELETON_RADIUS_M = 0.0017
_JOINT_RADIUS_M = 0.0034


@dataclass(frozen=True, slots=True)
class PosedMesh:
    """Vertices and normals (N, 3) in the scene's frame, m, and how each vertex is known (N,) `Knowledge`."""

    vertices: Array
    normals: Array
    knowledge: Codes


def bone_knowledge(joint_knowledge: Codes, near: NDArray[np.intp], far: NDArray[np.intp]) -> Codes:
    """How bones between joints `near` and `far` (B,) are known: no better than the less known end."""
    return np.maximum(joint_knowledge[near], joint_knowledge[far]).astype(np.uint8)


def mirrored(points: Array, anatomy: HandAnatomy) -> Array:
    """Points of a right hand's palm frame (..., 3), in the frame of `anatomy`'s own side."""
    return points if anatomy.side == "right" else points * np.array([1.0, -1.0, 1.0])


def palm_hull(anatomy: HandAnatomy) -> Mesh:
    """The palm in its own frame, m: the convex hull of the wrist's two sides, the knuckles and the thumb's base."""
    half = 0.5 * anatomy.wrist_thickness_mm
    side = 0.5 * anatomy.wrist_breadth_mm - half
    centres = [(0.0, side, 0.0), (0.0, -side, 0.0)]
    radii = [half, half]
    for name in FINGERS:
        finger = anatomy.fingers[name]
        centres.append(finger.base_mm)
        least = 0.0 if name == "thumb" else 0.42 * anatomy.palm_thickness_mm
        radii.append(max(finger.radii_mm[0], least))
    return hull_of_spheres(1e-3 * mirrored(np.array(centres), anatomy), 1e-3 * np.array(radii))


def finger_radii(anatomy: HandAnatomy) -> Array:
    """(15, 2) m: radius at the near and far end of each finger segment; a segment tapers to the next one's radius."""
    rows = []
    for name in FINGERS:
        r = np.array(anatomy.fingers[name].radii_mm) * 1e-3
        rows += [(r[0], r[1]), (r[1], r[2]), (r[2], 0.9 * r[2])]
    return np.array(rows)


class HandMesh:
    """Skin of one hand. `faces` never change; `pose` gives the vertices of one state."""

    def __init__(self, anatomy: HandAnatomy) -> None:
        self._template = capsule_template(12, 3)
        self._palm = palm_hull(anatomy)
        self._radii = finger_radii(anatomy)
        self._shortening = np.array([0.0, 0.0, 1.0] * 5) * (self._radii[:, 1] + _UNDER_PAINT_M)
        count = len(self._template.directions)
        fingers = repeat_faces(self._template.faces, count, len(BONES))
        self.faces: Faces = np.concatenate([fingers, self._palm.faces + np.uint32(len(BONES) * count)])

    def pose(self, state: HandState) -> PosedMesh:
        """The skin at `state`. Segments with an unknown end, and an unknown palm, collapse to a point."""
        joints = to_display(state.joint_positions)
        near, far = np.array(BONES).T
        starts, stops = joints[near], joints[far]
        direction = stops - starts
        length = np.maximum(np.linalg.norm(direction, axis=1), 1e-9)
        stops = stops - direction * np.minimum(self._shortening / length, 0.8)[:, None]
        known = np.isfinite(starts).all(axis=1) & np.isfinite(stops).all(axis=1)
        starts, stops = np.where(known[:, None], starts, 0.0), np.where(known[:, None], stops, 0.0)
        vertices, normals = pose_capsules(self._template, starts, stops, self._radii * known[:, None])
        count = len(self._template.directions)
        knowledge = np.repeat(bone_knowledge(state.joint_knowledge, near, far), count)
        palm, palm_normals = self._pose_palm(state.world_from_palm)
        return PosedMesh(np.concatenate([vertices, palm]), np.concatenate([normals, palm_normals]),
                         np.concatenate([knowledge, np.full(len(palm), int(state.palm_knowledge), np.uint8)]))

    def _pose_palm(self, world_from_palm: Array) -> tuple[Array, Array]:
        if not np.isfinite(world_from_palm).all():
            return np.zeros_like(self._palm.vertices), self._palm.normals
        rotation, translation = world_from_palm[:3, :3], world_from_palm[:3, 3]
        return (to_display(self._palm.vertices @ rotation.T + translation),
                to_display(self._palm.normals @ rotation.T))


class SkeletonMesh:
    """Thin lines from joint to joint and a ball at each joint, as meshes because wide lines are not portable."""

    def __init__(self) -> None:
        self._template = capsule_template(6, 1)
        count = len(self._template.directions)
        self._pairs = np.array([*BONES, *RAYS, *((k, k) for k in range(len(JOINTS)) if k not in TIPS)])
        bones = len(BONES) + len(RAYS)
        radii = np.repeat([_SKELETON_RADIUS_M, _JOINT_RADIUS_M], [bones, len(self._pairs) - bones])
        self._radii = radii[:, None] * np.ones(2)
        self._share = np.where(np.isin(self._pairs[:, 1], TIPS), _LAST_BONE, 1.0)[:, None]
        self.faces: Faces = repeat_faces(self._template.faces, count, len(self._pairs))

    def pose(self, state: HandState) -> PosedMesh:
        """The skeleton at `state`; parts with an unknown end are not drawn. A ball is as known as its joint."""
        joints = to_display(state.joint_positions)
        near, far = self._pairs.T
        starts = joints[near]
        stops = starts + self._share * (joints[far] - starts)
        known = np.isfinite(starts).all(axis=1) & np.isfinite(stops).all(axis=1)
        starts, stops = np.where(known[:, None], starts, 0.0), np.where(known[:, None], stops, 0.0)
        vertices, normals = pose_capsules(self._template, starts, stops, self._radii * known[:, None])
        count = len(self._template.directions)
        return PosedMesh(vertices, normals, np.repeat(bone_knowledge(state.joint_knowledge, near, far), count))


# -- Measured, inferred, guessed: how each looks -----------------------------------------------------------------------

Colours = NDArray[np.uint8]

ALPHA: dict[Knowledge, int] = {Knowledge.MEASURED: 255, Knowledge.INFERRED: 115, Knowledge.GUESSED: 135,
                               Knowledge.UNKNOWN: 0}
"""How solid each kind is; what is guessed is hatched besides."""

_ALPHAS = np.array([ALPHA[knowledge] for knowledge in Knowledge], np.uint8)


def tinted(colour: str, knowledge: Codes, scheme: Scheme) -> Colours:
    """(N, 4) bytes of something of one colour: grey where it is guessed."""
    table = np.zeros((len(Knowledge), 4), np.uint8)
    for kind in Knowledge:
        table[kind] = (*rgb_of(scheme.guessed if kind is Knowledge.GUESSED else colour), ALPHA[kind])
    return np.asarray(table[knowledge])


def with_knowledge(colours: Colours, knowledge: Codes) -> Colours:
    """The same colours (N, 4), as solid as each is known; what has a colour of its own keeps it."""
    shown = colours.copy()
    shown[:, 3] = _ALPHAS[knowledge]
    return shown
