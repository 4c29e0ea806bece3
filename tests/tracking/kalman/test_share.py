"""Arrays that go into compiled functions as one.

Plain tuples only: the cache of compiled functions, which other programs read, would else name classes of this file.
"""

import numpy as np
from numba import njit

from rhot_app.tracking.kalman.share import Share


@njit
def _add(shared, amount):
    one, (numbers, total) = shared.of
    one[:] += amount
    total[0] = one.sum() + numbers[1]
    return numbers[0]


def test_compiled_functions_change_the_very_arrays():
    one, total = np.zeros(3), np.zeros(1)
    shared = Share((one, (np.array([7, 8]), total)))
    assert _add(shared, 1.0) == 7 and _add(shared, 1.0) == 7
    np.testing.assert_array_equal(one, [2.0, 2.0, 2.0])
    assert total[0] == 14.0


@njit
def _sum_of_first(shared):
    return shared.of[0].sum()


def test_what_is_shared_lives_as_long_as_its_share():
    shared = Share((np.arange(5.0), (np.array([3]), np.zeros(1))))
    assert _sum_of_first(shared) == 10.0
