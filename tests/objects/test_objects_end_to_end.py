"""A tagged cube beside a hand, rendered to recordings: two nodes, an engine and a client on real sockets; and a replay
of the log that the engine wrote."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "e2e"))

from bench import FPS, HEIGHT, START_S, TEST_S, WIDTH, Bench, states_of, wait_until
from scene import EXPOSURE_NS, ROW_TIME_NS, Scene, draw
from tag_pictures import render

from rhot_app.engine.client import EngineClient
from rhot_app.estimation.se3 import exp_so3, log_so3
from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.object_file import cube, save_object
from rhot_app.objects.state import ObjectState, Validity
from rhot_app.project import RigNode, load_rig, with_object
from rhot_node.capture.yuv import YuvWriter

CUBE = cube("cube", 60.0, 45.0, "DICT_APRILTAG_36h11")
WORLD_FROM_CUBE = rigid(exp_so3([0.5, 0.4, 0.1]) @ exp_so3([np.pi, 0.0, 0.0]), [-0.08, -0.04, 0.55])
SECONDS = 1.0
SAME_M = 5e-5  # of a state that is replayed
WORST_M, WORST_RAD = 1e-3, np.radians(0.5)


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    """A bench whose rig has the cube."""
    bench = Bench(tmp_path)
    (tmp_path / "objects").mkdir()
    save_object(tmp_path / "objects" / "cube.json", CUBE)
    bench.rig = with_object(bench.rig, tmp_path / "objects" / "cube.json")
    bench.save()
    try:
        yield bench
    finally:
        bench.clear()


def record(folder: Path, scene: Scene, node: RigNode) -> None:
    """A quarter of a second of what `node` sees of a hand and a cube at rest."""
    rng, camera = np.random.default_rng(node.node_id), CameraModel.from_rig(node.intrinsics, node.pose)
    with YuvWriter(folder, WIDTH, HEIGHT, EXPOSURE_NS, ROW_TIME_NS) as writer:
        for frame in range(round(0.25 * FPS)):
            picture = draw(scene.pixels(node, frame / FPS), scene.rig.markers)
            luma = picture[:WIDTH * HEIGHT].reshape(HEIGHT, WIDTH)
            luma[:] = np.clip(render(CUBE, WORLD_FROM_CUBE, camera, rng), 1, 254)
            writer.append(round(1e9 * frame / FPS), picture)


def errors(states: list[ObjectState]) -> tuple[np.ndarray, np.ndarray]:
    return (np.array([np.linalg.norm(one.world_from_object[:3, 3] - WORLD_FROM_CUBE[:3, 3]) for one in states]),
            np.array([np.linalg.norm(log_so3(one.world_from_object[:3, :3] @ WORLD_FROM_CUBE[:3, :3].T))
                      for one in states]))


@pytest.mark.timeout(2 * TEST_S)
def test_a_cube_before_two_nodes_reaches_a_client_and_a_replay_says_the_same(bench: Bench) -> None:
    scene = Scene(bench.rig)
    for index, node in enumerate(bench.rig.nodes):
        record(bench.folder / f"{node.name}.yuv", scene, node)
        bench.start_node(index, f"yuv:{bench.folder / node.name}.yuv")
    log = bench.folder / "cube.log"
    bench.start_engine("--start", "--record", str(log))
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: client.state is not None and client.state.objects[0].tracked, 2 * START_S,
                   "the cube")
        states_of(client, 0.5)
        states = states_of(client, SECONDS)
        node = client.command("node", node_id=bench.rig.nodes[0].node_id, request={"request": "counters"})
        client.command("record_stop")
    objects = [state.objects[0] for state in states]
    assert len(objects) > 0.9 * SECONDS * FPS
    assert {one.validity for one in objects} == {Validity.TRACKED}
    assert all(state.t_master_ns == state.objects[0].t_master_ns for state in states), "hand and object at one instant"
    distances, angles = errors(objects)
    assert distances.max() < WORST_M and angles.max() < WORST_RAD
    hands = [state for state in states if state.tracked]
    assert hands and all(np.isfinite(state.objects[0].distances).all() for state in hands)
    counters = node["answer"]["counters"]
    assert counters["fiducials_sent"] > SECONDS * FPS and counters["fiducials_not_sent"] == 0

    again = replayed(log)  # whose clock model knows the exchanges since the log began only
    times = np.array([state.t_master_ns for state in again])
    nearest = [again[int(np.argmin(np.abs(times - state.t_master_ns)))] for state in states]
    late_ns = np.array([one.t_master_ns - state.t_master_ns for one, state in zip(nearest, states, strict=True)])
    assert np.mean(np.abs(late_ns) < 1_000_000) > 0.9
    apart_m = [np.linalg.norm(one.objects[0].world_from_object[:3, 3] - state.objects[0].world_from_object[:3, 3])
               for one, state in zip(nearest, states, strict=True)]
    assert np.mean(np.array(apart_m) < SAME_M) > 0.9
    distances, angles = errors([state.objects[0] for state in nearest])
    assert distances.max() < WORST_M and angles.max() < WORST_RAD


def replayed(log: Path) -> list:
    """The states of a log tracked at once, with the rig that it holds."""
    from rhot_app.engine.offline.replay_summary import replay_states
    from rhot_app.recording.raw_log import LogReader
    from rhot_app.sources.replay import LogValidator
    from rhot_app.tracking.scene import make_tracker

    reader = LogReader(log)
    door = LogValidator(reader.rig)
    states = list(replay_states(reader, door, make_tracker(reader.rig)))
    assert all(link.door.frames["tags"] > SECONDS * FPS for link in door.links)
    return states


def test_a_missing_object_file_is_a_sentence(bench: Bench) -> None:
    (bench.folder / "objects" / "cube.json").unlink()
    document = json.loads(bench.rig_path.read_text())
    assert document["objects"] == [{"file": "objects/cube.json"}], "relative to the rig, and the file is the object"
    done = subprocess.run([sys.executable, "-m", "rhot_app", "check", str(bench.rig_path)], capture_output=True,
                          text=True, check=False)
    assert done.returncode == 2
    assert "objects/cube.json: no such file." in done.stderr


def test_a_rig_keeps_its_objects_wherever_it_is_saved(bench: Bench, tmp_path: Path) -> None:
    from rhot_app.project import save_rig
    rig = load_rig(bench.rig_path)
    assert rig == bench.rig and rig.models == (CUBE,)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    save_rig(elsewhere / "rig.json", rig)
    assert load_rig(elsewhere / "rig.json") == rig
    assert json.loads((elsewhere / "rig.json").read_text())["objects"][0]["file"] == "../objects/cube.json"
