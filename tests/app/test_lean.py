"""Compiled functions without memory of their own."""

import numpy as np
import pytest
from numba.core.errors import NumbaError

from rhot_app.lean import lean, room, slots

MOST = 8


@lean
def _mean_square(values):
    squares, order = room((MOST, 2)), slots((MOST,))
    for i in range(values.shape[0]):
        squares[i, 0], squares[i, 1], order[i] = values[i] ** 2, 0.0, i
    total = 0.0
    for i in order[:values.shape[0]]:
        total += squares[i, 0] + squares[i, 1]
    return total / values.shape[0]


@lean
def _mean_squares(values, out):
    for row in range(values.shape[0]):
        out[row] = _mean_square(values[row])


def test_room_is_an_array_of_every_call_of_its_own():
    values, out = np.random.default_rng(1).normal(size=(5, MOST)), np.empty(5)
    _mean_squares(values, out)
    np.testing.assert_allclose(out, (values**2).mean(axis=1))


def test_what_needs_memory_does_not_compile():
    @lean
    def doubled(values):
        return (2.0 * values).sum()
    with pytest.raises(NumbaError):
        doubled(np.ones(3))


def test_room_of_no_known_size_does_not_compile():
    @lean
    def last(values):
        return room((values.shape[0],))[-1]
    with pytest.raises(NumbaError):
        last(np.ones(3))
