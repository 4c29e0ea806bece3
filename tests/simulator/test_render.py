"""The renderer against geometry done another way, and what the evaluation takes from it: visible fractions."""

from __future__ import annotations

import numpy as np
import pytest
from shipped_markers import RHOT6
from shipped_rig import RIGHT_MODEL as MODEL
from simulator_solids import CAMERA, STILL, Gliding, Shown, ball_image, balls, brightness_centroid, renderer

from rhot_app.errors import RigError
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import neutral_pose
from rhot_app.hand.shape import segments
from rhot_app.hand.skeleton import HandPose
from rhot_app.simulator.render.body import CAPSULE, SKIN, build_body
from rhot_app.simulator.render.exposure_samples import Shutter
from rhot_app.simulator.render.rays import ray_table
from rhot_app.simulator.scene.background import background_image

SHADING = 0.25


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.6), (0.21, -0.13, 0.61), (-0.1304, 0.1517, 0.6), (0.0501, 0.1, 1.0)])
def test_still_ball_has_its_analytic_centroid_and_area(place: tuple[float, float, float]) -> None:
    image, _, _ = renderer(balls([0.0085], [(0.0, 0.0, 0.0)], [True])).radiance(Gliding(place), 0.0, 3)
    centroid, area = brightness_centroid(image)
    expected, expected_area = ball_image(np.array(place), 0.0085)
    assert np.abs(centroid - expected).max() < 0.015
    assert area == pytest.approx(expected_area, rel=0.01)


def test_sub_pixel_phases_leave_no_bias() -> None:
    drawing = renderer(balls([0.0085], [(0.0, 0.0, 0.0)], [True]))
    errors = []
    for number in range(40):
        place = np.array([0.02 + 0.0011 * number / 40, 0.03 + 0.0013 * number / 40, 0.6])
        image, box, _ = drawing.radiance(Gliding(place), 0.0, number)
        errors.append(brightness_centroid(image)[0] - ball_image(place, 0.0085)[0])
        image[:, box[1]:box[3], box[0]:box[2]] = 0.0
    assert np.abs(np.mean(errors, axis=0)).max() < 0.003
    assert np.std(errors, axis=0).max() < 0.01


@pytest.mark.parametrize("velocity", [(1.5, 0.0, 0.0), (0.0, -1.5, 0.0), (1.0, 1.0, 0.5)])
def test_moving_ball_is_where_it_was_at_its_own_rows_time(velocity: tuple[float, float, float]) -> None:
    start, drawing, errors = np.array([-0.02, 0.01, 0.6]), renderer(balls([0.0085], [(0.0, 0.0, 0.0)], [True])), []
    for number in range(12):
        t_row0 = 0.001 * number
        image, box, _ = drawing.radiance(Gliding(start, velocity), t_row0, number)
        centroid, _ = brightness_centroid(image)
        t_seen = t_row0 + centroid[1] * STILL.row_time_s
        errors.append(centroid - ball_image(start + t_seen * np.array(velocity), 0.0085)[0])
        image[:, box[1]:box[3], box[0]:box[2]] = 0.0
    assert np.abs(np.mean(errors, axis=0)).max() < 0.02
    assert np.std(errors, axis=0).max() < 0.03


def test_exposure_smears_by_speed_times_time() -> None:
    body = balls([0.0085], [(0.0, 0.0, 0.0)], [True])
    widths = []
    for exposure_s in (1e-6, 0.008):
        glide = Gliding((0.0, 0.0, 0.6), (1.5, 0.0, 0.0))
        image, _, _ = renderer(body, Shutter(exposure_s, 0.0)).radiance(glide, 0.0, 1)
        weight, x = image[0].sum(axis=0).astype(np.float64), np.arange(640)
        mean = (weight * x).sum() / weight.sum()
        widths.append((weight * (x - mean) ** 2).sum() / weight.sum())
    smear_px = 1.5 * 0.008 / 0.6 * CAMERA.intrinsics[0]
    assert widths[1] - widths[0] == pytest.approx(smear_px**2 / 12.0, rel=0.03)


def test_visible_fraction_counts_what_others_hide_and_what_the_border_cuts() -> None:
    row = ray_table(CAMERA)[241]
    at_border = np.append(0.5 * (row[0] + row[1]), 1.0)
    _, _, cut = renderer(balls([0.02], [(0.0, 0.0, 0.0)], [True])).radiance(Gliding(0.6 * at_border), 0.0, 0)
    assert cut[0] == pytest.approx(0.5, abs=0.02)

    hidden = balls([0.01, 0.2], [(0.0, 0.0, 0.0), (0.2, 0.0, -0.2)], [True, False])
    _, _, half = renderer(hidden).radiance(Gliding((0.0, 0.0, 0.8)), 0.0, 0)
    assert 0.3 < half[0] < 0.7

    _, _, gone = renderer(balls([0.01], [(0.0, 0.0, 0.0)], [True])).radiance(Gliding((0.0, 0.0, -0.6)), 0.0, 0)
    assert gone[0] == 0.0


def test_open_hand_shows_every_marker_whole_in_its_colour() -> None:
    body = build_body(MODEL, RHOT6)
    background = background_image("cloth", CAMERA, 0.6, 1)
    camera = renderer(body, background=background, shading=SHADING)
    hand = Shown((0.0375, 0.085, 0.6))
    image, box, visible = camera.radiance(hand, 0.0, 0)
    assert visible.min() > 0.98
    centres = CAMERA.project(body.marker_positions(*hand.sample(np.zeros(1)))[0])
    for marker, (x, y) in zip(RHOT6.markers, centres, strict=True):
        seen = image[:, round(y), round(x)]
        colour = np.array(marker.display_rgb, dtype=np.float64)
        shade = seen @ colour / (colour @ colour)
        assert 0.7 < shade <= 1.01, marker.id
        np.testing.assert_allclose(seen, shade * colour, atol=1.0)
    np.testing.assert_array_equal(image[:, :, :box[0]], background[:, :, :box[0]])


def test_solids_ride_on_their_bones_as_the_hands_shape_says() -> None:
    rng = np.random.default_rng(5)
    angles = rng.uniform(MODEL.limits[:, 0], MODEL.limits[:, 1])
    pose = HandPose(Shown((0.1, 0.2, 0.5)).sample(np.zeros(1))[0][0], angles)
    body = build_body(MODEL, RHOT6)
    placed = body.place(pose.world_from_palm[None], pose.angles[None])[0]
    shape = segments(MODEL, pose, forward(MODEL, pose))
    skin = np.flatnonzero((body.solids.marker == SKIN) & (body.solids.kind == CAPSULE))
    named = [k for k, name in enumerate(shape.names) if not name.startswith(("forearm", "wrist"))]
    np.testing.assert_allclose(placed[skin, :3], shape.start[named], atol=1e-12)
    np.testing.assert_allclose(placed[skin, 3:6], shape.end[named], atol=1e-12)
    np.testing.assert_allclose(body.solids.size[skin, 0], shape.radius[named])


def test_a_finger_before_another_hides_its_marker() -> None:
    angles = neutral_pose().angles.copy()
    angles[[6, 7, 8]] = np.radians([75.0, 85.0, 60.0])  # index curled: its tip lies before the palm
    body = build_body(MODEL, RHOT6)
    background = np.zeros((3, 480, 640), np.float32)
    camera = renderer(body, background=background, shading=SHADING)
    from_palm, from_back = (camera.radiance(Shown(back=back, angles=angles), 0.0, 0)[2].copy()
                            for back in (False, True))
    index = RHOT6.ids.index("index")
    assert from_palm[index] > 0.6
    assert from_back[index] < 0.05


def test_hidden_markers_are_bare_skin() -> None:
    body = build_body(MODEL, RHOT6, frozenset({"thumb"}))
    assert 0 not in body.solids.marker and body.marker_count == 6
    camera = renderer(body, shading=SHADING)
    _, visible = camera.render(Shown(), 0.0, 0)
    assert visible[0] == 0.0 and visible[1:].min() > 0.9
    with pytest.raises(RigError, match="toe"):
        build_body(MODEL, RHOT6, frozenset({"toe"}))


def test_frames_repeat_by_seed_and_differ_by_number() -> None:
    body, background = build_body(MODEL, RHOT6), background_image("clutter", CAMERA, 0.6, 1)
    hand = Shown()
    first, again = (renderer(body, seed=4, background=background) for _ in range(2))
    one = first.render(hand, 0.0, 0)[0].copy()
    np.testing.assert_array_equal(one, again.render(hand, 0.0, 0)[0])
    assert (one != first.render(hand, 0.0, 1)[0]).mean() > 0.5
