"""MCAP for ROS 2: joint angles, joint positions and frames as messages of ROS's own types, in CDR. Topics:
docs/export.md."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from rhot_app.errors import require
from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.export.formats.mcap_file import TimedMessages
from rhot_app.export.plan import Format, Plan
from rhot_app.export.states import HandStates, hands_of
from rhot_app.hand.skeleton import ANGLES

Message = dict[str, Any]

_RULE: Final = f"\n{'=' * 80}\n"
_HEADER: Final = (_RULE + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id"
                  + _RULE + "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec")
_POINTS: Final = (_RULE + "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z"
                  + _RULE + "MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1")
TYPES: Final = {
    "sensor_msgs/msg/JointState": "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
                                  "float64[] effort" + _HEADER,
    "geometry_msgs/msg/PoseArray": "std_msgs/Header header\ngeometry_msgs/Pose[] poses" + _HEADER + _RULE
                                   + "MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\n"
                                     "geometry_msgs/Quaternion orientation" + _POINTS,
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms" + _RULE
                              + "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
                                "geometry_msgs/Transform transform" + _HEADER + _RULE
                              + "MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\n"
                                "geometry_msgs/Quaternion rotation" + _RULE
                              + "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z" + _POINTS}
"""The definitions of the messages, as ROS 2 has them."""

_NO_TURN: Final = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}


class Ros2Writer(TimedMessages):
    """Streams messages; a hand that is not tracked has none, because ROS's types have no word for unknown."""

    def __init__(self, plan: Plan) -> None:
        require("mcap_ros2", "an MCAP file for ROS 2")
        from mcap_ros2.writer import Writer

        super().__init__(plan, Writer)
        self._types = {name: self._writer.register_msgdef(name, text) for name, text in TYPES.items()}
        first_ns = plan.first_ns + self._offset_ns
        self._send("/tf_static", "tf2_msgs/msg/TFMessage", first_ns, {"transforms": [
            _transform(first_ns, f"camera_{node.name}", node.pose.translation_m, node.pose.rotation_wxyz)
            for node in plan.rig.nodes]})

    def add(self, states: HandStates) -> None:
        """Write the messages of these states."""
        hands = hands_of(states)
        turns = {prefix: quaternion_from_rotation(hand.world_from_palm[:, :3, :3]) for prefix, hand in hands.items()}
        object_turns = [quaternion_from_rotation(one.world_from_object[:, :3, :3]) for one in states.objects]
        for number, t_master_ns in enumerate(states.t_master_ns.tolist()):
            t_ns, frames = t_master_ns + self._offset_ns, []
            for prefix, hand in hands.items():
                if not (hand.present[number] and np.isfinite(hand.joint_positions[number]).all()):
                    continue
                header = {"stamp": _time(t_ns), "frame_id": self._frame_id}
                self._send(f"/{prefix}hand/joint_states", "sensor_msgs/msg/JointState", t_ns, {
                    "header": header, "name": [f"{prefix}{angle}" for angle in ANGLES],
                    "position": hand.angles[number].tolist(), "velocity": [], "effort": []})
                self._send(f"/{prefix}hand/joints", "geometry_msgs/msg/PoseArray", t_ns, {
                    "header": header, "poses": [{"position": _vector(point), "orientation": _NO_TURN}
                                                for point in hand.joint_positions[number].tolist()]})
                frames.append(_transform(t_ns, f"{prefix}palm", hand.world_from_palm[number, :3, 3].tolist(),
                                         turns[prefix][number].tolist()))
            frames += [_transform(t_ns, one.name, one.world_from_object[number, :3, 3].tolist(), turn[number].tolist())
                       for one, turn in zip(states.objects, object_turns, strict=True)
                       if np.isfinite(one.world_from_object[number]).all()]
            if frames:
                self._send("/tf", "tf2_msgs/msg/TFMessage", t_ns, {"transforms": frames})

    def _send(self, topic: str, kind: str, t_ns: int, message: Message) -> None:
        self._writer.write_message(topic=topic, schema=self._types[kind], message=message, log_time=t_ns,
                                   publish_time=t_ns)


def _time(t_ns: int) -> Message:
    return {"sec": t_ns // 1_000_000_000, "nanosec": t_ns % 1_000_000_000}


def _vector(point: Any) -> Message:
    x, y, z = point
    return {"x": x, "y": y, "z": z}


def _transform(t_ns: int, child: str, place: Any, rotation_wxyz: Any) -> Message:
    w, x, y, z = rotation_wxyz
    return {"header": {"stamp": _time(t_ns), "frame_id": "rig"}, "child_frame_id": child,
            "transform": {"translation": _vector(place), "rotation": {"x": x, "y": y, "z": z, "w": w}}}


FORMATS = (Format("ros2", "MCAP: for ROS 2", Ros2Writer, (".mcap",), "m", units_free=False),)
