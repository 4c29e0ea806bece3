"""The tracked hand as layered templates before one camera: which link hides which, for people to look at. No Qt."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.articulated.bodies import Bodies, camera_rays, hand_bodies, place
from rhot_app.articulated.visibility import visibility
from rhot_app.barehand.surface import surface_of
from rhot_app.engine.status import Preview
from rhot_app.export.layers_picture import draw_layers, layer_colours
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anthropometry import scaled_hand
from rhot_app.hand.model import build_model
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_node.errors import PictureError
from rhot_node.pictures import decode_picture

Image = NDArray[np.uint8]

WIDTH_PX = 640
"""Of the picture that is drawn, whatever the camera has: numbers and outlines are readable then."""

GREY = 60  # behind the layers when no picture is, so that white and black lines both show
_SCALES = 100.0  # a hand's estimated size counts in steps of a hundredth


@dataclass(frozen=True, slots=True)
class LayerLine:
    """One layer of the visibility order: `place` from 1, of what nothing hides; `rgb` of its mask; `cut`: it is taken
    though another one hides it, to end a cycle."""

    place: int
    name: str
    rgb: tuple[int, int, int]
    cut: bool

    @property
    def text(self) -> str:
        """As in the picture, with its name."""
        number = f"({self.place})" if self.cut else str(self.place)
        return f"{number}  {self.name.replace('_', ' ')}"


@dataclass(frozen=True, slots=True, eq=False)
class LayerPicture:
    """`image` (H, W, 3) RGB with masks, outlines and numbers; `lines` from the layer that nothing hides on."""

    image: Image
    lines: tuple[LayerLine, ...]


class LayerPictures:
    """Draws the hand of one rig."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self._cameras = {node.name: _smaller(CameraModel.from_rig(node.intrinsics, node.pose)) for node in rig.nodes}
        self._rays = lru_cache(maxsize=None)(lambda name: camera_rays(self._cameras[name]))
        self._bodies = lru_cache(maxsize=4)(self._hand)

    def draw(self, camera: str, state: HandState, preview: Preview | None) -> LayerPicture | None:
        """The layers of the hand in `state` over the picture `preview`, or on grey; None without a hand."""
        if not (state.tracked and np.isfinite(state.world_from_palm).all() and np.isfinite(state.angles).all()):
            return None
        model = self._cameras[camera]
        scale = state.hand_scale if np.isfinite(state.hand_scale) else 1.0
        bodies, names = self._bodies(round(_SCALES * scale))
        placed = place(bodies, state.world_from_palm, state.angles)
        image = draw_layers(_background(preview, model), bodies, placed, model, self._rays(camera))
        seen, colours = visibility(bodies, placed, model.record), layer_colours(
            len(names))
        lines = tuple(LayerLine(k + 1, names[layer], (int(colours[layer][0]), int(colours[layer][1]),
                                                      int(colours[layer][2])), bool(seen.cut[layer]))
                      for k, layer in enumerate(seen.order))
        return LayerPicture(image, lines)

    def _hand(self, hundredths: int) -> tuple[Bodies, tuple[str, ...]]:
        return hand_bodies(surface_of(build_model(scaled_hand(self.rig.hand, hundredths / _SCALES))))


def _smaller(camera: CameraModel) -> CameraModel:
    """The camera as if it had WIDTH_PX columns."""
    scale = WIDTH_PX / camera.width
    lens = camera.intrinsics.copy()
    lens[:2] *= scale
    lens[2:4] = scale * (lens[2:4] + 0.5) - 0.5
    return CameraModel(WIDTH_PX, round(scale * camera.height), lens, camera.world_from_camera, camera.camera_from_world)


def _background(preview: Preview | None, camera: CameraModel) -> Image:
    size = camera.width, camera.height
    try:
        bgr = decode_picture(b"" if preview is None else preview.jpeg)
    except PictureError:
        return np.full((size[1], size[0], 3), GREY, np.uint8)
    return np.ascontiguousarray(cv2.resize(bgr, size, interpolation=cv2.INTER_LINEAR)[:, :, ::-1], np.uint8)
