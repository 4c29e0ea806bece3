"""The twin's bare hand: seeds, mirror images, sizes, skin, forearm, blur, wrong rigs, and what is kept on disk."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from shipped_rig import RIGHT_HAND as RIGHT

from rhot_app.errors import SimulatorError
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.model import build_model, neutral_pose
from rhot_app.hand.skeleton import FINGERS
from rhot_app.simulator.bare_hand.sequence import (
    BareHandOptions,
    BareHandSequence,
    bare_hand_rig,
    bare_hand_sequence,
    varied_hand,
)
from rhot_app.simulator.bare_hand.skin import TONES, skin_colours
from rhot_app.simulator.bare_hand.surface import (
    FOREARM,
    SLEEVE_GROUP,
    Surface,
    build_surface,
    rest_frames,
    surface_nets,
)
from rhot_app.simulator.film.pictures import take_pictures
from rhot_app.simulator.film.points import PointNoise, write_points
from rhot_app.simulator.film.shot import make_shot
from rhot_app.simulator.film.truth import load_truth
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.simulator.scene.scene_arguments import add_scene_arguments, add_show_argument, show_of
from rhot_app.simulator.scene.scene_description import BareHandShow

WIDTH = 160
NEAR = BareHandOptions(distance_m=0.4, tone=4.0, mesh_m=5e-3)


def coarse(anatomy: HandAnatomy = RIGHT, **options: object) -> Surface:
    return build_surface(anatomy, spacing_m=4e-3, **options)  # type: ignore[arg-type]


def filmed(options: BareHandOptions = NEAR, motion: str = "rest", seed: int = 3, side: str = "right",
           seconds: float = 0.1) -> BareHandSequence:
    return bare_hand_sequence(bare_hand_rig(side, width=WIDTH), motion, seconds, 30.0, seed, options)  # type: ignore[arg-type]


def first(sequence: BareHandSequence) -> np.ndarray:
    image = next(sequence.frames()).images[0]
    assert image is not None
    return image.astype(np.float64)


def hand_mask(sequence: BareHandSequence, levels: float = 40.0) -> np.ndarray:
    """Where the first picture is not as it is without a hand."""
    empty = first(bare_hand_sequence(sequence.rig, sequence.motion, 0.1, 30.0, sequence.seed,
                                     replace(sequence.options, enters_after_s=10.0)))
    return np.abs(first(sequence) - empty).max(axis=2) > levels


def test_a_ball_is_polygonised_where_it_is() -> None:
    axis = np.arange(-1.5, 1.5, 0.1)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    vertices, triangles = surface_nets((np.sqrt(x * x + y * y + z * z) - 1.0).astype(np.float32), (axis, axis, axis))
    assert np.linalg.norm(vertices, axis=1) == pytest.approx(1.0, abs=0.01)
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    volume = np.einsum("ti,ti->t", a, np.cross(b, c)).sum() / 6.0
    assert volume == pytest.approx(4.0 / 3.0 * np.pi, rel=0.03), "closed, and counter-clockwise from outside"


def test_the_surface_is_closed_encloses_the_joints_and_its_weights_sum_to_one() -> None:
    surface = coarse()
    edges = np.sort(np.concatenate([surface.triangles[:, [0, 1]], surface.triangles[:, [1, 2]],
                                    surface.triangles[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all()
    assert surface.weights.sum(axis=1) == pytest.approx(1.0) and surface.weights.min() >= 0.0
    sequence = filmed()
    truth = sequence.truth_at(0)
    world = sequence.hand.vertices(truth.world_from_palm[None], truth.angles[None])[0]
    off = np.linalg.norm(world[None] - truth.joints[:, None], axis=2).min(axis=1)
    tips = [4 * finger + 4 for finger in range(5)]
    assert off[tips].max() < 4e-3, "a tip lies on the skin"
    assert np.delete(off, tips).min() > 5e-3 and off.max() < 25e-3, "every other joint lies in flesh"


def test_the_same_seed_gives_the_same_pictures_and_another_one_others() -> None:
    rig = bare_hand_rig(width=WIDTH)
    frames = [list(bare_hand_sequence(rig, "wave", 0.1, 30.0, seed, NEAR).frames()) for seed in (3, 3, 4)]
    for once, again, other in zip(*frames, strict=True):
        assert len(once.images) == 2 and once.t_ns == again.t_ns
        for image, same, different in zip(once.images, again.images, other.images, strict=True):
            assert image is not None and image.dtype == np.uint8 and image.shape == (120, WIDTH, 3)
            assert np.array_equal(image, same) and not np.array_equal(image, different)


def test_a_left_hand_is_the_mirror_image_of_a_right_one() -> None:
    right, left = coarse(), coarse(msgspec.structs.replace(RIGHT, side="left"))
    angles = neutral_pose().angles[None]
    eye = np.eye(4)[None]
    arm = np.array([1.0, 0.0, 0.0])
    hands = [replace(filmed().hand, surface=surface, arm=arm) for surface in (right, left)]
    posed = [hand.vertices(eye, angles)[0] for hand in hands]
    assert posed[1] == pytest.approx(posed[0] * [1.0, -1.0, 1.0], abs=1e-9)
    assert np.array_equal(left.triangles, right.triangles[:, ::-1]), "its outside is outside"


def test_lengths_and_radii_change_as_told_and_the_skin_with_them() -> None:
    drawn = [varied_hand(RIGHT, 0.05, 0.08, seed) for seed in range(300)]
    bones = np.array([[np.divide(hand.fingers[f].bones_mm, RIGHT.fingers[f].bones_mm) for f in FINGERS]
                      for hand in drawn])
    radii = np.array([[hand.fingers[f].radii_mm[0] / RIGHT.fingers[f].radii_mm[0] for f in FINGERS] for hand in drawn])
    assert bones.std() == pytest.approx(0.05, rel=0.15) and bones.mean() == pytest.approx(1.0, abs=0.01)
    assert radii.std() == pytest.approx(0.08, rel=0.15)
    assert varied_hand(RIGHT, 0.0, 0.0, 5) == RIGHT
    thick = msgspec.structs.replace(RIGHT, fingers={
        name: msgspec.structs.replace(finger, radii_mm=tuple(1.08 * r for r in finger.radii_mm))
        for name, finger in RIGHT.fingers.items()})
    assert _girth(coarse(thick)) == pytest.approx(1.08 * _girth(coarse()), rel=0.02)


def _girth(surface: Surface) -> float:
    """Mean radius of the index finger half way between its PIP and DIP joints, m."""
    _, points = rest_frames(build_model(msgspec.structs.replace(surface.model.anatomy, side="right")))
    start, end = points[6], points[7]
    along = (surface.right - start) @ (end - start) / ((end - start) @ (end - start))
    middle = (np.abs(along - 0.5) < 0.1) & (surface.group == 1)
    across = surface.right[middle] - start - along[middle, None] * (end - start)
    return float(np.linalg.norm(across, axis=1).mean())


@pytest.mark.parametrize("tone", [2.0, 5.0, 9.0])
def test_there_is_skin_and_no_paint(tone: float) -> None:
    colours = skin_colours(coarse(), tone, None, 1)
    red, green, blue = colours.T
    assert (red >= 0.98 * green).all() and (green >= 0.9 * blue).all(), "every colour is one of skin or nail"
    assert np.median(red) == pytest.approx(TONES[round(tone) - 1][0], rel=0.25)
    sequence = filmed(replace(NEAR, tone=tone))
    image = first(sequence)[hand_mask(sequence, 40.0 if tone < 8.0 else 12.0)]
    assert np.mean(image[:, 0] - image[:, 2] > -10.0) > 0.97


def test_a_dark_hand_is_darker_than_a_light_one_and_its_palm_lighter_than_its_back() -> None:
    surface = coarse()
    light, dark = (skin_colours(surface, tone, None, 1) for tone in (2.0, 8.0))
    assert np.median(light) > 2.0 * np.median(dark)
    palmar = surface.right[:, 2] < -0.012
    dorsal = surface.right[:, 2] > 0.008
    assert np.median(dark[palmar]) > 1.1 * np.median(dark[dorsal])


def test_forearm_and_sleeve_are_there_when_asked_for() -> None:
    bare, sleeve, none = coarse(), coarse(sleeve_from_m=0.08), coarse(forearm=False)
    assert bare.vertices[:, 0].min() < -0.25 < none.vertices[:, 0].min() - 0.2
    assert (bare.weights[:, FOREARM] > 0.9).any() and not (none.weights[:, FOREARM] > 0.9).any()
    cloth = sleeve.group == SLEEVE_GROUP
    assert cloth.any() and not (bare.group == SLEEVE_GROUP).any()
    colours = skin_colours(sleeve, 4.0, (30.0, 60.0, 200.0), 1)
    assert (colours[cloth, 2] > colours[cloth, 0]).all() and sleeve.right[cloth, 0].max() < -0.04
    with_arm, without = (hand_mask(filmed(replace(NEAR, forearm=forearm))) for forearm in (True, False))
    assert with_arm[-1].any() and not without[-1].any(), "an arm leaves the picture"


def test_a_fast_hand_is_blurred_and_sheared_by_the_shutter() -> None:
    def sharpness(options: BareHandOptions) -> float:
        image = first(filmed(options, "fast", seed=2))
        return float(np.abs(np.diff(image[:, :, 0], axis=1)).max(axis=1).mean())

    still = replace(NEAR, exposure_ms=0.1)
    assert sharpness(replace(NEAR, exposure_ms=25.0)) < 0.8 * sharpness(still)
    rolling = filmed(replace(still, row_time_us=150.0), "fast", seed=2)
    at_once = filmed(still, "fast", seed=2)
    assert rolling.times_ns[0][0] == round(1e9 * 0.5 * 150e-6 * 120), "timed at the middle row"
    assert not np.array_equal(hand_mask(rolling), hand_mask(at_once))


def test_the_hand_in_the_picture_is_where_the_truth_says() -> None:
    for side in ("right", "left"):
        sequence = filmed(replace(NEAR, forearm=False), "spread", side=side)
        frame = next(sequence.frames())
        assert frame.truth.in_view
        mask = hand_mask(sequence)
        node = sequence.rig.nodes[0]
        x, y = np.round(CameraModel.from_rig(node.intrinsics, node.pose).project(frame.truth.joints)).astype(int).T
        inside = mask[y, x]
        assert inside[[k for k in range(21) if k not in (4, 8, 12, 16, 20)]].mean() > 0.9, side
        rows, columns = np.nonzero(mask)
        assert abs(rows.min() - y.min()) <= 3
        assert abs(columns.min() - x.min()) <= 5 and abs(columns.max() - x.max()) <= 5


def test_the_hand_enters_after_the_background_alone() -> None:
    sequence = filmed(replace(NEAR, enters_after_s=0.2), seconds=0.6)
    frames = list(sequence.frames())
    assert not frames[0].truth.in_view and frames[-1].truth.in_view
    early = [np.abs(frames[k].images[0].astype(float) - frames[0].images[0]).mean() for k in (3, 5)]  # type: ignore[union-attr]
    late = np.abs(frames[-1].images[0].astype(float) - frames[0].images[0]).mean()  # type: ignore[union-attr]
    assert max(early) < 0.5 * late, "noise alone"


def test_exposure_steps_change_the_whole_picture_and_lost_cameras_deliver_none() -> None:
    sequence = filmed(replace(NEAR, exposure_steps=True, background="clutter", lost=((1, 0.0, 0.05),)), seconds=0.8)
    frames = list(sequence.frames())
    assert [frame.images[1] is None for frame in frames[:4]] == [True, True, False, False]
    corner = [float(np.mean(frame.images[0][:20, :20])) for frame in frames]  # type: ignore[index]
    assert np.ptp(corner) > 0.05 * np.mean(corner)


def test_a_wrong_rig_is_wrong_by_as_much_as_told() -> None:
    sequence = filmed(replace(NEAR, calibration_deg=0.2, calibration_mm=1.0))
    true, told = ([CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
                  for rig in (sequence.rig, sequence.tracker_rig))
    assert np.array_equal(true[0].world_from_camera, told[0].world_from_camera)
    turn = true[1].world_from_camera[:3, :3].T @ told[1].world_from_camera[:3, :3]
    assert np.degrees(np.arccos(0.5 * (np.trace(turn) - 1.0))) == pytest.approx(0.2, rel=1e-3)
    assert np.linalg.norm(true[1].centre - told[1].centre) == pytest.approx(1e-3, rel=1e-6)


def test_the_rig_that_a_tracker_gets_holds_nothing_of_the_truth() -> None:
    sequence = filmed(replace(NEAR, length_sd=0.05, radius_sd=0.08))
    assert sequence.tracker_rig.hand == sequence.rig.hand == bare_hand_rig(width=WIDTH).hand
    assert build_model(sequence.rig.hand).bones != pytest.approx(sequence.model.bones, rel=1e-3)


def test_what_is_kept_on_disk_gives_the_same_pictures(tmp_path: Path) -> None:
    options = replace(NEAR, exposure_steps=True, enters_after_s=0.0)
    rig = bare_hand_rig(width=WIDTH)
    never, once, again = (bare_hand_sequence(rig, "rest", 0.2, 30.0, 1, options, folder)
                          for folder in (None, tmp_path, tmp_path))
    pictures = [[image for frame in sequence.frames() for image in frame.images] for sequence in (never, once, again)]
    assert len(list(tmp_path.iterdir())) == 2
    assert "hand" not in vars(again), "no surface was made"
    for plain, first_time, second_time in zip(*pictures, strict=True):
        assert np.array_equal(plain, first_time) and np.array_equal(plain, second_time)
    lamp = bare_hand_sequence(rig, "rest", 0.2, 30.0, 2, options, tmp_path)
    list(lamp.frames())
    assert len(list(tmp_path.iterdir())) == 4, "another seed is another file"


def test_a_bare_hand_can_be_shown_and_is_filmed_with_its_truth(tmp_path: Path) -> None:
    settings = msgspec.structs.replace(twin_defaults(), distance_m=0.4)
    shot = make_shot(make_scene(settings, 1), BareHandShow("rest", tone=3.0, sleeve=True), 0.2)
    take_pictures(shot, tmp_path / "bare", 1)
    truth = load_truth(tmp_path / "bare" / "truth.npz")
    assert truth.joints.shape[1:] == (21, 3) and np.isnan(truth.markers).all()
    image = cv2.imread(str(tmp_path / "bare" / "left" / "000.png"))
    assert image is not None
    joints = shot.scene.camera(0).project(truth.joints_at(np.array([0.1]))[0])
    x, y = np.round(joints[9:11].mean(axis=0)).astype(int)
    blue, _, red = image[y, x]
    assert red > blue + 25, "skin where the hand is, before charcoal cloth"
    with pytest.raises(SimulatorError, match="no markers"):
        write_points(shot, tmp_path / "points", PointNoise(0.1))


def test_the_command_line_asks_for_a_bare_hand() -> None:
    parser = argparse.ArgumentParser()
    add_scene_arguments(parser)
    add_show_argument(parser)
    bare = ["--show", "bare-hand"]
    assert show_of(parser.parse_args([*bare, "--set", "show.tone=7", "--motion", "wave"])) == BareHandShow(
        "wave", tone=7.0)
    for arguments, says in (([*bare, "--set", "show.tone=70"], r"show.tone=70: expected a number <= 10"),
                            ([*bare, "--set", "show.cube=true"], 'no field "cube"'),
                            (["--set", "show.sleeve=true"], 'no field "sleeve"'),
                            (["--set", "show.cube=true", "--show", "board"], 'no field "cube"'),
                            ([*bare, "--set", "show.sleeve"], "write NAME=VALUE"),
                            (["--show", "empty", "--motion", "wave"], "--motion is of a hand")):
        with pytest.raises(SimulatorError, match=says):
            show_of(parser.parse_args(arguments))
