"""Articulated objects from files: Rehg's hand against his table and a numpy twin, any other tree, what is refused."""

import csv
import json
from pathlib import Path

import msgspec
import numpy as np
import pytest
from dh_oracle import frames_of, jacobian_of, points_of, root_transform
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot_app.errors import RigError
from rhot_app.hand.articulated import Capsule, load_articulated, save_articulated, scaled, scaled_to_length
from rhot_app.hand.articulated_model import build_articulated, forward_state, state_jacobian
from rhot_node.files import resource_path

DIGITEYES = resource_path("hands", "digiteyes.json")
HAND = load_articulated(DIGITEYES)
MODEL = build_articulated(HAND)
TABLE = Path(__file__).parents[2] / "../shared/reference/digiteyes_hand_dh.csv"

LAMP = {"format": "rhot-articulated", "version": 1, "name": "desk lamp", "root": {"name": "foot"},
        "angles": [{"name": "swing"}, {"name": "nod", "limits_deg": [-10, 80], "rest_deg": 5}],
        "frames": [{"name": "pole", "parent": "foot", "d_mm": 300, "alpha_deg": 90, "angle": "swing",
                    "shape": {"kind": "box", "size_mm": [20, 20, 300]}},
                   {"name": "arm", "parent": "pole", "a_mm": 200, "angle": "nod", "sign": -1,
                    "shape": {"kind": "capsule", "radius_mm": 10}}],
        "points": [{"name": "bulb", "frame": "arm", "offset_mm": [0, 0, 5]}, {"name": "plug", "frame": "foot"}]}


def lamp(tmp_path, **changes):
    path = tmp_path / "lamp.json"
    path.write_text(json.dumps(LAMP | changes))
    return path


def some_state(model, seed):
    """A state anywhere, its quaternion of any length."""
    rng = np.random.default_rng(seed)
    quaternion = rng.normal(size=4)
    return np.concatenate([quaternion * rng.uniform(0.3, 3.0), rng.uniform(-0.5, 0.5, 3), rng.uniform(*model.limits.T)])


def test_digiteyes_stretched_is_where_the_table_puts_it():
    """Sums of the table's own lengths, mm, palm frame: x to the index finger, y distal, z out of the palm."""
    straight = MODEL.rest.copy()
    straight[7:] = 0.0
    points = dict(zip(MODEL.point_names, 1e3 * forward_state(MODEL, straight).points, strict=True))
    np.testing.assert_allclose(points["index_mcp"], [31, 38, 0], atol=1e-9)
    np.testing.assert_allclose(points["index_tip"], [31, 38 + 45 + 26 + 24, 0], atol=1e-9)
    np.testing.assert_allclose(points["middle_tip"], [9, 37 + 56 + 27 + 22, 0], atol=1e-9)
    np.testing.assert_allclose(points["ring_tip"], [-6, 33 + 53 + 25 + 20, 0], atol=1e-9)
    np.testing.assert_allclose(points["little_tip"], [-26, 30 + 38 + 19 + 17, 0], atol=1e-9)
    np.testing.assert_allclose(points["thumb_tip"], [38, -43 + 46 + 34 + 25, 15], atol=1e-9)


def test_digiteyes_is_the_published_table():
    if not TABLE.exists():
        pytest.skip(f"{TABLE} is not here")
    lines = [line for line in TABLE.read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))[1:]
    assert len(rows) == len(HAND.frames)
    turns = {"0": 0.0, "pi/2": 90.0, "-pi/2": -90.0, "-pi": -180.0}
    for row, frame in zip(rows, HAND.frames, strict=True):
        assert (float(row["d"]), float(row["a"]), turns[row["alpha"]]) == (frame.d_mm, frame.a_mm, frame.alpha_deg)
        if row["theta"].startswith("q"):
            assert frame.angle == MODEL.angle_names[int(row["theta"][1:]) - 7]
            assert (frame.theta_deg, frame.sign) == (0.0, 1)
        else:
            assert (frame.theta_deg, frame.angle) == (turns[row["theta"]], None)
        if "link" in row["geometry"]:
            assert frame.shape.radius_mm == float(row["shape"].split()[1])
    parents = {next_: row["frame"] for row in csv.DictReader(lines) for next_ in row["next"].split()}
    names = [HAND.root.name, *(frame.name for frame in HAND.frames)]
    for k, frame in enumerate(HAND.frames, 1):
        assert names[int(parents[str(k)])] == frame.parent


@pytest.mark.parametrize("seed", range(3))
def test_kinematics_are_the_numpy_twins(seed):
    state = some_state(MODEL, seed)
    posed = forward_state(MODEL, state)
    frames = frames_of(HAND, state)
    np.testing.assert_allclose(posed.root, root_transform(state), atol=1e-12)
    for body in MODEL.bodies:
        np.testing.assert_allclose(posed.world_from(body), frames[body.name][:3], atol=1e-12)
    np.testing.assert_allclose(posed.points, points_of(HAND, state), atol=1e-12)


@pytest.mark.parametrize("side", ["right", "left"])
def test_jacobian_of_all_28_numbers_is_the_numerical_one(side):
    model = build_articulated(msgspec.structs.replace(HAND, side=side))
    state = some_state(model, 4)
    numerical = jacobian_of(lambda moved: forward_state(model, moved).points, state)
    assert np.max(np.abs(state_jacobian(model, state) - numerical)) <= 1e-6
    along = state_jacobian(model, state)[:, :, :4] @ state[:4]
    np.testing.assert_allclose(along, 0.0, atol=1e-12)  # the quaternion's length means nothing


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 10_000))
def test_left_is_the_mirror_image(seed):
    left = build_articulated(msgspec.structs.replace(HAND, side="left"))
    state = some_state(MODEL, seed)
    state[:7] = [1, 0, 0, 0, 0, 0, 0]
    mirrored = forward_state(left, state).points * [-1, 1, 1]
    np.testing.assert_allclose(mirrored, forward_state(MODEL, state).points, atol=1e-12)


@settings(deadline=None, max_examples=50)
@given(st.floats(0.2, 3.0), st.integers(0, 10_000))
def test_scale_scales_and_turns_nothing(factor, seed):
    state = some_state(MODEL, seed)
    big = state.copy()
    big[4:7] *= factor
    model = build_articulated(scaled(HAND, factor))
    np.testing.assert_allclose(forward_state(model, big).points, factor * forward_state(MODEL, state).points,
                               atol=1e-10)
    assert model.bodies[0].shape.size_mm[0] == pytest.approx(56 * factor)


def test_scaled_to_a_hand_length():
    longer = scaled_to_length(HAND, 0.2035)
    assert longer.length_mm == pytest.approx(203.5)
    assert longer.frames[3].a_mm == pytest.approx(45 * 1.1)
    assert isinstance(longer.frames[3].shape, Capsule)
    with pytest.raises(ValueError, match="states no length_mm"):
        scaled_to_length(msgspec.structs.replace(HAND, length_mm=None), 0.2)
    with pytest.raises(ValueError, match="positive"):
        scaled(HAND, 0.0)


def test_couplings_become_a_linear_map():
    assert MODEL.coupled.basis.shape == (21, 16)
    angles = dict(zip(MODEL.angle_names, MODEL.coupled.angles(np.full(16, 0.3)), strict=True))
    assert angles["ring_dip_flexion"] == pytest.approx(0.2)
    assert angles["middle_mcp_abduction"] == 0.0


def test_any_other_tree(tmp_path):
    document = load_articulated(lamp(tmp_path))
    model = build_articulated(document)
    state = some_state(model, 7)
    assert [body.name for body in model.bodies] == ["foot", "pole", "arm"]
    np.testing.assert_allclose(forward_state(model, state).points, points_of(document, state), atol=1e-12)
    numerical = jacobian_of(lambda moved: forward_state(model, moved).points, state)
    np.testing.assert_allclose(state_jacobian(model, state), numerical, atol=1e-8)


def test_saved_files_read_back_and_the_shipped_one_is_as_saved(tmp_path):
    path = tmp_path / "hand.json"
    save_articulated(path, HAND)
    assert load_articulated(path) == HAND
    assert path.read_text() == DIGITEYES.read_text()


@pytest.mark.parametrize(("changes", "complaint"), [
    ({"frames": [{"name": "arm", "parent": "shade"}]}, '"arm" hangs on "shade"'),
    ({"frames": LAMP["frames"][::-1]}, '"pole", which comes later; put it before'),
    ({"frames": [{"name": "pole", "parent": "arm"}, {"name": "arm", "parent": "pole"}]},
     'in a loop: "pole" on "arm" on "pole"'),
    ({"frames": [*LAMP["frames"], {"name": "arm", "parent": "foot"}]}, 'two frames named "arm"'),
    ({"frames": LAMP["frames"][:1], "points": []}, '"nod" turns no frame'),
    ({"angles": [{"name": "swing"}]}, 'turned by "nod"'),
    ({"angles": [{"name": "swing"}, {"name": "nod", "limits_deg": [5, 1]}]}, "lower limit above"),
    ({"angles": [{"name": "swing"}, {"name": "nod", "limits_deg": [5, 9]}]}, "outside its limits"),
    ({"root": {"name": "foot", "quaternion_wxyz": [0, 0, 0, 0]}}, "length zero"),
    ({"points": [{"name": "bulb", "frame": "shade"}]}, 'rides on "shade"'),
    ({"couplings": [{"angle": "nod", "follows": "wink"}]}, '"wink", which does not exist'),
    ({"couplings": [{"angle": "nod", "follows": "swing"}, {"angle": "swing", "follows": "nod"}]}, "not free"),
    ({"colour": "red"}, 'no field "colour"'),
    ({"version": 2}, "version 2"),
])
def test_what_cannot_be_is_refused_by_name(tmp_path, changes, complaint):
    with pytest.raises(RigError, match=complaint) as refused:
        load_articulated(lamp(tmp_path, **changes))
    assert "lamp.json" in str(refused.value)
