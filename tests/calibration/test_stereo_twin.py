"""The stereo calibration on a synthetic rig: the truth comes back, with two cameras or more, whatever the board."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from patience import quickest
from stereo_twin import BOARD, LENSES, RIGHT_FROM_LEFT, SIZE, Twin, stereo_twin, with_boards

from rhot_app.calibration.board.boards import CharucoBoard, Chessboard
from rhot_app.calibration.board.shared_views import BoardShot, SharedViews
from rhot_app.calibration.lens.fit import LensStart
from rhot_app.calibration.stereo.adjust import StereoSolution, view_rms
from rhot_app.calibration.stereo.calibrate import calibrate, solve
from rhot_app.calibration.stereo.points import locate
from rhot_app.calibration.stereo.result import StereoFigures, StereoResult
from rhot_app.calibration.stereo.ruler import RulerReading, read_ruler
from rhot_app.errors import CalibrationError
from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.camera import CameraModel, full_lens, intrinsics_row
from rhot_app.geometry.transforms import inverse, rigid


def figures(report: StereoResult) -> StereoFigures:
    assert report.figures is not None
    return report.figures


def about(twin: Twin, origin: str = "views") -> list[LensStart]:
    """Lenses some percent off, to be found."""
    scale = np.repeat([1.02, 0.98, 0.9, 1.0], [3, 1, 2, 6])
    return [LensStart(lens * scale, SIZE, None, origin) for lens in twin.lenses]  # type: ignore[arg-type]


def ring(count: int = 4, shots: int = 24) -> Twin:
    """Cameras on an arc around the board; the first and the last share few shots."""
    world_from_camera = []
    for angle in np.linspace(0.0, 1.2, count):
        place = np.array([0.6 * np.sin(angle), 0.0, 0.6 - 0.6 * np.cos(angle)])
        world_from_camera.append(rigid(exp_so3([0.0, -angle, 0.0]), place))
    poses = np.array([inverse(pose) for pose in world_from_camera])
    lenses = LENSES[np.arange(count) % 2].copy()
    twin = Twin(tuple(f"pi{i}" for i in range(count)), BOARD, lenses, poses, np.empty((0, 4, 4)))
    return with_boards(twin, np.random.default_rng(2), shots, np.array([0.0, 0.0, 0.6]))


def test_exact_corners_give_every_parameter_back() -> None:
    twin = stereo_twin()
    found = figures(calibrate(twin.views(), about(twin))).state
    assert np.allclose(found.lenses[:, :4], twin.lenses[:, :4], rtol=1e-6)
    assert np.allclose(found.lenses[:, 4:], twin.lenses[:, 4:], atol=1e-6 * np.abs(twin.lenses[:, 4:]).max())
    size = np.linalg.norm(RIGHT_FROM_LEFT[:3, 3])
    assert np.allclose(found.camera_from_world[1, :3, 3], RIGHT_FROM_LEFT[:3, 3], atol=1e-6 * size)
    assert np.allclose(found.camera_from_world[1, :3, :3], RIGHT_FROM_LEFT[:3, :3], atol=1e-8)


def test_many_cameras_stand_where_they_stand() -> None:
    twin = ring()
    views = twin.views()
    assert views.shared(0, 3) < views.shared(0, 1)
    found = figures(calibrate(views, about(twin)))
    assert np.allclose(found.state.camera_from_world, twin.camera_from_world, atol=1e-7)
    assert [pair.second for pair in found.pairs] == ["pi1", "pi2", "pi3"]


def test_cameras_that_never_meet_are_linked_by_others() -> None:
    twin = ring()
    shots = tuple(BoardShot(shot.name, (*shot.views[:2], None, None) if i % 3 == 0 else
                            (None, *shot.views[1:3], None) if i % 3 == 1 else (None, None, *shot.views[2:]))
                  for i, shot in enumerate(twin.views().shots))
    views = SharedViews(twin.names, twin.board, shots)
    assert views.shared(0, 3) == 0
    found = figures(calibrate(views, twin.starts()))
    assert np.allclose(found.state.camera_from_world, twin.camera_from_world, atol=1e-7)
    assert np.isnan(found.pairs[-1].epipolar_px)


def test_cameras_without_shared_views_are_named() -> None:
    twin = ring()
    every = twin.views().shots
    alone = tuple(BoardShot(shot.name, (*shot.views[:3], None)) for shot in every)
    with pytest.raises(CalibrationError, match=r"^pi3: no picture shows the board at the same moment"):
        calibrate(SharedViews(twin.names, twin.board, alone), twin.starts())
    groups = tuple(BoardShot(shot.name, (*shot.views[:2], None, None) if i % 2 else (None, None, *shot.views[2:]))
                   for i, shot in enumerate(every))
    with pytest.raises(CalibrationError, match=r"^pi2 and pi3: no shot is shared with the group of pi0"):
        calibrate(SharedViews(twin.names, twin.board, groups), twin.starts())


def test_a_camera_that_saw_another_moment_loses_only_that_view() -> None:
    twin = ring()
    views = twin.views()
    shots = list(views.shots)
    shots[3] = BoardShot(shots[3].name, (shots[9].views[0], *shots[3].views[1:]))
    report = calibrate(replace(views, shots=tuple(shots)), twin.starts())
    assert [each.name for each in report.dropped] == ["04 of pi0"]
    assert np.allclose(figures(report).state.camera_from_world, twin.camera_from_world, atol=1e-7)


@pytest.mark.parametrize("board", [Chessboard(8, 6, 0.03), Chessboard(9, 7, 0.025)])
def test_a_board_that_looks_the_same_turned_may_be_counted_from_either_end(board: Chessboard) -> None:
    twin = stereo_twin(board=board)
    views = twin.views()
    shots = tuple(BoardShot(shot.name, (shot.views[0], shot.views[1].turned(board) if i % 2 and shot.views[1] else
                                   shot.views[1])) for i, shot in enumerate(views.shots))
    found = figures(calibrate(replace(views, shots=shots), twin.starts()))
    assert np.allclose(found.state.camera_from_world[1], RIGHT_FROM_LEFT, atol=1e-7)
    assert found.rms_px < 1e-6


def test_a_board_seen_in_part_serves() -> None:
    """As a ChArUco board is: each camera sees some corners, not the same."""
    twin = stereo_twin(board=CharucoBoard(10, 7, 0.03, 0.022))
    rng = np.random.default_rng(4)

    def part(shot: BoardShot) -> BoardShot:
        kept = [np.sort(rng.choice(54, 30, replace=False)) for _ in shot.views]
        return BoardShot(shot.name, tuple(replace(view, pixels=view.pixels[those], ids=view.ids[those])  # type: ignore
                                     for view, those in zip(shot.views, kept, strict=True)))

    views = twin.views()
    found = figures(calibrate(replace(views, shots=tuple(map(part, views.shots))), twin.starts()))
    assert np.allclose(found.state.camera_from_world[1], RIGHT_FROM_LEFT, atol=1e-7)


def test_a_shot_with_a_bumped_board_is_left_out() -> None:
    twin = stereo_twin()
    views = twin.views(np.random.default_rng(0), 0.1)
    shots = list(views.shots)
    left, right = shots[5].views
    assert right is not None
    bumped = replace(right, pixels=right.pixels + np.array([0.0, 3.0]))  # between the exposures
    shots[5] = BoardShot(shots[5].name, (left, bumped))
    report = calibrate(replace(views, shots=tuple(shots)), twin.starts())
    assert [(each.name, each.code) for each in report.dropped] == [("06", "residual")]
    assert figures(report).noise_px == pytest.approx(0.1, rel=0.1)


def test_stated_certainty_is_that_of_the_noise() -> None:
    """Twice the noise, twice the standard deviations; given lenses add their own."""
    twin = stereo_twin()
    stds = [figures(calibrate(twin.views(np.random.default_rng(0), noise), twin.starts())).pairs[0].translation_std_m
            for noise in (0.1, 0.2)]
    assert stds[1] == pytest.approx(2.0 * stds[0], rel=0.1)
    unsure = [replace(lens, std=full_lens([2.0, 2, 2, 2])) for lens in twin.starts()]
    wider = figures(calibrate(twin.views(np.random.default_rng(0), 0.1), unsure))
    assert np.all(wider.pairs[0].translation_std_m > 2.0 * stds[0])
    assert wider.cameras[0].lens_std[:4] == pytest.approx([2.0, 2.0, 2.0, 2.0])


def test_the_expected_error_is_what_triangulation_shows() -> None:
    """A point at the working distance, located with rigs calibrated from noisy corners, scatters as stated."""
    offs, stated = [], []
    for seed in range(10):
        twin = stereo_twin(0, 6)
        found = figures(calibrate(twin.views(np.random.default_rng(seed), 0.3), twin.starts()))
        stated.append(found.error_m[0])
        point, other = np.array([[0.05, 0.0, 0.6]]), np.array([[0.05, 0.1, 0.6]])
        models = [CameraModel(*SIZE, intrinsics_row(lens), inverse(pose), pose)
                  for lens, pose in zip(twin.lenses, twin.camera_from_world, strict=True)]
        ends = np.stack([np.vstack([model.project(point), model.project(other)]) for model in models])
        measured = read_ruler(RulerReading(0.1, ends), found.state)
        assert measured.ratio == pytest.approx(1.0, abs=0.01)
        offs.append(locate(ends, found.state)[0] - point[0])
    spread = float(np.sqrt(np.mean(np.sum(np.square(offs), axis=1))))
    assert spread == pytest.approx(float(np.mean(stated)), rel=0.6)


def test_many_stereo_views_are_quick_and_tell_of_it() -> None:
    """Four times as many views take no more than a good four times as long: nothing grows with their square."""
    told: list[float] = []

    def seconds(shots: int) -> float:
        twin = stereo_twin(shots=shots)
        views, rig = twin.views(np.random.default_rng(0), 0.2), about(twin)
        told.clear()
        return quickest(lambda: calibrate(views, rig, progress=lambda text, fraction: told.append(fraction)), times=2,
                        clock=time.process_time)

    few, many = seconds(6), seconds(24)
    assert many < 8.0 * few  # the square of it would be 16
    assert told[0] == 0.0
    assert told[-1] == 1.0
    assert len(told) > 10


def test_too_few_shots_are_refused() -> None:
    twin = stereo_twin(shots=2)
    with pytest.raises(CalibrationError, match="Only 2 shots"):
        calibrate(twin.views(), twin.starts())


def test_view_errors_are_per_shot_and_camera() -> None:
    twin = stereo_twin(shots=5)
    solution = solve(twin.views(np.random.default_rng(0), 0.2), twin.starts())
    assert isinstance(solution, StereoSolution)
    rms = view_rms(solution)
    assert rms.shape == (5, 2)
    assert np.all((rms > 0.1) & (rms < 0.4))
