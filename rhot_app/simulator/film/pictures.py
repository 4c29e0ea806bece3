"""Pictures of a shot as files that the calibration commands read: PNG, one folder per camera, and what they show.

A board is taken in the middle of its pauses, everything else evenly over the shot's seconds; both cameras at the same
instants.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.simulator.bare_hand.painter import BareHand
from rhot_app.simulator.film.film import TRUTH_NAME, Progress, new_folder
from rhot_app.simulator.film.shot import Shot, make_renderer, save_shot
from rhot_app.simulator.film.truth import FrameTruth, save_truth, true_object
from rhot_app.simulator.render.painter import Body
from rhot_app.simulator.render.sheet import Sheet, ruler_ends
from rhot_app.simulator.scene.rigid_target import BoardPoses
from rhot_app.simulator.scene.scene_description import RulerShow
from rhot_node.detect.image import from_i420, to_bgr
from rhot_node.files import write_document

Array = NDArray[np.float64]

PICTURES_NAME = "pictures.json"
FORMAT: Final = "rhot-pictures"
VERSION: Final = 1

_WHOLE = 0.9  # visible part from which a marker's paint is worth a sample
_SAMPLE = 0.5  # of the paint's half width on the picture: half the side of a box that lies on paint for certain
_PAINT_M = 0.008


class Picture(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One file. `t_s`: mid-exposure of row 0, scene time. `samples`: x, y, width, height px of a box on the paint of
    each marker that is seen whole. `ruler`: x, y, x, y px of the ruler's crosses, where a person would mark them."""

    file: str
    t_s: float
    samples: dict[str, tuple[int, int, int, int]]
    ruler: tuple[float, float, float, float] | None = None


class PicturesFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """``pictures.json``: the pictures of each camera, by its name."""

    cameras: dict[str, list[Picture]]
    format: Literal["rhot-pictures"] = FORMAT
    version: Literal[1] = VERSION


@dataclass(frozen=True, slots=True)
class _Roll:
    """One camera's pictures and what was visible in them."""

    pictures: list[Picture]
    truth: FrameTruth


def take_pictures(shot: Shot, folder: Path, count: int, progress: Progress | None = None) -> None:
    """Render `count` pictures per camera into the new `folder`, with truth, rig, node settings and ``pictures.json``.

    The folder appears only when all is complete. Raises SimulatorError.
    """
    times = picture_times(shot, count)
    names = shot.scene.names
    with new_folder(folder) as work:
        rolls = [_expose(shot, index, work, times, progress) for index in range(len(names))]
        write_document(work / PICTURES_NAME,
                       PicturesFile({name: roll.pictures for name, roll in zip(names, rolls, strict=True)}))
        truths = tuple(roll.truth for roll in rolls)
        save_truth(work / TRUTH_NAME, true_object(shot.scene_object, float(times[-1]), truths))
        save_shot(shot, work)


def picture_times(shot: Shot, count: int) -> Array:
    """(count,) s: when to take them."""
    source = shot.scene_object.source
    if isinstance(source, BoardPoses):
        rests = source.rest_times_s()
        rounds, place = np.divmod(np.arange(count), len(rests))
        return np.asarray(rests[place] + rounds * source.period_s)
    return np.asarray((np.arange(count) + 0.5) * shot.seconds / count)


def _expose(shot: Shot, index: int, folder: Path, times: Array, progress: Progress | None) -> _Roll:
    name, preset = shot.scene.names[index], shot.scene.preset
    (folder / name).mkdir()
    renderer = make_renderer(shot, index)
    pictures, visible = [], []
    for number, t_s in enumerate(times):
        frame, fractions = renderer.render(shot.scene_object.source, float(t_s), number)
        file = f"{name}/{number:03d}.png"
        cv2.imwrite(str(folder / file), to_bgr(from_i420(frame, preset.width, preset.height)))
        pictures.append(Picture(file, float(t_s), _samples(shot, index, float(t_s), fractions),
                                _ruler(shot, index, float(t_s))))
        visible.append(fractions.copy())
        if progress is not None:
            progress(index * len(times) + number + 1, len(shot.scene.names) * len(times))
    return _Roll(pictures, FrameTruth(times, np.array(visible)))


def _ruler(shot: Shot, index: int, t_s: float) -> tuple[float, float, float, float] | None:
    """Where a ruler's crosses are, to a tenth of a pixel."""
    if not isinstance(shot.show, RulerShow):
        return None
    pose = shot.scene_object.source.sample(np.array([t_s]))[0][0]
    ends = ruler_ends(1e-3 * shot.show.length_mm) @ pose[:3, :3].T + pose[:3, 3]
    (x0, y0), (x1, y1) = np.round(shot.scene.camera(index).project(ends), 1)
    return float(x0), float(y0), float(x1), float(y1)


def _samples(shot: Shot, index: int, t_s: float, visible: Array) -> dict[str, tuple[int, int, int, int]]:
    """A box on the paint of every marker that is seen whole."""
    if isinstance(shot.scene_object.thing, Sheet | BareHand):
        return {}
    body: Body = shot.scene_object.thing
    camera = shot.scene.camera(index)
    centres = body.marker_positions(*shot.scene_object.source.sample(np.array([t_s])))[0]
    boxes = {}
    for marker, centre, part in zip(shot.scene.markers.markers, centres, visible, strict=True):
        (x, y), half = camera.project(centre)[0], _SAMPLE * camera.intrinsics[0] * _PAINT_M / centre[2]
        if part >= _WHOLE:
            boxes[marker.id] = (round(x - half), round(y - half), round(2.0 * half), round(2.0 * half))
    return boxes
