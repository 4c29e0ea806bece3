"""Rigid transforms against each other."""

import numpy as np

from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.transforms import apply, inverse, rigid


def test_inverse_and_apply_chain():
    a_from_b = rigid(exp_so3([0.3, -0.2, 0.9]), [0.1, 0.2, -0.3])
    points = np.random.default_rng(1).normal(size=(5, 3))
    np.testing.assert_allclose(apply(inverse(a_from_b), apply(a_from_b, points)), points, atol=1e-14)
