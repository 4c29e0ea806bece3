"""Poses of objects that another tracker measured; no node sends them. Their record is docs/log.md's: time, pose and
covariance as bytes. Their residual is `objects.motion.PoseResidual`."""

from __future__ import annotations

import struct

import numpy as np

from rhot_app.errors import RecordingError
from rhot_app.objects.observations import MeasuredPose

_HEAD = struct.Struct("<q12d21d")
_UPPER = np.triu_indices(6)
_ORTHONORMAL = 1e-6


def encode_pose(pose: MeasuredPose) -> bytes:
    """The record's data."""
    return _HEAD.pack(pose.t_ns, *pose.world_from_object[:3].ravel(), *pose.covariance[_UPPER]) + pose.name.encode()


def decode_pose(data: bytes) -> MeasuredPose:
    """Raises RecordingError for what is no pose."""
    try:
        t_ns, *numbers = _HEAD.unpack_from(data)
        name = data[_HEAD.size:].decode()
    except (struct.error, UnicodeDecodeError) as exc:
        raise RecordingError("a record of an object's pose is cut or damaged.") from exc
    world, covariance = np.eye(4), np.empty((6, 6))
    world[:3] = np.reshape(numbers[:12], (3, 4))
    covariance[_UPPER] = numbers[12:]
    covariance.T[_UPPER] = numbers[12:]
    rotation = world[:3, :3]
    if (not np.isfinite(numbers).all() or np.abs(rotation @ rotation.T - np.eye(3)).max() > _ORTHONORMAL
            or (np.linalg.eigvalsh(covariance) <= 0.0).any()):
        raise RecordingError("a record of an object's pose holds no pose.")
    return MeasuredPose(name, t_ns, world, covariance)
