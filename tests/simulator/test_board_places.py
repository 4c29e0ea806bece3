"""How the board is moved: still while it pauses, smooth between, over all of the pictures, and by the seed."""

from __future__ import annotations

import numpy as np
import pytest

from rhot_app.errors import CalibrationError, SimulatorError
from rhot_app.simulator.film.scene_objects import make_object
from rhot_app.simulator.scene.rigid_target import MOVE_S, STILL_S, BoardPoses
from rhot_app.simulator.scene.scene import Scene, make_scene, twin_defaults
from rhot_app.simulator.scene.scene_description import BoardShow, HandShow, MarkerShow, RulerShow

SHOW = BoardShow()


@pytest.fixture(scope="module")
def scene() -> Scene:
    return make_scene(twin_defaults(), 1)


def corners_px(scene: Scene, pose: np.ndarray, camera: int) -> np.ndarray:
    points = SHOW.board().object_points() @ pose[:3, :3].T + pose[:3, 3]
    return scene.camera(camera).project(points)


def test_places_cover_both_pictures_near_and_far_and_lean_every_way(scene: Scene) -> None:
    scene_object = make_object(SHOW, scene)
    assert isinstance(scene_object.source, BoardPoses)
    poses = scene_object.source.poses
    whole = np.zeros((len(poses), 2), dtype=bool)
    for camera in (0, 1):
        hits = np.zeros((6, 8))
        for k, pose in enumerate(poses):
            pixels = corners_px(scene, pose, camera)
            whole[k, camera] = ((pixels > 0) & (pixels < (639, 479))).all()
            if whole[k, camera]:
                hits += np.histogram2d(pixels[:, 1], pixels[:, 0], (6, 8), ((0, 480), (0, 640)))[0]
        assert (hits > 0).mean() > 0.85, f"camera {camera} sees corners in too few of its fields"
    assert whole.any(axis=1).all() and whole.all(axis=1).sum() >= 16
    depths = poses[:, 2, 3]
    assert depths.max() / depths.min() > 1.7
    normals = poses[:, :3, 2]
    assert np.degrees(np.arccos(normals[:, 2])).max() > 30.0
    for quadrant in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        assert (np.sign(normals[:, :2]) == quadrant).all(axis=1).any()


def test_pauses_are_still_and_moves_are_smooth(scene: Scene) -> None:
    source = make_object(SHOW, scene).source
    assert isinstance(source, BoardPoses)
    pause = source.sample(np.linspace(0.02, STILL_S - 0.02, 60))[0]
    pixels = np.array([corners_px(scene, pose, 0) for pose in pause])
    assert np.ptp(pixels, axis=0).max() < 0.5
    times = np.arange(0.0, 2 * (STILL_S + MOVE_S), 1e-3)
    speeds = np.diff(source.sample(times)[0][:, :3, 3], axis=0) / 1e-3
    assert np.linalg.norm(speeds, axis=1).max() > 0.05
    assert np.linalg.norm(np.diff(speeds, axis=0), axis=1).max() / 1e-3 < 60.0


def test_seed_decides_the_places(scene: Scene) -> None:
    one, again, other = (make_object(SHOW, s).source.sample(np.array([0.5]))[0]
                         for s in (scene, scene, make_scene(twin_defaults(), 2)))
    np.testing.assert_array_equal(one, again)
    assert np.abs(one - other).max() > 1e-3


def test_table_board_lies_still_and_whole_before_both_cameras(scene: Scene) -> None:
    source = make_object(BoardShow(on_table=True), scene).source
    poses = source.sample(np.array([0.0, 3.0]))[0]
    np.testing.assert_array_equal(poses[0], poses[1])
    for camera in (0, 1):
        pixels = corners_px(scene, poses[0], camera)
        assert ((pixels > 5) & (pixels < (634, 474))).all()
    assert np.degrees(np.arccos(poses[0, 2, 2])) == pytest.approx(45.0)


@pytest.mark.parametrize("distance", [0.2, 0.6, 1.5])
def test_single_marker_is_at_its_distance_in_both_pictures(scene: Scene, distance: float) -> None:
    scene_object = make_object(MarkerShow(marker="ring", distance_m=distance), scene)
    positions = scene_object.thing.marker_positions(*scene_object.source.sample(np.linspace(0.0, 5.0, 50)))  # type: ignore[union-attr]
    ring = positions[:, scene.markers.ids.index("ring")]
    np.testing.assert_allclose(ring[:, 2], distance, atol=0.6e-3)
    assert np.isnan(np.delete(positions, 3, axis=1)).all()
    for camera in (0, 1):
        pixels = scene.camera(camera).project(ring)
        assert ((pixels > 30) & (pixels < (609, 449))).all()


@pytest.mark.parametrize("preset", ["wide", "fast"])
def test_moving_marker_is_fast_and_stays_in_both_pictures(preset: str) -> None:
    settings = twin_defaults()
    scene = make_scene(type(settings)(**{name: getattr(settings, name) for name in settings.__struct_fields__}
                                      | {"preset": preset}), 1)
    scene_object = make_object(MarkerShow(moving=True), scene)
    times = np.linspace(0.0, 30.0, 6001)
    path = scene_object.source.sample(times)[0][:, :3, 3]
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1) / np.diff(times)
    assert speed.max() > (1.5 if preset == "wide" else 0.5)
    for camera in (0, 1):
        pixels = scene.camera(camera).project(path)
        assert ((pixels > 10) & (pixels < (629, 469))).all()


def test_what_cannot_be_shown_is_refused_with_a_sentence(scene: Scene) -> None:
    with pytest.raises(SimulatorError, match="toe"):
        make_object(MarkerShow(marker="toe"), scene)
    with pytest.raises(CalibrationError, match="9 by"):
        make_object(BoardShow(size="9 by"), scene)
    with pytest.raises(SimulatorError, match="juggle"):
        make_object(HandShow("juggle"), scene)
    assert make_object(RulerShow(150.0), scene).name == "ruler of 150 mm"
