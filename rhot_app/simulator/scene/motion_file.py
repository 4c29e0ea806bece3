"""Named motions as people write them: keyframes in JSON (format ``rhot-motion``, docs/twin.md)."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from rhot_app.errors import RigError
from rhot_app.hand.skeleton import ANGLES
from rhot_node.files import read_document

FORMAT: Final = "rhot-motion"
VERSION: Final = 1

NotNegative = Annotated[float, Meta(ge=0)]


class Key(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A pose at a time: offsets from an open hand that shows its palm to the cameras, fingers up.

    Position and rotation vector in the cameras' axes: x right, y down, z away.
    """

    t_s: NotNegative
    position_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    angles_deg: dict[str, float] = {}


class Sway(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What no hand can help, rms per axis: slow sway, and physiological tremor at 8 to 12 Hz. Seeds differ in it."""

    position_mm: NotNegative = 0.0
    rotation_deg: NotNegative = 0.0
    angle_deg: NotNegative = 0.0
    tremor_mm: NotNegative = 0.0


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
