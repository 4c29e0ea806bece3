"""Transitions and noise of Gauss-Markov processes against their stochastic differential equations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad_vec
from scipy.linalg import expm, solve_continuous_lyapunov

from rhot_app.estimation.gauss_markov import (
    integrated,
    integrated_noise,
    jerk_density,
    matern52,
    matern52_noise,
)

JERK = np.diag([0.0, 0.0, 1.0])

rates = st.floats(0.5, 30.0)
times = st.floats(0.0, 0.5)


def matern52_companion(rate):
    """The value's third derivative, (d/dt + rate)^3 x = white noise."""
    return np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-rate**3, -3.0 * rate**2, -3.0 * rate]])


def integrated_companion(rate):
    """The velocity's second derivative, (d/dt + rate)^2 v = white noise."""
    return np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -rate**2, -2.0 * rate]])


@pytest.mark.parametrize(("fill", "companion"), [(matern52, matern52_companion), (integrated, integrated_companion)])
def test_transitions_are_the_exponentials_of_the_companion_matrices(fill, companion):
    @given(rate=rates, dt=times)
    def holds(rate, dt):
        out = np.full((3, 3), np.nan)
        fill(rate, dt, out)
        units = rate ** np.subtract.outer(np.arange(3), np.arange(3))  # value, velocity, acceleration
        np.testing.assert_allclose(out / units, expm(companion(rate) * dt) / units, atol=1e-10)

    holds()


@pytest.mark.parametrize(("fill", "companion"), [(matern52_noise, matern52_companion),
                                                 (integrated_noise, integrated_companion)])
def test_the_noise_is_the_integral_of_the_jerk_s_effects(fill, companion):
    @given(rate=rates, share=st.floats(1e-3, 0.5))
    def holds(rate, share):
        def effect(age):
            column = expm(companion(rate) * age)[:, 2]
            return jerk_density(rate) * np.outer(column, column)

        out = np.full((3, 3), np.nan)
        fill(rate, share / rate, out)
        np.testing.assert_allclose(out, quad_vec(effect, 0.0, share / rate, epsrel=1e-10)[0], rtol=0.02)

    holds()


@given(rate=rates)
def test_the_jerk_s_density_gives_a_process_of_variance_one(rate):
    stationary = solve_continuous_lyapunov(matern52_companion(rate), -jerk_density(rate) * JERK)
    assert stationary[0, 0] == pytest.approx(1.0, rel=1e-8)
    assert stationary[1, 1] == pytest.approx(rate**2 / 3.0, rel=1e-8)
