"""What a tracked object is, in one JSON file (``rhot-object``): its fiducial tags or its colour markers.

docs/objects.md describes the format.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from rhot_app.errors import ObjectError
from rhot_node.files import PRINTABLE, read_document, write_document
from rhot_node.wire.messages import FAMILIES

FORMAT: Final = "rhot-object"
VERSION: Final = 1

COLLINEAR_MM = 1.0
"""mm: markers whose spread across their common line is smaller leave the rotation about it open: a painted marker's
centre is known no better (`marker_model.PAINT_SD_M`)."""

Array = NDArray[np.float64]
Name = Annotated[str, Meta(min_length=1, max_length=64, pattern=PRINTABLE)]
Millimetres = Annotated[float, Meta(ge=-10_000, le=10_000)]
Size = Annotated[float, Meta(gt=0, le=10_000)]
Vector = tuple[Millimetres, Millimetres, Millimetres]

_FACES = ("+z", "+x", "-z", "-x", "+y", "-y")
_NORMALS = {"+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0), "+z": (0, 0, 1), "-z": (0, 0, -1)}


class Tag(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A fiducial tag. Its frame: origin in its middle, x right, y up, z out of the print.

    `family`: a dictionary of cv2.aruco. `size_mm`: length of the black square's side. The pose is object_from_tag.
    """

    family: Annotated[str, Meta(max_length=64)]
    id: Annotated[int, Meta(ge=0, le=65535)]
    size_mm: Size
    rotation_wxyz: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    translation_mm: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        from rhot_node.detect.tags import family_size  # here, because a rig without objects needs no OpenCV
        if self.family not in FAMILIES:
            raise ValueError(f"there is no tag dictionary {self.family!r}; cv2.aruco has {', '.join(FAMILIES)}")
        count = family_size(FAMILIES.index(self.family))
        if self.id >= count:
            raise ValueError(f"{self.family} has the tags 0 to {count - 1}; there is no {self.id}")
        norm = sum(q * q for q in self.rotation_wxyz)
        if not 0.998 < norm < 1.002:
            raise ValueError(f"rotation_wxyz is not a unit quaternion (its squared norm is {norm:.4f})")

    @property
    def key(self) -> tuple[int, int]:
        """Family, as an index into FAMILIES, and id: what a node reports."""
        return FAMILIES.index(self.family), self.id

    @property
    def code(self) -> bytes:
        """The bits that a detector reads."""
        from rhot_node.detect.tags import tag_code
        return tag_code(*self.key)

    def corners(self) -> Array:
        """(4, 3) m in the object's frame: top left, top right, bottom right, bottom left of the upright tag."""
        from rhot_app.estimation.se3 import rotation_from_quaternion

        half = 0.5 * self.size_mm
        square = np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])
        return 1e-3 * (square @ rotation_from_quaternion(self.rotation_wxyz).T + np.array(self.translation_mm))


class ObjectMarker(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A colour marker on the object: the `marker` of that id in the rig's marker set, and its centre."""

    marker: Name
    position_mm: Vector


class Mesh(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The object's surface for displays: a mesh file beside the object file, in the object's frame."""

    file: Annotated[str, Meta(min_length=1, max_length=256)]
    unit: Literal["m", "mm"] = "mm"


class BoxShape(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="box"):
    """A box about the object's origin, its sides along the axes."""

    sides_mm: tuple[Size, Size, Size]

    @property
    def largest_mm(self) -> float:
        """The largest side."""
        return max(self.sides_mm)


class SphereShape(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="sphere"):
    """A sphere about the object's origin."""

    diameter_mm: Size

    @property
    def largest_mm(self) -> float:
        """The diameter."""
        return self.diameter_mm


class CylinderShape(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="cylinder"):
    """A cylinder about the object's z axis, its middle in the origin."""

    diameter_mm: Size
    length_mm: Size

    @property
    def largest_mm(self) -> float:
        """The larger of diameter and length."""
        return max(self.diameter_mm, self.length_mm)


class ObjectModel(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A rigid object with fiducial tags or at least three colour markers, and not both; with neither where another
    tracker follows it.

    `shape`: its surface, for displays and the contacts of fingertips; a `mesh` is both where there is no shape.
    """

    name: Name
    fiducials: Annotated[tuple[Tag, ...], Meta(max_length=256)] = ()
    markers: Annotated[tuple[ObjectMarker, ...], Meta(max_length=64)] = ()
    mesh: Mesh | None = None
    shape: BoxShape | SphereShape | CylinderShape | None = None
    format: Literal["rhot-object"] = FORMAT
    version: Literal[1] = VERSION

    def __post_init__(self) -> None:
        if self.fiducials and self.markers:
            raise ValueError("an object has fiducials or markers; give one of the two")
        for one, other in combinations(self.fiducials, 2):
            if one.code == other.code:
                raise ValueError(f"tag {other.id} of {other.family} stands twice among the fiducials; print another")
        names = [marker.marker for marker in self.markers]
        doubled = [name for name in names if names.count(name) > 1]
        if doubled:
            raise ValueError(f"marker {doubled[0]!r} stands twice among the markers; each needs its own colour")
        if self.markers and not spans_plane(np.array([marker.position_mm for marker in self.markers])):
            raise ValueError("the markers lie in one line, which leaves the rotation about it open; give three or more "
                             "that do not")
        for tag in self.fiducials:
            if self.shape is not None and tag.size_mm > self.shape.largest_mm:
                raise ValueError(f"tag {tag.id} of {tag.family} is {tag.size_mm:g} mm wide, and the shape's largest "
                                 f"side is {self.shape.largest_mm:g} mm; correct size_mm or the shape")


def spans_plane(points_mm: Array) -> bool:
    """Whether points (N, 3) mm determine a rotation: at least three, not in one line."""
    if len(points_mm) < 3:
        return False
    spread = np.linalg.svd(points_mm - points_mm.mean(axis=0), compute_uv=False)
    return bool(spread[1] > COLLINEAR_MM)


def cube(name: str, size_mm: float, tag_size_mm: float, family: str, first_id: int = 0) -> ObjectModel:
    """A cube about the object's origin with one tag in the middle of each face, in the order +z, +x, -z, -x, +y, -y.

    Raises ValueError when the tags are larger than the faces, or the dictionary is unknown or has too few tags.
    """
    if not 0.0 < tag_size_mm <= size_mm:
        raise ValueError(f"tags of {tag_size_mm:g} mm do not fit a cube of {size_mm:g} mm; make them smaller")
    tags = []
    for number, face in enumerate(_FACES):
        normal = np.array(_NORMALS[face], dtype=np.float64)
        up = np.array([0.0, 1.0, 0.0]) if face[1] != "y" else np.array([0.0, 0.0, -normal[1]])
        rotation = np.column_stack([np.cross(up, normal), up, normal])
        tags.append(_tag(family, first_id + number, tag_size_mm, rotation, 0.5 * size_mm * normal))
    return ObjectModel(name, tuple(tags), shape=BoxShape((size_mm, size_mm, size_mm)))


def plate(name: str, columns: int, rows: int, tag_size_mm: float, gap_mm: float, family: str,
          first_id: int = 0) -> ObjectModel:
    """A plane of `columns` x `rows` tags about the object's origin, numbered row by row from the top left one.

    Raises ValueError when there is no tag, or the dictionary is unknown or has too few tags.
    """
    if columns < 1 or rows < 1 or not gap_mm >= 0.0:
        raise ValueError("a plate has at least one column and one row, and a gap of 0 mm or more")
    pitch = tag_size_mm + gap_mm
    return ObjectModel(name, tuple(
        _tag(family, first_id + row * columns + column, tag_size_mm, np.eye(3),
             pitch * np.array([column - 0.5 * (columns - 1), 0.5 * (rows - 1) - row, 0.0]))
        for row in range(rows) for column in range(columns)))


def _tag(family: str, number: int, size_mm: float, rotation: Array, translation_mm: Array) -> Tag:
    if not (size_mm > 0.0 and math.isfinite(size_mm)):
        raise ValueError(f"a tag of {size_mm:g} mm cannot be; give a size above 0")
    from rhot_app.estimation.se3 import quaternion_from_rotation

    w, x, y, z = (float(q) for q in quaternion_from_rotation(rotation))
    tx, ty, tz = (float(t) for t in translation_mm)
    return Tag(family, number, size_mm, (w, x, y, z), (tx, ty, tz))


def load_object(path: Path) -> ObjectModel:
    """Read and validate an object file; raises ObjectError naming file and field."""
    return read_document(path, ObjectModel, format_name=FORMAT, version=VERSION, error=ObjectError)


def save_object(path: Path, model: ObjectModel) -> None:
    """Write an object file atomically; raises OSError, the old file then stays as it was."""
    write_document(path, model)


def require_distinct(objects: Sequence[ObjectModel], places: Sequence[str]) -> None:
    """Raises ObjectError when two objects have the same name, tag or marker. `places`: each one's file."""
    for (one, here), (other, there) in combinations(zip(objects, places, strict=True), 2):
        if one.name == other.name:
            raise ObjectError(f"{there}: the object is called {other.name!r}, as is that of {here}. Rename one.")
        for what, remedy in _in_common(one, other):
            raise ObjectError(f"{there}: {what} is also on {one.name!r} ({here}), so the two cannot be told apart. "
                              f"{remedy}")


def _in_common(one: ObjectModel, other: ObjectModel) -> Iterator[tuple[str, str]]:
    codes = {tag.code for tag in one.fiducials}
    for tag in other.fiducials:
        if tag.code in codes:
            yield f"tag {tag.id} of {tag.family}", "Print other tags for one of them."
    names = {marker.marker for marker in one.markers}
    for marker in other.markers:
        if marker.marker in names:
            yield f"marker {marker.marker!r}", "Paint one of them in another colour."
