"""Many hand states as arrays: what a program computes with, and what every export format is written from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import require
from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.hand.skeleton import ANGLES, FINGERS, JOINTS
from rhot_app.objects.state import Validity
from rhot_app.project import OTHER_HAND
from rhot_app.state import Condition, HandState, Knowledge

if TYPE_CHECKING:
    import pandas

Array = NDArray[np.float64]
Codes = NDArray[np.uint8]
Mask = NDArray[np.bool_]

CONDITIONS: tuple[Condition, ...] = tuple(Condition)
"""A condition's code is its place here."""

VALIDITIES: tuple[Validity, ...] = tuple(Validity)
"""Likewise of a validity's code."""

FILLED = max(Knowledge) + 1
"""Beside the codes of `Knowledge`: lies between values that are known, filled in by `rhot_app.export.gaps`."""

BLOCK = 256
"""States that travel together through an export: some 2 MB."""

_TRACKED = np.array([one in (Condition.TRACKING, Condition.PARTIAL) for one in CONDITIONS])


@dataclass(frozen=True, slots=True)
class ObjectStates:
    """N states of one tracked object at the hand's instants; fields are those of `ObjectState` (docs/objects.md)."""

    name: str
    validity: Codes  # (N,) index into VALIDITIES
    world_from_object: Array  # (N, 4, 4)
    covariance: Array  # (N, 6, 6) m^2 and rad^2
    velocity: Array  # (N, 6) m/s and rad/s
    distances: Array  # (N, 5) m
    distance_sd: Array  # (N, 5) m
    contacts: Codes  # (N, 5) 1 where a fingertip touches

    @property
    def validities(self) -> tuple[str, ...]:
        """The N validities as words."""
        return tuple(VALIDITIES[code].value for code in self.validity)

    def map(self, change: Callable[[NDArray[Any]], NDArray[Any]]) -> ObjectStates:
        """The states with every array changed."""
        return ObjectStates(self.name, **{name: change(getattr(self, name)) for name in OBJECT_ARRAYS})


@dataclass(frozen=True, slots=True)
class HandStates:
    """N states of one hand in the order of time; M markers. Fields are those of `HandState` (docs/states.md): rig
    frame, metres, radians, NaN where unknown.

    `other`: the rig's other hand at the same instants, with its own markers only; None when the rig has one hand.
    """

    marker_ids: tuple[str, ...]
    sequence: NDArray[np.int64]  # (N,)
    t_master_ns: NDArray[np.int64]  # (N,) master's monotonic clock
    condition: Codes  # (N,) index into CONDITIONS
    marker_positions: Array  # (N, M, 3) m
    marker_raw_positions: Array  # (N, M, 3) m
    marker_covariances: Array  # (N, M, 3, 3) m^2
    marker_knowledge: Codes  # (N, M) Knowledge or FILLED
    epipolar_error_px: Array  # (N, M)
    joint_positions: Array  # (N, 21, 3) m
    joint_covariances: Array  # (N, 21, 3, 3) m^2
    joint_knowledge: Codes  # (N, 21)
    fingertip_positions: Array  # (N, 5, 3) m
    fingertip_covariances: Array  # (N, 5, 3, 3) m^2
    angles: Array  # (N, 21) rad
    angle_sd: Array  # (N, 21) rad
    angle_knowledge: Codes  # (N, 21)
    world_from_palm: Array  # (N, 4, 4)
    palm_covariance: Array  # (N, 6, 6) m^2 and rad^2
    palm_knowledge: Codes  # (N,)
    hand_scale: Array  # (N,)
    hand_scale_sd: Array  # (N,)
    other: HandStates | None = None
    objects: tuple[ObjectStates, ...] = ()  # the rig's tracked objects

    def __len__(self) -> int:
        return len(self.t_master_ns)

    @property
    def times_s(self) -> Array:
        """(N,) s since the first state."""
        return np.asarray(1e-9 * (self.t_master_ns - self.t_master_ns[:1]))

    @property
    def conditions(self) -> tuple[str, ...]:
        """The N conditions as words."""
        return tuple(CONDITIONS[code].value for code in self.condition)

    @property
    def tracked(self) -> Mask:
        """(N,) whether the hand is TRACKING or PARTIAL."""
        return np.asarray(_TRACKED[self.condition])

    @property
    def present(self) -> Mask:
        """(N,) whether there is a hand: tracked, or filled in."""
        return np.asarray(self.tracked | (self.palm_knowledge == FILLED))

    def map(self, change: Callable[[NDArray[Any]], NDArray[Any]]) -> HandStates:
        """The states with every array changed, those of the other hand too."""
        arrays = {name: change(getattr(self, name)) for name in ARRAYS}
        return HandStates(marker_ids=self.marker_ids, **arrays, other=self.other and self.other.map(change),
                          objects=tuple(one.map(change) for one in self.objects))

    def where(self, chosen: Mask | NDArray[np.intp] | slice) -> HandStates:
        """The states that a mask (N,), indices or a slice choose."""
        return self.map(lambda array: array[chosen])

    def to_dataframe(self, *, units: str = "mm") -> pandas.DataFrame:
        """One row per state, the columns of a CSV export (docs/export.md); lengths in `units`, "mm" or "m".

        Raises ExportError when pandas is not installed.
        """
        frame = require("pandas", "a data frame")
        return frame.DataFrame(dict(columns(self, 1000.0 if units == "mm" else 1.0, first_ns=None)))


ARRAYS: tuple[str, ...] = tuple(field.name for field in fields(HandStates) if field.name not in ("marker_ids", "other",
                                                                                         "objects"))
"""The fields whose first axis counts states."""

OBJECT_ARRAYS: tuple[str, ...] = tuple(field.name for field in fields(ObjectStates) if field.name != "name")
"""Likewise of an object."""

_KINDS: dict[str, Any] = {name: np.uint8 for name in ARRAYS if name.endswith("knowledge")} | {
    "sequence": np.int64, "t_master_ns": np.int64}


def states_of(states: Sequence[HandState]) -> HandStates:
    """The arrays of at least one state of a run."""
    arrays = {name: np.array([getattr(state, name) for state in states], dtype=_KINDS.get(name, np.float64))
              for name in ARRAYS if name != "condition"}
    codes = np.array([CONDITIONS.index(state.condition) for state in states], dtype=np.uint8)
    others = [state.other for state in states if state.other is not None]
    return HandStates(marker_ids=states[0].marker_ids, condition=codes, **arrays,
                      other=states_of(others) if len(others) == len(states) else None, objects=_objects_of(states))


def _objects_of(states: Sequence[HandState]) -> tuple[ObjectStates, ...]:
    """The objects that all states have."""
    count = min(len(state.objects) for state in states)
    found = []
    for number in range(count):
        own = [state.objects[number] for state in states]
        arrays = {name: np.array([getattr(one, name) for one in own], np.float64)
                  for name in OBJECT_ARRAYS if name not in ("validity", "contacts")}
        found.append(ObjectStates(
            own[0].name, validity=np.array([VALIDITIES.index(one.validity) for one in own], np.uint8),
            contacts=np.array([one.contacts for one in own], np.uint8), **arrays))
    return tuple(found)


def joined(parts: Sequence[HandStates]) -> HandStates:
    """Parts of one run, one after the other; at least one."""
    others = [part.other for part in parts if part.other is not None]
    return HandStates(
        marker_ids=parts[0].marker_ids,
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in ARRAYS},
        other=joined(others) if len(others) == len(parts) else None,
        objects=tuple(ObjectStates(same[0].name, **{name: np.concatenate([getattr(one, name) for one in same])
                                                    for name in OBJECT_ARRAYS})
                      for same in zip(*(part.objects for part in parts), strict=True)))


def hands_of(states: HandStates) -> dict[str, HandStates]:
    """The hands by what their names begin with."""
    return {"": states} if states.other is None else {"": states, OTHER_HAND: states.other}


def in_blocks(states: Iterable[HandState]) -> Iterator[HandStates]:
    """States as they come, BLOCK at a time."""
    waiting: list[HandState] = []
    for state in states:
        waiting.append(state)
        if len(waiting) == BLOCK:
            yield states_of(waiting)
            waiting = []
    if waiting:
        yield states_of(waiting)


def hidden_where_lost(positions: Array, states: HandStates) -> Array:
    """Positions (N, P, 3) with NaN where there is no hand: for formats that cannot say how a point is known."""
    return np.where(states.present[:, None, None], positions, np.nan)


# -- columns of a table: docs/export.md --------------------------------------------------------------------------------

Column = NDArray[Any]

_AXES = "x", "y", "z"
_TWIST = "x", "y", "z", "rx", "ry", "rz"


def columns(states: HandStates, scale: float, first_ns: int | None,
            wall_clock_offset_ns: int | None = None) -> Iterator[tuple[str, Column]]:
    """The columns of a table, each (N,), by name; `scale` is the unit of length per metre, 1000 or 1.

    `first_ns`: where `time_s` is 0; None: at the first of these states. `wall_clock_offset_ns`: ns since 1970 less the
    master's clock; without it there is no column of wall clock time.
    """
    unit = "mm" if scale == 1000.0 else "m"
    begin = states.t_master_ns[:1] if first_ns is None else first_ns
    yield "time_s", 1e-9 * (states.t_master_ns - begin)
    yield "t_master_ns", states.t_master_ns
    if wall_clock_offset_ns is not None:
        yield "t_unix_ns", states.t_master_ns + wall_clock_offset_ns
    yield "sequence", states.sequence
    yield "condition", np.array(states.conditions, dtype=object)
    for index, marker in enumerate(states.marker_ids):
        name = f"marker_{marker}"
        yield from _point(name, states.marker_positions[:, index], scale, unit)
        yield from _point(f"{name}_raw", states.marker_raw_positions[:, index], scale, unit)
        yield from _covariance(name, states.marker_covariances[:, index], scale, unit)
        yield f"{name}_epipolar_error_px", states.epipolar_error_px[:, index]
        yield f"{name}_knowledge", states.marker_knowledge[:, index]
    yield from _hand("", states, scale, unit)
    if states.other is not None:
        yield f"{OTHER_HAND}condition", np.array(states.other.conditions, dtype=object)
        yield from _hand(OTHER_HAND, states.other, scale, unit)
    for one in states.objects:
        yield from _object(one, scale, unit)
        yield from _fingertips("", one, scale, unit)
    for one in states.other.objects if states.other is not None else ():
        yield from _fingertips(OTHER_HAND, one, scale, unit)


def _object(one: ObjectStates, scale: float, unit: str) -> Iterator[tuple[str, Column]]:
    name = f"object_{one.name}"
    yield f"{name}_validity", np.array(one.validities, dtype=object)
    yield from _point(name, one.world_from_object[:, :3, 3], scale, unit)
    for index, part in enumerate(quaternion_from_rotation(one.world_from_object[:, :3, :3]).T):
        yield f"{name}_q{'wxyz'[index]}", part
    yield from _pose_covariance(name, one.covariance, scale, unit)


def _fingertips(prefix: str, one: ObjectStates, scale: float, unit: str) -> Iterator[tuple[str, Column]]:
    """How far a hand's fingertips are from an object."""
    for index, finger in enumerate(FINGERS):
        name = f"object_{one.name}_{prefix}{finger}"
        yield f"{name}_distance_{unit}", scale * one.distances[:, index]
        yield f"{name}_distance_sd_{unit}", scale * one.distance_sd[:, index]
        yield f"{name}_contact", one.contacts[:, index]


def _pose_covariance(name: str, covariances: Column, scale: float, unit: str) -> Iterator[tuple[str, Column]]:
    for i, j in combinations_with_replacement(range(6), 2):
        factor, of = ((scale * scale, f"{unit}2"), (scale, f"{unit}_rad"), (1.0, "rad2"))[(i > 2) + (j > 2)]
        yield f"{name}_cov_{_TWIST[i]}_{_TWIST[j]}_{of}", factor * covariances[:, i, j]


def _hand(prefix: str, states: HandStates, scale: float, unit: str) -> Iterator[tuple[str, Column]]:
    for index, joint in enumerate(JOINTS):
        name = f"{prefix}joint_{joint}"
        yield from _point(name, states.joint_positions[:, index], scale, unit)
        yield from _covariance(name, states.joint_covariances[:, index], scale, unit)
        yield f"{name}_knowledge", states.joint_knowledge[:, index]
    for index, finger in enumerate(FINGERS):
        name = f"{prefix}fingertip_{finger}"
        yield from _point(name, states.fingertip_positions[:, index], scale, unit)
        yield from _covariance(name, states.fingertip_covariances[:, index], scale, unit)
    for index, angle in enumerate(ANGLES):
        yield f"{prefix}angle_{angle}_deg", np.degrees(states.angles[:, index])
        yield f"{prefix}angle_{angle}_sd_deg", np.degrees(states.angle_sd[:, index])
        yield f"{prefix}angle_{angle}_knowledge", states.angle_knowledge[:, index]
    yield from _point(f"{prefix}palm", states.world_from_palm[:, :3, 3], scale, unit)
    for index, part in enumerate(quaternion_from_rotation(states.world_from_palm[:, :3, :3]).T):
        yield f"{prefix}palm_q{'wxyz'[index]}", part
    yield from _pose_covariance(f"{prefix}palm", states.palm_covariance, scale, unit)
    yield f"{prefix}palm_knowledge", states.palm_knowledge
    yield f"{prefix}hand_scale", states.hand_scale
    yield f"{prefix}hand_scale_sd", states.hand_scale_sd


def _point(name: str, positions: Column, scale: float, unit: str) -> Iterator[tuple[str, Column]]:
    for index, axis in enumerate(_AXES):
        yield f"{name}_{axis}_{unit}", scale * positions[:, index]


def _covariance(name: str, covariances: Column, scale: float, unit: str) -> Iterator[tuple[str, Column]]:
    for i, j in combinations_with_replacement(range(3), 2):
        yield f"{name}_cov_{_AXES[i]}{_AXES[j]}_{unit}2", scale * scale * covariances[:, i, j]
