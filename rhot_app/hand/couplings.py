"""Angles that follow others, as hand files and articulated objects write them, and the thesis's for a hand."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Annotated, Final

import msgspec
from msgspec import Meta

from rhot_app.hand.skeleton import FINGERS

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
