"""The hand model of the 3-D mouse (Rehg 1995, 4.3.4): the palm slides on a plane, and three joint angles are free.

One camera then suffices. The index finger rises from its knuckle; thumb and little finger spread. The other joints are
locked in the posture of a flat, relaxed hand.
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
"""Angles that control the mouse. Rehg's index finger bent at the PIP joint, too. One camera, or two side by side,
cannot distinguish that from a finger that rises from its knuckle."""

FLAT_DEG: Final = {
    "thumb_cmc_abduction": -18.0, "thumb_cmc_flexion": 8.0, "thumb_mcp_flexion": 12.0, "thumb_ip_flexion": 12.0,
    "index_mcp_flexion": 26.0, "index_pip_flexion": 10.0, "index_dip_flexion": 6.0, "index_mcp_abduction": 5.0,
    "middle_mcp_flexion": 12.0, "middle_pip_flexion": 16.0, "middle_dip_flexion": 10.0,
    "ring_mcp_flexion": 12.0, "ring_pip_flexion": 16.0, "ring_dip_flexion": 10.0, "ring_mcp_abduction": -3.0,
    "little_mcp_flexion": 12.0, "little_pip_flexion": 16.0, "little_dip_flexion": 10.0, "little_mcp_abduction": -6.0}
"""degrees: a flat relaxed hand with the thumb on the table; the index finger is bent a little, so that it can rise. All
others are 0."""


RISING: Final = "index_mcp_flexion", (0.5 * FLAT_DEG["index_mcp_flexion"], 0.25 * FLAT_DEG["index_mcp_flexion"])
"""degrees: prior mean and standard deviation of the index MCP flexion, whose range is from rest to straight, two
standard deviations to both sides. At 45 degrees to the table the finger is perpendicular to the camera's line of sight,
where one camera cannot tell a larger flexion from a smaller one."""


LOCKED_DEG: Final[dict[str, float | tuple[float, float]]] = {
    name: FLAT_DEG.get(name, 0.0) for name in ANGLES if name not in FREE} | dict([RISING])
"""The tracker setting `locked_deg` of the mouse's hand."""


def with_mouse_model(rig: Rig, plane: PalmPlane | None) -> Rig:
    """The rig with an estimator with the hand model of the mouse. `plane`: on which the palm lies; None: two cameras
    measure it."""
    tracker = msgspec.structs.replace(rig.tracker, kind="estimator", locked_deg=dict(LOCKED_DEG), palm_plane=plane)
    return msgspec.structs.replace(rig, tracker=tracker)


def table_plane(rig: Rig) -> PalmPlane | None:
    """The plane of a palm on a rig's table: half a wrist's thickness above it. None without a table."""
    if rig.up != "z":
        return None
    return PalmPlane((0.0, 0.0, 1.0), 0.5e-3 * rig.hand.wrist_thickness_mm)


def up_of(rig: Rig) -> Array | None:
    """(3,) unit normal of the plane of a rig's mouse, rig frame: the tracker's plane or the table; None if neither is
    known."""
    plane = rig.tracker.palm_plane
    if plane is not None:
        return np.array(plane.normal) / float(np.linalg.norm(plane.normal))
    return np.array([0.0, 0.0, 1.0]) if rig.up == "z" else None
