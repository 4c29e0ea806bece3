"""Pictures for the calibration commands: both cameras, at the pauses, with truth and samples that lie on paint."""

from __future__ import annotations

from pathlib import Path

import cv2
import msgspec
import numpy as np

from rhot_app.calibration.board.boards import STANDARD_BOARD
from rhot_app.calibration.board.corners import detect
from rhot_app.simulator.film.pictures import PicturesFile, picture_times, take_pictures
from rhot_app.simulator.film.shot import make_shot, read_shot
from rhot_app.simulator.film.truth import load_thing_truth, load_truth
from rhot_app.simulator.scene.background import background_image
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.simulator.scene.scene_description import BoardShow, EmptyShow, RulerShow


def test_board_pictures_show_the_board_at_its_true_place(tmp_path: Path) -> None:
    shot = make_shot(make_scene(twin_defaults(), 3), BoardShow(), 1.0)
    take_pictures(shot, tmp_path / "take", 2)
    truth, times = load_thing_truth(tmp_path / "take" / "truth.npz"), picture_times(shot, 2)
    board = STANDARD_BOARD
    for index, name in enumerate(("left", "right")):
        for number, t_s in enumerate(times):
            picture = cv2.imread(str(tmp_path / "take" / name / f"{number:03d}.png"))
            view = detect(picture, board)
            assert view is not None
            pose = truth.world_from_thing[round(1e3 * t_s)]
            points = view.object_points(board) @ pose[:3, :3].T + pose[:3, 3]
            assert np.abs(view.pixels - shot.scene.camera(index).project(points)).max() < 0.2
    assert read_shot(tmp_path / "take")[0].show == BoardShow()


def test_samples_lie_on_the_markers_paint(tmp_path: Path) -> None:
    shot = make_shot(make_scene(twin_defaults(), 3), "spread", 2.0)
    take_pictures(shot, tmp_path / "take", 1)
    file = msgspec.json.decode((tmp_path / "take" / "pictures.json").read_bytes(), type=PicturesFile)
    picture = file.cameras["left"][0]
    assert set(picture.samples) == set(shot.scene.markers.ids)
    image = cv2.imread(str(tmp_path / "take" / picture.file)).astype(float)
    for marker in shot.scene.markers.markers:
        x, y, width, height = picture.samples[marker.id]
        colour = image[y:y + height, x:x + width].reshape(-1, 3).mean(axis=0)[::-1]
        paint = np.array(marker.display_rgb)
        assert np.dot(colour, paint) / (np.linalg.norm(colour) * np.linalg.norm(paint)) > 0.985, marker.id
    assert load_truth(tmp_path / "take" / "truth.npz").cameras[0].visible.shape == (1, 6)


def test_an_empty_scene_shows_the_background_alone(tmp_path: Path) -> None:
    scene = make_scene(twin_defaults(), 3)
    take_pictures(make_shot(scene, EmptyShow(), 1.0), tmp_path / "take", 1)
    for index, name in enumerate(("left", "right")):
        image = cv2.imread(str(tmp_path / "take" / name / "000.png")).astype(float)
        wall = background_image(scene.settings.background, scene.camera(index), scene.settings.distance_m, scene.seed)
        assert np.abs(image[:, :, ::-1] - wall.transpose(1, 2, 0)).mean() < 6.0, "the sensor's noise is the difference"


def test_the_rulers_crosses_are_told_where_they_are_drawn(tmp_path: Path) -> None:
    shot = make_shot(make_scene(twin_defaults(), 3), RulerShow(180.0), 1.0)
    take_pictures(shot, tmp_path / "take", 1)
    file = msgspec.json.decode((tmp_path / "take" / "pictures.json").read_bytes(), type=PicturesFile)
    for name, pictures in file.cameras.items():
        image = cv2.imread(str(tmp_path / "take" / name / "000.png"), cv2.IMREAD_GRAYSCALE)
        assert pictures[0].ruler is not None
        for x, y in np.reshape(pictures[0].ruler, (2, 2)):
            around = image[round(y) - 12:round(y) + 13, round(x) - 12:round(x) + 13]
            assert image[round(y), round(x)] < 90 < 150 < np.percentile(around, 70)
