"""One camera's frame of fiducial tags or colour markers as arrays, and which image points belong to an object.
Poses that another tracker measured, and their records in logs."""

from __future__ import annotations

import struct
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import RecordingError
from rhot_app.objects.object_file import ObjectModel
from rhot_node.wire.messages import Fiducials

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

NO_TAG = -1


@dataclass(frozen=True, slots=True)
class FiducialFrame:
    """N tags in one frame of one camera, in master time.

    `camera`: index into the rig's nodes. `t_row0_master_ns`: mid-exposure of row 0. `keys` (N, 2): family, as an index
    into the wire's FAMILIES, and id. `corners` (N, 4, 2) raw px, NaN for one that is not observed, with `covariances`
    (N, 4, 2, 2) px^2. `t_receive_ns`: kernel receive time of the datagram.
    """

    camera: int
    t_row0_master_ns: int
    row_time_ns: int
    keys: NDArray[np.int64]
    corners: Array
    covariances: Array
    t_receive_ns: int = 0


@dataclass(frozen=True, slots=True)
class MeasuredPose:
    """A pose of the object `name` in the rig frame, `world_from_object` (4, 4) m, that another tracker measured at
    master time `t_ns`. `covariance` (6, 6) m^2 and rad^2: translation, then rotation about its origin, world axes."""

    name: str
    t_ns: int
    world_from_object: Array
    covariance: Array


@dataclass(frozen=True, slots=True, eq=False)
class PictureFrame:
    """One frame of one camera as it is, `image` (H, W, 3) RGB, in master time. Its rows count as one instant."""

    camera: int
    t_row0_master_ns: int
    image: NDArray[np.uint8]


ObjectFrame = FiducialFrame | MeasuredPose | PictureFrame
"""What is observed of objects beside the markers: tags of one frame, one pose, or a picture."""


@dataclass(frozen=True, slots=True)
class MarkerPoints:
    """M colour markers in one frame of one camera, by their ids in the marker set; the rest as in `FiducialFrame`.

    `pixels` (M, 2) raw px, NaN for a lost one; `covariances` (M, 2, 2) px^2.
    """

    camera: int
    t_row0_master_ns: int
    row_time_ns: int
    ids: tuple[str, ...]
    pixels: Array
    covariances: Array


FrameOfObjects = FiducialFrame | MarkerPoints | PictureFrame
"""What one camera observes of objects."""


@dataclass(frozen=True, slots=True)
class ObjectView:
    """K image points of one object in one frame of one camera.

    `rows` (K,): which points of `ObjectPoints` they are. `pixels` (K, 2) raw px, `covariances` (K, 2, 2) px^2.
    `t_ns`: master time of the points' mean row; `late_s` (K,): each point's own time less that.
    """

    camera: int
    t_ns: int
    late_s: Array
    rows: Indices
    pixels: Array
    covariances: Array


class ObjectPoints:
    """The image points of an object: the corners of its tags, four by four, or the centres of its markers.

    `points` (P, 3) m, object frame. `tags` (P,): the number of the point's tag in the file, NO_TAG for a marker.
    `normals` (P, 3): the outward normal of the point's tag; NaN for a marker. `sizes` (P,) m: side of the tag. `sized`:
    the points' distances are known as prints are, better than markers' by a ruler.
    """

    def __init__(self, model: ObjectModel) -> None:
        self.name, self.families = model.name, tuple(sorted({tag.key[0] for tag in model.fiducials}))
        self.sized = bool(model.fiducials)
        self._first = {tag.key: 4 * number for number, tag in enumerate(model.fiducials)}
        self._marker = {marker.marker: number for number, marker in enumerate(model.markers)}
        if model.fiducials:
            corners = np.array([tag.corners() for tag in model.fiducials])
            normals = np.cross(corners[:, 1] - corners[:, 2], corners[:, 3] - corners[:, 2])
            self.points = corners.reshape(-1, 3)
            self.tags = np.repeat(np.arange(len(corners)), 4)
            self.normals = np.repeat(normals / np.linalg.norm(normals, axis=1)[:, None], 4, axis=0)
            self.sizes = np.repeat([1e-3 * tag.size_mm for tag in model.fiducials], 4)
        else:
            self.points = 1e-3 * np.array([marker.position_mm for marker in model.markers])
            self.tags = np.full(len(self.points), NO_TAG)
            self.normals, self.sizes = np.full_like(self.points, np.nan), np.full(len(self.points), np.nan)

    def copies(self, frame: FiducialFrame) -> list[list[int]]:
        """The object's tags that a frame has more than once: for each, which of the frame's tags it may be."""
        places: dict[tuple[int, ...], list[int]] = {}
        for n, key in enumerate(map(tuple, frame.keys.tolist())):
            if key in self._first:
                places.setdefault(key, []).append(n)
        return [found for found in places.values() if len(found) > 1]

    def view(self, frame: FiducialFrame | MarkerPoints, chosen: Collection[int] = ()) -> ObjectView | None:
        """The object's image points in a frame, None without any. A tag that the frame has more than once is ambiguous:
        of it only the copy in `chosen`, numbers of the frame's tags, counts."""
        if isinstance(frame, FiducialFrame):
            left_out = {n for found in self.copies(frame) for n in found if n not in chosen}
            own = [(n, self._first[key]) for n, key in enumerate(map(tuple, frame.keys.tolist()))
                   if key in self._first and n not in left_out]
            rows = np.array([first + corner for _, first in own for corner in range(4)], np.intp)
            chosen = [n for n, _ in own]
            pixels, covariances = frame.corners[chosen].reshape(-1, 2), frame.covariances[chosen].reshape(-1, 2, 2)
        else:
            own = [(n, self._marker[name]) for n, name in enumerate(frame.ids) if name in self._marker]
            rows, chosen = np.array([row for _, row in own], np.intp), [n for n, _ in own]
            pixels, covariances = frame.pixels[chosen], frame.covariances[chosen]
        found = np.isfinite(pixels).all(axis=1)
        if not found.any():
            return None
        pixels, mean_row = pixels[found], float(pixels[found, 1].mean())
        return ObjectView(frame.camera, frame.t_row0_master_ns + round(mean_row * frame.row_time_ns),
                          1e-9 * frame.row_time_ns * (pixels[:, 1] - mean_row), rows[found], pixels,
                          covariances[found])


def fiducial_frame(message: Fiducials, camera: int, t_row0_master_ns: int, t_receive_ns: int = 0) -> FiducialFrame:
    """A decoded datagram as arrays. `camera`: the node's index in the rig; `t_row0_master_ns`: its frame's time by the
    clock model."""
    count = len(message.fiducials)
    keys = np.array([(one.family, one.number) for one in message.fiducials], np.int64).reshape(count, 2)
    corners = np.array([one.corners for one in message.fiducials], np.float64).reshape(count, 4, 2)
    numbers = np.array([one.covariances for one in message.fiducials], np.float64).reshape(count, 4, 3)
    return FiducialFrame(camera, t_row0_master_ns, message.row_time_ns, keys, corners,
                         numbers[:, :, [0, 1, 1, 2]].reshape(count, 4, 2, 2), t_receive_ns)


# -- poses of another tracker in a log (docs/log.md) -------------------------------------------------------------------

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
