"""Shapes of hand-held objects: signed distance and outward normal from points to a surface, object frame, m.

Boxes, spheres and cylinders are analytic. Meshes (STL, OBJ, glTF) are exact: the nearest point of the nearest triangle
(Ericson 2005), with the sign of its angle-weighted pseudonormal (Bærentzen and Aanæs 2005).
"""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from rhot_app.errors import RigError
from rhot_app.objects.object_file import BoxShape, CylinderShape, ObjectModel, SphereShape
from rhot_node.errors import printable
from rhot_node.files import read_input, why

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

UNITS_M = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 25.4e-3}

SMALLEST_M, LARGEST_M = 5e-3, 1.0
"""m: largest side of an object that a hand holds, from a peg to a stick."""

SUFFIXES = (".stl", ".obj", ".glb", ".gltf")

FACES_MAX = 700_000
"""Triangles of a mesh: 0.9 GB of memory while they are read and prepared."""

MESH_BYTES_MAX = 100 << 20
"""Of a file: as OBJ, the most triangles take about 30 to 80 MiB."""

_AT_CENTRE_M = 1e-12
"""Nearer than this to a centre or an axis, every direction leads away from it: a smaller vector's length underflows."""

_SAME = 1e-6  # of the size: vertices nearer than this are one; STL files have 24 bits


class Shape(Protocol):
    """A closed surface."""

    @property
    def size_m(self) -> Array:
        """(3,) m, sides of the bounding box."""
        ...

    def signed_distance(self, points: Array) -> tuple[Array, Array]:
        """Distances (N,) m of points (N, 3), negative inside, and unit normals (N, 3): the gradient of the distance.
        The distance from an unknown (NaN) point is NaN."""
        ...


@dataclass(frozen=True, slots=True)
class Box:
    """A box with its centre at the origin; `sides_m` (3,)."""

    sides_m: tuple[float, float, float]

    def __post_init__(self) -> None:
        require_size(self.size_m, "the box")

    @property
    def size_m(self) -> Array:
        """See `Shape`."""
        return np.array(self.sides_m, dtype=np.float64)

    def signed_distance(self, points: Array) -> tuple[Array, Array]:
        """See `Shape`."""
        sign = np.where(points < 0.0, -1.0, 1.0)
        distance, normal = _corner_distance(np.abs(points) - 0.5 * self.size_m)
        return distance, sign * normal


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere with its centre at the origin."""

    radius_m: float

    def __post_init__(self) -> None:
        require_size(self.size_m, "the sphere")

    @property
    def size_m(self) -> Array:
        """See `Shape`."""
        return np.full(3, 2.0 * self.radius_m)

    def signed_distance(self, points: Array) -> tuple[Array, Array]:
        """See `Shape`."""
        far = np.linalg.norm(points, axis=1)
        central = far[:, None] <= _AT_CENTRE_M
        normal = np.where(central, [1.0, 0.0, 0.0], points / np.where(central, 1.0, far[:, None]))
        return far - self.radius_m, normal


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A cylinder about the z axis with its centre at the origin."""

    radius_m: float
    length_m: float

    def __post_init__(self) -> None:
        require_size(self.size_m, "the cylinder")

    @property
    def size_m(self) -> Array:
        """See `Shape`."""
        return np.array([2.0 * self.radius_m, 2.0 * self.radius_m, self.length_m])

    def signed_distance(self, points: Array) -> tuple[Array, Array]:
        """See `Shape`."""
        far = np.hypot(points[:, 0], points[:, 1])
        axial = far[:, None] <= _AT_CENTRE_M
        radial = np.where(axial, [1.0, 0.0], points[:, :2] / np.where(axial, 1.0, far[:, None]))
        up = np.where(points[:, 2] < 0.0, -1.0, 1.0)
        away = np.column_stack([far - self.radius_m, np.abs(points[:, 2]) - 0.5 * self.length_m])
        distance, across = _corner_distance(away)
        return distance, np.column_stack([radial * across[:, :1], up * across[:, 1]])


def _corner_distance(away: Array) -> tuple[Array, Array]:
    """Distance (N,) and gradient (N, D) of the corner whose D faces lie `away` (N, D) m, each negative inside."""
    outside = np.maximum(away, 0.0)
    far = np.linalg.norm(outside, axis=1)
    nearest = np.eye(away.shape[1])[np.argmax(away, axis=1)]
    inside = far == 0.0
    normal = np.where(inside[:, None], nearest, outside / np.where(inside, 1.0, far)[:, None])
    return np.where(inside, away.max(axis=1), far), normal


class _MeshArrays(NamedTuple):
    """Of F triangles: a corner (F, 3) and the two edges from it, m; centre (F, 3) and the radius (F,) about it; outward
    pseudonormals (F, 7, 3) of the corners a, b, c, the edges ab, ac, bc and the face. Of G groups of neighbouring
    triangles: `group_begin` (G + 1,), `group_centre` (G, 3) and `group_radius` (G,)."""

    corner: Array
    first: Array
    second: Array
    centre: Array
    radius: Array
    normals: Array
    group_begin: Faces
    group_centre: Array
    group_radius: Array


class Mesh:
    """A closed triangle mesh. Groups of triangles, and triangles, that cannot be the nearest are skipped by their
    bounding spheres: a query takes about the square root of their number."""

    def __init__(self, vertices: Array, faces: Faces, where: str = "the mesh") -> None:
        """`vertices` (V, 3) m, `faces` (F, 3) indices. `where` begins every message.

        Raises RigError when the mesh is empty, too fine, not closed, or not of the size of a hand-held object.
        """
        vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)
        if len(faces) > FACES_MAX:
            raise RigError(f"{where}: it has {len(faces)} faces; at most {FACES_MAX} are taken. Make it coarser (in "
                           "Blender: the modifier Decimate).")
        if not len(faces) or not np.isfinite(vertices).all():
            raise RigError(f"{where}: it has no faces, or positions that are no numbers. Export it again.")
        require_size(np.ptp(vertices[np.unique(faces)], axis=0), where)
        self.vertices, self.faces = _merged(vertices, faces)
        _require_closed(self.faces, where)
        corners = self.vertices[self.faces]
        if np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) < 0.0:  # six times the volume
            self.faces = np.ascontiguousarray(self.faces[:, ::-1])
        self._arrays = _compiled(self.vertices, self.faces)

    @property
    def size_m(self) -> Array:
        """See `Shape`."""
        return np.asarray(np.ptp(self.vertices[self.faces].reshape(-1, 3), axis=0))

    def signed_distance(self, points: Array) -> tuple[Array, Array]:
        """See `Shape`."""
        points = np.ascontiguousarray(points, dtype=np.float64)
        distance, normal = np.empty(len(points)), np.empty((len(points), 3))
        _mesh_distance(self._arrays, points, distance, normal)
        return distance, normal


def shape_of(model: ObjectModel, folder: Path | None) -> Shape | None:
    """An object's surface: its shape, else its mesh, a file in `folder`; None without both, or without a folder.

    Raises RigError when the mesh cannot be used.
    """
    match model.shape:
        case BoxShape(sides_mm=(x, y, z)):
            return Box((1e-3 * x, 1e-3 * y, 1e-3 * z))
        case SphereShape(diameter_mm=diameter):
            return Sphere(0.5e-3 * diameter)
        case CylinderShape(diameter_mm=diameter, length_mm=length):
            return Cylinder(0.5e-3 * diameter, 1e-3 * length)
    if model.mesh is None or folder is None:
        return None
    return load_mesh(folder / model.mesh.file, model.mesh.unit)


def load_mesh(path: Path, unit: str) -> Mesh:
    """Read an STL, OBJ or glTF file whose lengths are in `unit` (m, cm, mm, in), with trimesh.

    Raises RigError naming file and remedy: no such file or format, trimesh is missing, not closed, or of a size that
    shows another unit.
    """
    if unit not in UNITS_M:
        raise RigError(f"{path}: the unit {printable(unit)!r} is not known. Give one of {', '.join(UNITS_M)}.")
    if path.suffix.lower() not in SUFFIXES:
        raise RigError(f"{path}: shapes are read from {', '.join(SUFFIXES)} files. Export it as one of them.")
    try:
        import trimesh
    except ImportError as exc:
        raise RigError(f"{path}: shapes from files need the package trimesh, RHOT's extra mesh: "
                       "`.venv/bin/python -m pip install trimesh`. Boxes, spheres and cylinders do not.") from exc
    suffix = path.suffix.lower()
    others: dict[str, Any] = {}
    if suffix == ".gltf":  # it may keep its arrays in other files
        others["resolver"] = _Beside(path.parent)
    try:
        data = io.BytesIO(read_input(path, MESH_BYTES_MAX))
        loaded: Any = trimesh.load(data, file_type=suffix[1:], force="mesh", skip_materials=True, **others)
        vertices, faces = np.asarray(loaded.vertices, np.float64), np.asarray(loaded.faces, np.int64)
    except (OSError, ValueError) as exc:
        raise RigError(f"{path}: cannot be read ({printable(why(exc))}). Is it the right file?") from exc
    except Exception as exc:  # the readers of trimesh raise whatever a damaged file makes them do
        raise RigError(f"{path}: this is no {path.suffix} mesh ({type(exc).__name__}). Export it again.") from exc
    if len(faces):
        size = float(np.ptp(vertices[np.unique(faces)], axis=0).max())
        fitting = [name for name, metres in UNITS_M.items() if SMALLEST_M <= metres * size <= LARGEST_M]
        if unit not in fitting:
            raise RigError(f"{path}: its largest side is {UNITS_M[unit] * size:.4g} m if its unit is {unit}; a hand "
                           f"holds {1e3 * SMALLEST_M:g} mm to {LARGEST_M:g} m. " +
                           (f"Give the unit {' or '.join(fitting)}." if fitting else "Scale it."))
    return Mesh(UNITS_M[unit] * vertices, faces, str(path))


class _Beside:
    """Gives trimesh files of one folder, by the names that another file there says. Raises OSError."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __getitem__(self, name: str) -> bytes:
        """The bytes of a file."""
        if Path(name).name != name:
            raise OSError(f"{printable(name)} is not a file beside it")
        return read_input(self._folder / name, MESH_BYTES_MAX)

    get = __getitem__  # which of the two is asked depends on the release


def require_size(size_m: Array, where: str) -> None:
    """Raises RigError unless a bounding box (3,) m is that of a hand-held object."""
    largest = float(np.max(size_m))
    if not (np.isfinite(size_m).all() and np.min(size_m) >= 0.0 and SMALLEST_M <= largest <= LARGEST_M):
        raise RigError(f"{where}: its largest side is {largest:.4g} m; a hand holds {1e3 * SMALLEST_M:g} mm to "
                       f"{LARGEST_M:g} m. Are its lengths in metres?")


def _merged(vertices: Array, faces: Faces) -> tuple[Array, Faces]:
    """Vertices at the same place as one, and no faces of fewer than three: files repeat them for every face."""
    used = vertices[np.unique(faces)]
    low, step = used.min(axis=0), _SAME * np.ptp(used, axis=0).max()
    grid = np.clip(np.rint((vertices - low) / step), 0.0, 1.0 / _SAME).astype(np.int64)
    _, first, number = np.unique(grid @ [1 << 40, 1 << 20, 1], return_index=True, return_inverse=True)
    faces = number[faces]
    apart = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return vertices[first], np.ascontiguousarray(faces[apart])


def _require_closed(faces: Faces, where: str) -> None:
    """Every edge of a closed, oriented surface has two faces, which run along it in opposite directions."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    count = int(faces.max()) + 1
    ways, back = np.sort(edges @ [count, 1]), np.sort(edges @ [1, count])
    if len(np.unique(ways)) < len(ways) or not np.array_equal(ways, back):
        raise RigError(f"{where}: the surface is not closed, or its faces are turned differently, so that inside and "
                       "outside cannot be told. Repair it (in Blender: 3D Print, Make Manifold; Recalculate Outside), "
                       "or use a box, sphere or cylinder.")


def _compiled(vertices: Array, faces: Faces) -> _MeshArrays:
    group = math.isqrt(len(faces)) + 1
    faces = faces[cKDTree(vertices[faces].mean(axis=1), leafsize=group).indices]  # neighbours follow each other
    edge = _edges_of(faces)
    corners = vertices[faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face = area / np.maximum(np.linalg.norm(area, axis=1), 1e-300)[:, None]
    at_vertex, at_edge = np.zeros_like(vertices), np.zeros((int(edge.max()) + 1, 3))
    for k in range(3):
        to, other = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        angle = np.arctan2(np.linalg.norm(np.cross(to, other), axis=1), np.einsum("fi,fi->f", to, other))
        np.add.at(at_vertex, faces[:, k], angle[:, None] * face)
        np.add.at(at_edge, edge[:, k], face)
    normals = np.empty((len(faces), 7, 3))
    normals[:, 6] = face
    for k in range(3):
        normals[:, k], normals[:, 3 + k] = at_vertex[faces[:, k]], at_edge[edge[:, k]]
    centre = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    normals /= np.sqrt(np.maximum(np.einsum("fki,fki->fk", normals, normals), 1e-300))[:, :, None]
    first, second = (np.ascontiguousarray(corners[:, k] - corners[:, 0]) for k in (1, 2))
    begin = np.append(np.arange(0, len(faces), group), len(faces))
    middle = np.add.reduceat(centre, begin[:-1]) / np.diff(begin)[:, None]
    away = np.linalg.norm(centre - np.repeat(middle, np.diff(begin), axis=0), axis=1) + radius
    return _MeshArrays(np.ascontiguousarray(corners[:, 0]), first, second, centre, radius, normals, begin, middle,
                       np.maximum.reduceat(away, begin[:-1]))


def _edges_of(faces: Faces) -> Faces:
    """(F, 3) numbers of the edges ab, ac, bc of each face; an edge of two faces has one."""
    edges = np.sort(faces[:, [[0, 1], [0, 2], [1, 2]]], axis=2) @ [int(faces.max()) + 1, 1]
    return np.unique(edges.ravel(), return_inverse=True)[1].reshape(-1, 3)


@njit(cache=True)
def _mesh_distance(mesh: _MeshArrays, points: Array, distance: Array, normal: Array) -> None:
    """Fill `distance` (N,) and `normal` (N, 3) of `points` (N, 3)."""
    groups = mesh.group_radius.shape[0]
    to_group, away, best_away = np.empty(groups), np.empty(3), np.zeros(3)
    for n in range(points.shape[0]):
        if not math.isfinite(points[n, 0] + points[n, 1] + points[n, 2]):
            distance[n], normal[n] = math.nan, math.nan
            continue
        nearest, start = math.inf, 0
        for g in range(groups):
            to_group[g] = _distance(points[n], mesh.group_centre[g])
            if to_group[g] < nearest:
                nearest, start = to_group[g], g
        best, best_face, best_part = math.inf, 0, 6
        for k in range(-1, groups):  # the group of the nearest centre first: it excludes most others
            g = start if k < 0 else k
            if to_group[g] - mesh.group_radius[g] > best:
                continue
            for f in range(mesh.group_begin[g], mesh.group_begin[g + 1]):
                if _distance(points[n], mesh.centre[f]) - mesh.radius[f] > best:
                    continue
                part = _nearest_part(points[n], mesh.corner[f], mesh.first[f], mesh.second[f], away)
                length = math.sqrt(away[0] ** 2 + away[1] ** 2 + away[2] ** 2)
                if length < best:
                    best, best_face, best_part = length, f, part
                    best_away[:] = away
        outward = mesh.normals[best_face, best_part]
        side = best_away[0] * outward[0] + best_away[1] * outward[1] + best_away[2] * outward[2]
        sign = 1.0 if side >= 0.0 else -1.0
        distance[n] = sign * best
        for i in range(3):
            normal[n, i] = sign * best_away[i] / best if best > 1e-9 else outward[i]


@njit(cache=True)
def _distance(point: Array, other: Array) -> float:
    x, y, z = point[0] - other[0], point[1] - other[1], point[2] - other[2]
    return math.sqrt(x * x + y * y + z * z)


@njit(cache=True)
def _nearest_part(point: Array, corner: Array, first: Array, second: Array, away: Array) -> int:
    """Fill `away` (3,) from the nearest point of a triangle to `point`; returns its part: 0 to 2 the corners a, b, c,
    3 to 5 the edges ab, ac, bc, 6 the face (Ericson 2005, 5.1.5)."""
    x, y, z = point[0] - corner[0], point[1] - corner[1], point[2] - corner[2]
    d1 = first[0] * x + first[1] * y + first[2] * z
    d2 = second[0] * x + second[1] * y + second[2] * z
    aa = first[0] ** 2 + first[1] ** 2 + first[2] ** 2
    bb = second[0] ** 2 + second[1] ** 2 + second[2] ** 2
    ab = first[0] * second[0] + first[1] * second[1] + first[2] * second[2]
    d3, d4, d5, d6 = d1 - aa, d2 - ab, d1 - ab, d2 - bb
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        v, w, part = 0.0, 0.0, 0
    elif d3 >= 0.0 and d4 <= d3:
        v, w, part = 1.0, 0.0, 1
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, w, part = d1 / aa, 0.0, 3
    elif d6 >= 0.0 and d5 <= d6:
        v, w, part = 0.0, 1.0, 2
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        v, w, part = 0.0, d2 / bb, 4
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v, part = 1.0 - w, 5
    else:
        whole = max(va + vb + vc, 1e-300)
        v, w, part = vb / whole, vc / whole, 6
    away[0] = x - v * first[0] - w * second[0]
    away[1] = y - v * first[1] - w * second[1]
    away[2] = z - v * first[2] - w * second[2]
    return part
