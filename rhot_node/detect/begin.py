"""Where the quick lane begins: the outline of a marker that was measured carefully, in the very picture.

All coordinates are chroma pixels.
"""

from __future__ import annotations

import math

from numba import njit

from rhot_node.detect import contour_columns as c
from rhot_node.detect.contour import fit
from rhot_node.detect.contour_pixels import project
from rhot_node.detect.follow import AREA_LEAST, ELONGATED, MISFIT_MOST, MISFIT_NOISE, NOISE_MOST
from rhot_node.detect.followed_band import READY, SAG, SAG_FRAMES, SAG_ZERO
from rhot_node.detect.position import BLUR_VARIANCE

START_AWAY, START_RATIO = 0.35, 1.15  # px, area: how well outline and careful measurement agree
ARC_VARIANCE = 2.0 / 3.0 - (0.25 * math.pi) ** 2  # of sqrt(1 - u^2) over -1..1


@njit(**c.FAST)
def start(y, u, v, x, y_at, var_long, var_high, axis_x, axis_y, area, noise, is_band, sag, mark, look, radius, rim,
          pixels, work, fitted):
    """Begin to follow a marker that was measured carefully in this picture; sets READY when its outline is found.

    `x`, `y_at`: its place; `var_long`, `var_high`, `axis_x`, `axis_y`: second moments and major axis; `sag`: a band's.
    """
    mark[READY] = 0.0
    first_x, first_y = x, y_at
    long2, high2 = max(var_long - BLUR_VARIANCE, 0.5), max(var_high - BLUR_VARIANCE, 0.5)
    if area < AREA_LEAST:
        return
    if not _levels(u, v, x - 0.25 * math.pi * sag * axis_y, y_at + 0.25 * math.pi * sag * axis_x, axis_x, axis_y,
                   math.sqrt(4.0 * long2), math.sqrt(4.0 * high2), look):
        return
    high2 = max(high2 - ARC_VARIANCE * sag * sag, 0.5)
    look[c.BEND], look[c.WIDTH], mark[SAG] = sag, math.sqrt(3.0 * long2) if is_band else 0.0, 0.0
    aspect = math.sqrt(long2 / high2)
    look[c.AXIS_X], look[c.AXIS_Y] = axis_x, axis_y
    look[c.LONG] = look[c.HIGH] = 1.0
    side = math.sqrt(math.sqrt(long2 * high2) * (3.0 if is_band else 4.0))
    if aspect > ELONGATED:
        look[c.LONG], look[c.HIGH] = math.sqrt(aspect), 1.0 / math.sqrt(aspect)
        aspect = 1.0
    for j in range(c.NODES):
        cosine, sine = c.COSINES[j], c.SINES[j]
        if is_band:
            radius[j] = side / max(abs(cosine), abs(sine))
        else:
            radius[j] = side / math.sqrt(cosine * cosine / aspect + sine * sine * aspect)
    radius[c.NODES] = radius[0]
    rim[:] = 0.0
    look[c.SLOPE_X] = look[c.SLOPE_Y] = look[c.AGE] = 0.0
    look[c.BLUR] = c.BLUR_START
    for _ in range(3):
        project(look)
        if not look[c.GAIN] * noise < NOISE_MOST:
            return
        if not fit(y, u, v, x, y_at, look, radius, rim, 3, pixels, work, fitted):
            return
        x, y_at = fitted[c.X], fitted[c.Y]
    mark[SAG_FRAMES] = mark[SAG_ZERO] = 0.0
    mark[READY] = (
        fitted[c.MISFIT] < math.hypot(MISFIT_NOISE * look[c.GAIN] * noise, MISFIT_MOST)
        and fitted[c.AREA] < START_RATIO * area and area < START_RATIO * fitted[c.AREA]
        and math.hypot(x - first_x, y_at - first_y) < START_AWAY)


@njit(**c.FAST)
def _levels(u, v, x, y_at, ax, ay, long, high, look):
    """Mean chroma of the inner half of the marker, and mean and covariance around it, by ellipses."""
    reach = int(long + 6.0)
    x0, x1 = max(int(x) - reach, 0), min(int(x) + reach + 1, u.shape[1] - 1)
    y0, y1 = max(int(y_at) - reach, 0), min(int(y_at) + reach + 1, u.shape[0] - 1)
    n = s_u = s_v = r_n = r_u = r_v = r_uu = r_uv = r_vv = 0.0
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            dx, dy = column - x, row - y_at
            long_way, high_way = dx * ax + dy * ay, dy * ax - dx * ay
            cu, cv = u[row, column] - 128.0, v[row, column] - 128.0
            if (long_way / long) ** 2 + (high_way / high) ** 2 < 0.4:
                n += 1.0
                s_u += cu
                s_v += cv
            elif (long_way / (1.1 * long + 2.0)) ** 2 + (high_way / (1.1 * high + 2.0)) ** 2 > 1.0 and (
                    (long_way / (1.1 * long + 4.5)) ** 2 + (high_way / (1.1 * high + 4.5)) ** 2 < 1.0):
                r_n += 1.0
                r_u += cu
                r_v += cv
                r_uu += cu * cu
                r_uv += cu * cv
                r_vv += cv * cv
    if n < 4.0 or r_n < 10.0:
        return False
    m_u, m_v = r_u / r_n, r_v / r_n
    look[c.PAINT_U], look[c.PAINT_V] = 128.0 + s_u / n, 128.0 + s_v / n
    look[c.AROUND_U], look[c.AROUND_V] = 128.0 + m_u, 128.0 + m_v
    look[c.C_UU], look[c.C_UV], look[c.C_VV] = r_uu / r_n - m_u * m_u, r_uv / r_n - m_u * m_v, r_vv / r_n - m_v * m_v
    return True
