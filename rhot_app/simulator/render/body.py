"""The hand as solids: skin, forearm and the markers it wears, posed for the renderer.

Skin and fingertips are the capsules of `rhot_app.hand.shape`; forearm and band are elliptic cylinders, flat as wrists
are. Each solid rides on one row of the hand's kinematic table.

Parameter rows (12,), m: capsule: end a (3), end b (3), the unit vector out of the back of the hand (3), unused (3).
Elliptic cylinder: centre (3), then the unit vectors of its length, breadth and thickness (3 x 3).

Paint rows (PAINT_FIELDS,) say which part of a solid's surface is there at all: the rest lets rays through to the skin.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import RigError
from rhot_app.hand.dh import ROOT
from rhot_app.hand.kinematics import forward, frames_and_points
from rhot_app.hand.model import HandModel, neutral_pose
from rhot_app.hand.places import KNUCKLE_ROLES, Place, dorsal, gap_middle, patch_of, place_of, segment_axis
from rhot_app.hand.shape import segments
from rhot_app.hand.skeleton import FINGERS, JOINTS, TIP_ROLES, WRIST_ROLE
from rhot_node.markers import Marker, MarkerSet

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CAPSULE, CYLINDER = 0, 1
KIND, GROUP, MARKER = range(3)
"""Columns of `Solids.what`."""

PARAMETERS = 12
SKIN = -1
PALM_GROUP = len(FINGERS)
"""Group of palm, thumb base, forearm and wrist band; groups 0..4 are the fingers."""
REST_GROUP = PALM_GROUP + 1
"""Group of what tape and bands have in other colours than their marker's: paint does not show through it."""

PAINT_FIELDS = 11
BOUNDS, MIDDLE, HALF, ACROSS, CORNERS, SIDE, GAP, GAP_AT, WORN, UNEVEN, SEED = range(PAINT_FIELDS)
"""Fields of a paint row. `BOUNDS`: PLAIN (all of the surface, and none of the other fields counts), EVERYWHERE,
ON_ONE_SIDE (the outline of half axes `HALF` along and `ACROSS`, m, with `CORNERS`, about `MIDDLE` along the axis from
its end a; `SIDE` +1 up, -1 down) or ALL_ROUND (`HALF` about `MIDDLE`, less a gap of half angle `GAP` about `GAP_AT`,
rad, up is 0). `WORN`: share that has come off; `UNEVEN`: share by which the brightness varies; `SEED` of both."""
PLAIN, EVERYWHERE, ON_ONE_SIDE, ALL_ROUND = range(4)

SKIN_RGB = (201.0, 152.0, 128.0)
FOREARM_M = 0.45  # it reaches out of the picture, as arms do
BAND_LENGTH_MM = 22.0  # where the marker set gives none, as the next two
KNUCKLE_RADIUS_MM, BALL_RADIUS_MM = 12.5, 5.0
POINT_M = 1e-7  # a capsule of this length is a ball
FILM_M = 1e-4  # a patch of paint and tape stand this far out of the skin, and tape's paint as far out of the tape

TIP_MARGIN, BAND_MARGIN = 1.05, 2.1
"""Of a marker's largest half width: how far its own finger's (wrist's) skin may stand before it and still be paint."""

FOREARM = "forearm"
_CYLINDER_NAMES = (FOREARM, "wrist")
_BONE_ENDS = {"metacarpal": 1, "proximal": 1, "medial": 2, "neck": 2, "distal": 3}  # joint of the finger, 0 its base
_THUMB_BONE_ENDS = {**_BONE_ENDS, "proximal": 2}


class Solids(NamedTuple):
    """N solids, painted ones first.

    `what` (N, 3): what it is (CAPSULE, CYLINDER), which part of the hand, index in the marker set or SKIN. `size`
    (N, 3) m: capsule (radius, 0, 0), cylinder (half length, half breadth, half thickness). `rgb` (N, 3) 0..255.
    `margin` (N,) m: by how much paint wins over skin of its own group. `paint` (N, PAINT_FIELDS).
    """

    what: Indices
    size: Array
    rgb: Array
    margin: Array
    paint: Array

    @property
    def kind(self) -> Indices:
        """(N,)."""
        return self.what[:, KIND]

    @property
    def group(self) -> Indices:
        """(N,)."""
        return self.what[:, GROUP]

    @property
    def marker(self) -> Indices:
        """(N,)."""
        return self.what[:, MARKER]


@dataclass(frozen=True, slots=True)
class HandBody:
    """One hand wearing one marker set: N `solids` and M markers.

    `row` (N,): kinematic row that carries the solid, `ends` (N, 2, 3) m: a capsule's ends, a cylinder's centre, and
    `up` (N, 3), the unit vector across a capsule to the back of the hand, in that row's frame. `places` (M,): where the
    markers sit.
    """

    model: HandModel
    solids: Solids
    row: Indices
    ends: Array
    up: Array
    places: tuple[Place, ...]

    @property
    def marker_count(self) -> int:
        """Number of markers of the set, hidden ones included."""
        return len(self.places)

    def joints_and_markers(self, world_from_palm: Array, angles: Array) -> tuple[Array, Array]:
        """(T, 21, 3) m joints and (T, M, 3) m marker centres for poses (T, 4, 4) and (T, 21)."""
        frames, points = frames_and_points(self.model.dh, world_from_palm, angles)
        worn = frames[:, [place.row for place in self.places]]
        offsets = np.array([place.point for place in self.places])
        return points[:, :len(JOINTS)], np.einsum("tmij,mj->tmi", worn[..., :3], offsets) + worn[..., 3]

    def marker_positions(self, world_from_palm: Array, angles: Array) -> Array:
        """(T, M, 3) m, the markers' centres for poses (T, 4, 4) and (T, 21)."""
        return self.joints_and_markers(world_from_palm, angles)[1]

    def marker_poses(self, world_from_palm: Array, angles: Array, marker: int) -> Array:
        """(T, 4, 4) m: the segment that carries a marker, its origin at the marker's centre, for poses (T, 4, 4) and
        (T, 21)."""
        out = np.tile(np.eye(4), (len(angles), 1, 1))
        out[:, :3] = frames_and_points(self.model.dh, world_from_palm, angles)[0][:, self.places[marker].row]
        out[:, :3, 3] = self.marker_positions(world_from_palm, angles)[:, marker]
        return out

    def place(self, world_from_palm: Array, angles: Array) -> Array:
        """(T, N, 12) parameters of the solids in the world for poses (T, 4, 4) and (T, 21)."""
        frames = frames_and_points(self.model.dh, world_from_palm, angles)[0][:, self.row]
        out = np.zeros((len(angles), len(self.row), PARAMETERS))
        out[:, :, :6] = (np.einsum("tnij,nkj->tnki", frames[..., :3], self.ends)
                         + frames[:, :, None, :, 3]).reshape(len(angles), -1, 6)
        out[:, :, 6:9] = np.einsum("tnij,nj->tni", frames[..., :3], self.up)
        axes = world_from_palm[:, None, :3, :3].transpose(0, 1, 3, 2)
        out[:, self.solids.kind == CYLINDER, 3:] = axes.reshape(-1, 1, 9)
        return out


@dataclass(frozen=True, slots=True)
class Appearance:
    """How paint and skin look. `worn`: share of the paint that has come off; `uneven`: share by which its brightness
    varies; `glove_rgb`: the hand's colour in a glove, None: skin; `seed` of what is random."""

    worn: float = 0.0
    uneven: float = 0.0
    glove_rgb: tuple[int, int, int] | None = None
    seed: int = 0


@dataclass(frozen=True, slots=True)
class _Solid:
    kind: int
    group: int
    marker: int
    size: tuple[float, float, float]
    row: int
    ends: Array  # (2, 3) in the row's frame
    up: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  # (3,) the same
    rgb: tuple[float, ...] | None = None  # None: the marker's, or skin
    bounds: dict[int, float] = field(default_factory=dict)  # fields of its paint row


def build_body(model: HandModel, markers: MarkerSet, hidden: frozenset[str] = frozenset(),
               look: Appearance = Appearance()) -> HandBody:
    """Dress the hand in `markers`; ids in `hidden` stay unpainted skin.

    Raises RigError when a marker names no place on the hand, or `hidden` no marker.
    """
    unknown = sorted(hidden - set(markers.ids))
    if unknown:
        raise RigError(f"marker {unknown[0]!r} cannot be hidden: the marker set has {', '.join(markers.ids)}.")
    places = tuple(place_of(marker, model) for marker in markers.markers)
    skin = dict(_skin(model))
    worn = [k for k, name in enumerate(markers.ids) if name not in hidden]
    painted = [_paint(model, k, markers.markers[k], places[k], skin) for k in worn]
    rests = [rest for k, solid in zip(worn, painted, strict=True)
             if (rest := _rest(markers.markers[k], solid)) is not None]
    solids = painted + rests + list(skin.values())
    bare = SKIN_RGB if look.glove_rgb is None else tuple(map(float, look.glove_rgb))
    colours = [*(markers.markers[k].display_rgb for k in worn), *(rest.rgb for rest in rests),
               *(SKIN_RGB if name == FOREARM else bare for name in skin)]
    return HandBody(
        model=model,
        solids=Solids(np.array([(solid.kind, solid.group, solid.marker) for solid in solids], np.int64),
                      size=np.array([solid.size for solid in solids]),
                      rgb=np.array(colours, dtype=np.float64),
                      margin=np.array([_margin(solid) * max(solid.size) for solid in solids]),
                      paint=np.array([_paint_row(solid, look) for solid in solids])),
        row=np.array([solid.row for solid in solids], dtype=np.int64),
        ends=np.array([solid.ends for solid in solids]),
        up=np.array([solid.up for solid in solids]),
        places=places,
    )


def _margin(solid: _Solid) -> float:
    """Of its largest half width: how far skin of its own group may stand before a solid and not hide it. Patches and
    tape end on the skin itself, and what stands before them hides them."""
    if solid.marker == SKIN or (solid.kind == CAPSULE and solid.bounds):
        return 0.0
    return TIP_MARGIN if solid.kind == CAPSULE else BAND_MARGIN


def _paint_row(solid: _Solid, look: Appearance) -> Array:
    row = np.zeros(PAINT_FIELDS)
    bounds = solid.bounds
    if solid.marker != SKIN and (look.worn > 0.0 or look.uneven > 0.0):
        bounds = {BOUNDS: EVERYWHERE} | bounds | {WORN: look.worn, UNEVEN: look.uneven,
                                                  SEED: float(64 * look.seed + solid.marker)}
    for index, value in bounds.items():
        row[index] = value
    return row


def _paint(model: HandModel, index: int, marker: Marker, place: Place, skin: dict[str, _Solid]) -> _Solid:
    """The painted part of a fingertip, a band round the wrist, as flat as the wrist is, or a ball."""
    if marker.role == WRIST_ROLE:
        breadth, thickness = _wrist(model)
        scale = 1e-3 * marker.radius_mm / (0.5 * (breadth + thickness)) if marker.radius_mm else 1.03
        half = 0.5e-3 * (marker.length_mm or BAND_LENGTH_MM)
        return _Solid(CYLINDER, PALM_GROUP, index, (half, scale * breadth, scale * thickness), ROOT, np.zeros((2, 3)),
                      bounds=_all_round(marker, model, 0.0, half) if marker.gap_deg else {})
    if marker.role not in TIP_ROLES:
        knuckle = marker.role in KNUCKLE_ROLES
        radius = 1e-3 * (marker.radius_mm or (KNUCKLE_RADIUS_MM if knuckle else BALL_RADIUS_MM))
        group = place.finger if place.finger >= 0 else PALM_GROUP
        return _Solid(CAPSULE, group, index, (radius, 0.0, 0.0), place.row,
                      place.point + np.array([[0.0, 0.0, 0.0], [POINT_M, 0.0, 0.0]]))
    distal = skin[f"{str(marker.role).removesuffix('_tip')}_distal"]
    radius = 1e-3 * marker.radius_mm if marker.radius_mm else distal.size[0]
    patch = patch_of(marker, model, place.finger)
    if patch is None:
        return _Solid(CAPSULE, distal.group, index, (radius, 0.0, 0.0), distal.row, distal.ends, distal.up)
    axis, half_axis = segment_axis(model, place.finger)
    middle = patch.middle - axis + half_axis  # from the axis' end a
    if patch.side:  # the radius of a flat patch is its own, not the finger's
        radius, bounds = distal.size[0], {BOUNDS: ON_ONE_SIDE, MIDDLE: middle, HALF: patch.half,
                                          ACROSS: patch.half_across, CORNERS: patch.corners, SIDE: patch.side}
    else:
        bounds = _all_round(marker, model, middle, patch.half)
    return _Solid(CAPSULE, distal.group, index, (max(radius, distal.size[0]) + FILM_M, 0.0, 0.0), distal.row,
                  distal.ends, distal.up, bounds=bounds)


def _all_round(marker: Marker, model: HandModel, middle: float, half: float) -> dict[int, float]:
    return {BOUNDS: ALL_ROUND, MIDDLE: middle, HALF: half, GAP: 0.5 * math.radians(marker.gap_deg),
            GAP_AT: gap_middle(marker, model.mirror)}


def _rest(marker: Marker, painted: _Solid) -> _Solid | None:
    """The tape or band in another colour, under the marker's own and beside it; None without one."""
    if marker.rest_rgb is None:
        return None
    rest = 0.5e-3 * marker.rest_mm
    first, breadth, thickness = painted.size
    size = ((first - FILM_M, 0.0, 0.0) if painted.kind == CAPSULE
            else (first + rest, breadth - FILM_M, thickness - FILM_M))
    return replace(painted, group=REST_GROUP, marker=SKIN, size=size, rgb=marker.rest_rgb,
                   ends=painted.ends - np.array([rest, 0.0, 0.0]), bounds=painted.bounds | {GAP: 0.0}
                   if painted.kind == CAPSULE else {})


def _skin(model: HandModel) -> Iterator[tuple[str, _Solid]]:
    """Every capsule of the hand's shape, taken to the frame of the bone it rides on; an elliptic forearm."""
    pose = neutral_pose()
    frames = frames_and_points(model.dh, pose.world_from_palm[None], pose.angles[None])[0][0]
    shape = segments(model, pose, forward(model, pose))
    for name, start, end, radius in zip(shape.names, shape.start, shape.end, shape.radius, strict=True):
        part, _, bone = name.partition("_")
        if part in _CYLINDER_NAMES:
            continue
        row, group = ROOT, PALM_GROUP
        if part in FINGERS:
            finger = FINGERS.index(part)
            joint = (_THUMB_BONE_ENDS if finger == 0 else _BONE_ENDS)[bone]
            row = int(model.dh.point_row[1 + 4 * finger + joint])
            group = PALM_GROUP if bone == "metacarpal" else finger
        local = (np.stack([start, end]) - frames[row, :, 3]) @ frames[row, :, :3]
        up = np.array([0.0, 0.0, 1.0]) if row == ROOT else dorsal(model, FINGERS.index(part), row)
        yield name, _Solid(CAPSULE, group, SKIN, (float(radius), 0.0, 0.0), row, local, up)
    centre = np.array([0.012 - 0.5 * FOREARM_M, 0.0, 0.0])
    yield FOREARM, _Solid(CYLINDER, PALM_GROUP, SKIN, (0.5 * FOREARM_M, *_wrist(model)), ROOT,
                            np.stack([centre, centre]))


def _wrist(model: HandModel) -> tuple[float, float]:
    """Half breadth and half thickness of the wrist, m."""
    return 0.5e-3 * model.anatomy.wrist_breadth_mm, 0.5e-3 * model.anatomy.wrist_thickness_mm
