"""A hand's anatomy written out as an articulated object: the same rows, angles and points, each with its name."""

from __future__ import annotations

import math

from rhot_app.hand.anatomy import FingerAnatomy, HandAnatomy
from rhot_app.hand.anthropometry import hand_length
from rhot_app.hand.articulated import Angle, Articulated, Box, Capsule, Frame, Point, Root
from rhot_app.hand.dh import FIXED, ROOT, DhRow
from rhot_app.hand.model import HandTable, hand_table
from rhot_app.hand.skeleton import ANGLES, BONES, FINGERS, JOINTS

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


def _frame(name: str, row: DhRow, names: tuple[str, ...], shapes: dict[str, Capsule]) -> Frame:
    return Frame(name, PALM if row.parent == ROOT else names[row.parent], _degrees(row.theta), _mm(row.d), _mm(row.a),
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
