"""Variants as linear maps, the limit sets, and the inter-finger constraint, against the equations of the thesis."""

import json

import msgspec
import numpy as np
import pytest
from hand_samples import natural_angles
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot_app.errors import RigError
from rhot_app.hand.anatomy import Coupling, load_hand, save_hand
from rhot_app.hand.model import inter_finger, limit_set, make_variant
from rhot_app.hand.skeleton import ANGLES, FINGERS
from rhot_node.files import resource_path

COUPLED = make_variant("coupled")
coordinates = st.lists(st.floats(-2.0, 2.0), min_size=15, max_size=15).map(np.array)


@settings(deadline=None, max_examples=50)
@given(coordinates)
def test_coupled_keeps_the_equations_of_the_thesis(q):
    angles = dict(zip(ANGLES, COUPLED.angles(q), strict=True))
    assert angles["middle_mcp_abduction"] == 0.0  # eq. 2.2
    assert angles["thumb_mcp_abduction"] == 0.0  # eq. 2.3: the thumb has one less
    for finger in FINGERS[1:]:  # eq. 2.4
        assert angles[f"{finger}_dip_flexion"] == pytest.approx(2 / 3 * angles[f"{finger}_pip_flexion"])
    np.testing.assert_allclose(COUPLED.coordinates(COUPLED.angles(q)), q, atol=1e-12)


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


def test_a_hand_file_has_couplings_of_its_own(right_hand, tmp_path):
    own = (Coupling("ring_pip_flexion", "little_pip_flexion", 0.5, 10.0),
           Coupling("index_mcp_abduction", None, 1.0, 5.0))
    path = tmp_path / "hand.json"
    save_hand(path, msgspec.structs.replace(right_hand.anatomy, couplings=own))
    variant = make_variant("coupled", load_hand(path).couplings)
    assert len(variant.names) == 19
    angles = dict(zip(ANGLES, np.degrees(variant.angles(np.full(19, 0.2))), strict=True))
    assert angles["ring_pip_flexion"] == pytest.approx(10.0 + 0.5 * angles["little_pip_flexion"])
    assert angles["index_mcp_abduction"] == pytest.approx(5.0)
    np.testing.assert_array_equal(make_variant("full", own).basis, np.eye(21))


@pytest.mark.parametrize(("couplings", "complaint"), [
    ([{"angle": "ring_pip_flexion", "follows": "elbow"}], '"elbow", which does not exist'),
    ([{"angle": "ring_pip_flexion", "follows": "ring_pip_flexion"}], "not free itself"),
    ([{"angle": "ring_pip_flexion"}, {"angle": "ring_pip_flexion"}], "coupled twice"),
])
def test_couplings_that_cannot_be_are_refused_by_file_and_name(tmp_path, couplings, complaint):
    hand = json.loads(resource_path("hands", "right.json").read_text()) | {"couplings": couplings}
    path = tmp_path / "hand.json"
    path.write_text(json.dumps(hand))
    with pytest.raises(RigError, match=complaint):
        load_hand(path)


def test_limits_that_exclude_each_other_are_refused(right_hand):
    apart = right_hand.limits.copy()
    apart[ANGLES.index("ring_dip_flexion")] = 1.5, 1.6
    apart[ANGLES.index("ring_pip_flexion")] = 0.0, 0.1
    with pytest.raises(ValueError, match="ring_pip_flexion"):
        COUPLED.limits(apart)
