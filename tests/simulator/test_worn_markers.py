"""Markers sit where their roles say, on both hands, and are seen where they are painted."""

from __future__ import annotations

import numpy as np
import pytest
from shipped_rig import RIGHT_MODEL
from simulator_solids import CAMERA, RELAXED, Shown, renderer

from rhot_app.errors import RigError
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import ANGLES, JOINTS
from rhot_app.simulator.render.body import build_body
from rhot_node.files import resource_path
from rhot_node.markers import MarkerSet, load_markers

RHOT8, RICH = (load_markers(resource_path("markers", f"{name}.json")) for name in ("rhot8", "rich"))


def centres(model: HandModel, markers: MarkerSet, angles: np.ndarray = RELAXED) -> tuple[dict, dict]:
    """Joints and markers by name, m in the palm frame."""
    joints, worn = build_body(model, markers).joints_and_markers(np.eye(4)[None], angles[None])
    return dict(zip(JOINTS, joints[0], strict=True)), dict(zip(markers.ids, worn[0], strict=True))


def test_inner_markers_sit_half_way_along_their_bones_on_the_back(model: HandModel) -> None:
    for angles in (np.zeros(21), RELAXED):
        joints, worn = centres(model, RICH, angles)
        for finger, inner in (("index", ("mcp", "pip", "dip")), ("little", ("mcp", "pip", "dip")),
                              ("thumb", ("cmc", "mcp", "ip"))):
            bones = ("metacarpal", "proximal") if finger == "thumb" else ("proximal", "medial")
            for bone, start, end in zip(bones, inner[:2], inner[1:], strict=True):
                a, b = joints[f"{finger}_{start}"], joints[f"{finger}_{end}"]
                along = (worn[f"{finger}_{bone}"] - a) @ (b - a) / ((b - a) @ (b - a))
                assert along == pytest.approx(0.5, abs=1e-9), (finger, bone)
                assert np.linalg.norm(worn[f"{finger}_{bone}"] - 0.5 * (a + b)) > 0.006
    joints, straight = centres(model, RICH, np.zeros(21))
    for finger in ("index", "middle", "ring", "little"):
        above = straight[f"{finger}_medial"] - joints[f"{finger}_pip"]
        assert above[2] > 0.006, "the palm's z comes out of the back of the hand"


def test_palm_markers_do_not_move_with_the_fingers(model: HandModel) -> None:
    joints, open_hand = centres(model, RHOT8)
    fist = RELAXED + 0.6 * np.array(["flexion" in name for name in ANGLES])
    _, closed = centres(model, RHOT8, fist)
    for name, joint in (("index_knuckle", "index_mcp"), ("little_knuckle", "little_mcp")):
        np.testing.assert_allclose(open_hand[name], joints[joint], atol=1e-9)
        np.testing.assert_allclose(closed[name], open_hand[name], atol=1e-12)
    _, rich = centres(model, RICH)
    back = np.array([rich[f"hand_{k}"] for k in (1, 2, 3)])
    assert (back[:, 2] > 0.01).all() and np.linalg.norm(back[0] - back[1]) > 0.03
    assert np.sign(back[0, 1]) == np.sign(joints["index_mcp"][1])


def test_knuckles_of_rhot8_show_to_cameras_that_see_the_palm() -> None:
    body = build_body(RIGHT_MODEL, RHOT8)
    image, _, visible = renderer(body, shading=0.0).radiance(Shown(back=False), 0.0, 0)
    for name in ("index_knuckle", "little_knuckle"):
        index = RHOT8.ids.index(name)
        assert visible[index] > 0.6, name
        x, y = CAMERA.project(body.marker_positions(*Shown(back=False).sample(np.zeros(1)))[0])[index]
        np.testing.assert_allclose(image[:, round(y), round(x)], RHOT8.markers[index].display_rgb, atol=1.0)


def test_glued_balls_show_only_from_the_back() -> None:
    body = build_body(RIGHT_MODEL, RICH)
    glued = [k for k, name in enumerate(RICH.ids) if name.startswith(("hand_", "index_m", "middle_p", "ring_m"))]
    front = renderer(body).radiance(Shown(back=False), 0.0, 0)[2]
    back = renderer(body).radiance(Shown(back=True), 0.0, 0)[2]
    assert front[glued].max() < 0.1 and back[glued].min() > 0.7


@pytest.mark.parametrize(("markers", "apart"), [(RHOT8, 25.0), (RICH, 5.0)], ids=["rhot8", "rich"])
def test_colours_of_a_set_are_apart(markers: MarkerSet, apart: float) -> None:
    hues = np.sort(np.degrees([marker.chroma.hue_rad for marker in markers.markers]))
    assert np.diff([*hues, hues[0] + 360.0]).min() >= apart


def test_a_role_that_is_no_place_on_the_hand_is_named() -> None:
    with pytest.raises(RigError, match=r"'red' has no role.*palm_index"):
        build_body(RIGHT_MODEL, load_markers(resource_path("markers", "trifinger_cube.json")))
