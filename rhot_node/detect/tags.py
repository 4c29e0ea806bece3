"""Corners of fiducial tags (AprilTag, ArUco) in the luma plane, with a covariance for each corner.

Knows dictionaries and pixels; which tag belongs to which object only the master knows.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_node.errors import SettingsError
from rhot_node.wire.fiducials import FAMILIES

Array = NDArray[np.float64]


def family_number(name: str) -> int:
    """The index into FAMILIES of a dictionary by its cv2.aruco name, such as DICT_APRILTAG_36h11.

    Raises SettingsError when there is no such dictionary.
    """
    number = getattr(cv2.aruco, name, None) if name.startswith("DICT_") else None
    if not isinstance(number, int) or not 0 <= number < len(FAMILIES):
        raise SettingsError(f"there is no tag dictionary {name!r}; cv2.aruco has {', '.join(FAMILIES)}.")
    return number


def family_size(number: int) -> int:
    """How many tags a dictionary has."""
    return len(cv2.aruco.getPredefinedDictionary(number).bytesList)


def tag_code(number: int, tag: int) -> bytes:
    """The bits of a tag. Tags of equal bits, such as 3 of DICT_4X4_50 and of DICT_4X4_100, look the same."""
    dictionary = cv2.aruco.getPredefinedDictionary(number)
    return bytes([dictionary.markerSize]) + dictionary.bytesList[tag].tobytes()
