"""An engine without processes or sockets: the client's interface, and a synthetic hand that opens and closes.

`FakeClient.poll` gives the states due since the last call at `rate_hz` by the clock that is passed in, so that a test
can move time by hand.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np

from rhot_app.engine.advice import NodeFacts, calibration_advice, node_advice
from rhot_app.engine.node_meter import Recent
from rhot_app.engine.status import Advice, EngineStatus, LatencySummary, NodeStatus, Preview
from rhot_app.errors import EngineError
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import ANGLES, JOINTS, HandPose
from rhot_app.outputs.spec import OutputStatus, as_run
from rhot_app.project import CameraCalibration, CameraPose, Intrinsics, Rig, RigNode, parse_rig
from rhot_app.rig_history import accept
from rhot_app.state import LATENCY_STAGES, UNESTIMATED, Condition, HandState, Knowledge
from rhot_node.files import resource_path
from rhot_node.markers import load_markers
from rhot_node.wire.messages import MarkerFlag

EXACT = CameraCalibration("exact", error_m=0.0)
NOISE_M = np.array([0.0001, 0.0001, 0.0006])
_STAGE_S = (0.0031, 0.0004, 0.0042, 0.00006, 0.00009, 0.00021, 0.00008, 0.0006)


def synthetic_rig(name: str = "test bench", calibration: CameraCalibration | None = EXACT) -> Rig:
    """Two cameras 75 mm apart, known exactly unless `calibration` says otherwise, six colours, an adult right hand."""
    lens = Intrinsics(width=640, height=480, fx=530.0, fy=530.0, cx=319.5, cy=239.5)
    nodes = (RigNode(node_id=1, name="left", intrinsics=lens),
             RigNode(node_id=2, name="right", intrinsics=lens, pose=CameraPose(translation_m=(0.075, 0.0, 0.0))))
    return Rig(name=name, nodes=nodes, markers=load_markers(resource_path("markers", "rhot6.json")),
               hand=load_hand(resource_path("hands", "right.json")), calibration=calibration)


def world_from_palm(t_s: float) -> np.ndarray:
    """A palm that faces the cameras at 0.55 m, fingers up, swaying."""
    turn = 0.25 * math.sin(0.9 * t_s)
    back = np.array([math.sin(turn), 0.12, math.cos(turn)])
    back /= np.linalg.norm(back)
    up = np.array([0.05 * math.sin(0.7 * t_s), -1.0, 0.0])
    x = up - back * (up @ back)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(back, x), back], axis=1)
    pose[:3, 3] = (0.03 + 0.04 * math.sin(0.6 * t_s), 0.06, 0.55 + 0.02 * math.cos(0.8 * t_s))
    return pose


def hand_pose(t_s: float) -> HandPose:
    """Fingers that open and close one after the other."""
    angles = np.zeros(len(ANGLES))
    for number, name in enumerate(ANGLES):
        if "flexion" in name:
            phase = 0.8 * t_s - 0.5 * ["thumb", "index", "middle", "ring", "little"].index(name.split("_")[0])
            bend = 0.5 - 0.5 * math.cos(phase)
            angles[number] = (0.25 if name.startswith("thumb") else 0.6) * bend + 0.12
    return HandPose(world_from_palm(t_s), angles)


class FakeEngine:
    """What the engine would do; commands and trouble are set as attributes by the tests."""

    def __init__(self, rig: Rig | None = None, *, rate_hz: float = 40.0, running: bool = True,
                 clock: Callable[[], float] = time.monotonic) -> None:
        self.rig = rig or synthetic_rig()
        self.rate_hz = rate_hz
        self.running = running
        self.clock = clock
        self.hidden: dict[str, str] = {}  # marker id -> "left", "right" or "both": who does not see it
        self.advice: tuple[Advice, ...] = ()
        self.black: tuple[str, ...] = ()  # cameras whose picture is black
        self.node_words = {node.name: "ready" for node in self.rig.nodes}
        self.lost = {node.name: 0 for node in self.rig.nodes}
        self.dead = False
        self.log_path = ""
        self.replaying = ""
        self.rig_path = ""
        self.outputs: dict[str, OutputStatus] = {}  # by spec: outputs that go otherwise than well
        self.refuse_rig = ""  # why the engine takes no other rig
        self.scale = (1.03, 0.017)  # what a floating hand's size is estimated to be
        self.commands: list[tuple[str, dict[str, Any]]] = []
        self.sequence = 0
        self.session = 1
        self._model = build_model(self.rig.hand)
        self._random = np.random.default_rng(7)

    def condition(self) -> Condition:
        """As the tracker would judge."""
        if not self.running:
            return Condition.IDLE
        missing = len(self.hidden)
        if missing == 0:
            return Condition.TRACKING
        return Condition.PARTIAL if missing < 4 else Condition.LOST

    def state(self, t_s: float) -> HandState:
        """The hand at `t_s`."""
        self.sequence += 1
        pose = hand_pose(t_s)
        points = forward(self._model, pose)
        truth = np.vstack([points.marker_centres, points.joints[:1]])
        count = len(truth)
        raw = truth + NOISE_M * self._random.standard_normal((count, 3))
        pixels, flags, knowledge = self._sights(raw)
        unseen = knowledge == Knowledge.UNKNOWN
        joint_knowledge, angle_knowledge, palm_knowledge = self._kinds(knowledge)
        latency = {stage: value * (1 + 0.25 * abs(self._random.standard_normal()))
                   for stage, value in zip(LATENCY_STAGES, _STAGE_S, strict=True)}
        return HandState(
            sequence=self.sequence, t_master_ns=round(t_s * 1e9), t_receive_ns=round(t_s * 1e9) + 5_000_000,
            condition=self.condition(), marker_ids=self.rig.markers.ids,
            marker_positions=np.where(unseen[:, None], np.nan, truth),
            marker_raw_positions=np.where(unseen[:, None], np.nan, raw),
            marker_covariances=np.tile(np.diag((3.0 * NOISE_M) ** 2), (count, 1, 1)), marker_knowledge=knowledge,
            camera_names=tuple(node.name for node in self.rig.nodes), camera_pixels=pixels, camera_flags=flags,
            joint_positions=points.joints, joint_knowledge=joint_knowledge,
            fingertip_positions=points.marker_centres, angles=pose.angles, angle_knowledge=angle_knowledge,
            world_from_palm=pose.world_from_palm, palm_knowledge=palm_knowledge,
            epipolar_error_px=np.full(count, 0.12), **self._estimated(), latency_s=latency)

    def _estimated(self) -> dict[str, Any]:
        """What the estimator adds: fingers that grow less certain from the thumb on, and the hand's size."""
        if self.rig.tracker.kind == "classic":
            return UNESTIMATED
        spread = np.repeat([1.0, 1.0, 1.5, 3.0, 8.0, 20.0], [1, 4, 4, 4, 4, 4])
        scale = {"hand_scale": self.scale[0], "hand_scale_sd": self.scale[1]} if self.rig.tracker.float_scale else {
            "hand_scale": 1.0, "hand_scale_sd": 0.0}
        return {"joint_covariances": np.diag(NOISE_M**2) * (spread**2)[:, None, None],
                "fingertip_covariances": np.diag(NOISE_M**2) * (spread[4::4]**2)[:, None, None],
                "angle_sd": np.radians(np.repeat([1.0, 1.0, 3.0, 8.0, 20.0], [5, 4, 4, 4, 4])),
                "palm_covariance": np.diag([4e-4, 4e-4, 5e-4, 0.01, 0.01, 0.02]) ** 2,
                "velocity": np.repeat([0.1, 0.0], [3, 24]), "acceleration": np.zeros(27),
                "velocity_sd": np.full(27, 0.01), "joint_velocity_sd": np.full(21, 0.01),
                "acceleration_sd": np.full(27, 0.1), "joint_acceleration_sd": np.full(21, 0.1), **scale}

    def _kinds(self, knowledge: np.ndarray) -> tuple[np.ndarray, np.ndarray, Knowledge]:
        """How joints, angles and palm are known, from how the markers are."""
        if self.rig.tracker.kind == "classic":
            joints = np.full(len(JOINTS), Knowledge.INFERRED, np.uint8)
            joints[[4, 8, 12, 16, 20]] = np.where(knowledge[:5] == Knowledge.MEASURED, Knowledge.MEASURED,
                                                  Knowledge.GUESSED)
            angles = np.full(len(ANGLES), Knowledge.INFERRED, np.uint8)
            angles[[5, 9, 13, 17]] = Knowledge.GUESSED
            return joints, angles, Knowledge.GUESSED
        fingers = [Knowledge.MEASURED] * 3 + [Knowledge.INFERRED, Knowledge.GUESSED]
        joints = np.repeat([Knowledge.MEASURED, *fingers], [1, 4, 4, 4, 4, 4]).astype(np.uint8)
        return joints, np.repeat(fingers, [5, 4, 4, 4, 4]).astype(np.uint8), Knowledge.MEASURED

    def _sights(self, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        pixels = np.full((len(self.rig.nodes), len(positions), 2), np.nan)
        flags = np.zeros(pixels.shape[:2], np.uint16)
        knowledge = np.full(len(positions), Knowledge.MEASURED, np.uint8)
        for camera, node in enumerate(self.rig.nodes):
            seen = positions - np.asarray(node.pose.translation_m)
            lens = node.intrinsics
            pixels[camera] = np.stack([lens.fx * seen[:, 0] / seen[:, 2] + lens.cx,
                                       lens.fy * seen[:, 1] / seen[:, 2] + lens.cy], axis=1)
            for marker, name in enumerate(self.rig.markers.ids):
                if self.hidden.get(name) in (node.name, "both"):
                    pixels[camera, marker] = np.nan
                    flags[camera, marker] = int(MarkerFlag.LOST)
                    knowledge[marker] = Knowledge.UNKNOWN if self.hidden[name] == "both" else Knowledge.INFERRED
        return pixels, flags, knowledge

    def status(self, t_s: float) -> EngineStatus:
        """The engine about itself."""
        nodes = tuple(NodeStatus(
            node_id=node.node_id, name=node.name, text_datagrams=False,
            state="streaming" if self.running and self.node_words[node.name] == "ready"
            else self.node_words[node.name],  # type: ignore[arg-type]
            rate_hz=self.rate_hz if self.running and self.node_words[node.name] == "ready" else 0.0,
            received=self.sequence, lost=self.lost[node.name], dropped={}, clock_offset_s=3.2 + node.node_id,
            clock_bound_s=0.00011, clock_round_trip_s=0.0002,
            message="" if self.node_words[node.name] != "silent" else "Nothing heard from 127.0.0.1 for 2 s.")
            for node in self.rig.nodes)
        return EngineStatus(
            t_master_ns=round(t_s * 1e9), pid=4242, session=self.session, running=self.running,
            condition=self.condition().value, rig_name=self.rig.name, rig_path=self.rig_path,
            state_rate_hz=self.rate_hz if self.running else 0.0, nodes=nodes,
            advice=(*self.advice, *self._sight_advice(nodes), *calibration_advice(self.rig)),
            latency={stage: LatencySummary(value, 1.4 * value)
                     for stage, value in zip(LATENCY_STAGES, _STAGE_S, strict=True)},
            log_path=self.log_path, log_bytes=120_000 if self.log_path else 0,
            outputs=tuple(self.outputs.get(one.spec, OutputStatus(one.spec, one.kind, "running", sent=self.sequence))
                          for one in map(as_run, self.rig.outputs) if one.enabled),
            replaying=self.replaying)

    def _sight_advice(self, nodes: tuple[NodeStatus, ...]) -> list[Advice]:
        """What the engine says of cameras that see nothing because their picture is black."""
        ids = self.rig.markers.ids
        return [advice for node in nodes if node.name in self.black for advice in node_advice(
            NodeFacts(replace(node, paired=True), Recent(80, 0, {}, 0), "127.0.0.1", 1, (640, 480), None, 1, 1,
                      (9.0,) * len(ids), False, 0.0, black=True), ids, self.running)]

    def preview(self, camera: int, t_s: float) -> Preview:
        """A picture of the hand as a camera would see it, skin and painted tips on a desk, and what is in it."""
        node = self.rig.nodes[camera]
        points = forward(self._model, hand_pose(t_s))
        image = np.full((240, 320, 3), (58, 62, 66), np.uint8)
        cv2.rectangle(image, (20, 150), (130, 239), (70, 84, 96), -1)
        def at(point: np.ndarray) -> tuple[int, int]:
            p = point - np.asarray(node.pose.translation_m)
            return (round(0.5 * (530 * p[0] / p[2] + 319.5)), round(0.5 * (530 * p[1] / p[2] + 239.5)))
        joints = points.joints
        hull = cv2.convexHull(np.array([at(joints[k]) for k in (0, 1, 5, 9, 13, 17)], np.int32))
        cv2.fillConvexPoly(image, hull, (120, 150, 190))
        for finger in range(5):
            chain = [at(joints[k]) for k in range(1 + 4 * finger, 5 + 4 * finger)]
            for a, b in itertools.pairwise(chain):
                cv2.line(image, a, b, (120, 150, 190), 10, cv2.LINE_AA)
        for marker, place in zip(self.rig.markers.markers, [*points.marker_centres, joints[0]], strict=True):
            cv2.circle(image, at(place), 6, marker.display_rgb[::-1], -1, cv2.LINE_AA)
        _, jpeg = cv2.imencode(".jpg", image)
        pixels, flags, _ = self._sights(np.vstack([points.marker_centres, joints[:1]]))
        t_ns = round(t_s * 1e9)
        return Preview(node.name, t_ns, 640, 480, jpeg.tobytes(), t_ns, pixels[camera], flags[camera])


class FakeClient:
    """The client's side of `FakeEngine`."""

    def __init__(self, engine: FakeEngine) -> None:
        self.engine = engine
        self.closed = False
        self._next_state = self._next_status = self._next_preview = engine.clock()

    def poll(self) -> list[HandState | EngineStatus | Preview]:
        """Everything due since the last call."""
        engine, now = self.engine, self.engine.clock()
        messages: list[HandState | EngineStatus | Preview] = []
        if engine.dead:
            self._next_state = self._next_status = self._next_preview = now
            return messages
        self._next_state = max(self._next_state, now - 1.0)  # of a longer absence the last second is told
        while self._next_state <= now:
            if engine.running and engine.condition() is not Condition.LOST:
                messages.append(engine.state(self._next_state))
            self._next_state += 1.0 / engine.rate_hz
        self._next_status = max(self._next_status, now - 1.0)
        while self._next_status <= now:
            messages.append(engine.status(self._next_status))
            self._next_status += 0.1
        self._next_preview = max(self._next_preview, now - 0.25)
        while self._next_preview <= now:
            messages += [engine.preview(camera, self._next_preview) for camera in range(len(engine.rig.nodes))]
            self._next_preview += 0.25
        return messages

    def command(self, name: str, **args: Any) -> dict[str, Any]:
        """Start, stop, and tell or save the rig as the engine would; raises EngineError when it is dead."""
        if self.engine.dead:
            raise EngineError("The engine does not answer.")
        if name == "rig":
            return {"document": msgspec.to_builtins(self.engine.rig), "path": self.engine.rig_path}
        self.engine.commands.append((name, args))
        if name in ("start", "stop"):
            self.engine.running = name == "start"
        if name == "set_rig":
            if self.engine.refuse_rig:
                raise EngineError(self.engine.refuse_rig)
            self.engine.rig = parse_rig(msgspec.json.encode(args["document"]), "the new rig")
        if name == "record":
            Path(args["path"]).write_bytes(bytes(120_000))
            self.engine.log_path = args["path"]
        if name == "record_stop":
            self.engine.log_path = ""
        if name == "save_rig":
            accept(Path(self.engine.rig_path), self.engine.rig, "a change")
            return {"path": self.engine.rig_path}
        return {}

    def close(self) -> None:
        """Nothing is held."""
        self.closed = True
