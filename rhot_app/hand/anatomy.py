"""The anatomy of one hand: bone lengths, radii, joint limits, marker places. File format ``rhot-hand`` (docs/hand.md).

Millimetres and degrees in the file, because people measure and edit them; metres and radians in every array.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from rhot_app.errors import RigError
from rhot_app.hand.skeleton import ANGLES, FINGERS
from rhot_node.files import PRINTABLE, read_document, resource_path, write_document

# -- coupled angles ----------------------------------------------------------------------------------------------------

Name = Annotated[str, Meta(min_length=1, max_length=64)]
Degrees = Annotated[float, Meta(ge=-360, le=360)]

DIP_PER_PIP: Final = 2.0 / 3.0
"""Flexion of the DIP joint per flexion of the PIP joint (RHOT eq. 2.4; Rijpkema and Girard 1991)."""


class Coupling(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """In the coupled variant, `angle` = `offset_deg` + `factor` times the free angle `follows`; without `follows` it
    stays at `offset_deg`."""

    angle: Name
    follows: Name | None = None
    factor: Annotated[float, Meta(ge=-100, le=100)] = 1.0
    offset_deg: Degrees = 0.0


THESIS_COUPLINGS: Final[tuple[Coupling, ...]] = (
    *(Coupling(f"{finger}_dip_flexion", f"{finger}_pip_flexion", DIP_PER_PIP) for finger in FINGERS[1:]),
    Coupling("middle_mcp_abduction"), Coupling("thumb_mcp_abduction"))
"""RHOT eq. 2.4, 2.2 and 2.3: six of a hand's 21 angles, which leaves 15.

Eq. 2.3 does not say which angle the thumb gives up. It is the MCP joint's abduction here: without it the other four
still bring the tip of natural poses to 1.3 mm rms of its place, without the CMC joint's abduction only to 8 mm.
"""


def coupling_complaints(couplings: Sequence[Coupling], angles: Collection[str]) -> Iterator[str]:
    """What cannot be about couplings between these angles, in words."""
    followers = [coupling.angle for coupling in couplings]
    for coupling in couplings:
        if missing := {coupling.angle, coupling.follows or coupling.angle} - set(angles):
            yield f'a coupling names the angle "{min(missing)}", which does not exist'
        if coupling.follows in followers:
            yield f'angle "{coupling.angle}" follows "{coupling.follows}", which is not free itself'
        if followers.count(coupling.angle) > 1:
            yield f'angle "{coupling.angle}" is coupled twice'


# -- the file ``rhot-hand`` --------------------------------------------------------------------------------------------

FORMAT: Final = "rhot-hand"
VERSION: Final = 1

Millimetres = Annotated[float, Meta(gt=0, le=400)]
Place = Annotated[float, Meta(ge=-400, le=400)]
LimitDeg = tuple[Degrees, Degrees]


class FingerAnatomy(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """One finger. Its base joint (MCP; the thumb's CMC) sits at `base_mm` in the palm frame of a right hand.

    `base_rotation_deg` are the angles (about z, then y, then x; intrinsic) that turn the palm frame into the
    finger's neutral frame, whose x runs along the first bone at zero angles and about whose y it flexes.
    `bones_mm`: proximal, medial, distal (thumb: metacarpal, proximal, distal), joint to joint, the last one to the
    end of the soft tip. `radii_mm`: of the three segments. `limits_deg`: (low, high) for the finger's angles in the
    order of `skeleton.ANGLES`: five for the thumb, four for the others.
    `marker_mm`: distance of the painted marker's centre from the last joint, along the distal bone.
    `bones_sd_mm`, `radii_sd_mm`: their standard deviations where they were estimated, else None.
    """

    base_mm: tuple[Place, Place, Place]
    bones_mm: tuple[Millimetres, Millimetres, Millimetres]
    radii_mm: tuple[Millimetres, Millimetres, Millimetres]
    limits_deg: tuple[LimitDeg, ...]
    marker_mm: Millimetres
    base_rotation_deg: tuple[Degrees, Degrees, Degrees] = (0.0, 0.0, 0.0)
    bones_sd_mm: tuple[Millimetres, Millimetres, Millimetres] | None = None
    radii_sd_mm: tuple[Millimetres, Millimetres, Millimetres] | None = None


class HandAnatomy(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A hand. `fingers` has exactly the five names of `skeleton.FINGERS`; `couplings`, of the variant `coupled`, are
    between angles of `skeleton.ANGLES`."""

    side: Literal["right", "left"]
    fingers: dict[str, FingerAnatomy]
    wrist_breadth_mm: Millimetres = 58.0
    wrist_thickness_mm: Millimetres = 40.0
    palm_thickness_mm: Millimetres = 28.0
    couplings: Annotated[tuple[Coupling, ...], Meta(max_length=64)] = THESIS_COUPLINGS
    name: Annotated[str, Meta(pattern=PRINTABLE)] = ""
    format: Literal["rhot-hand"] = FORMAT
    version: Literal[1] = VERSION

    def __post_init__(self) -> None:
        if set(self.fingers) != set(FINGERS):
            raise ValueError(f"fingers must be exactly {', '.join(FINGERS)}; got {', '.join(sorted(self.fingers))}")
        for name, finger in self.fingers.items():
            expected = sum(angle.startswith(name) for angle in ANGLES)
            if len(finger.limits_deg) != expected:
                raise ValueError(f"fingers.{name}.limits_deg needs {expected} pairs, got {len(finger.limits_deg)}")
            if any(low > high for low, high in finger.limits_deg):
                raise ValueError(f"fingers.{name}.limits_deg has a lower limit above its upper one")
            if finger.marker_mm > finger.bones_mm[2]:
                raise ValueError(f"fingers.{name}.marker_mm lies beyond the fingertip")
        complaint = next(coupling_complaints(self.couplings, ANGLES), None)
        if complaint:
            raise ValueError(f"couplings: {complaint}")


def load_hand(path: Path) -> HandAnatomy:
    """Read and validate a hand file; raises RigError naming file and field."""
    return read_document(path, HandAnatomy, format_name=FORMAT, version=VERSION, error=RigError)


def is_shipped(hand: HandAnatomy) -> bool:
    """Whether it is the hand that RHOT comes with: nobody's own has been measured."""
    return hand == load_hand(resource_path("hands", f"{hand.side}.json"))


def save_hand(path: Path, hand: HandAnatomy) -> None:
    """Write a hand file atomically; raises OSError."""
    write_document(path, hand)
