"""The world is placed by a board on the table: z up, origin at its first corner, x along its columns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from stereo_twin import BOARD, LENSES, Twin

from rhot_app.calibration.board.boards import Chessboard
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.bundle.model import BundleState
from rhot_app.calibration.stereo.start import place_world
from rhot_app.calibration.verdict import Grade
from rhot_app.errors import CalibrationError
from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.transforms import inverse, rigid

NAMES = ("left", "right")
UP_BOARD = rigid(np.diag([1.0, -1.0, -1.0]), np.zeros(3))  # table_from_board of a board that lies as it should


def over_table(down_deg: float = 50.0, roll_deg: float = 0.0) -> Twin:
    """Two cameras 0.4 m above a table, looking down at a board whose first corner is the table's origin."""
    middle = BOARD.object_points().mean(axis=0) * [1.0, -1.0, 1.0]  # in the table's frame
    down, roll = np.radians([down_deg, roll_deg])
    forward = np.array([0.0, np.cos(down), -np.sin(down)])
    right = np.array([1.0, 0.0, 0.0])
    turn = np.column_stack([right, np.cross(forward, right), forward]) @ exp_so3([0.0, 0.0, roll])
    place = middle - 0.4 / np.sin(down) * forward
    poses = [rigid(turn, place + shift * turn[:, 0]) for shift in (-0.0375, 0.0375)]
    return Twin(NAMES, BOARD, LENSES, np.array([inverse(pose) for pose in poses]), UP_BOARD[None])


def as_calibrated(twin: Twin) -> BundleState:
    """What a stereo calibration knows: the same cameras, the first one at the origin."""
    first = inverse(twin.camera_from_world[0])
    return BundleState(twin.lenses, twin.camera_from_world @ first, np.empty((0, 4, 4)))


def seen(twin: Twin, noise_px: float = 0.0) -> tuple[BoardView | None, ...]:
    rng = np.random.default_rng(0)
    return twin.views(rng, noise_px).shots[0].views


@pytest.mark.parametrize("who", [(0, 1), (0,), (1,)])
def test_the_table_is_where_the_board_lies(who: tuple[int, ...]) -> None:
    twin = over_table()
    views = [view if camera in who else None for camera, view in enumerate(seen(twin))]
    frame = place_world(views, BOARD, as_calibrated(twin), NAMES)
    truth = np.array([inverse(pose) for pose in twin.camera_from_world])
    assert np.allclose(frame.world_from_camera, truth, atol=1e-7)
    assert frame.verdict.grade is Grade.GOOD
    assert [stance.height_m for stance in frame.stances] == pytest.approx([0.4, 0.4], abs=1e-6)
    assert np.degrees(frame.stances[0].down_rad) == pytest.approx(50.0)
    assert frame.stances[0].roll_rad == pytest.approx(0.0, abs=1e-6)


def test_noise_moves_the_table_little() -> None:
    twin = over_table()
    frame = place_world(seen(twin, 0.2), BOARD, as_calibrated(twin), NAMES)
    assert frame.rms_px == pytest.approx(0.28, abs=0.05)
    assert np.allclose(frame.world_from_camera, [inverse(pose) for pose in twin.camera_from_world], atol=3e-3)


def test_the_rig_itself_is_not_bent() -> None:
    twin = over_table()
    state = as_calibrated(twin)
    frame = place_world(seen(twin, 0.2), BOARD, state, NAMES)
    relative = inverse(frame.world_from_camera[1]) @ frame.world_from_camera[0]
    assert np.allclose(relative, state.camera_from_world[1], atol=1e-12)


def test_a_board_that_does_not_lie_level_is_noticed() -> None:
    twin = over_table(down_deg=40.0, roll_deg=35.0)
    verdict = place_world(seen(twin), BOARD, as_calibrated(twin), NAMES).verdict
    assert verdict.codes == {"roll"}
    assert "rolled by" in verdict.findings[0].figure
    assert verdict.acceptable


def test_a_camera_that_looks_up_is_noticed() -> None:
    """As it comes out when the board leans back behind the table's edge."""
    twin = over_table(down_deg=15.0)
    upward = np.array([rigid(exp_so3([-np.radians(18.0), 0.0, 0.0]), np.zeros(3)) @ pose
                       for pose in twin.camera_from_world])
    twin = replace(twin, camera_from_world=upward, lenses=LENSES * ([0.6, 0.6, 1, 1] + 8 * [0]))
    frame = place_world(seen(twin), BOARD, as_calibrated(twin), NAMES)
    assert frame.verdict.codes == {"gravity"}
    assert np.degrees(frame.stances[0].down_rad) == pytest.approx(-3.0, abs=0.01)


def test_a_mirrored_or_moved_picture_is_refused() -> None:
    twin = over_table()
    views = seen(twin)
    right = views[1]
    assert right is not None
    moved = replace(right, pixels=right.pixels + np.array([40.0, 0.0]))
    with pytest.raises(CalibrationError, match="left and right see the board on the table at different places"):
        place_world((views[0], moved), BOARD, as_calibrated(twin), NAMES)


def test_no_board_is_named() -> None:
    with pytest.raises(CalibrationError, match="in no picture"):
        place_world((None, None), BOARD, as_calibrated(over_table()), NAMES)


def test_a_small_board_in_one_camera_does_not_tell_its_tilt() -> None:
    small = Chessboard(4, 3, 0.004)
    far = replace(over_table(down_deg=85.0), board=small)
    views = far.views(np.random.default_rng(3), 0.3).shots[0].views
    verdict = place_world((views[0], None), small, as_calibrated(far), NAMES).verdict
    assert "tilt" in verdict.codes
    assert not verdict.acceptable

