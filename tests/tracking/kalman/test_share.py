"""Arrays that go into compiled functions as one."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.tracking.kalman.share import Share


class Pair(NamedTuple):
    one: NDArray[np.float64]
    other: tuple[NDArray[np.int64], NDArray[np.float64]]


@njit
def _add(shared, amount):
    pair = shared.of
    pair.one[:] += amount
    pair.other[1][0] = pair.one.sum() + pair.other[0][1]
    return pair.other[0][0]


def test_compiled_functions_change_the_very_arrays():
    pair = Pair(np.zeros(3), (np.array([7, 8]), np.zeros(1)))
    shared = Share(pair)
    assert _add(shared, 1.0) == 7 and _add(shared, 1.0) == 7
    np.testing.assert_array_equal(pair.one, [2.0, 2.0, 2.0])
    assert pair.other[1][0] == 14.0


def test_what_is_shared_lives_as_long_as_its_share():
    shared = Share((np.arange(5.0), (np.array([3]), np.zeros(1))))
    assert _first(shared) == 10.0


@njit
def _first(shared):
    return shared.of[0].sum()
