"""BVH and glTF, read back by other packages and set in motion by the tests' own kinematics: the states' joints."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bvh
import numpy as np
import pygltflib
import pytest
import trimesh
from scipy.spatial.transform import Rotation, Slerp

from rhot_app.export.export import export_log
from rhot_app.export.plan import ExportOptions
from rhot_app.export.states import HandStates
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.shape import segments
from rhot_app.hand.skeleton import JOINTS, HandPose
from rhot_app.recording.raw_log import LogReader

CLASSIC = ExportOptions(tracker="classic")
Y_UP = np.array([1.0, -1.0, -1.0])


def posed_bvh(file: bvh.Bvh, frame: int) -> dict[str, np.ndarray]:
    """Where the joints and end sites of a BVH file are."""
    found: dict[str, np.ndarray] = {}

    def walk(name: str, origin: np.ndarray, turn: np.ndarray) -> None:
        channels = file.joint_channels(name)
        values = dict(zip(channels, file.frame_joint_channels(frame, name, channels), strict=True))
        moved = [values.get(f"{axis}position", 0.0) for axis in "XYZ"]
        origin = origin + turn @ (np.array(file.joint_offset(name)) + moved)
        for channel in channels:
            if channel.endswith("rotation"):
                turn = turn @ Rotation.from_euler(channel[0].lower(), values[channel], degrees=True).as_matrix()
        found[name] = origin
        node = file.get_joint(name)
        for end in node.filter("End"):
            found[f"{name.rsplit('_', 1)[0]}_tip"] = origin + turn @ np.array([float(part) for part in end["OFFSET"]])
        for child in node.filter("JOINT"):
            walk(child.name, origin, turn)

    walk(JOINTS[0], np.zeros(3), np.eye(3))
    return found


def test_the_skeleton_of_bvh_moves_as_the_hand(log: Path, states: HandStates, tmp_path: Path) -> None:
    path = export_log(log, tmp_path / "a.bvh", options=CLASSIC).path
    file = bvh.Bvh(path.read_text())
    assert file.frame_time == pytest.approx(1.0 / 40.0)
    model = build_model(LogReader(log).rig.hand)
    known = np.flatnonzero(states.tracked)
    slerp = Slerp(states.times_s[known], Rotation.from_matrix(states.world_from_palm[known, :3, :3]))
    for frame in range(10, file.nframes - 1, 7):
        t_s = frame * file.frame_time
        world = np.eye(4)
        world[:3, :3] = slerp(t_s).as_matrix()
        world[:3, 3] = [np.interp(t_s, states.times_s[known], column) for column in
                        states.world_from_palm[known, :3, 3].T]
        angles = np.array([np.interp(t_s, states.times_s[known], column) for column in states.angles[known].T])
        expected = forward(model, HandPose(world, angles)).joints * Y_UP
        found = posed_bvh(file, frame)
        assert np.array([found[name] for name in JOINTS]) == pytest.approx(expected, abs=2e-5)


def test_bvh_holds_the_pose_over_a_gap_and_says_so(gappy: Path, tmp_path: Path) -> None:
    done = export_log(gappy, tmp_path / "a.bvh", options=CLASSIC)
    file = bvh.Bvh(done.path.read_text())
    held = [file.frames[frame] for frame in range(int(0.8 * 40), int(1.2 * 40))]
    assert all(pose == held[0] for pose in held)
    assert any("BVH has no gaps" in note for note in done.notes)


class Gltf:
    """A glTF file's nodes, set to one keyframe by the rules of the format."""

    def __init__(self, path: Path) -> None:
        self.file = pygltflib.GLTF2().load(str(path))
        self.names = [node.name for node in self.file.nodes]
        self.parent = {child: index for index, node in enumerate(self.file.nodes) for child in node.children or []}

    def array(self, accessor: int) -> np.ndarray:
        one = self.file.accessors[accessor]
        view = self.file.bufferViews[one.bufferView]
        kind = {pygltflib.FLOAT: np.float32, pygltflib.UNSIGNED_SHORT: np.uint16, pygltflib.UNSIGNED_BYTE: np.uint8}
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[one.type]
        data = self.file.binary_blob()[view.byteOffset:view.byteOffset + view.byteLength]
        return np.frombuffer(data, kind[one.componentType]).reshape(one.count, width)

    def times(self) -> np.ndarray:
        return self.array(self.file.animations[0].samplers[0].input)[:, 0]

    def worlds(self, key: int) -> list[np.ndarray]:
        """(4, 4) of every node."""
        local = [self._local(node, {}) for node in self.file.nodes]
        moved: dict[int, dict[str, np.ndarray]] = {}
        for channel in self.file.animations[0].channels:
            sampler = self.file.animations[0].samplers[channel.sampler]
            moved.setdefault(channel.target.node, {})[channel.target.path] = self.array(sampler.output)[key]
        for index, values in moved.items():
            local[index] = self._local(self.file.nodes[index], values)
        return [self._chain(index, local) for index in range(len(local))]

    def _local(self, node: pygltflib.Node, values: dict[str, np.ndarray]) -> np.ndarray:
        out = np.eye(4)
        out[:3, 3] = values.get("translation", node.translation or [0.0, 0.0, 0.0])
        turn = values.get("rotation", node.rotation or [0.0, 0.0, 0.0, 1.0])
        out[:3, :3] = Rotation.from_quat(turn).as_matrix() * values.get("scale", np.ones(3))
        return out

    def _chain(self, index: int, local: list[np.ndarray]) -> np.ndarray:
        return local[index] if index not in self.parent else self._chain(self.parent[index], local) @ local[index]


@pytest.mark.parametrize("tracker", ["classic", "estimator"])
def test_the_nodes_of_gltf_move_as_the_hand(tracker: str, log: Path, states_by: Callable[[str], HandStates],
                                            tmp_path: Path) -> None:
    options = ExportOptions(tracker="estimator" if tracker == "estimator" else "classic")
    file, states = Gltf(export_log(log, tmp_path / "a.glb", options=options).path), states_by(tracker)
    known = np.flatnonzero(states.tracked & np.isfinite(states.world_from_palm[:, 0, 0]))
    assert file.times() == pytest.approx(states.times_s[known], abs=1e-5), "a keyframe for every tracked state"
    rows = [file.names.index(name) for name in JOINTS]
    for key in range(0, len(known), 11):
        worlds = file.worlds(key)
        found = np.array([worlds[row][:3, 3] for row in rows])
        assert found == pytest.approx(states.joint_positions[known[key]] * Y_UP, abs=2e-6)


def test_the_skin_of_gltf_lies_on_the_hands_capsules(log: Path, states: HandStates, tmp_path: Path) -> None:
    file = Gltf(export_log(log, tmp_path / "a.glb", options=CLASSIC).path)
    attributes = file.file.meshes[0].primitives[0].attributes
    rest = file.array(attributes.POSITION)
    skin = file.file.skins[0]
    bind = file.array(skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
    joint, weight = file.array(attributes.JOINTS_0)[:, 0], file.array(attributes.WEIGHTS_0)
    assert (weight.sum(axis=1) == 1.0).all()
    key = len(file.times()) // 2
    worlds = file.worlds(key)
    bones = np.array([worlds[node] @ bind[index] for index, node in enumerate(skin.joints)])
    skinned = np.einsum("vij,vj->vi", bones[joint], np.column_stack([rest, np.ones(len(rest))]))[:, :3] * Y_UP
    number = np.flatnonzero(states.tracked)[key]
    model = build_model(LogReader(log).rig.hand)
    pose = HandPose(states.world_from_palm[number], states.angles[number])
    capsules = segments(model, pose, forward(model, pose))
    axis = capsules.end - capsules.start
    part = np.clip(np.einsum("vci,ci->vc", skinned[:, None] - capsules.start, axis) / np.sum(axis**2, axis=1), 0.0, 1.0)
    off = np.linalg.norm(skinned[:, None] - capsules.start - part[:, :, None] * axis, axis=2) - capsules.radius
    assert np.abs(off).min(axis=1).max() < 1e-5, "every vertex is on the surface of a posed capsule"


def test_another_reader_loads_the_surface(log: Path, tmp_path: Path) -> None:
    scene = trimesh.load(export_log(log, tmp_path / "a.glb", options=CLASSIC).path)
    (mesh,) = scene.geometry.values()
    assert mesh.is_watertight and mesh.volume > 0.0, "closed, and its triangles face outwards"
    assert 0.15 < mesh.extents.max() < 0.35, "a hand with a piece of forearm, in metres"


def test_no_keyframe_stands_in_a_gap(gappy: Path, tmp_path: Path) -> None:
    times = Gltf(export_log(gappy, tmp_path / "a.glb", options=CLASSIC).path).times()
    assert not ((times > 0.8) & (times < 1.2)).any() and (times > 1.5).any()


def test_gltf_can_be_one_text_file(log: Path, tmp_path: Path) -> None:
    path = export_log(log, tmp_path / "a.gltf", options=CLASSIC).path
    assert path.read_text().startswith("{")
    assert len(pygltflib.GLTF2().load(str(path)).animations[0].channels) == 17
