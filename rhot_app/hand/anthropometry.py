"""Hands from one number: bone lengths of adults as parts of hand length, from a published table.

Hand length is measured from the wrist to the tip of the stretched middle finger. Bones measured one
by one (`rhot calibrate bones`) are better: in hands of one length they scatter by 3 to 8 % each.
"""

from __future__ import annotations

import msgspec

from rhot_app.hand.anatomy import FingerAnatomy, HandAnatomy
from rhot_app.hand.tables import TABLES


def hand_length(anatomy: HandAnatomy) -> float:
    """m, from the wrist to the tip of the middle finger, stretched straight ahead."""
    middle = anatomy.fingers["middle"]
    return 1e-3 * (middle.base_mm[0] + sum(middle.bones_mm))


def require_human_length(hand_length_m: float) -> None:
    """Raises ValueError when no human hand is so long."""
    shortest_m, longest_m = TABLES.human_lengths_m
    if not shortest_m <= hand_length_m <= longest_m:
        raise ValueError(f"a hand is {1e3 * shortest_m:.0f} to {1e3 * longest_m:.0f} mm long, from the wrist to the "
                         "tip of the middle finger")


def scaled_hand(anatomy: HandAnatomy, factor: float) -> HandAnatomy:
    """The hand with every length `factor` times as long; angles and proportions stay.

    Raises ValueError for a factor that is not positive.
    """
    if not factor > 0.0:
        raise ValueError(f"the scale of a hand is positive, not {factor:g}")
    fingers = {name: _resized(finger, factor, factor, [factor * bone for bone in finger.bones_mm])
               for name, finger in anatomy.fingers.items()}
    return _with_palm(anatomy, fingers, factor)


def scaled_by_hand_length(anatomy: HandAnatomy, hand_length_m: float) -> HandAnatomy:
    """A hand of this length with the table's bones; what the table does not say comes from `anatomy`.

    The palm takes what the middle finger leaves of the length, and the finger roots keep their layout in it. Breadths,
    radii and thickness grow with the length. A marker keeps its part of its bone; limits and turns stay. Raises
    ValueError when the length is none of a human hand.
    """
    require_human_length(hand_length_m)
    factor = hand_length_m / hand_length(anatomy)
    bones = {name: [1e3 * hand_length_m * part for part in parts] for name, parts in TABLES.bones.items()}
    palm = (1e3 * hand_length_m - sum(bones["middle"])) / anatomy.fingers["middle"].base_mm[0]
    fingers = {name: _resized(finger, factor, palm, bones[name]) for name, finger in anatomy.fingers.items()}
    return _with_palm(anatomy, fingers, factor)


def _resized(finger: FingerAnatomy, factor: float, palm: float, bones: list[float]) -> FingerAnatomy:
    """`factor` across the hand, `palm` along it."""
    x, y, z = finger.base_mm
    first, second, last = (_mm(bone) for bone in bones)
    radii = [_mm(factor * radius) for radius in finger.radii_mm]
    return msgspec.structs.replace(
        finger, base_mm=(_mm(palm * x), _mm(factor * y), _mm(factor * z)), bones_mm=(first, second, last),
        radii_mm=(radii[0], radii[1], radii[2]), marker_mm=min(_mm(last * finger.marker_mm / finger.bones_mm[2]), last),
        bones_sd_mm=None, radii_sd_mm=None)


def _with_palm(anatomy: HandAnatomy, fingers: dict[str, FingerAnatomy], factor: float) -> HandAnatomy:
    return msgspec.structs.replace(
        anatomy, fingers=fingers, wrist_breadth_mm=_mm(factor * anatomy.wrist_breadth_mm),
        wrist_thickness_mm=_mm(factor * anatomy.wrist_thickness_mm),
        palm_thickness_mm=_mm(factor * anatomy.palm_thickness_mm))


def _mm(value: float) -> float:
    return round(value, 6)  # a nanometre; files stay readable
