"""The hand of the 3-D mouse (Rehg 1995, 4.3.4): its palm slides on a plane, and only the fingers move that it needs.

One camera then suffices. The forefinger rises from its knuckle; thumb and little finger spread; the other joints are
held as a flat, relaxed hand has them.
"""

from __future__ import annotations

from typing import Final

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.skeleton import ANGLES
from rhot_app.project import PalmPlane, Rig

Array = NDArray[np.float64]

FREE: Final = "index_mcp_flexion", "thumb_cmc_flexion", "little_mcp_abduction"
"""Angles that work the mouse. Rehg's forefinger bent in its middle, too; one camera, or two side by side, do not tell
that from a finger that rises from its knuckle."""

FLAT_DEG: Final = {
    "thumb_cmc_abduction": -18.0, "thumb_cmc_flexion": 8.0, "thumb_mcp_flexion": 12.0, "thumb_ip_flexion": 12.0,
    "index_mcp_flexion": 26.0, "index_pip_flexion": 10.0, "index_dip_flexion": 6.0, "index_mcp_abduction": 5.0,
    "middle_mcp_flexion": 12.0, "middle_pip_flexion": 16.0, "middle_dip_flexion": 10.0,
    "ring_mcp_flexion": 12.0, "ring_pip_flexion": 16.0, "ring_dip_flexion": 10.0, "ring_mcp_abduction": -3.0,
    "little_mcp_flexion": 12.0, "little_pip_flexion": 16.0, "little_dip_flexion": 10.0, "little_mcp_abduction": -6.0}
"""A flat relaxed hand, the thumb beside it on the table; its index finger hangs down a little, so that it can rise. All
others are 0."""


RISING: Final = "index_mcp_flexion", (0.5 * FLAT_DEG["index_mcp_flexion"], 0.25 * FLAT_DEG["index_mcp_flexion"])
"""The forefinger is between its rest and straight, two standard deviations to both sides, degrees. One camera sees a
finger that is bent 45 degrees to the table square to its line of sight: it looks the same if bent more or less."""


LOCKED_DEG: Final[dict[str, float | tuple[float, float]]] = {
    name: FLAT_DEG.get(name, 0.0) for name in ANGLES if name not in FREE} | dict([RISING])
"""What a tracker's `locked_deg` says of the mouse's hand."""


def with_mouse_model(rig: Rig, plane: PalmPlane | None) -> Rig:
    """The rig with an estimator that knows the mouse's hand. `plane`: on which the palm lies; None: two cameras see
    where."""
    tracker = msgspec.structs.replace(rig.tracker, kind="estimator", locked_deg=dict(LOCKED_DEG), palm_plane=plane)
    return msgspec.structs.replace(rig, tracker=tracker)


def table_plane(rig: Rig) -> PalmPlane | None:
    """Where the palm lies on a rig's table: the wrist is half its thickness above it. None of a rig without one."""
    if rig.up != "z":
        return None
    return PalmPlane((0.0, 0.0, 1.0), 0.5e-3 * rig.hand.wrist_thickness_mm)


def up_of(rig: Rig) -> Array | None:
    """(3,) normal of the plane on which a rig's mouse moves: of the tracker's, or of the table; None: neither is
    known."""
    plane = rig.tracker.palm_plane
    if plane is not None:
        return np.array(plane.normal) / float(np.linalg.norm(plane.normal))
    return np.array([0.0, 0.0, 1.0]) if rig.up == "z" else None
