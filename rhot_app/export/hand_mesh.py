"""A hand's surface for skinned animation: the capsules of `rhot_app.hand.shape` as triangles, bound to the bones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.export.bones import TURNING
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandModel
from rhot_app.hand.shape import segments
from rhot_app.hand.skeleton import ANGLES, FINGERS, JOINTS, HandPose

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

AROUND: Final = 14  # corners of a capsule's cross-section
RINGS: Final = 4  # of each round end, the pole apart


@dataclass(frozen=True, slots=True)
class HandMesh:
    """The surface at zero angles, palm frame, m: `vertices` (V, 3), outward unit `normals` (V, 3), `triangles` (T, 3)
    counterclockwise seen from outside, and the `bone` (V,) that each vertex rides on, an index into TURNING."""

    vertices: Array
    normals: Array
    triangles: Indices
    bone: Indices


def mesh_of(model: HandModel) -> HandMesh:
    """The surface of a hand."""
    pose = HandPose(np.eye(4), np.zeros(len(ANGLES)))
    capsules = segments(model, pose, forward(model, pose))
    vertices, normals, triangles, bones = [], [], [], []
    count = 0
    for name, start, end, radius in zip(capsules.names, capsules.start, capsules.end, capsules.radius, strict=True):
        points, directions, faces = _capsule(start, end, float(radius))
        vertices.append(points)
        normals.append(directions)
        triangles.append(faces + count)
        bones.append(np.full(len(points), _bone(name)))
        count += len(points)
    return HandMesh(np.concatenate(vertices), np.concatenate(normals), np.concatenate(triangles), np.concatenate(bones))


def _bone(capsule: str) -> int:
    """The turning joint behind which a capsule lies: the first bone of a finger turns at its base joint."""
    finger, _, segment = capsule.partition("_")
    if finger not in FINGERS:
        return 0
    first = ("metacarpal", "proximal", "distal") if finger == "thumb" else ("proximal", "medial", "distal")
    number = 1 if segment == "neck" else first.index(segment)
    base = JOINTS.index("thumb_cmc" if finger == "thumb" else f"{finger}_mcp")
    return TURNING.index(base + number)


def _capsule(start: Array, end: Array, radius: float) -> tuple[Array, Array, Indices]:
    """Vertices, normals and triangles of one capsule."""
    axis = end - start
    length = float(np.linalg.norm(axis))
    along = axis / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
    side = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    side /= np.linalg.norm(side)
    turns = 2.0 * np.pi * np.arange(AROUND) / AROUND
    around = np.cos(turns)[:, None] * side + np.sin(turns)[:, None] * np.cross(along, side)
    heights = 0.5 * np.pi * np.arange(1, RINGS + 1) / RINGS  # from the pole to the equator
    rings = [-np.cos(height) * along + np.sin(height) * around for height in heights]
    rings += [np.cos(height) * along + np.sin(height) * around for height in heights[::-1]]
    normals = np.concatenate([[-along], *rings, [along]])
    centres = np.repeat([start, end], 1 + RINGS * AROUND, axis=0)
    return centres + radius * normals, normals, _faces(2 * RINGS)


def _faces(rings: int) -> Indices:
    """Triangles between a first pole, `rings` rings and a last pole."""
    here = np.arange(AROUND)
    after = (here + 1) % AROUND
    first, last = 1 + here, 1 + (rings - 1) * AROUND
    faces = [np.column_stack([np.zeros(AROUND, np.int64), 1 + after, first])]
    for ring in range(rings - 1):
        low, high = 1 + ring * AROUND, 1 + (ring + 1) * AROUND
        faces += [np.column_stack([low + here, low + after, high + after]),
                  np.column_stack([low + here, high + after, high + here])]
    faces.append(np.column_stack([np.full(AROUND, 1 + rings * AROUND), last + here, last + after]))
    return np.concatenate(faces)
