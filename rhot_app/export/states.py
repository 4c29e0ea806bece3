"""Many hand states as arrays: what a program computes with, and what every export format is written from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.objects.state import Validity
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
        from rhot_app.export.plan import require
        from rhot_app.export.tables import columns

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


def in_blocks(states: Iterable[HandState], size: int = BLOCK) -> Iterator[HandStates]:
    """States as they come, `size` at a time."""
    waiting: list[HandState] = []
    for state in states:
        waiting.append(state)
        if len(waiting) == size:
            yield states_of(waiting)
            waiting = []
    if waiting:
        yield states_of(waiting)


def hidden_where_lost(positions: Array, states: HandStates) -> Array:
    """Positions (N, P, 3) with NaN where there is no hand: for formats that cannot say how a point is known."""
    return np.where(states.present[:, None, None], positions, np.nan)

