"""The numbers of a fit as a person reads and moves them, in mm, degrees and per cent, with standard deviations."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.barehand.surface import (
    FINGER_SIZE,
    FOREARM_RADIUS,
    HAND_SIZE,
    LENGTH,
    RADIUS,
    THICKNESS,
)
from rhot_app.geometry.transforms import rigid
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.motion.hand_state import POSE
from rhot_app.hand.skeleton import ANGLE_SLICES, ANGLES, BONES, FINGERS, HandPose
from rhot_app.handfit.hand_shape import ROOTS, SHAPE_LIMIT
from rhot_app.handfit.state import BEND_LIMIT, FitState

Array = NDArray[np.float64]
Kind = Literal["place", "turn", "angle", "bend", "size", "length", "radius", "root"]

PALM = "Palm"
GROUPS: tuple[str, ...] = (PALM, *(name.capitalize() for name in FINGERS), "Forearm", "Sizes", "Lengths",
                           "Radii", "Finger roots")
"""In the order of the screen. Those of the pose come first."""

NEAR_MM = 1000.0
"""A palm is no farther than this to any side of the rig's origin while a slider moves it; a typed number may be."""


@dataclass(frozen=True, slots=True)
class Number:
    """One number: `group` and `name` for the screen, `unit`, and its range `low` to `high` in that unit. `index` is its
    place among those of its `kind`."""

    group: str
    name: str
    unit: str
    low: float
    high: float
    kind: Kind
    index: int
    meaning: str = ""

    @property
    def key(self) -> tuple[str, int]:
        """What tells it from the others."""
        return self.kind, self.index


def numbers_of(base: HandAnatomy) -> tuple[Number, ...]:
    """All numbers of a fit that begins with the hand `base`."""
    found = [Number(PALM, name, "mm", -NEAR_MM, NEAR_MM, "place", k, "Of the wrist in the rig's frame.")
             for k, name in enumerate(("x", "y", "z"))]
    found += [Number(PALM, name, "°", -low, low, "turn", k, "The palm turns about its axes, z first, then y, then x.")
              for k, (name, low) in enumerate((("turn about z", 180.0), ("turn about y", 90.0),
                                               ("turn about x", 180.0)))]
    for finger, own in zip(FINGERS, ANGLE_SLICES, strict=True):
        limits = np.array(base.fingers[finger].limits_deg)
        found += [Number(finger.capitalize(), _words(ANGLES[k], finger), "°", low, high, "angle", k,
                         "Within the limits of the hand file.")
                  for k, (low, high) in zip(range(own.start, own.stop), limits.tolist(), strict=True)]
    found += [Number("Forearm", name, "°", -limit, limit, "bend", k, "Of the forearm behind the wrist.")
              for k, (name, limit) in enumerate(zip(("flexion", "deviation"), np.degrees(BEND_LIMIT), strict=True))]
    for name, index, meaning in (("whole hand", HAND_SIZE, "every length"),
                                 ("fingers", FINGER_SIZE, "all phalanges, beside the size of the whole hand"),
                                 ("thickness", THICKNESS, "all radii but the forearm's, and the palm's thickness"),
                                 ("forearm", FOREARM_RADIUS, "the forearm's thickness")):
        most = float(SHAPE_LIMIT[index])
        found.append(Number("Sizes", name, "%", 100.0 * math.exp(-most), 100.0 * math.exp(most), "size", index,
                            f"Relative to the hand of the beginning: {meaning}."))
    found += [_phalanx(base, "length", k) for k in range(15)] + [_phalanx(base, "radius", k) for k in range(15)]
    for k in range(15):
        finger, value = FINGERS[k // 3], base.fingers[FINGERS[k // 3]].base_mm[k % 3]
        reach = 1e3 * float(SHAPE_LIMIT[ROOTS + k])
        found.append(Number("Finger roots", f"{finger} {('distal', 'radial', 'dorsal')[k % 3]}", "mm", value - reach,
                            value + reach, "root", k, "Where the finger begins, from the wrist joint: towards the "
                            "fingertips, towards the thumb, and out of the back of the hand."))
    return tuple(found)


def _phalanx(base: HandAnatomy, kind: Literal["length", "radius"], k: int) -> Number:
    """The range is that of a phalanx's own length or radius; the sizes of the whole hand may bring it beyond."""
    finger = FINGERS[k // 3]
    name, own = f"{finger} {BONES[k // 3][k % 3]}", base.fingers[finger]
    if kind == "length":
        group, value, most = "Lengths", own.bones_mm[k % 3], float(SHAPE_LIMIT[LENGTH + k])
        meaning = "From joint to joint; the last bone ends at the fingertip."
    else:
        group, value, most = "Radii", own.radii_mm[k % 3], float(SHAPE_LIMIT[RADIUS + k])
        meaning = "Half of the thickness."
    return Number(group, name, "mm", value * math.exp(-most), value * math.exp(most), kind, k, meaning)


def _words(angle: str, finger: str) -> str:
    joint, movement = angle.removeprefix(f"{finger}_").split("_")
    return f"{joint.upper()} {movement}"


def value_of(state: FitState, instant: int, hand: HandAnatomy, number: Number) -> float:
    """In the number's unit; `hand`: the state's hand file."""
    one, k = state.instants[instant], number.index
    match number.kind:
        case "place":
            return 1e3 * float(one.pose.world_from_palm[k, 3])
        case "turn":
            return float(_turns(one.pose.world_from_palm)[k])
        case "angle":
            return math.degrees(one.pose.angles[k])
        case "bend":
            return math.degrees(one.bend[k])
        case "size":
            return 100.0 * math.exp(state.shape[k])
        case "length":
            return hand.fingers[FINGERS[k // 3]].bones_mm[k % 3]
        case "radius":
            return hand.fingers[FINGERS[k // 3]].radii_mm[k % 3]
        case "root":
            return hand.fingers[FINGERS[k // 3]].base_mm[k % 3]


def with_value(state: FitState, instant: int, hand: HandAnatomy, number: Number, value: float) -> FitState:
    """The state with one number at `value`, in the number's unit and as near as its limits allow."""
    one, k = state.instants[instant], number.index
    world, angles = one.pose.world_from_palm.copy(), one.pose.angles.copy()
    bend, shape, before = one.bend.copy(), state.shape.copy(), value_of(state, instant, hand, number)
    if number.kind in ("turn", "angle", "bend", "size"):
        value = min(max(value, number.low), number.high)
    match number.kind:
        case "place":
            world[k, 3] = 1e-3 * value
        case "turn":
            turns = _turns(world)
            turns[k] = value
            world = rigid(Rotation.from_euler("ZYX", turns, degrees=True).as_matrix(), world[:3, 3])
        case "angle":
            angles[k] = math.radians(value)
        case "bend":
            bend[k] = math.radians(value)
        case "size":
            shape[k] = math.log(value / 100.0)
        case "length" | "radius":
            shape[(LENGTH if number.kind == "length" else RADIUS) + k] += math.log(max(value, 1e-3) / before)
        case "root":
            shape[ROOTS + k] += 1e-3 * (value - before) / math.exp(shape[HAND_SIZE])
    shape = np.clip(shape, -SHAPE_LIMIT, SHAPE_LIMIT)
    changed = replace(one, pose=HandPose(world, angles), bend=bend)
    return replace(state.change(instant, changed), shape=shape)


def sd_of(state: FitState, instant: int, hand: HandAnatomy, number: Number, covariance: Array) -> float:
    """The number's standard deviation, in its unit, of the state's `covariance` (n, n)."""
    row = np.zeros(state.size)
    first, k = state.own(instant).start, number.index
    match number.kind:
        case "place":
            row[first + k] = 1e3
        case "turn":
            row[first + 3:first + 6] = _turn_slopes(state.instants[instant].pose.world_from_palm)[k]
        case "angle":
            row[first + 6 + k] = math.degrees(1.0)
        case "bend":
            row[first + POSE + k] = math.degrees(1.0)
        case "size":
            row[k] = value_of(state, instant, hand, number)
        case "length":
            row[[HAND_SIZE, FINGER_SIZE, LENGTH + k]] = value_of(state, instant, hand, number)
        case "radius":
            row[[HAND_SIZE, THICKNESS, RADIUS + k]] = value_of(state, instant, hand, number)
        case "root":
            row[HAND_SIZE] = value_of(state, instant, hand, number)
            row[ROOTS + k] = 1e3 * math.exp(state.shape[HAND_SIZE])
    return math.sqrt(max(float(row @ covariance @ row), 0.0))


def _turns(world: Array) -> Array:
    """(3,) degrees about z, y and x, of a palm's rotation."""
    return np.asarray(Rotation.from_matrix(world[:3, :3]).as_euler("ZYX", degrees=True))


def _turn_slopes(world: Array) -> Array:
    """(3, 3) degrees per rad: how `_turns` follow a rotation about the world's axes."""
    z, y, _ = np.radians(_turns(world))
    axes = np.column_stack([[0.0, 0.0, 1.0], [-math.sin(z), math.cos(z), 0.0],
                            [math.cos(z) * math.cos(y), math.sin(z) * math.cos(y), -math.sin(y)]])
    return np.degrees(np.linalg.pinv(axes))
