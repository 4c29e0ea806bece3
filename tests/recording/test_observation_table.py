"""Logs as tables: each frame at its own rows' times, instants as the tracker has them, and sentences when empty."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from log_writing import write_log
from synthetic_rig import EPOCH_NS, LOST, WIDE, Viewing, hand_trajectory, make_rig, observe

from rhot_app.calibration.recorded_observations import read_instants, read_observations
from rhot_app.errors import RecordingError
from rhot_app.recording.raw_log import encode_header

RIG = make_rig()
SECONDS = 2.0


@pytest.fixture(scope="module")
def grasp():
    return hand_trajectory(RIG, "grasp", SECONDS)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory, grasp) -> Path:
    frames = observe(RIG, WIDE, grasp, SECONDS, Viewing(marker_loss=0.05))
    return write_log(tmp_path_factory.mktemp("log") / "grasp.log", RIG, frames)


def test_every_frame_is_there_at_its_own_time(log: Path, grasp) -> None:
    rig, table = read_observations(log)
    assert rig.name == RIG.name and table.marker_ids == RIG.markers.ids
    assert [len(camera.t_row0_ns) for camera in table.cameras] == [80, 80]
    assert table.duration_s == pytest.approx(SECONDS, abs=0.05)
    for camera, node in zip(table.cameras, RIG.nodes, strict=True):
        assert camera.name == node.name and camera.rate_hz == pytest.approx(40.0, rel=1e-3)
        lost = (camera.flags & LOST) != 0
        assert 0.02 < lost.mean() < 0.08 and (np.isnan(camera.pixels[..., 0]) == lost).all()
        expected = camera.t_row0_ns[:, None] + 48_000 * camera.pixels[..., 1]
        np.testing.assert_allclose(camera.times_ns[~lost], expected[~lost], atol=1.0)


def test_a_calibrated_offset_of_the_given_rig_is_added_once(log: Path) -> None:
    shifted = msgspec.structs.replace(RIG, nodes=(RIG.nodes[0],
                                                  msgspec.structs.replace(RIG.nodes[1], time_offset_s=0.004)))
    before, after = read_observations(log)[1], read_observations(log, shifted)[1]
    np.testing.assert_array_equal(before.cameras[0].t_row0_ns, after.cameras[0].t_row0_ns)
    np.testing.assert_array_equal(after.cameras[1].t_row0_ns - before.cameras[1].t_row0_ns, 4_000_000)


def test_instants_are_where_the_hand_was(log: Path, grasp) -> None:
    _, instants = read_instants(log)
    assert len(instants.t_ns) > 70 and instants.pixels.shape[1:] == (2, 6, 2)
    truth = grasp(1e-9 * (instants.t_ns - EPOCH_NS))
    error_m = np.linalg.norm(instants.positions - truth, axis=2)[instants.measured]
    assert instants.measured.mean() > 0.8
    assert np.sqrt(np.mean(error_m**2)) < 1e-3
    assert (np.isnan(instants.positions[..., 0]) == np.isnan(instants.position_covariances[..., 0, 0])).all()


def test_logs_without_use_say_why(tmp_path: Path, log: Path) -> None:
    empty = tmp_path / "empty.log"
    empty.write_bytes(encode_header(RIG, {}))
    with pytest.raises(RecordingError, match=r"empty\.log.*holds no observations"):
        read_observations(empty)
    fewer = msgspec.structs.replace(RIG.markers, markers=RIG.markers.markers[:5])
    with pytest.raises(RecordingError, match="marker_set"):
        read_observations(log, msgspec.structs.replace(RIG, markers=fewer))
