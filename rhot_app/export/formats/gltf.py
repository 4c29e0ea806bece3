"""glTF 2.0: a skinned hand with a skeleton whose animation plays in a viewer. Metres, y up; nodes: docs/export.md."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import ExportError, require
from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.export.formats.bones import PARENTS, TIPS, TURNING, Skeleton, skeleton_of
from rhot_app.export.frames import file_from_frame, frame_up
from rhot_app.export.plan import Format, Plan
from rhot_app.export.states import HandStates
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandModel, build_model
from rhot_app.hand.shape import segments
from rhot_app.hand.skeleton import ANGLES, FINGERS, JOINTS, HandPose
from rhot_app.project import OTHER_HAND

Array = NDArray[np.float64]
Compact = NDArray[np.float32]

SKIN = [0.80, 0.58, 0.47, 1.0]


class GltfWriter:
    """Keeps the poses while the hand is tracked, as keyframes: none stands in a gap."""

    def __init__(self, plan: Plan) -> None:
        require("pygltflib", "a glTF file")
        self.notes: list[str] = []
        self._plan = plan
        turn = file_from_frame(frame_up(plan.rig.up, plan.frame), "y-up")
        self._hands = [_Hand(plan, "", plan.rig.hand, turn)]
        self._turn = turn

    def add(self, states: HandStates) -> None:
        """Keep these poses."""
        other = self._plan.rig.other_hand
        if states.other is not None and other is not None and len(self._hands) == 1:
            self._hands.append(_Hand(self._plan, OTHER_HAND, other, self._turn))
        for hand, own in zip(self._hands, (states, states.other), strict=False):
            if own is not None:
                hand.add(own)

    def finish(self) -> None:
        """Write the file: GLB, or one JSON document where its name ends in .gltf."""
        import pygltflib

        if not any(hand.count for hand in self._hands):
            raise ExportError(f"{self._plan.log}: the hand is nowhere tracked, so there is no pose to animate.")
        build = _Build()
        for hand in self._hands:
            if hand.count:
                hand.build(build)
        file = build.file(self._plan)
        if self._plan.path.suffix == ".gltf":
            file.convert_buffers(pygltflib.BufferFormat.DATAURI)
            file.save_json(str(self._plan.path))
        else:
            file.save_binary(str(self._plan.path))

    def close(self) -> None:
        """Let go of the poses."""
        self._hands = []


class _Hand:
    """The keyframes of one hand: times (s), place (m) and rotations (xyzw) of the wrist, of the other joints, scale."""

    def __init__(self, plan: Plan, prefix: str, anatomy: HandAnatomy, turn: Array) -> None:
        self._plan, self._prefix, self._turn = plan, prefix, turn
        self._skeleton: Skeleton = skeleton_of(build_model(anatomy))
        self._keys: list[tuple[Compact, Compact, Compact, Compact]] = []

    @property
    def count(self) -> int:
        """How many keyframes there are."""
        return sum(len(key[0]) for key in self._keys)

    def add(self, states: HandStates) -> None:
        """Keep the poses in which the hand is tracked."""
        palm = states.world_from_palm
        known = states.present & np.isfinite(palm[:, 0, 0]) & np.isfinite(states.angles).all(axis=1)
        if not known.any():
            return
        turn, palm = self._turn, palm[known]
        if self._plan.frame == "wrist":
            palm = np.tile(np.eye(4), (len(palm), 1, 1))
        turned = np.concatenate([palm[:, None, :3, :3], self._skeleton.rotations(states.angles[known])], axis=1)
        turned = turn @ turned @ turn.T
        found = quaternion_from_rotation(turned.reshape(-1, 3, 3))[:, [1, 2, 3, 0]].reshape(len(palm), -1, 4)
        seconds = 1e-9 * (states.t_master_ns[known] - self._plan.first_ns)
        self._keys.append((seconds.astype(np.float32), (palm[:, :3, 3] @ turn.T).astype(np.float32),
                           found.astype(np.float32), states.hand_scale[known].astype(np.float32)))

    def build(self, build: _Build) -> None:
        """Add skeleton, surface and animation to the file."""
        times, places, rotations, scales = (np.concatenate(column) for column in zip(*self._keys, strict=True))
        rotations = _without_flips(rotations)
        nodes = build.skeleton(self._prefix, self._skeleton, self._turn)
        build.surface(self._prefix, self._skeleton, self._turn, nodes)
        clock = build.accessor(times, "SCALAR", limits=True)
        build.channel(nodes[0], "translation", clock, build.accessor(places, "VEC3"))
        for index, node in enumerate(nodes):
            build.channel(node, "rotation", clock, build.accessor(np.ascontiguousarray(rotations[:, index]), "VEC4"))
        if np.ptp(scales) > 0.0 or scales[0] != 1.0:
            build.channel(nodes[0], "scale", clock, build.accessor(np.repeat(scales[:, None], 3, axis=1), "VEC3"))


def _without_flips(rotations: Compact) -> Compact:
    """Quaternions (N, J, 4), each with the sign nearer to the one before, so that viewers turn the shorter way."""
    same = np.sum(rotations[1:] * rotations[:-1], axis=2) >= 0.0
    signs = np.cumprod(np.where(same, 1, -1), axis=0)
    return np.concatenate([rotations[:1], rotations[1:] * signs[:, :, None]]).astype(np.float32)


class _Build:
    """A glTF document that grows, and the bytes of its one buffer."""

    def __init__(self) -> None:
        import pygltflib

        self._lib: Any = pygltflib
        self._bytes = bytearray()
        self._file = pygltflib.GLTF2()
        self._file.materials = [pygltflib.Material(
            name="skin", pbrMetallicRoughness=pygltflib.PbrMetallicRoughness(
                baseColorFactor=SKIN, metallicFactor=0.0, roughnessFactor=0.8))]
        self._file.animations = [pygltflib.Animation(name="recording")]
        self._file.scenes = [pygltflib.Scene(nodes=[])]
        self._file.scene = 0

    def accessor(self, array: NDArray[Any], kind: str, *, limits: bool = False, target: int | None = None) -> int:
        """Add an array; returns its accessor. `limits`: with its least and greatest values."""
        data = np.ascontiguousarray(array)
        codes = {"f": self._lib.FLOAT, "u1": self._lib.UNSIGNED_BYTE, "u2": self._lib.UNSIGNED_SHORT}
        code = codes["f" if data.dtype.kind == "f" else f"u{data.dtype.itemsize}"]
        self._bytes += bytes(-len(self._bytes) % 4)
        self._file.bufferViews.append(self._lib.BufferView(
            buffer=0, byteOffset=len(self._bytes), byteLength=data.nbytes, target=target))
        self._bytes += data.tobytes()
        low = np.atleast_1d(data.min(axis=0)).tolist() if limits else None
        high = np.atleast_1d(data.max(axis=0)).tolist() if limits else None
        count = data.size if kind == "SCALAR" else len(data)
        self._file.accessors.append(self._lib.Accessor(
            bufferView=len(self._file.bufferViews) - 1, componentType=code, count=count, type=kind, min=low, max=high))
        return len(self._file.accessors) - 1

    def skeleton(self, prefix: str, skeleton: Skeleton, turn: Array) -> list[int]:
        """Add the nodes of a hand; returns those of the 16 turning joints. Tips are nodes without a rotation."""
        first = len(self._file.nodes)
        nodes = list(range(first, first + len(TURNING)))
        for index, joint in enumerate(TURNING):
            children = [nodes[child] for child, parent in enumerate(PARENTS) if parent == index]
            if joint + 1 in TIPS:
                children.append(first + len(TURNING) + TIPS.index(joint + 1))
            self._file.nodes.append(self._lib.Node(
                name=prefix + JOINTS[joint], children=children,
                translation=(turn @ skeleton.offsets[index]).tolist(), rotation=[0.0, 0.0, 0.0, 1.0]))
        self._file.nodes += [self._lib.Node(name=prefix + JOINTS[tip], translation=(turn @ offset).tolist())
                             for tip, offset in zip(TIPS, skeleton.tips, strict=True)]
        self._file.scenes[0].nodes.append(first)
        return nodes

    def surface(self, prefix: str, skeleton: Skeleton, turn: Array, nodes: list[int]) -> None:
        """Add the skinned mesh of a hand."""
        mesh, lib = mesh_of(skeleton.model), self._lib
        bind = np.tile(np.eye(4, dtype=np.float32), (len(nodes), 1, 1))
        bind[:, 3, :3] = -skeleton.rest[list(TURNING)] @ turn.T  # column-major: the last row is the translation
        joints = np.zeros((len(mesh.bone), 4), np.uint8)
        joints[:, 0] = mesh.bone
        weights = np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (len(mesh.bone), 1))
        attributes = lib.Attributes(
            POSITION=self.accessor((mesh.vertices @ turn.T).astype(np.float32), "VEC3", limits=True,
                                   target=lib.ARRAY_BUFFER),
            NORMAL=self.accessor((mesh.normals @ turn.T).astype(np.float32), "VEC3", target=lib.ARRAY_BUFFER),
            JOINTS_0=self.accessor(joints, "VEC4", target=lib.ARRAY_BUFFER),
            WEIGHTS_0=self.accessor(weights, "VEC4", target=lib.ARRAY_BUFFER))
        corners = self.accessor(mesh.triangles.astype(np.uint16).reshape(-1), "SCALAR",
                                target=lib.ELEMENT_ARRAY_BUFFER)
        self._file.meshes.append(lib.Mesh(name=f"{prefix}hand", primitives=[lib.Primitive(
            attributes=attributes, indices=corners, material=0)]))
        self._file.skins.append(lib.Skin(name=f"{prefix}hand", joints=nodes, skeleton=nodes[0],
                                         inverseBindMatrices=self.accessor(bind.reshape(-1, 16), "MAT4")))
        self._file.nodes.append(lib.Node(name=f"{prefix}hand", mesh=len(self._file.meshes) - 1,
                                         skin=len(self._file.skins) - 1))
        self._file.scenes[0].nodes.append(len(self._file.nodes) - 1)

    def channel(self, node: int, path: str, clock: int, values: int) -> None:
        """Animate one property of a node."""
        animation = self._file.animations[0]
        animation.samplers.append(self._lib.AnimationSampler(input=clock, output=values, interpolation="LINEAR"))
        animation.channels.append(self._lib.AnimationChannel(
            sampler=len(animation.samplers) - 1, target=self._lib.AnimationChannelTarget(node=node, path=path)))

    def file(self, plan: Plan) -> Any:
        """The whole document with its buffer."""
        self._file.asset = self._lib.Asset(version="2.0", generator="RHOT")
        self._file.extras = plan.about()
        self._bytes += bytes(-len(self._bytes) % 4)
        self._file.buffers = [self._lib.Buffer(byteLength=len(self._bytes))]
        self._file.set_binary_blob(bytes(self._bytes))
        return self._file


# -- a hand's surface for skinned animation ----------------------------------------------------------------------------

Indices = NDArray[np.int64]

AROUND: Final = 14  # corners of a capsule's cross-section
RINGS: Final = 4  # of each round end, the pole apart


@dataclass(frozen=True, slots=True)
class HandMesh:
    """The surface at zero angles, palm frame, m: `vertices` (V, 3), outward unit `normals` (V, 3), `triangles` (T, 3)
    counterclockwise seen from outside, and the `bone` (V,) that each vertex rides on, an index into TURNING."""

    vertices: Array
    normals: Array
    triangles: Indices
    bone: Indices


def mesh_of(model: HandModel) -> HandMesh:
    """The surface of a hand."""
    pose = HandPose(np.eye(4), np.zeros(len(ANGLES)))
    capsules = segments(model, pose, forward(model, pose))
    vertices, normals, triangles, bones = [], [], [], []
    count = 0
    for name, start, end, radius in zip(capsules.names, capsules.start, capsules.end, capsules.radius, strict=True):
        points, directions, faces = _capsule(start, end, float(radius))
        vertices.append(points)
        normals.append(directions)
        triangles.append(faces + count)
        bones.append(np.full(len(points), _bone(name)))
        count += len(points)
    return HandMesh(np.concatenate(vertices), np.concatenate(normals), np.concatenate(triangles), np.concatenate(bones))


def _bone(capsule: str) -> int:
    """The turning joint behind which a capsule lies: the first bone of a finger turns at its base joint."""
    finger, _, segment = capsule.partition("_")
    if finger not in FINGERS:
        return 0
    first = ("metacarpal", "proximal", "distal") if finger == "thumb" else ("proximal", "medial", "distal")
    number = 1 if segment == "neck" else first.index(segment)
    base = JOINTS.index("thumb_cmc" if finger == "thumb" else f"{finger}_mcp")
    return TURNING.index(base + number)


def _capsule(start: Array, end: Array, radius: float) -> tuple[Array, Array, Indices]:
    """Vertices, normals and triangles of one capsule."""
    axis = end - start
    length = float(np.linalg.norm(axis))
    along = axis / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
    side = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    side /= np.linalg.norm(side)
    turns = 2.0 * np.pi * np.arange(AROUND) / AROUND
    around = np.cos(turns)[:, None] * side + np.sin(turns)[:, None] * np.cross(along, side)
    heights = 0.5 * np.pi * np.arange(1, RINGS + 1) / RINGS  # from the pole to the equator
    rings = [-np.cos(height) * along + np.sin(height) * around for height in heights]
    rings += [np.cos(height) * along + np.sin(height) * around for height in heights[::-1]]
    normals = np.concatenate([[-along], *rings, [along]])
    centres = np.repeat([start, end], 1 + RINGS * AROUND, axis=0)
    return centres + radius * normals, normals, _faces(2 * RINGS)


def _faces(rings: int) -> Indices:
    """Triangles between a first pole, `rings` rings and a last pole."""
    here = np.arange(AROUND)
    after = (here + 1) % AROUND
    first, last = 1 + here, 1 + (rings - 1) * AROUND
    faces = [np.column_stack([np.zeros(AROUND, np.int64), 1 + after, first])]
    for ring in range(rings - 1):
        low, high = 1 + ring * AROUND, 1 + (ring + 1) * AROUND
        faces += [np.column_stack([low + here, low + after, high + after]),
                  np.column_stack([low + here, high + after, high + here])]
    faces.append(np.column_stack([np.full(AROUND, 1 + rings * AROUND), last + here, last + after]))
    return np.concatenate(faces)


FORMATS = (Format("gltf", "glTF: an animated hand", GltfWriter, (".glb", ".gltf"), "m", units_free=False),)
