"""Articulated objects as files of Denavit-Hartenberg frames, format ``rhot-articulated`` (docs/hand.md); a hand as one.

The file is Rehg's table (1995, Table 2.1 and appendix A) with names: a root with a spatial transform (quaternion and
translation), frames that each hang on an earlier one, and the angle that turns a frame. Millimetres and degrees in the
file, metres and radians in every array.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import msgspec
from msgspec import Meta

from rhot_app.errors import RigError
from rhot_app.hand.anatomy import Coupling, Degrees, FingerAnatomy, HandAnatomy, Name, coupling_complaints
from rhot_app.hand.anthropometry import hand_length
from rhot_app.hand.dh import FIXED, ROOT, DhRow
from rhot_app.hand.model import HandTable, hand_table
from rhot_app.hand.skeleton import ANGLES, BONES, FINGERS, JOINTS
from rhot_node.files import read_document, write_atomically

FORMAT: Final = "rhot-articulated"
VERSION: Final = 1

PARTS_MAX: Final = 1000
"""Frames, angles, points, couplings each: a hand has 32 frames."""

Length = Annotated[float, Meta(ge=-10_000, le=10_000)]  # mm
Size = Annotated[float, Meta(gt=0, le=10_000)]  # mm
Vector = tuple[Length, Length, Length]


class Capsule(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="capsule"):
    """A rod with round ends along the frame's own `a_mm`, from its joint to its origin; a ball where that is zero.

    `radius_mm` at the joint; `end_radius_mm` at the origin, where it differs.
    """

    radius_mm: Size
    end_radius_mm: Size | None = None


class Box(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="box"):
    """A box along the axes of the shape frame (Rehg eq. 2.4); `centre_mm` from the middle of the frame's own `a_mm`."""

    size_mm: tuple[Size, Size, Size]
    centre_mm: Vector = (0.0, 0.0, 0.0)


Shape = Capsule | Box


class Root(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The body that everything hangs on, and where it is to begin with: the first seven numbers of the state.

    `free`: what a tracker estimates of its pose; ``none``: it stands where the file says.
    """

    name: Name
    quaternion_wxyz: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    translation_mm: Vector = (0.0, 0.0, 0.0)
    shape: Shape | None = None
    free: Literal["pose", "translation", "none"] = "pose"


class ArticulatedFrame(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One row: Rot_z(theta) Trans_z(d) Trans_x(a) Rot_x(alpha) in its parent's frame (Rehg eq. 2.2).

    `angle`, if any, times `sign` adds to theta. A frame with a `shape` is a body of its own.
    """

    name: Name
    parent: Name  # the root, or an earlier frame
    theta_deg: Degrees = 0.0
    d_mm: Length = 0.0
    a_mm: Length = 0.0
    alpha_deg: Degrees = 0.0
    angle: Name | None = None
    sign: Literal[1, -1] = 1
    shape: Shape | None = None


class Angle(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One state angle. The file's order of angles is that of the state. A tracker keeps one that is not `free` at
    rest."""

    name: Name
    limits_deg: tuple[Degrees, Degrees] = (-180.0, 180.0)
    rest_deg: Degrees = 0.0
    free: bool = True


class Point(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A named point that rides on the root or on a frame, such as a joint, a fingertip or a marker."""

    name: Name
    frame: Name
    offset_mm: Vector = (0.0, 0.0, 0.0)


class Articulated(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An open articulated object. `side` ``left``: what is built is the rows' mirror image in `mirror_axis` of the
    root's frame. `length_mm`: the object's nominal length, for a hand wrist to middle fingertip, by which to scale."""

    format: Literal["rhot-articulated"] = FORMAT
    version: Literal[1] = VERSION
    name: str
    source: str = ""
    side: Literal["right", "left"] = "right"
    mirror_axis: Literal["x", "y"] = "y"
    length_mm: Size | None = None
    root: Root
    frames: Annotated[tuple[ArticulatedFrame, ...], Meta(max_length=PARTS_MAX)]
    angles: Annotated[tuple[Angle, ...], Meta(max_length=PARTS_MAX)] = ()
    points: Annotated[tuple[Point, ...], Meta(max_length=PARTS_MAX)] = ()
    couplings: Annotated[tuple[Coupling, ...], Meta(max_length=PARTS_MAX)] = ()

    def __post_init__(self) -> None:
        complaint = next(_complaints(self), None)
        if complaint:
            raise ValueError(complaint)


def load_articulated(path: Path) -> Articulated:
    """Read and validate an object's file; raises RigError naming file and field."""
    return read_document(path, Articulated, format_name=FORMAT, version=VERSION, error=RigError)


def save_articulated(path: Path, document: Articulated) -> None:
    """Write an object's file atomically, a line for each frame, angle, point and coupling; raises OSError."""
    fields = (f'  "{key}": {_layout(getattr(document, key))}' for key in document.__struct_fields__)
    write_atomically(path, ("{\n" + ",\n".join(fields) + "\n}\n").encode())


def _layout(value: Any) -> str:
    if isinstance(value, tuple) and value:
        return "[\n" + ",\n".join(f"    {_layout(item)}" for item in value) + "\n  ]"
    return json.dumps(_terse(value) if isinstance(value, msgspec.Struct) else value, ensure_ascii=False)


def _terse(row: msgspec.Struct) -> dict[str, Any]:
    """The fields that say something: what is at its default need not be written."""
    named: dict[str, Any] = {"kind": row.__struct_config__.tag} if row.__struct_config__.tag else {}
    for field in msgspec.structs.fields(row):
        value = getattr(row, field.name)
        if value != field.default:
            named[field.name] = _terse(value) if isinstance(value, msgspec.Struct) else value
    return named


def scaled(document: Articulated, factor: float) -> Articulated:
    """The object with every length `factor` times as long. Raises ValueError for a factor that is not positive, or
    makes a length that no file may have."""
    if not factor > 0.0:
        raise ValueError(f"the scale of an object is positive, not {factor:g}")
    try:
        return msgspec.convert(_scale_lengths(msgspec.to_builtins(document), factor), Articulated)
    except msgspec.ValidationError as exc:
        raise ValueError(f'"{document.name}" at {factor:g} times its size: {exc}') from exc


def scaled_to_length(document: Articulated, length_m: float) -> Articulated:
    """The object at another nominal length, m. Raises ValueError when its file states none."""
    if document.length_mm is None:
        raise ValueError(f'"{document.name}" states no length_mm by which to scale it')
    return scaled(document, 1e3 * length_m / document.length_mm)


def _scale_lengths(value: Any, factor: float, *, is_length: bool = False) -> Any:
    """The document with the numbers of every ``..._mm`` field multiplied."""
    if isinstance(value, dict):
        return {key: _scale_lengths(item, factor, is_length=key.endswith("_mm")) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_scale_lengths(item, factor, is_length=is_length) for item in value]
    return factor * value if is_length and isinstance(value, int | float) else value


def _complaints(document: Articulated) -> Iterator[str]:
    yield from _tree_complaints(document)
    angles = {angle.name for angle in document.angles}
    turned = {frame.angle for frame in document.frames}
    for angle in document.angles:
        low, high = angle.limits_deg
        if low > high:
            yield f'angle "{angle.name}" has a lower limit above its upper one'
        if not low <= angle.rest_deg <= high:
            yield f'angle "{angle.name}" rests at {angle.rest_deg:g} degrees, outside its limits'
        if angle.name not in turned:
            yield f'angle "{angle.name}" turns no frame'
    yield from coupling_complaints(document.couplings, angles)


def _tree_complaints(document: Articulated) -> Iterator[str]:
    angles = {angle.name for angle in document.angles}
    known = {document.root.name}
    if not any(document.root.quaternion_wxyz):
        yield f'root "{document.root.name}" has a quaternion of length zero, which is no rotation'
    parents = {frame.name: frame.parent for frame in document.frames}
    for frame in document.frames:
        if frame.parent not in known:
            yield _parent_complaint(frame, parents)
        if frame.name in known:
            yield f'there are two frames named "{frame.name}"'
        if frame.angle is not None and frame.angle not in angles:
            yield f'frame "{frame.name}" is turned by "{frame.angle}", which is not among the angles'
        known.add(frame.name)
    for point in document.points:
        if point.frame not in known:
            yield f'point "{point.name}" rides on "{point.frame}", which does not exist'
    named = {"angles": [angle.name for angle in document.angles], "points": [point.name for point in document.points]}
    for what, names in named.items():
        if len(set(names)) < len(names):
            yield f'{what}: "{max(names, key=names.count)}" occurs twice'


def _parent_complaint(frame: ArticulatedFrame, parents: dict[str, str]) -> str:
    """Why the parent of a frame is neither the root nor an earlier frame."""
    way = [frame.name]
    while way[-1] in parents and way[-1] not in way[:-1]:
        way.append(parents[way[-1]])
    if way[-1] not in parents:
        known = frame.parent in parents
        return (f'frame "{frame.name}" hangs on "{frame.parent}", which '
                + ("comes later; put it before" if known else "is neither the root nor a frame"))
    loop = way[way.index(way[-1]):]
    return "frames hang on each other in a loop: " + " on ".join(f'"{name}"' for name in loop)


# -- a hand as an articulated object -----------------------------------------------------------------------------------

PALM = "palm"


def articulated_hand(anatomy: HandAnatomy) -> Articulated:
    """The hand as an articulated object: 16 bodies, 21 angles, 28 state numbers; its points are the 21 joints of
    `skeleton.JOINTS` and then the five marker centres, `<finger>_marker`; its couplings are the hand file's."""
    table = hand_table(anatomy)
    names = _row_names()
    shapes = {f"{finger}_{bone}": Capsule(radius_mm=radius) for finger, bones in zip(FINGERS, BONES, strict=True)
              for bone, radius in zip(bones, anatomy.fingers[finger].radii_mm, strict=True)}
    frames = tuple(_frame(name, row, names, shapes) for name, row in zip(names, table.rows, strict=True))
    limits = [pair for finger in FINGERS for pair in anatomy.fingers[finger].limits_deg]
    angles = tuple(Angle(name, (low, high), min(max(0.0, low), high))
                   for name, (low, high) in zip(ANGLES, limits, strict=True))
    return Articulated(name=anatomy.name, side=anatomy.side, length_mm=1e3 * hand_length(anatomy),
                       root=Root(PALM, shape=_palm_shape(anatomy)), frames=frames, angles=angles,
                       points=_points(table, names), couplings=anatomy.couplings)


def _row_names() -> tuple[str, ...]:
    """Of the rows of `hand_table`: a row that ends a bone has the bone's name."""
    thumb = ("base", "root", "cmc", "metacarpal", "mcp", "proximal", "distal")
    finger = ("base", "root", "mcp", "proximal", "medial", "distal")
    return tuple(f"{name}_{row}" for name in FINGERS for row in (thumb if name == "thumb" else finger))


def _frame(name: str, row: DhRow, names: tuple[str, ...], shapes: dict[str, Capsule]) -> ArticulatedFrame:
    return ArticulatedFrame(
        name, PALM if row.parent == ROOT else names[row.parent], _degrees(row.theta), _mm(row.d), _mm(row.a),
        _degrees(row.alpha), None if row.angle == FIXED else ANGLES[row.angle], 1 if row.sign > 0 else -1,
        shapes.get(name))


def _points(table: HandTable, names: tuple[str, ...]) -> tuple[Point, ...]:
    words = (*JOINTS, *(f"{finger}_marker" for finger in FINGERS))
    return tuple(Point(word, PALM if row == ROOT else names[row], (_mm(x), _mm(y), _mm(z)))
                 for word, (row, (x, y, z)) in zip(words, [*table.joints, *table.markers], strict=True))


def _palm_shape(anatomy: HandAnatomy) -> Box:
    """A box from the wrist to the middle knuckle, as broad as the knuckles from index to little finger."""
    def edge(finger: FingerAnatomy, sign: float) -> float:
        return finger.base_mm[1] + sign * finger.radii_mm[0]

    left, right = edge(anatomy.fingers["little"], -1.0), edge(anatomy.fingers["index"], 1.0)
    length = anatomy.fingers["middle"].base_mm[0]
    return Box((length, right - left, anatomy.palm_thickness_mm), (0.5 * length, 0.5 * (left + right), 0.0))


def _mm(metres: float) -> float:
    return round(1e3 * metres, 9) + 0.0


def _degrees(radians: float) -> float:
    return round(math.degrees(radians), 9) + 0.0
