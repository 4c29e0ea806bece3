"""MCAP, as Foxglove plays it: every state, the hand as a scene, and the frames. Channels: docs/export.md.

The schemas of the scene and the frames are Foxglove's, by its names of messages and fields.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, BinaryIO, Final

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import require
from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.export.plan import Format, Plan
from rhot_app.export.states import CONDITIONS, OBJECT_ARRAYS, VALIDITIES, HandStates, hands_of
from rhot_app.hand.skeleton import FINGERS

Array = NDArray[np.float64]
Message = dict[str, Any]
Schema = dict[str, Any]

_BONES: Final = [pair for finger in range(len(FINGERS)) for first in (1 + 4 * finger,)
                 for pair in ((0, first), (first, first + 1), (first + 1, first + 2), (first + 2, first + 3))]
_ORIGIN: Final[Message] = {"position": {"x": 0.0, "y": 0.0, "z": 0.0},
                           "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}
_JOINT_COLOR, _MARKER_COLOR = (0.85, 0.85, 0.9), (1.0, 0.55, 0.1)
_OPACITY: Final = (1.0, 0.6, 0.3, 0.0, 0.3)  # by knowledge, as in the app's scene; the last: filled in
_JOINT_M, _MARKER_M, _LINE_M = 0.008, 0.014, 0.004
_MATCHING_ID, _LINE_LIST = 0, 2


def _object(**properties: Schema) -> Schema:
    return {"type": "object", "properties": properties}


def _list(items: Schema, count: int | None = None) -> Schema:
    return {"type": "array", "items": items} | ({} if count is None else {"minItems": count, "maxItems": count})


_NUMBER: Final[Schema] = {"type": "number"}
_WHOLE: Final[Schema] = {"type": "integer"}
_TEXT: Final[Schema] = {"type": "string"}
_MAYBE: Final[Schema] = {"type": ["number", "null"]}  # null: unknown
_TIME: Final[Schema] = {"title": "time", **_object(sec=_WHOLE, nsec=_WHOLE)}
_DURATION: Final[Schema] = {"title": "duration", **_object(sec=_WHOLE, nsec=_WHOLE)}
_VECTOR: Final[Schema] = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION: Final[Schema] = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE: Final[Schema] = _object(position=_VECTOR, orientation=_QUATERNION)
_COLOR: Final[Schema] = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)

FRAME_TRANSFORMS: Final[Schema] = {"title": "foxglove.FrameTransforms", **_object(transforms=_list(_object(
    timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_VECTOR, rotation=_QUATERNION)))}

_ENTITY: Final[Schema] = _object(
    timestamp=_TIME, frame_id=_TEXT, id=_TEXT, lifetime=_DURATION, frame_locked={"type": "boolean"},
    metadata=_list(_object(key=_TEXT, value=_TEXT)),
    arrows=_list({"type": "object"}), cubes=_list({"type": "object"}),
    spheres=_list(_object(pose=_POSE, size=_VECTOR, color=_COLOR)), cylinders=_list({"type": "object"}),
    lines=_list(_object(type=_WHOLE, pose=_POSE, thickness=_NUMBER, scale_invariant={"type": "boolean"},
                        points=_list(_VECTOR), color=_COLOR, colors=_list(_COLOR), indices=_list(_WHOLE))),
    triangles=_list({"type": "object"}), texts=_list({"type": "object"}), models=_list({"type": "object"}))

SCENE_UPDATE: Final[Schema] = {"title": "foxglove.SceneUpdate", **_object(
    deletions=_list(_object(timestamp=_TIME, type=_WHOLE, id=_TEXT)), entities=_list(_ENTITY))}


def hand_state(markers: int) -> Schema:
    """The schema of ``rhot.HandState``: the fields of docs/states.md, metres and radians; null is unknown."""
    point, matrix = _list(_MAYBE, 3), _list(_list(_MAYBE, 3), 3)
    hand = {
        "condition": {"enum": [condition.value for condition in CONDITIONS]},
        "joint_positions": _list(point, 21), "joint_covariances": _list(matrix, 21),
        "joint_knowledge": _list(_WHOLE, 21),
        "fingertip_positions": _list(point, 5), "fingertip_covariances": _list(matrix, 5),
        "angles": _list(_MAYBE, 21), "angle_sd": _list(_MAYBE, 21), "angle_knowledge": _list(_WHOLE, 21),
        "world_from_palm": _list(_list(_MAYBE, 4), 4), "palm_covariance": _list(_list(_MAYBE, 6), 6),
        "palm_knowledge": _WHOLE, "hand_scale": _MAYBE, "hand_scale_sd": _MAYBE}
    return {"title": "rhot.HandState", **_object(
        sequence=_WHOLE, t_master_ns=_WHOLE, marker_ids=_list(_TEXT, markers),
        marker_positions=_list(point, markers), marker_raw_positions=_list(point, markers),
        marker_covariances=_list(matrix, markers), marker_knowledge=_list(_WHOLE, markers),
        epipolar_error_px=_list(_MAYBE, markers), other=_object(**hand), **hand)}


OBJECT_STATES: Final[Schema] = {"title": "rhot.ObjectStates", **_object(
    t_master_ns=_WHOLE, objects=_list(_object(
        name=_TEXT, validity={"enum": [validity.value for validity in VALIDITIES]},
        world_from_object=_list(_list(_MAYBE, 4), 4), covariance=_list(_list(_MAYBE, 6), 6),
        velocity=_list(_MAYBE, 6), distances=_list(_MAYBE, 5), distance_sd=_list(_MAYBE, 5),
        contacts=_list(_WHOLE, 5))))}
"""The schema of ``rhot.ObjectStates``: the fields of docs/objects.md, metres and radians; null is unknown."""

OF_HAND: Final = tuple(name for name in hand_state(0)["properties"]
                       if name in HandStates.__slots__ and not name.startswith(("marker", "sequence", "t_", "epi"))
                       and name not in ("condition", "other", "objects"))
"""The arrays that each hand has for itself."""


class TimedMessages:
    """Messages on their way to an MCAP file, by a writer of the library's; their time is the wall clock's, of logs that
    say when they were begun."""

    def __init__(self, plan: Plan, make_writer: Callable[[BinaryIO], Any]) -> None:
        self.notes: list[str] = []
        if plan.wall_clock_offset_ns is None:
            self.notes.append("the log does not say when it was begun; the file's times are of the master's own clock")
        self._offset_ns = plan.wall_clock_offset_ns or 0
        self._frame_id = "rig" if plan.frame == "rig" else "palm"
        self._file = plan.path.open("wb")
        self._writer = make_writer(self._file)

    def finish(self) -> None:
        """Write the index."""
        self._writer.finish()
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class McapWriter(TimedMessages):
    """Every state as Foxglove's messages, in JSON."""

    def __init__(self, plan: Plan) -> None:
        require("mcap", "an MCAP file")
        from mcap.writer import Writer

        super().__init__(plan, Writer)
        self._encode = msgspec.json.Encoder().encode
        self._writer.start(profile="", library="rhot")
        self._writer.add_metadata("rhot", plan.about())
        self._channels = {
            "/tf_static": self._channel("/tf_static", "foxglove.FrameTransforms", FRAME_TRANSFORMS),
            "/tf": self._channel("/tf", "foxglove.FrameTransforms", FRAME_TRANSFORMS),
            "/hand/scene": self._channel("/hand/scene", "foxglove.SceneUpdate", SCENE_UPDATE),
            "/hand/state": self._channel("/hand/state", "rhot.HandState", hand_state(len(plan.rig.markers.ids)))}
        if plan.rig.objects:
            self._channels["/objects/state"] = self._channel("/objects/state", "rhot.ObjectStates", OBJECT_STATES)
        first_ns = plan.first_ns + self._offset_ns
        self._send("/tf_static", first_ns, {"transforms": [
            _transform(first_ns, f"camera_{node.name}", node.pose.translation_m, node.pose.rotation_wxyz)
            for node in plan.rig.nodes]})

    def _channel(self, topic: str, name: str, schema: Message) -> int:
        number = self._writer.register_schema(name=name, encoding="jsonschema", data=self._encode(schema))
        return int(self._writer.register_channel(topic=topic, message_encoding="json", schema_id=number))

    def add(self, states: HandStates) -> None:
        """Write the messages of these states."""
        hands = list(hands_of(states).items())
        turns = [quaternion_from_rotation(hand.world_from_palm[:, :3, :3]).tolist() for _, hand in hands]
        object_turns = [quaternion_from_rotation(one.world_from_object[:, :3, :3]).tolist() for one in states.objects]
        object_tables: list[dict[str, list[Any]]] = [
            {"name": [one.name] * len(states), **{name: getattr(one, name).tolist() for name in OBJECT_ARRAYS},
             "validity": list(one.validities)} for one in states.objects]
        there_is = [hand.present for _, hand in hands]
        tables = [_rows(states, with_markers=True)] + [_rows(hand) for _, hand in hands[1:]]
        for number, t_master_ns in enumerate(states.t_master_ns.tolist()):
            t_ns = t_master_ns + self._offset_ns
            rows = [{name: column[number] for name, column in table.items()} for table in tables]
            self._send("/hand/state", t_ns, rows[0] | ({"other": rows[1]} if len(rows) > 1 else {}))
            shown = [present[number] and row["joint_positions"][0][0] == row["joint_positions"][0][0]
                     for present, row in zip(there_is, rows, strict=True)]
            names = [f"{prefix}hand" for prefix, _ in hands]
            self._send("/hand/scene", t_ns, {
                "deletions": [{"timestamp": _time(t_ns), "type": _MATCHING_ID, "id": name}
                              for name, there in zip(names, shown, strict=True) if not there],
                "entities": [_entity(t_ns, name, row, self._frame_id)
                             for name, row, there in zip(names, rows, shown, strict=True) if there]})
            frames = [_transform(t_ns, f"{prefix}palm", hand.world_from_palm[number, :3, 3].tolist(), turn[number])
                      for (prefix, hand), turn, there in zip(hands, turns, shown, strict=True) if there]
            frames += [_transform(t_ns, one.name, one.world_from_object[number, :3, 3].tolist(), turn[number])
                       for one, turn in zip(states.objects, object_turns, strict=True)
                       if np.isfinite(one.world_from_object[number]).all()]
            if states.objects:
                self._send("/objects/state", t_ns, {"t_master_ns": t_master_ns, "objects": [
                    {name: column[number] for name, column in table.items()} for table in object_tables]})
            if frames:
                self._send("/tf", t_ns, {"transforms": frames})

    def _send(self, topic: str, t_ns: int, message: Message) -> None:
        self._writer.add_message(channel_id=self._channels[topic], log_time=t_ns, publish_time=t_ns,
                                 data=self._encode(message))


def _rows(states: HandStates, *, with_markers: bool = False) -> dict[str, list[Any]]:
    """The columns of a hand as lists, by the names of the message's fields."""
    names = OF_HAND
    table: dict[str, list[Any]] = {"condition": list(states.conditions)}
    if with_markers:
        names += ("sequence", "t_master_ns", "marker_positions", "marker_raw_positions", "marker_covariances",
                  "marker_knowledge", "epipolar_error_px")
        table["marker_ids"] = [states.marker_ids] * len(states)
    return table | {name: getattr(states, name).tolist() for name in names}


def _entity(t_ns: int, name: str, row: Message, frame_id: str) -> Message:
    """A hand of joints and bones, and the markers that are seen."""
    joints = row["joint_positions"]
    spheres = [_sphere(point, _JOINT_M, _JOINT_COLOR, known)
               for point, known in zip(joints, row["joint_knowledge"], strict=True)]
    spheres += [_sphere(point, _MARKER_M, _MARKER_COLOR, known)
                for point, known in zip(row.get("marker_positions", ()), row.get("marker_knowledge", ()), strict=True)
                if point[0] == point[0]]
    bones = {"type": _LINE_LIST, "pose": _ORIGIN, "thickness": _LINE_M, "scale_invariant": False,
             "points": [_vector(joints[joint]) for bone in _BONES for joint in bone],
             "color": _color(_JOINT_COLOR, 1.0), "colors": [], "indices": []}
    return {"timestamp": _time(t_ns), "frame_id": frame_id, "id": name, "lifetime": {"sec": 0, "nsec": 0},
            "frame_locked": False, "metadata": [{"key": "condition", "value": row["condition"]}], "arrows": [],
            "cubes": [], "spheres": spheres, "cylinders": [], "lines": [bones], "triangles": [], "texts": [],
            "models": []}


def _sphere(point: list[float], size_m: float, color: tuple[float, float, float], known: int) -> Message:
    return {"pose": {"position": _vector(point), "orientation": _ORIGIN["orientation"]},
            "size": {"x": size_m, "y": size_m, "z": size_m}, "color": _color(color, _OPACITY[known])}


def _color(color: tuple[float, float, float], opacity: float) -> Message:
    return {"r": color[0], "g": color[1], "b": color[2], "a": opacity}


def _vector(point: list[float]) -> Message:
    return {"x": point[0], "y": point[1], "z": point[2]}


def _time(t_ns: int) -> Message:
    return {"sec": t_ns // 1_000_000_000, "nsec": t_ns % 1_000_000_000}


def _transform(t_ns: int, child: str, place: Any, rotation_wxyz: Any) -> Message:
    w, x, y, z = rotation_wxyz
    return {"timestamp": _time(t_ns), "parent_frame_id": "rig", "child_frame_id": child,
            "translation": _vector(list(place)), "rotation": {"x": x, "y": y, "z": z, "w": w}}


FORMATS = (Format("mcap", "MCAP: for Foxglove", McapWriter, (".mcap",), "m", units_free=False, says_knowledge=True),)
