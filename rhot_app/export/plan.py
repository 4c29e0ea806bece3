"""What is asked of an export, and what every writer of a format gets and does."""

from __future__ import annotations

import importlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import ExportError
from rhot_app.export.states import HandStates
from rhot_app.project import Rig

# -- frame of positions ------------------------------------------------------------------------------------------------

Array = NDArray[np.float64]

Frame = Literal["rig", "wrist"]
Up = Literal["-y", "z"]
Axes = Literal["own", "y-up", "z-up"]

_SAME: Final = np.eye(3)
_HALF_TURN: Final = np.diag([1.0, -1.0, -1.0])  # x right, y down, z away -> x right, y up, z towards the viewer
_Z_TO_Y: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # x, y forward, z up -> x, y up, z back
_Y_DOWN_TO_Z: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # x right, y down, z away -> z up


def file_from_frame(up: Up, axes: Axes) -> Array:
    """(3, 3) rotation from a frame whose `up` points up (as in the rig file) to the axes of a file."""
    if axes == "own":
        return _SAME
    if axes == "y-up":
        return _HALF_TURN if up == "-y" else _Z_TO_Y
    return _Y_DOWN_TO_Z if up == "-y" else _SAME


def frame_up(up: Up, frame: Frame) -> Up:
    """Which axis points up: the rig's, or in the wrist's frame the one out of the back of the hand."""
    return up if frame == "rig" else "z"


def in_frame(states: HandStates, frame: Frame) -> HandStates:
    """The positions of `states` in the rig frame (as they are), or each relative to the wrist joint along the axes of
    the palm frame (docs/conventions.md).

    In the wrist's frame, covariances of positions are NaN: they would be those of differences, which are not known
    (docs/states.md). `world_from_palm` stays in the rig frame. Markers are relative to the first hand's wrist, those of
    `other` to its own.
    """
    if frame == "rig":
        return states
    changed: dict[str, Any] = {}
    for name in ("marker_positions", "marker_raw_positions", "joint_positions", "fingertip_positions"):
        changed[name] = _relative(states.world_from_palm, getattr(states, name))
    for name in ("marker_covariances", "joint_covariances", "fingertip_covariances"):
        changed[name] = np.full_like(getattr(states, name), np.nan)
    other = None if states.other is None else in_frame(states.other, frame)
    return replace(states, **changed, other=other)


def _relative(world_from_palm: Array, positions: Array) -> Array:
    """(N, P, 3) m in the palm frame of each state, of positions in the rig frame."""
    rotation, origin = world_from_palm[:, :3, :3], world_from_palm[:, None, :3, 3]
    return np.asarray((positions - origin) @ rotation)


# -- export request ----------------------------------------------------------------------------------------------------

Units = Literal["mm", "m"]
Tracker = Literal["classic", "estimator"]
Hand = Literal["hand", "other_hand"]


@dataclass(frozen=True, slots=True)
class ExportOptions:
    """How a recording is exported. None leaves a choice to the rig (`tracker`) or to the format (`rate_hz`, `units`).

    `hand`: which of the rig's hands a format gets that holds a single one (BVH). `smooth`: every state uses the whole
    recording, not only what came before it; the estimator alone can. `fill_s`: gaps up to this length are filled
    (`rhot_app.export.gaps`); None: none is.
    """

    tracker: Tracker | None = None
    rate_hz: float | None = None
    frame: Frame = "rig"
    units: Units | None = None
    hand: Hand = "hand"
    smooth: bool = False
    fill_s: float | None = None


@dataclass(frozen=True, slots=True)
class Plan:
    """What a writer knows before the first state. `path`: of the file to write, which is renamed when it is whole."""

    path: Path
    rig: Rig
    frame: Frame
    units: Units
    hand: Hand
    rate_hz: float | None  # of states at equal intervals; None: they come at their own times
    log: str  # name of the log
    created: str  # when it was begun, UTC
    first_ns: int  # master's time of the first state
    smooth: bool = False  # whether states use what came after them
    wall_clock_offset_ns: int | None = None  # ns since 1970 less the master's clock; None: unknown

    @property
    def scale(self) -> float:
        """The file's unit of length per metre."""
        return 1000.0 if self.units == "mm" else 1.0

    def about(self) -> dict[str, str]:
        """What formats with room for it say of themselves."""
        began = self.wall_clock_offset_ns
        return {"log": self.log, "created": self.created, "rig": self.rig.name, "tracker": self.rig.tracker.kind,
                "frame": self.frame, "up": self.rig.up, "units": self.units, "smoothed": "yes" if self.smooth else "no",
                "first_t_master_ns": str(self.first_ns),
                "first_t_unix_ns": "" if began is None else str(self.first_ns + began)}


class Writer(Protocol):
    """Writes one file. `notes` are sentences for the operator about what the format cannot hold."""

    notes: list[str]

    def add(self, states: HandStates) -> None:
        """Take the next states."""
        ...

    def finish(self) -> None:
        """Write what is left; the file is whole then."""
        ...

    def close(self) -> None:
        """Let go of the file, whole or not. May be called twice."""
        ...


def require(package: str, what: str, extra: str = "export") -> Any:
    """The module of an optional package. Raises ExportError that names `what` needs it, and the extra that has it."""
    try:
        return importlib.import_module(package)
    except ImportError as exc:
        raise ExportError(f"{what} needs the package {package.split('.')[0]!r}, which cannot be imported ({exc}). "
                          f"Install it with: pip install 'rhot[{extra}]'") from exc
