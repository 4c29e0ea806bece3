"""Films of a moving board: frames are chosen where it is still, sharp and elsewhere, and calibrate as stills do."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest
from board_rendering import Photo, corners_px, take
from numpy.typing import NDArray
from stereo_twin import LENSES, RIGHT_FROM_LEFT, stereo_twin

from rhot_app.__main__ import main
from rhot_app.calibration.board.boards import Chessboard
from rhot_app.calibration.lens.film import choose_frames, frame_at
from rhot_app.calibration.lens.intrinsics import solve
from rhot_app.calibration.lens.views import read_views
from rhot_app.calibration.stereo.reading import read_shared
from rhot_app.errors import CalibrationError
from rhot_app.estimation.se3 import exp_so3, log_so3
from rhot_app.geometry.transforms import rigid

BOARD = Chessboard(9, 6, 0.030)
FPS = 25.0
HELD, MOVING = 3, 2  # frames for which the board rests in a pose, and on the way to the next one
PHOTOS = [Photo(lens=tuple(lens), noise=2.0, oversampling=2) for lens in LENSES]
COUNT = 12 * HELD + 11 * MOVING
CAMERA_FROM_WORLD = (np.eye(4), RIGHT_FROM_LEFT)

Gray = NDArray[np.uint8]


@dataclass(frozen=True)
class Films:
    """Both cameras' films, and the stills of the same poses; the frames in which the board rests."""

    films: tuple[Path, Path]
    stills: Path
    still: frozenset[int]
    poses: list[NDArray[np.float64]]


def between(one, other, share: float):
    turn = other[:3, :3] @ one[:3, :3].T
    middle = BOARD.object_points().mean(axis=0)
    at = [pose[:3, :3] @ middle + pose[:3, 3] for pose in (one, other)]
    rotation = exp_so3(share * log_so3(turn)) @ one[:3, :3]
    return rigid(rotation, (1.0 - share) * at[0] + share * at[1] - rotation @ middle)


def write(path: Path, frames: list[Gray], fps: float = FPS) -> Path:
    size = frames[0].shape[1], frames[0].shape[0]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), fps, size)
    writer.set(cv2.VIDEOWRITER_PROP_QUALITY, 98)
    for frame in frames:
        writer.write(cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR))
    writer.release()
    return path


def frames_of(path: Path) -> list[Gray]:
    capture, frames = cv2.VideoCapture(str(path)), []
    while (read := capture.read())[0]:
        frames.append(cv2.cvtColor(read[1], cv2.COLOR_BGR2GRAY))
    return frames


@pytest.fixture(scope="module")
def films(tmp_path_factory: pytest.TempPathFactory) -> Films:
    """Twelve poses of a board before two cameras; it rests in each for three frames, and moves for two."""
    folder = tmp_path_factory.mktemp("films")
    poses = list(stereo_twin(seed=4, shots=12).world_from_board)
    shown: list[list[Gray]] = [[], []]
    still = set()
    for k, pose in enumerate(poses):
        for camera, (photo, camera_from_world) in enumerate(zip(PHOTOS, CAMERA_FROM_WORLD, strict=True)):
            picture = take(BOARD, camera_from_world @ pose, photo, seed=k)
            cv2.imwrite(str(folder / f"{'left' if camera == 0 else 'right'}{k:02d}.png"), picture)
            for j in range(HELD):
                still.add(len(shown[camera]))
                noise = np.random.default_rng(100 * k + j).normal(0.0, 2.0, picture.shape)
                shown[camera].append(np.clip(picture + (noise if j else 0.0), 0, 255).astype(np.uint8))
            for j in range(MOVING if k + 1 < len(poses) else 0):
                way = between(pose, poses[k + 1], (j + 0.5) / MOVING)
                shown[camera].append(take(BOARD, camera_from_world @ way, photo, seed=k))
    paths = write(folder / "left.avi", shown[0]), write(folder / "right.avi", shown[1])
    return Films(paths, folder, frozenset(still), poses)


def test_frames_are_taken_where_the_board_rests_and_is_elsewhere(films: Films) -> None:
    chosen = choose_frames([films.films[0]], BOARD)
    numbers = [round(moment.t_s * FPS) for moment in chosen.moments]
    assert chosen.searched == COUNT and numbers == sorted(numbers)
    assert set(numbers) <= films.still and len({number // (HELD + MOVING) for number in numbers}) == len(numbers) >= 10


def test_a_lens_from_a_film_lies_in_the_intervals_of_the_stills(films: Films) -> None:
    reports = [solve(read_views(files, BOARD).views, BOARD)
               for files in ([films.films[0]], sorted(films.stills.glob("left*.png")))]
    film, stills = reports
    assert np.all(np.abs(film.lens - stills.lens) <= 1.96 * stills.std)
    assert np.all(np.abs(film.lens - LENSES[0]) <= 3.5 * film.std) and film.verdict.acceptable


def stereo(folder: Path, left: Path, right: Path, *more: str) -> None:
    assert main(["calibrate", "stereo", "--left", str(left), "--right", str(right), "--board", "9x6", "--square-mm",
                 "30", "--baseline-mm", "99.8", "--out", str(folder / "rig.json"), "--json", *more]) == 0


def test_two_films_put_the_cameras_together_as_stills_do(films: Films, tmp_path: Path,
                                                         capsys: pytest.CaptureFixture[str]) -> None:
    stereo(tmp_path, *films.films)
    film = json.loads(capsys.readouterr().out)
    stereo(tmp_path, films.stills / "left*.png", films.stills / "right*.png")
    stills = json.loads(capsys.readouterr().out)
    for what, std in (("translation_mm", "translation_std_mm"), ("rotation_rad", "rotation_std_rad")):
        assert np.all(np.abs(np.subtract(film[what], stills[what])) <= 1.96 * np.array(stills[std])), what
    assert film["views_used"] >= 10 and all(" s" in shot["name"] for shot in film["shots"])


def test_a_film_that_began_later_is_moved_by_its_offset(films: Films, tmp_path: Path) -> None:
    """Without it the board stands elsewhere in the two pictures of a moment."""
    left, right = (frames_of(path)[:31] for path in films.films)
    files = {"left": [write(tmp_path / "left.avi", left)], "right": [write(tmp_path / "late.avi", right[6:])]}
    for offset, together in ((6 / FPS, True), (0.0, False)):
        shots = read_shared(files, BOARD, offsets_s={"right": offset}).views.shots
        apart = [np.abs(shot.views[1].pixels - corners_px(BOARD, RIGHT_FROM_LEFT @ films.poses[pose], LENSES[1])).max()
                 for shot in shots if shot.views[0] is not None and shot.views[1] is not None
                 for pose in [round(float(shot.name.split()[0]) * FPS) // (HELD + MOVING)]]
        assert len(shots) >= 4 and (float(np.median(apart)) < 1.0) is together


def test_a_board_that_never_rests_is_taken_where_it_moves_least(films: Films, tmp_path: Path) -> None:
    shown = frames_of(films.films[0])
    path = write(tmp_path / "moving.avi", [frame for k, frame in enumerate(shown) if k not in films.still])
    chosen = choose_frames([path], BOARD)
    assert len(chosen.moments) >= 3
    assert all(seen is not None and seen.badness > 1.0 for moment in chosen.moments for seen in moment.views)


def test_a_frame_of_a_film_is_named_by_its_second(films: Films) -> None:
    picture = cv2.cvtColor(frame_at(Path(f"{films.films[0]}@{(HELD + MOVING + 1) / FPS}")),
                           cv2.COLOR_BGR2GRAY)  # in the second pose
    corners = corners_px(BOARD, films.poses[1], LENSES[0])
    seen = cv2.findChessboardCorners(picture, (9, 6))[1][:, 0]
    assert min(np.abs(seen - corners).max(), np.abs(seen[::-1] - corners).max()) < 3.0


@pytest.mark.parametrize(("arguments", "words"), [
    (["intrinsics", "--images", "FILM"], "no picture shows the board"),
    (["intrinsics", "--images", "TEXT"], "decoded"),
    (["stereo", "--left", "FILM", "--right", "STILLS"], "one film of each camera"),
    (["stereo", "--left", "FILM", "--right", "BOARD"], "left: no picture shows"),
    (["stereo", "--left", "BOARD", "--right", "BOARD", "--offset-s", "right=60"], "no common time"),
    (["stereo", "--left", "BOARD", "--right", "BOARD", "--offset-s", "right=nan"], "finite"),
    (["stereo", "--left", "BOARD", "--right", "BOARD", "--offset-s", "middle=1"], "left, right"),
    (["colours", "--image", "BOARD", "--sample", "a=1,1,20,20"], "second"),
    (["colours", "--image", "BOARD@900", "--sample", "a=1,1,20,20"], "ends at"),
    (["colours", "--image", "TEXT@1", "--sample", "a=1,1,20,20"], "decoded"),
])
def test_what_films_do_not_show_is_a_sentence(films: Films, tmp_path: Path, arguments: list[str], words: str,
                                              capsys: pytest.CaptureFixture[str]) -> None:
    empty = write(tmp_path / "empty.avi", [np.full((480, 640), level, np.uint8) for level in range(60, 75)])
    (tmp_path / "text.mp4").write_text("no film")
    places = {"FILM": empty, "TEXT": tmp_path / "text.mp4", "STILLS": films.stills / "left*.png",
              "BOARD": films.films[0]}
    filled = [next((word.replace(key, str(path)) for key, path in places.items() if word.startswith(key)), word)
              for word in arguments]
    code = main(["calibrate", *filled, "--out", str(tmp_path / "out.json")])
    assert code == 2 and words in capsys.readouterr().err
    assert not (tmp_path / "out.json").exists()


def test_a_film_without_rate_or_frames_is_refused(tmp_path: Path) -> None:
    (tmp_path / "cut.avi").write_bytes(b"RIFF\0\0\0\0AVI LIST")
    with pytest.raises(CalibrationError, match=r"cut\.avi"):
        choose_frames([tmp_path / "cut.avi"], BOARD)
