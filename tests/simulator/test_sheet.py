"""Printed sheets: fields as the board says, and corners found in rendered pictures where geometry puts them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulator_solids import CAMERA, NEUTRAL, OPTICS, STEADY, STILL, Gliding

from rhot_app.calibration.board.boards import Board, CharucoBoard, Chessboard
from rhot_app.calibration.board.corners import detect
from rhot_app.simulator.render.exposure_samples import Shutter
from rhot_app.simulator.render.painter import PoseSource
from rhot_app.simulator.render.render import Exposure, FrameRenderer
from rhot_app.simulator.render.sheet import BLACK, WHITE, board_sheet, ruler_ends, ruler_sheet
from rhot_app.simulator.render.sheet_painter import SheetPainter

CHESSBOARD, CHARUCO = Chessboard(9, 6, 0.03), CharucoBoard(8, 6, 0.035, 0.026)
LEGACY = CharucoBoard(8, 6, 0.035, 0.026, legacy=True)
Vector = tuple[float, float, float]
DARK = np.full((3, CAMERA.height, CAMERA.width), 40.0, np.float32)


class Held:
    """A sheet at one pose."""

    def __init__(self, pose: np.ndarray) -> None:
        self._pose = pose

    def sample(self, times_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.tile(self._pose, (len(times_s), 1, 1)), np.zeros((len(times_s), 0))


def pose_of(rotation_vector: Vector, middle: Vector, board: Board) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(rotation_vector).as_matrix()
    pose[:3, 3] = np.array(middle) - pose[:3, :3] @ board_sheet(board).middle
    return pose


def camera_on(board: Board, shutter: Shutter = STILL) -> FrameRenderer:
    painter = SheetPainter(board_sheet(board), CAMERA, 0.25, 3)
    return FrameRenderer(painter, DARK, OPTICS, Exposure(shutter, shutter.exposure_s, STEADY, NEUTRAL), 3)


def luma(camera: FrameRenderer, source: PoseSource, number: int = 0) -> np.ndarray:
    frame = camera.render(source, 0.0, number)[0]
    return frame[:CAMERA.width * CAMERA.height].reshape(CAMERA.height, CAMERA.width)


@pytest.mark.parametrize("board", [CHESSBOARD, CHARUCO, LEGACY], ids=["chessboard", "charuco", "legacy"])
def test_found_corners_are_where_geometry_puts_them(board: Board) -> None:
    rng, camera, errors = np.random.default_rng(4), camera_on(board), []
    for number in range(14):
        pose = pose_of(rng.uniform((-0.55, -0.55, -0.3), (0.55, 0.55, 0.3)),
                       rng.uniform((-0.07, -0.06, 0.5), (0.07, 0.06, 0.85)), board)
        view = detect(luma(camera, Held(pose), number), board)
        assert view is not None
        points = view.object_points(board) @ pose[:3, :3].T + pose[:3, 3]
        errors.append(view.pixels - CAMERA.project(points))
    every = np.concatenate(errors)
    assert len(every) > 14 * 30
    assert np.sqrt(np.mean(every**2, axis=0)).max() < 0.05
    assert np.abs(every.mean(axis=0)).max() < 0.02


def test_a_moving_board_is_where_it_was_at_its_rows_times() -> None:
    velocity, start = np.array([0.25, -0.2, 0.0]), pose_of((0.0, 0.0, 0.0), (0.0, 0.0, 0.55), CHESSBOARD)[:3, 3]
    view = detect(luma(camera_on(CHESSBOARD), Gliding(start, velocity)), CHESSBOARD)
    assert view is not None
    times = view.pixels[:, 1] * STILL.row_time_s
    expected = CAMERA.project(view.object_points(CHESSBOARD) + start + times[:, None] * velocity)
    errors = view.pixels - expected
    assert np.abs(errors.mean(axis=0)).max() < 0.03 and np.abs(errors).max() < 0.25


@pytest.mark.parametrize("board", [CHARUCO, LEGACY], ids=["new", "legacy"])
def test_charuco_fields_are_those_that_opencv_draws(board: CharucoBoard) -> None:
    sheet, per_square = board_sheet(board), 140
    picture = board.opencv().generateImage((8 * per_square, 6 * per_square))
    columns, rows = (((lines[1:-2] + lines[2:-1]) / 2.0 + board.square_m) / board.square_m * per_square
                     for lines in (sheet.x_lines, sheet.y_lines))
    drawn = picture[np.ix_(rows.astype(int), columns.astype(int))] > 128
    np.testing.assert_array_equal(drawn, sheet.levels[1:-1, 1:-1] > 128)


def test_chessboard_begins_black_beside_its_first_corner_on_white_paper() -> None:
    sheet = board_sheet(CHESSBOARD)
    assert sheet.levels[1, 1] == BLACK and sheet.levels[1, 2] == WHITE and sheet.levels[2, 2] == BLACK
    assert (sheet.levels[0] == WHITE).all() and sheet.levels.shape == (9, 12)
    assert sheet.x_lines[2] == pytest.approx(0.0) and sheet.x_lines[-2] == pytest.approx(9 * 0.03)


def test_ruler_crosses_are_as_far_apart_as_said() -> None:
    painter = SheetPainter(ruler_sheet(0.2), CAMERA, 0.0, 1)
    camera = FrameRenderer(painter, DARK, OPTICS, Exposure(STILL, STILL.exposure_s, STEADY, NEUTRAL), 1)
    pose = np.eye(4)
    pose[:3, 3] = (-0.1, 0.02, 0.5)
    picture = luma(camera, Held(pose)).astype(np.float32)
    ends = CAMERA.project(ruler_ends(0.2) + pose[:3, 3])
    found = []
    for x, y in ends:
        ys, xs = np.mgrid[round(y) - 4:round(y) + 5, round(x) - 4:round(x) + 5]
        weight = np.clip(226.0 - picture[ys, xs], 0.0, None)
        found.append(((weight * xs).sum() / weight.sum(), (weight * ys).sum() / weight.sum()))
    np.testing.assert_allclose(found, ends, atol=0.3)


def test_a_sheet_from_behind_or_beside_the_picture_is_not_seen() -> None:
    camera = camera_on(CHESSBOARD)
    away = pose_of((0.0, np.pi, 0.0), (0.0, 0.0, 0.5), CHESSBOARD)
    beside = pose_of((0.0, 0.0, 0.0), (1.5, 0.0, 0.5), CHESSBOARD)
    behind = pose_of((0.0, 0.0, 0.0), (0.0, 0.0, -0.5), CHESSBOARD)
    for pose in (away, beside, behind):
        assert cv2.mean(luma(camera, Held(pose)))[0] == pytest.approx(40.0, abs=0.5)


def test_motion_blurs_lines_by_speed_times_exposure() -> None:
    widths = []
    for velocity in (0.0, 1.2):
        start = pose_of((0.0, 0.0, 0.0), (0.0, 0.0, 0.5), CHESSBOARD)[:3, 3]
        row = luma(camera_on(CHESSBOARD), Gliding(start, np.array([velocity, 0.0, 0.0])))[250].astype(float)
        widths.append(int(((row > 70.0) & (row < 160.0)).sum()))
    assert widths[1] > 2 * widths[0] > 0
