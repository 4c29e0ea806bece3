"""Nails, dots, rings and worn paint in the twin's pictures: where the marker's place says, and nowhere else."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from shipped_markers import NAILS6, RHOT6
from shipped_rig import RIGHT_MODEL
from simulator_solids import CAMERA, Shown, renderer

from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import ANGLES
from rhot_app.simulator.film.ideal_observations import ObservationNoise, ideal_observations
from rhot_app.simulator.film.shot import make_shot
from rhot_app.simulator.film.truth import true_object
from rhot_app.simulator.render.body import Appearance, build_body
from rhot_app.simulator.scene.scene import Scene, make_scene, twin_defaults
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerFlag

FLAT = {"shape": "disc", "radius_mm": None}
STRAIGHT = np.array([0.2 if name.startswith("thumb") else 0.02 for name in ANGLES])
FINGERS = slice(1, 5)
GREY = (128, 128, 128)


def worn(tips: dict[str, Any] | None = None, wrist: dict[str, Any] | None = None) -> MarkerSet:
    return msgspec.structs.replace(RHOT6, markers=tuple(
        msgspec.structs.replace(m, **((wrist if m.role == "wrist" else tips) or {})) for m in RHOT6.markers))


class Picture:
    """A still hand without shading before black; `found` (M, 2) px middles of what has each marker's own colour,
    `areas` (M,) px^2, `places` (M, 2) px where the markers' places project."""

    def __init__(self, model: HandModel, markers: MarkerSet, *, back: bool, look: Appearance | None = None) -> None:
        body, shown = build_body(model, markers, look=look or Appearance()), Shown(back=back, angles=STRAIGHT)
        self.image, _, self.visible = renderer(body, shading=0.0).radiance(shown, 0.0, 0)
        self.image, self.visible = self.image.copy(), self.visible.copy()
        y, x = np.mgrid[:480, :640]
        own = [np.abs(self.image - np.array(m.display_rgb, np.float32)[:, None, None]).max(axis=0) < 2.0
               for m in markers.markers]
        self.areas = np.array([mask.sum() for mask in own])
        self.found = np.array([(x[m].mean(), y[m].mean()) if m.any() else (np.nan, np.nan) for m in own])
        self.places = CAMERA.project(body.marker_positions(*shown.sample(np.zeros(1)))[0])

    def count(self, rgb: tuple[int, int, int]) -> int:
        """Pixels of a colour."""
        return int((np.abs(self.image - np.array(rgb, np.float32)[:, None, None]).max(axis=0) < 2.0).sum())


def test_a_nail_shows_on_the_back_where_the_marker_is(model: HandModel) -> None:
    whole, nails = Picture(model, RHOT6, back=True), Picture(model, NAILS6, back=True)
    np.testing.assert_allclose(nails.found[FINGERS], nails.places[FINGERS], atol=0.5)
    assert (nails.areas[FINGERS] < 0.6 * whole.areas[FINGERS]).all() and nails.areas[FINGERS].min() > 20
    assert nails.visible.min() > 0.98
    palm = Picture(model, NAILS6, back=False)
    assert not palm.areas[FINGERS].any() and not palm.visible[FINGERS].any(), "no nail shows on the palm's side"


def test_a_dot_shows_on_the_pulp(model: HandModel) -> None:
    dots = worn(FLAT | {"patch": "pulp", "length_mm": 8.0})
    palm, back = Picture(model, dots, back=False), Picture(model, dots, back=True)
    np.testing.assert_allclose(palm.found[FINGERS], palm.places[FINGERS], atol=0.5)
    assert not back.visible[FINGERS].any() and not back.areas[FINGERS].any()
    focal, inner = CAMERA.intrinsics[0], math.pi * (0.5 * (530.5 * 0.008 / 0.6) - 1.0) ** 2  # without its mixed rim
    assert focal == 530.5
    assert inner < palm.areas[1] < math.pi * (0.5 * focal * 0.008 / 0.59) ** 2


def test_a_ring_ends_where_its_length_does_and_a_gap_has_no_paint(model: HandModel) -> None:
    whole = Picture(model, RHOT6, back=True)
    ring = Picture(model, worn({"patch": "ring", "length_mm": 8.0, "radius_mm": None}), back=True)
    np.testing.assert_allclose(ring.found[FINGERS], ring.places[FINGERS], atol=1.5)  # seen from below: the near side
    assert (ring.areas < 0.8 * whole.areas)[FINGERS].all()
    taped = {"patch": "ring", "length_mm": 8.0, "radius_mm": None, "gap_deg": 90.0, "rest_rgb": GREY}
    for side, shows in (("dorsal", True), ("palmar", False)):
        picture = Picture(model, worn(taped | {"gap_side": side}), back=True)
        x, y = picture.places[1]
        middle = picture.image[:, round(y), round(x)]
        np.testing.assert_allclose(middle, GREY if shows else RHOT6.markers[1].display_rgb, atol=1.0)
        assert (picture.count(GREY) > 50) == shows
    skin = Picture(model, worn(taped | {"gap_side": "dorsal", "rest_rgb": None}), back=True)
    assert skin.count(GREY) == 0 and (skin.areas < ring.areas)[FINGERS].all()


def test_the_thumbs_side_of_a_gap_is_the_thumbs_side(model: HandModel) -> None:
    """The half of the band that is not the marker's lies on the thumb's side on both hands."""
    half = Picture(model, worn(wrist={"gap_deg": 180.0, "gap_side": "radial", "rest_rgb": GREY}), back=False)
    _, x = np.nonzero(np.abs(half.image - np.array(GREY, np.float32)[:, None, None]).max(axis=0) < 2.0)
    thumb, wrist = half.places[0], half.places[5]
    assert (x.mean() - wrist[0]) * (thumb[0] - wrist[0]) > 0.0 > (half.found[5, 0] - wrist[0]) * (thumb[0] - wrist[0])


def test_a_band_of_two_colours_keeps_its_marker_in_place(model: HandModel) -> None:
    two = Picture(model, worn(wrist={"length_mm": 11.0, "rest_mm": 11.0, "rest_rgb": GREY}), back=False)
    np.testing.assert_allclose(two.found[5], two.places[5], atol=0.8)
    y, _ = np.nonzero(np.abs(two.image - np.array(GREY, np.float32)[:, None, None]).max(axis=0) < 2.0)
    assert y.mean() == pytest.approx(two.places[5, 1] + 530.5 * 0.011 / 0.6, abs=3.0), "towards the elbow"


def test_worn_paint_is_missing_in_its_share_and_uneven_paint_varies(model: HandModel) -> None:
    whole = Picture(model, RHOT6, back=False)
    worn_off = Picture(model, RHOT6, back=False, look=Appearance(worn=0.4, seed=3))
    other = Picture(model, RHOT6, back=False, look=Appearance(worn=0.4, seed=4))
    assert 0.2 < worn_off.areas[5] / whole.areas[5] < 0.7 and worn_off.areas.min() > 0
    assert (worn_off.image != other.image).any(), "the seed says where"
    uneven = Picture(model, RHOT6, back=False, look=Appearance(uneven=0.2))
    red = RHOT6.markers[5].display_rgb[0]
    x, y = (int(v) for v in whole.places[5])
    band = uneven.image[0, y - 5:y + 6, x - 15:x + 16]
    assert 0.8 * red <= band.min() < 0.9 * red and 1.1 * red < band.max() <= 1.2 * red + 0.1


def test_a_glove_covers_the_hand_and_not_the_forearm(model: HandModel) -> None:
    skin = Picture(model, RHOT6, back=False)
    glove = Picture(model, RHOT6, back=False, look=Appearance(glove_rgb=(60, 84, 150)))
    np.testing.assert_array_equal(glove.areas, skin.areas)
    assert glove.count((60, 84, 150)) > 1000 and 100 < glove.count((201, 152, 128)) < skin.count((201, 152, 128)) - 1000


def test_fields_that_say_what_was_always_so_change_no_bit() -> None:
    told = worn({"patch": "segment", "gap_deg": 0.0})
    one, other = (Picture(RIGHT_MODEL, markers, back=False) for markers in (RHOT6, told))
    np.testing.assert_array_equal(one.image, other.image)
    assert not build_body(RIGHT_MODEL, RHOT6).solids.paint.any(), "no ray asks where the paint of a whole segment is"


def scene(**settings: Any) -> Scene:
    return make_scene(msgspec.structs.replace(twin_defaults(), markers="nails6", **settings), 2)


def test_the_truth_and_the_sketch_have_nails_where_the_hand_has_them() -> None:
    taken = make_shot(scene(facing="back"), "tap", 1.0)
    frames, truth = ideal_observations(taken, 0, ObservationNoise(white=0.0, common=0.0, own=0.0))
    true = true_object(taken.scene_object, 1.0, (truth, truth))
    camera = taken.scene.camera(0)
    plain = 0
    for number in (5, 15, 30):
        for marker in range(1, 5):
            seen = frames[number][marker]
            if seen.flags:  # another finger is before it
                continue
            plain += 1
            t_s = truth.times_s[number] + 1e-9 * taken.scene.row_time_ns * seen.y
            expected = camera.project(true.markers_at(np.array([t_s]))[0, marker][None])[0]
            assert (seen.x, seen.y) == pytest.approx(expected, abs=0.05)
    assert plain > 6
    away, _ = ideal_observations(make_shot(scene(facing="palm"), "still", 0.5), 0)
    assert all(frame[marker].flags & MarkerFlag.LOST for frame in away for marker in range(1, 5))


def test_the_other_side_of_the_hand_faces_the_cameras_where_it_stood() -> None:
    palm, back = (make_shot(scene(facing=side), "still", 0.5).scene_object.source.sample(np.zeros(1))[0][0]
                  for side in ("palm", "back"))
    np.testing.assert_allclose(palm[:3, 3], back[:3, 3])
    assert palm[2, 2] > 0.9 > -0.9 > back[2, 2], "the palm's z comes out of the back of the hand"
    assert palm[1, 0] < -0.9 and back[1, 0] < -0.9, "fingers up"
