"""The median of a few numbers."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rhot_app.tracking.kalman.median import median


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=20))
def test_it_is_numpys(values):
    assert median(np.array(values)) == np.median(values)
