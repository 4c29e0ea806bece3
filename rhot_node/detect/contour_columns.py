"""The numbers that describe a free outline (`contour`): constants, and the columns of its arrays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

NODES = 24
STEP_RAD = 2.0 * math.pi / NODES
COSINES = np.cos(STEP_RAD * np.arange(NODES))
SINES = np.sin(STEP_RAD * np.arange(NODES))
HALF_COSINES = np.cos(STEP_RAD * (np.arange(NODES) + 0.5))
HALF_SINES = np.sin(STEP_RAD * (np.arange(NODES) + 0.5))

BAND = 1.5  # px on either side of the outline that its blurred edge reaches
RING_NEAR, RING_FAR = 1.4, 2.8  # px outside the outline: what surrounds the marker
FLATNESS = 4.0  # grey levels^2 that surroundings are taken to vary by at least, as in `coverage`
INSIDE_MIN = 4  # pixels that the paint's level is taken from at least
BLUR_START, BLUR_LEAST, BLUR_MOST = 0.455, 0.38, 0.9  # px: point spread of 0.7 luma px and the 2x2 mean
SLOW = 0.1  # gain of what changes slowly: shading, rim, blur
SETTLED, RESTING = 9.0, 3.0  # frames until rim and blur are learnt, and the luma read, in every third frame only
RIM_PRIOR = 0.2  # pixels' worth of believing that paint and surroundings are at the edge as they are further off
BARE = 0.02  # of a node's mean information: nodes with hardly any pixel stay where they were
PIXELS_MAX = 4096  # near an outline

FAST: Any = {"cache": True, "error_model": "numpy", "fastmath": {"nsz", "arcp", "contract", "afn", "reassoc"}}

# Columns of a marker's look: projection, levels, shape of the coordinates.
PAINT_U, PAINT_V, AROUND_U, AROUND_V, C_UU, C_UV, C_VV = range(7)
SLOPE_X, SLOPE_Y, BLUR, AXIS_X, AXIS_Y, LONG, HIGH, AGE = range(7, 15)
W_U, W_V, GAIN = range(15, 18)  # the projection: a = W . (chroma - around); GAIN is |W|
PAINT_Y, INSIDE, BEND, WIDTH = range(18, 22)
LOOK_COLUMNS = 22
# Columns of a pixel near the outline.
AT_NODE, PART, RHO, COVER, DX, DY = range(6)
PIXEL_COLUMNS = 6
# Columns of the work space by node: sums of a step, sums of the surroundings, and what is interpolated between nodes.
G2, GE, GP, P2, PE, GQ, Q2, QE, RING_SUM, RING_COUNT, RADIUS, SCALE, OUT, CONTRAST = range(14)
WORK_COLUMNS = 14
ONE = np.uint64(1)
# Columns of a fit.
X, Y, AREA, V_XX, V_XY, V_YY, M_XX, M_XY, M_YY, MISFIT, DENT, LEVEL = range(12)
FIT_COLUMNS = 12
