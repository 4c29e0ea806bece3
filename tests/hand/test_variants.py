"""Variants as linear maps, the limit sets, and the inter-finger constraint, against the equations of the thesis."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hand_samples import natural_angles
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot_app.hand.skeleton import ANGLES, FINGERS
from rhot_app.hand.variants import inter_finger, limit_set, linear_variant, make_variant
from rhot_node.files import resource_path

COUPLED = make_variant("coupled")
coordinates = st.lists(st.floats(-2.0, 2.0), min_size=15, max_size=15).map(np.array)


def test_full_is_the_angles_themselves():
    full = make_variant("full")
    angles = np.linspace(-1, 1, 21)
    assert full.names == ANGLES
    np.testing.assert_array_equal(full.angles(angles), angles)
    np.testing.assert_array_equal(full.coordinates(angles), angles)


@settings(deadline=None, max_examples=50)
@given(coordinates)
def test_coupled_keeps_the_equations_of_the_thesis(q):
    angles = dict(zip(ANGLES, COUPLED.angles(q), strict=True))
    assert angles["middle_mcp_abduction"] == 0.0  # eq. 2.2
    assert angles["thumb_mcp_abduction"] == 0.0  # eq. 2.3: the thumb has one less
    for finger in FINGERS[1:]:  # eq. 2.4
        assert angles[f"{finger}_dip_flexion"] == pytest.approx(2 / 3 * angles[f"{finger}_pip_flexion"])
    np.testing.assert_allclose(COUPLED.coordinates(COUPLED.angles(q)), q, atol=1e-12)


def test_coupled_has_15_of_21_angles():
    assert COUPLED.basis.shape == (21, 15)
    assert np.linalg.matrix_rank(COUPLED.basis) == 15
    assert np.all(np.count_nonzero(COUPLED.basis, axis=1) <= 1)


def test_coordinates_are_the_nearest(right_hand):
    angles = natural_angles(right_hand, np.random.default_rng(0), 30)
    nearest = COUPLED.angles(COUPLED.coordinates(angles))
    best = (angles - COUPLED.mean) @ np.linalg.pinv(COUPLED.basis).T
    np.testing.assert_allclose(nearest, COUPLED.angles(best), atol=1e-12)


@pytest.mark.parametrize("name", ["anatomical", "thesis"])
def test_a_box_of_coordinates_is_the_box_of_angles(right_hand, name):
    limits = limit_set(right_hand, name)
    low, high = COUPLED.limits(limits).T
    for q in np.random.default_rng(1).uniform(low, high, (200, 15)):
        angles = COUPLED.angles(q)
        assert np.all((angles >= limits[:, 0] - 1e-12) & (angles <= limits[:, 1] + 1e-12))
    pip = COUPLED.names.index("ring_pip_flexion")
    beyond = COUPLED.angles(high + 1e-6 * np.eye(15)[pip])
    assert np.any(beyond > limits[:, 1])


def test_thesis_limits_are_eq_2_1_and_leave_the_thumb(right_hand):
    limits = dict(zip(ANGLES, np.degrees(limit_set(right_hand, "thesis")), strict=True))
    for finger in FINGERS[1:]:
        np.testing.assert_allclose(limits[f"{finger}_mcp_flexion"], (0, 90))
        np.testing.assert_allclose(limits[f"{finger}_pip_flexion"], (0, 110))
        np.testing.assert_allclose(limits[f"{finger}_dip_flexion"], (0, 90))
        np.testing.assert_allclose(limits[f"{finger}_mcp_abduction"], (-15, 15))
    np.testing.assert_array_equal(limit_set(right_hand, "thesis")[:5], right_hand.limits[:5])
    np.testing.assert_array_equal(limit_set(right_hand, "anatomical"), right_hand.limits)


def test_inter_finger_forces_the_middle_finger_and_lets_people_point():
    rows, bounds = inter_finger()

    def allowed(**degrees):
        angles = np.zeros(21)
        for name, value in degrees.items():
            angles[ANGLES.index(f"{name}_mcp_flexion")] = np.radians(value)
        return bool(np.all(rows @ angles <= bounds))

    assert not allowed(index=80), "a bent index finger forces the middle one"
    assert allowed(index=80, middle=30)
    assert allowed(middle=90, ring=90, little=90), "pointing"


def test_inter_finger_cuts_no_shipped_motion():
    rows, bounds = inter_finger()
    for path in resource_path("motions").glob("*.json"):
        motion = json.loads(path.read_text())
        for key in motion.get("keys", []):
            degrees = motion["base_deg"] | key.get("angles_deg", {})
            angles = np.radians([degrees.get(name, 0.0) for name in ANGLES])
            assert np.all(rows @ angles <= bounds), f"{path.name} at {key['t_s']} s"


def test_what_cannot_be_is_refused(right_hand):
    with pytest.raises(ValueError, match="b follows c, which is not a free angle"):
        linear_variant("x", ("a", "b", "c"), {"b": ("c", 1.0), "c": ("a", 1.0)}, {})
    apart = right_hand.limits.copy()
    apart[ANGLES.index("ring_dip_flexion")] = 1.5, 1.6
    apart[ANGLES.index("ring_pip_flexion")] = 0.0, 0.1
    with pytest.raises(ValueError, match="ring_pip_flexion"):
        COUPLED.limits(apart)
