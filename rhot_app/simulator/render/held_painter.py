"""Paints a hand that holds a cube with fiducial tags. The cube is nearer to the cameras than the hand and is painted
over it: a finger before the cube is not shown.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.se3 import exp_so3, rotation_from_quaternion
from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.object_file import BoxShape, ObjectModel, Tag, load_object
from rhot_app.simulator.render.exposure_samples import FrameTime
from rhot_app.simulator.render.painter import Body, Box, LitImage, PoseSource
from rhot_app.simulator.render.sheet import tag_sheet
from rhot_app.simulator.render.sheet_painter import SheetPainter
from rhot_app.simulator.render.solids_painter import SolidsPainter
from rhot_node.files import resource_path

Array = NDArray[np.float64]

PALM_FROM_OBJECT = rigid(exp_so3([0.4, 0.3, 0.2]), [0.09, 0.0, -0.05])
"""Before the palm of a hand that holds the object towards the cameras."""

_FACE_FROM_TAG = np.diag([1.0, -1.0, -1.0, 1.0])  # a sheet has y down and z into the paper


def held_cube() -> ObjectModel:
    """The cube in the simulated hand: a box whose faces bear one tag each, in their middles."""
    return load_object(resource_path("objects", "cube.json"))


@dataclass(frozen=True)
class _Riding:
    """A `PoseSource` of something that is fixed to what another source moves."""

    source: PoseSource
    place: Array

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        poses, _ = self.source.sample(times_s)
        return poses @ self.place, np.zeros((len(times_s), 0))


class HeldPainter:
    """A `Painter` of a hand and a box with a tag on each face. A marker whose centre lies behind the box is hidden."""

    def __init__(self, body: Body, held: ObjectModel, camera: CameraModel, shading: float, seed: int) -> None:
        """`shading`: share of the brightness that depends on how a surface faces the lamp."""
        assert isinstance(held.shape, BoxShape)
        self._body, self._camera = body, camera
        self._hand = SolidsPainter(body, camera, shading, seed)
        face_m = 1e-3 * held.shape.sides_mm[0]
        self._faces = [(PALM_FROM_OBJECT @ _object_from_tag(tag) @ _FACE_FROM_TAG,
                        SheetPainter(tag_sheet(tag, face_m), camera, shading, seed + 1 + number))
                       for number, tag in enumerate(held.fiducials)]

    def paint(self, lit: LitImage, source: PoseSource, time: FrameTime, number: int) -> tuple[Box, Array]:
        """Paint both as `source` moves them during the frame."""
        box, visible = self._hand.paint(lit, source, time, number)
        t_s = float(np.mean(time.nodes_s))
        world_from_palm, angles = source.sample(np.array([t_s]))
        markers = self._camera.project(self._body.marker_positions(world_from_palm, angles)[0])
        for place, face in self._faces:
            if not self._faces_camera(world_from_palm[0] @ place):
                continue
            riding = _Riding(source, place)
            box = _around(box, face.paint(replace(lit, background=lit.image.copy()), riding, time, number)[0])
            outline = face.corners(riding, t_s).astype(np.float32)
            hidden = [bool(np.isfinite(pixel).all()) and cv2.pointPolygonTest(
                outline, (float(pixel[0]), float(pixel[1])), False) > 0 for pixel in markers]
            visible = np.where(hidden, 0.0, visible)
        return box, visible

    def _faces_camera(self, world_from_sheet: Array) -> bool:
        line_of_sight = world_from_sheet[:3, 3] - self._camera.centre
        return bool(world_from_sheet[:3, 2] @ line_of_sight > 0.0)


def _object_from_tag(tag: Tag) -> Array:
    return rigid(rotation_from_quaternion(tag.rotation_wxyz), 1e-3 * np.array(tag.translation_mm))


def _around(one: Box, other: Box) -> Box:
    """The smallest box about both."""
    if one[0] >= one[2] or one[1] >= one[3]:
        return other
    if other[0] >= other[2] or other[1] >= other[3]:
        return one
    return min(one[0], other[0]), min(one[1], other[1]), max(one[2], other[2]), max(one[3], other[3])
