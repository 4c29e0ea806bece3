"""A tagged cube in recordings: the states of a log, smoothed and not, and the formats that carry them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from rhot_app.api import export, open_recording
from rhot_app.estimation.se3 import exp_so3
from rhot_app.export.states import VALIDITIES, HandStates
from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.transforms import rigid
from rhot_app.hand.skeleton import FINGERS
from rhot_app.objects.object_file import cube, save_object
from rhot_app.objects.state import Validity
from rhot_app.project import with_object, with_tracker
from rhot_app.recording.raw_log import LogReader, Record, RecordKind, encode_header, encode_record
from rhot_node.wire.codec import decode_verified, encode
from rhot_node.wire.messages import Fiducial, Fiducials, Observations

CUBE = cube("cube", 60.0, 45.0, "DICT_APRILTAG_36h11")
NOISE_PX = 0.1
SPEED_M_S = 0.1


def pose(t_s: float) -> np.ndarray:
    """world_from_object: it slides to the right."""
    return rigid(exp_so3([0.5, 0.4, 0.1]) @ exp_so3([np.pi, 0.0, 0.0]), [-0.1 + SPEED_M_S * t_s, -0.04, 0.55])


@pytest.fixture(scope="module")
def cube_log(log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The hand's log with the cube's tags after every frame of markers."""
    folder = tmp_path_factory.mktemp("cube")
    save_object(folder / "cube.json", CUBE)
    reader, rng = LogReader(log), np.random.default_rng(1)
    rig = with_object(reader.rig, folder / "cube.json")
    cameras = {node.node_id: CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes}
    records, first_ns = [], 0
    for record in reader:
        records.append(record)
        message = decode_verified(record.data) if record.kind is RecordKind.DATAGRAM else None
        if isinstance(message, Observations):
            first_ns = first_ns or record.t_master_ns  # a datagram takes the same time from both cameras
            records.append(Record(record.kind, record.node_id, record.t_master_ns, encode(
                tags_of(message, cameras[message.node_id], 1e-9 * (record.t_master_ns - first_ns), rng))))
    path = folder / "cube.rhotlog"
    path.write_bytes(encode_header(rig, reader.about) + b"".join(map(encode_record, records)))
    return path


def tags_of(message: Observations, camera: CameraModel, t_s: float, rng: np.random.Generator) -> Fiducials:
    found = []
    for tag in CUBE.fiducials:
        row = 240.0
        for _ in range(3):
            world = pose(t_s + 1e-9 * message.row_time_ns * row)
            corners = tag.corners() @ world[:3, :3].T + world[:3, 3]
            pixels = camera.project(corners)
            row = float(pixels[:, 1].mean())
        normal = np.cross(corners[1] - corners[2], corners[3] - corners[2])
        sight = camera.centre - corners.mean(axis=0)
        if normal @ sight > 0.4 * np.linalg.norm(normal) * np.linalg.norm(sight):
            seen = pixels + NOISE_PX * rng.normal(size=pixels.shape)
            found.append(Fiducial(*tag.key, tuple(seen.ravel().tolist()), (NOISE_PX**2, 0.0, NOISE_PX**2) * 4))
    return Fiducials(message.node_id, message.session, message.sequence, message.t_frame_node_ns,
                     message.t_send_node_ns, message.processing_ns, message.exposure_ns, message.row_time_ns,
                     message.width, message.height, message.frame_number, found)


def errors_m(states: HandStates) -> np.ndarray:
    """(N,) of the object's place after the first tenth of a second, less the way that a datagram takes."""
    times = 1e-9 * (states.t_master_ns - states.t_master_ns[0])
    places = states.objects[0].world_from_object[:, :3, 3]
    along = np.array([pose(t)[:3, 3] for t in times])
    return np.linalg.norm((places - along)[times > 0.1] - np.median((places - along)[times > 0.1], axis=0), axis=1)


@pytest.fixture(scope="module")
def states(cube_log: Path) -> HandStates:
    """By the classic tracker."""
    return open_recording(cube_log).states("classic")


def test_a_log_gives_the_objects_with_the_hand(states: HandStates) -> None:
    one = states.objects[0]
    assert one.name == "cube" and one.world_from_object.shape == (len(states), 4, 4)
    assert np.mean(one.validity == VALIDITIES.index(Validity.TRACKED)) > 0.9
    assert np.isfinite(one.distances[states.tracked]).mean() > 0.9
    assert errors_m(states).max() < 2e-3


def test_smoothing_uses_what_comes_after(cube_log: Path) -> None:
    plain, smooth = (open_recording(cube_log).states("estimator", smooth=each) for each in (False, True))
    rms = [np.sqrt(np.mean(errors_m(states) ** 2)) for states in (plain, smooth)]
    print(f"{1e3 * rms[0]:.3f} mm rms as published, {1e3 * rms[1]:.3f} mm smoothed")
    assert rms[1] < 0.8 * rms[0]
    assert np.nanmedian(smooth.objects[0].covariance[:, 0, 0]) < np.nanmedian(plain.objects[0].covariance[:, 0, 0])


def test_tables_carry_objects(cube_log: Path, states: HandStates, tmp_path: Path) -> None:
    export(cube_log, tmp_path / "a.csv", tracker="classic")
    with (tmp_path / "a.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(states)
    middle = len(rows) // 2
    assert rows[middle]["object_cube_validity"] == "tracked"
    np.testing.assert_allclose([float(rows[middle][f"object_cube_{axis}_mm"]) for axis in "xyz"],
                               1e3 * states.objects[0].world_from_object[middle, :3, 3], atol=1e-3)
    assert {f"object_cube_{finger}_contact" for finger in FINGERS} < set(rows[0])
    assert float(rows[middle]["object_cube_cov_x_x_mm2"]) > 0.0
    export(cube_log, tmp_path / "a.npz", tracker="classic", units="m")
    with np.load(tmp_path / "a.npz") as file:
        assert file["object_names"].tolist() == ["cube"]
        np.testing.assert_allclose(file["object_world_from_object"][middle, 0],
                                   states.objects[0].world_from_object[middle], atol=1e-6)
        assert file["object_contacts"].shape == (len(states), 1, 5)
    frame = states.to_dataframe()
    assert frame["object_cube_validity"][middle] == "tracked"


def test_an_mcap_file_has_the_objects_and_their_frames(cube_log: Path, tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap.reader")
    export(cube_log, tmp_path / "a.mcap", tracker="classic")
    with (tmp_path / "a.mcap").open("rb") as file:
        messages = [(channel.topic, json.loads(message.data))
                    for _, channel, message in reader.make_reader(file).iter_messages()]
    found = [message for topic, message in messages if topic == "/objects/state"]
    assert found[-1]["objects"][0]["name"] == "cube" and found[-1]["objects"][0]["validity"] == "tracked"
    assert any(one["child_frame_id"] == "cube" for topic, message in messages if topic == "/tf"
               for one in message["transforms"])


def test_states_at_a_rate_have_objects(cube_log: Path) -> None:
    states = open_recording(cube_log).states("classic", rate_hz=100.0)
    assert states.objects[0].world_from_object.shape[0] == len(states)
    assert errors_m(states).max() < 2e-3
    assert with_tracker(open_recording(cube_log).rig, "classic").models == (CUBE,)
