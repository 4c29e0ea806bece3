"""JSON schemas of the messages in an MCAP export: two of Foxglove's by its field names, and the state's own."""

from __future__ import annotations

from typing import Any, Final

from rhot_app.export.states import CONDITIONS, HandStates

Schema = dict[str, Any]


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


OF_HAND: Final = tuple(name for name in hand_state(0)["properties"]
                       if name in HandStates.__slots__ and not name.startswith(("marker", "sequence", "t_", "epi"))
                       and name not in ("condition", "other"))
"""The arrays that each hand has for itself."""
