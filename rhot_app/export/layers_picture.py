"""Pictures for people: which link hides which before a camera, and the part of the image that each link has.

Every layer has a colour, and its place in the visibility order as a number, 1 for what nothing hides. Lines are the
visible outline: bright beside the background, dark before another link. A number in brackets: a cycle was cut there.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.articulated.bodies import Bodies, Placed
from rhot_app.articulated.outline import outline_of
from rhot_app.articulated.visibility import NONE, segment, visibility
from rhot_app.geometry.camera import CameraModel

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

MASK_OPACITY = 0.55
_SUB = 4  # bits of a pixel's fraction in OpenCV's drawing


def layer_colours(count: int) -> Image:
    """(L, 3) RGB: neighbours in the list are far apart in hue."""
    hue = (np.arange(count) * 0.381966 * 180.0) % 180.0  # the golden angle
    hsv = np.stack([hue, np.where(np.arange(count) % 2, 150.0, 230.0), np.full(count, 235.0)], axis=1)
    return np.asarray(cv2.cvtColor(hsv.astype(np.uint8)[None], cv2.COLOR_HSV2RGB)[0], np.uint8)


def draw_layers(image: Image, bodies: Bodies, placed: Placed, camera: CameraModel, rays: Array,
                names: Sequence[str] = ()) -> Image:
    """A copy of `image` (H, W, 3) RGB with masks, outlines and numbers of an object's layers. `rays`: `camera_rays`.
    `names` (L,): a list of the order beside them."""
    record = camera.record
    seen = visibility(bodies, placed, record)
    labels = segment(bodies, placed, seen.order, record, rays)
    colours, out = layer_colours(len(seen.order)), image.copy()
    shown = labels != NONE
    out[shown] = ((1.0 - MASK_OPACITY) * out[shown] + MASK_OPACITY * colours[labels[shown]]).astype(np.uint8)
    outline = outline_of(bodies, placed, seen.order, record, 1e-3)
    for pixel, behind in zip(outline.pixel, outline.behind, strict=True):
        x, y = (round(float(v) * 2**_SUB) for v in pixel)
        cv2.circle(out, (x, y), 1 << _SUB, (255, 255, 255) if behind == NONE else (0, 0, 0), -1, cv2.LINE_AA, _SUB)
    for place, layer in enumerate(seen.order):
        if np.any(labels == layer):
            mask = cv2.distanceTransform(np.pad(labels == layer, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1]
            y, x = np.unravel_index(int(np.argmax(mask)), mask.shape)
            _write(out, _number(place, bool(seen.cut[layer])), (int(x), int(y)), 0.4, centred=True)
    for place, layer in enumerate(seen.order if names else ()):
        text = f"{_number(place, bool(seen.cut[layer]))} {names[layer]}"
        _write(out, text, (6, 14 + 15 * place), 0.42, tuple(int(v) for v in colours[layer]))
    return np.asarray(out, np.uint8)


def _number(place: int, cut: bool) -> str:
    return f"({place + 1})" if cut else str(place + 1)


def _write(image: Image, text: str, at: tuple[int, int], size: float, rgb: tuple[int, ...] = (255, 255, 255),
           centred: bool = False) -> None:
    (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, size, 1)
    if centred:
        at = at[0] - width // 2, at[1] + height // 2
    cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, (0, 0, 0), 3, cv2.LINE_AA)
    cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, rgb, 1, cv2.LINE_AA)
