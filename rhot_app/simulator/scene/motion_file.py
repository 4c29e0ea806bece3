"""Motions by name: the keyframe file ``rhot-motion``, those that ship with the project, and recordings."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rhot_app.errors import RigError, SimulatorError
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import ANGLES
from rhot_app.simulator.scene.motion import WRIST_BELOW_CENTRE_M, Motion, NotNegative, Sway, SwayCurve
from rhot_node.files import read_document, resource_path

FORMAT: Final = "rhot-motion"
VERSION: Final = 1

Array = NDArray[np.float64]


class Key(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A pose at a time: offsets from an open hand that shows its palm to the cameras, fingers up.

    Position and rotation vector in the cameras' axes: x right, y down, z away.
    """

    t_s: NotNegative
    position_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    angles_deg: dict[str, float] = {}


class MotionFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A motion of one period that repeats. `base_deg` are joint angles that hold where a key names no other."""

    name: str
    description: str
    period_s: Annotated[float, Meta(gt=0)]
    keys: Annotated[tuple[Key, ...], Meta(min_length=1)]
    base_deg: dict[str, float] = {}
    sway: Sway = Sway()
    format: Literal["rhot-motion"] = FORMAT
    version: Literal[1] = VERSION

    def __post_init__(self) -> None:
        times = [key.t_s for key in self.keys]
        if any(b <= a for a, b in pairwise(times)) or times[-1] >= self.period_s:
            raise ValueError("keys must increase in t_s and end before period_s")
        for angles in (self.base_deg, *(key.angles_deg for key in self.keys)):
            unknown = sorted(set(angles) - set(ANGLES))
            if unknown:
                raise ValueError(f"there is no joint angle {unknown[0]!r}; they are {', '.join(ANGLES)}")


def read_motion_file(path: Path) -> MotionFile:
    """Read and validate a motion file; raises RigError naming file and field."""
    return read_document(path, MotionFile, format_name=FORMAT, version=VERSION, error=RigError)


def motion_names() -> list[str]:
    """Names of the motions that ship with the project."""
    return sorted(path.stem for path in resource_path("motions").glob("*.json"))


def keyed_motion(file: MotionFile, model: HandModel, centre: Array, seed: int) -> Motion:
    """The repeating motion of a keyframe file about `centre` (3,) m, the middle of the hand."""
    base = np.array([np.radians(file.base_deg.get(name, 0.0)) for name in ANGLES])
    rows = []
    for key in file.keys:
        angles = base.copy()
        for name, degrees in key.angles_deg.items():
            angles[ANGLES.index(name)] = np.radians(degrees)
        rows.append(np.concatenate([1e-3 * np.array(key.position_mm), np.radians(key.rotation_deg), angles]))
    times = np.array([*(key.t_s for key in file.keys), file.keys[0].t_s + file.period_s])
    curve = CubicSpline(times, np.array([*rows, rows[0]]), bc_type="periodic", extrapolate="periodic")
    return Motion(file.name, file.period_s, True, curve, centre + np.array([0.0, WRIST_BELOW_CENTRE_M, 0.0]),
                  model.limits, SwayCurve(file.sway, seed))


def find_motion(source: str) -> Path:
    """The file of the motion named `source`, or at that path. Raises SimulatorError when there is none."""
    if source in motion_names():
        return resource_path("motions", f"{source}.json")
    if not Path(source).exists():
        raise SimulatorError(f"there is no motion {source!r}: neither a file nor one of {', '.join(motion_names())}.")
    return Path(source)


def load_motion(source: str, model: HandModel, centre: Array, seed: int) -> Motion:
    """The motion named `source`, or of the keyframe file (.json) or recording (.tsv, .csv) at that path.

    `centre` (3,) m in the rig frame is where the middle of the hand stands. Raises SimulatorError when there is no
    such motion, RigError when the file is not one.
    """
    path = find_motion(source)
    if path.suffix.lower() in (".tsv", ".csv"):
        from rhot_app.simulator.scene.recorded import recorded_motion  # fitting is slow to import and rarely wanted

        return recorded_motion(path, model, centre)
    return keyed_motion(read_motion_file(path), model, centre, seed)
