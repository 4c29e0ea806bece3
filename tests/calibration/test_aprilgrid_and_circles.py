"""AprilGrids and grids of circles in pictures: where they are, in which order, and that another board is refused."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from board_rendering import LENS, Photo, april_grid, corners_px, pose, take
from numpy.typing import NDArray
from stereo_twin import LENSES, RIGHT_FROM_LEFT, stereo_twin

from rhot_app.__main__ import main
from rhot_app.calibration.board.aprilgrid import measured_spacing
from rhot_app.calibration.board.boards import AprilGrid, Board, CircleGrid
from rhot_app.calibration.board.corners import detect
from rhot_app.calibration.board.size_check import why_missing
from rhot_app.calibration.stereo.diagnosis import mirrored_view

GRID, CIRCLES = AprilGrid(6, 4, 0.036, 0.3), CircleGrid(4, 11, 0.02)
PHOTO = Photo(blur_px=0.8, noise=3.0, oversampling=3)
PICTURES = Path(__file__).parent / "aprilgrid"

Gray = NDArray[np.uint8]


def photo(board: Board, turn: tuple[float, float, float] = (0.3, -0.35, 0.15),
          place: tuple[float, float, float] = (0.0, 0.0, 0.5)) -> tuple[Gray, NDArray[np.float64]]:
    """A picture, and (N, 2) px where the board's corners truly are."""
    camera_from_board = pose(turn, place, board)
    return take(board, camera_from_board, PHOTO), corners_px(board, camera_from_board, LENS)


@pytest.mark.parametrize("board", [GRID, CIRCLES], ids=lambda board: board.text)
@pytest.mark.parametrize("roll", [0.0, 1.4, 3.0, -1.7])
def test_corners_are_found_in_their_order_however_the_board_is_held(board: Board, roll: float) -> None:
    image, truth = photo(board, (0.35, -0.3, roll))
    view = detect(image, board)
    assert view is not None and len(view.ids) == board.count
    off = np.linalg.norm(view.pixels - truth[view.ids], axis=1)
    assert np.sqrt(np.mean(off**2)) < 0.06 and off.max() < 0.25
    assert view.blur_px == pytest.approx(0.85, abs=0.3)


def test_circles_are_where_their_middles_are_not_where_their_pictures_have_theirs() -> None:
    """Perspective moves the middle of a tilted circle's picture by a tenth of a pixel."""
    image, truth = photo(CIRCLES, (0.7, -0.5, 0.1))
    view = detect(image, CIRCLES)
    found, centroids = cv2.findCirclesGrid(image, (4, 11), flags=cv2.CALIB_CB_ASYMMETRIC_GRID)
    assert view is not None and found
    bias, usual = (np.abs((pixels - truth).mean(axis=0)).max() for pixels in (view.pixels, centroids[:, 0]))
    assert usual > 0.05 and bias < 0.01


def test_circles_light_on_dark_are_found_too() -> None:
    image, truth = photo(CIRCLES)
    view = detect(cv2.bitwise_not(image), CIRCLES)
    assert view is not None and np.abs(view.pixels - truth[view.ids]).max() < 0.2


def test_part_of_an_april_grid_suffices() -> None:
    image, truth = photo(GRID, place=(0.19, 0.1, 0.45))
    view = detect(image, GRID)
    assert view is not None and 16 <= len(view.ids) < GRID.count
    assert np.abs(view.pixels - truth[view.ids]).max() < 0.3


@pytest.mark.parametrize(("shown", "said", "words"), [
    (GRID, AprilGrid(4, 6, 0.036, 0.3), "not as on an AprilGrid of 4x6"),
    (GRID, AprilGrid(6, 3, 0.036, 0.3), "not as on an AprilGrid of 6x3"),
    (GRID, AprilGrid(6, 4, 0.036, 0.25), "0.30 of their side apart, not 0.25"),
    (GRID, CIRCLES, "no asymmetric grid"),
    (CIRCLES, CircleGrid(11, 4, 0.02), "grid of 4x11 circles, not of 11x4"),
    (CIRCLES, CircleGrid(5, 11, 0.02), "no asymmetric grid of 5x11"),
    (CIRCLES, CircleGrid(4, 9, 0.02), "no asymmetric grid of 4x9"),
    (CIRCLES, GRID, "no tags"),
], ids=lambda one: one.size_text if not isinstance(one, str) else "")
def test_another_board_is_refused_and_said_why(shown: Board, said: Board, words: str) -> None:
    image, _ = photo(shown)
    assert detect(image, said) is None
    assert words in why_missing(image, said)


def test_a_mirrored_view_of_circles_is_counted_as_the_board_says() -> None:
    image, _ = photo(CIRCLES)
    plain, flipped = detect(image, CIRCLES), detect(np.ascontiguousarray(image[:, ::-1]), CIRCLES)
    assert plain is not None and flipped is not None
    np.testing.assert_allclose(mirrored_view(flipped, CIRCLES).pixels, plain.pixels, atol=0.05)


def test_the_printed_grid_is_kalibrs(tmp_path: Path) -> None:
    """Bit by bit as kalibr_create_target_pdf draws it: the order of the tags, their turn, their border, the squares."""
    out = tmp_path / "grid.svg"
    assert main(["target", "aprilgrid", "--board", "5x4", "--square-mm", "30", "--out", str(out)]) == 0
    expected = april_grid(5, 4, 40, 12)
    boxes = np.array([[float(word.split('"')[1]) for word in line.split()[1:5]] for line in out.read_text().splitlines()
                      if line.startswith('<rect x=')])
    boxes = boxes[boxes[:, 1] < 185.0]  # the ruler is below
    corner = boxes[:, :2].min(axis=0)
    drawn = np.zeros_like(expected)
    for x, y, width, height in np.rint(40 / 30 * (boxes - [*corner, 0, 0])).astype(int):
        drawn[y:y + height, x:x + width] = True
    np.testing.assert_array_equal(drawn, expected)


def test_published_pictures_of_kalibrs_grid_and_of_tags_with_another_border() -> None:
    """The pictures' origin is in PICTURES/README.md."""
    board = AprilGrid(6, 6, 0.088, 0.3)
    two_bits, one_bit = (cv2.imread(str(PICTURES / name), cv2.IMREAD_GRAYSCALE) for name in
                         ("two_bits.jpg", "one_bit.jpg"))
    view = detect(two_bits, board)
    assert view is not None and len(view.ids) == 144
    assert measured_spacing(view.grid(board)) == pytest.approx(0.3, abs=0.005)
    assert detect(one_bit, board) is None and "one bit" in why_missing(one_bit, board)


@pytest.mark.parametrize(("board", "words"), [
    (GRID, ["--kind", "aprilgrid", "--board", "6x4", "--square-mm", "36"]),
    (CIRCLES, ["--kind", "circles", "--square-mm", "20"])], ids=["aprilgrid", "circles"])
def test_the_command_takes_the_board(board: Board, words: list[str], tmp_path: Path,
                                     capsys: pytest.CaptureFixture[str]) -> None:
    for k, turn in enumerate(((0.3, 0.0, 0.0), (0.0, 0.3, 0.1), (-0.3, 0.1, 0.0))):
        cv2.imwrite(str(tmp_path / f"left{k}.png"), photo(board, turn)[0])
    main(["calibrate", "intrinsics", "--images", str(tmp_path / "left*.png"), *words, "--json"])
    answer = json.loads(capsys.readouterr().out)
    assert answer["views_used"] == 3 and answer["rms_px"] < 0.1
    assert main(["calibrate", "intrinsics", "--images", str(tmp_path / "left*.png"), "--kind", "chessboard",
                 "--tag-spacing", "0.3"]) == 2
    assert "AprilGrid" in capsys.readouterr().err


@pytest.mark.parametrize(("board", "words"), [
    (AprilGrid(6, 4, 0.030, 0.3), ["--kind", "aprilgrid", "--board", "6x4", "--square-mm", "30"]),
    (CIRCLES, ["--kind", "circles", "--square-mm", "20"])], ids=["aprilgrid", "circles"])
def test_two_cameras_are_put_together(board: Board, words: list[str], tmp_path: Path,
                                      capsys: pytest.CaptureFixture[str]) -> None:
    """Seven pictures of each camera; the baseline, and the board's own length, come back."""
    poses = stereo_twin(seed=5, shots=7, board=board).world_from_board
    for camera, (name, camera_from_world) in enumerate((("left", np.eye(4)), ("right", RIGHT_FROM_LEFT))):
        taken = Photo(lens=tuple(LENSES[camera]), blur_px=0.8, noise=2.0, oversampling=2)
        for k, world_from_board in enumerate(poses):
            picture = take(board, camera_from_world @ world_from_board, taken, k)
            cv2.imwrite(str(tmp_path / f"{name}{k:02d}.png"), picture)
    assert main(["calibrate", "stereo", "--left", str(tmp_path / "left*.png"), "--right", str(tmp_path / "right*.png"),
                 *words, "--baseline-mm", "99.8", "--out", str(tmp_path / "rig.json"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    off = np.abs(np.array(answer["translation_mm"]) - 1e3 * RIGHT_FROM_LEFT[:3, 3])
    assert answer["views_used"] >= 6 and np.all(off < 3.5 * np.array(answer["translation_std_mm"]))
    assert answer["square_mm_triangulated"] == pytest.approx(1e3 * board.square_m, abs=0.05)
