"""What chapter 7 and table 10.1 of the RHOT thesis (Kalbfleisch 2018) say, to stand beside the user's own numbers."""

from __future__ import annotations

from typing import Final

import numpy as np

JITTER_PX: Final = (2.0, 5.0)
"""Figure 7.7 and 7.2.2: "between 2 and 5 pixel deviation" of a static marker, at 640 x 480."""

FRAME_S: Final = 1.0 / 30.0
"""7.1: what is processed within this time is real time."""

TIMING_MS: Final = {"image retrieval": (0.91685, 0.17105), "stereo rectification": (31.39436, 7.19069),
                    "colour detection": (14.55122, 5.06205), "UDP sending": (0.12053, 0.06031),
                    "sum": (46.96780, 10.77171)}
"""Table 7.1: mean and standard deviation."""

REAL_M: Final = 0.01 * np.array([100, 95, 90, 85, 80, 75, 70, 65, 60, 55, 50, 45, 40, 35, 30, 25, 20], dtype=np.float64)
DISPARITY_PX: Final = np.array([40, 42, 44, 48, 49, 52, 56, 61, 66, 71, 76, 85, 97, 109, 129, 153, 189],
                               dtype=np.float64)
"""Table 10.1: the ruler, and the disparity. (The 25 cm row prints a left x of 288 for 228; its disparity is right.)"""

BASELINE_M, VIEW_ANGLE_DEG, WIDTH_PX = 0.075, 62.2, 640
"""7.2.3; eq. 6.12 gives the table's distances with 62.2 degrees, not with the 62.5 that the text prints."""

POWER_K_M, POWER_Z = 45.433, -1.035
"""Eq. 7.4: D = k x^z, fitted to table 10.1."""

DEVIATION_PERCENT, CORRECTED_PERCENT = 5.25, 2.91
"""Table 10.1: the largest deviation from the ruler, by eq. 6.12 and after the correction by eq. 7.4."""
