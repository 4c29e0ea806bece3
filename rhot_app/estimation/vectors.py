"""Vectors of three numbers within compiled functions: tuples or rows of arrays in, tuples out, so nothing is allocated.

A frame is (3, 4) or the beginning of a transform (4, 4): outer_from_inner.
"""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True)
def minus(a, b):
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(cache=True)
def along(a, t, b):
    """a + t b."""
    return a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]


@njit(cache=True)
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def cross(a, b):
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def norm(a):
    """Length."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@njit(cache=True)
def unit(a):
    """a / |a|."""
    length = norm(a)
    return a[0] / length, a[1] / length, a[2] / length


@njit(cache=True)
def axis(k):
    """The unit vector along axis k."""
    return 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0


@njit(cache=True)
def axis_of(frame, column):
    """A column of the frame's rotation."""
    return frame[0, column], frame[1, column], frame[2, column]


@njit(cache=True)
def origin_of(frame):
    """The frame's origin in the outer frame."""
    return frame[0, 3], frame[1, 3], frame[2, 3]


@njit(cache=True)
def to_outer(frame, p):
    """The point p of the frame, in the outer one."""
    return (frame[0, 3] + frame[0, 0] * p[0] + frame[0, 1] * p[1] + frame[0, 2] * p[2],
            frame[1, 3] + frame[1, 0] * p[0] + frame[1, 1] * p[1] + frame[1, 2] * p[2],
            frame[2, 3] + frame[2, 0] * p[0] + frame[2, 1] * p[1] + frame[2, 2] * p[2])


@njit(cache=True)
def turned(frame, v):
    """The direction v of the frame, in the outer one."""
    return (frame[0, 0] * v[0] + frame[0, 1] * v[1] + frame[0, 2] * v[2],
            frame[1, 0] * v[0] + frame[1, 1] * v[1] + frame[1, 2] * v[2],
            frame[2, 0] * v[0] + frame[2, 1] * v[1] + frame[2, 2] * v[2])


@njit(cache=True)
def turned_back(frame, v):
    """The direction v of the outer frame, in this one."""
    return (frame[0, 0] * v[0] + frame[1, 0] * v[1] + frame[2, 0] * v[2],
            frame[0, 1] * v[0] + frame[1, 1] * v[1] + frame[2, 1] * v[2],
            frame[0, 2] * v[0] + frame[1, 2] * v[1] + frame[2, 2] * v[2])
