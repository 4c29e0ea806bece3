"""A shot: an act in a scene for some seconds, who renders it, and the file that says what a folder shows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import msgspec

from rhot_app.errors import SimulatorError
from rhot_app.project import save_rig
from rhot_app.simulator.film.scene_objects import SceneObject, make_object, with_start_pose, write_held
from rhot_app.simulator.render.exposure_samples import Shutter
from rhot_app.simulator.render.painter import Image, Painter
from rhot_app.simulator.render.render import Exposure, FrameRenderer, Optics
from rhot_app.simulator.scene.background import background_image
from rhot_app.simulator.scene.scene import Scene, TwinSettings, build_rig, make_scene, node_settings
from rhot_app.simulator.scene.scene_description import HandShow, Show
from rhot_app.sources.local_nodes import NodePorts
from rhot_node.config import save_settings
from rhot_node.files import read_document, write_document

RIG_NAME = "rig.json"
SHOT_NAME = "shot.json"
FIRST_PORT = 47810  # of the first node of a shot; ten more for each further one, beside those of real nodes

FORMAT: Final = "rhot-shot"
VERSION: Final = 1


class ShotFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """``shot.json``: what a folder of frames shows. `motion` is the motion's name, or of what else is shown."""

    motion: str
    seconds: float
    seed: int
    hidden: list[str]
    settings: TwinSettings
    show: Show = HandShow()
    format: Literal["rhot-shot"] = FORMAT
    version: Literal[1] = VERSION


def read_shot(folder: Path) -> tuple[ShotFile, Scene]:
    """What was filmed into `folder`, and its scene. Raises SimulatorError when it holds no complete shot."""
    shot = read_document(folder / SHOT_NAME, ShotFile, format_name=FORMAT, version=VERSION, error=SimulatorError)
    return shot, make_scene(shot.settings, shot.seed)


@dataclass(frozen=True, eq=False)
class Shot:
    """What is filmed: `show` in a scene, as the act it became, for how long; ids of markers left unpainted."""

    scene: Scene
    show: Show
    scene_object: SceneObject
    seconds: float
    hidden: frozenset[str] = frozenset()


def make_shot(scene: Scene, show: Show | str, seconds: float, hidden: frozenset[str] = frozenset()) -> Shot:
    """A shot of a show; a string is the name or file of a hand's motion. Raises SimulatorError, RigError,
    CalibrationError."""
    if not seconds > 0.0:
        raise SimulatorError(f"a recording of {seconds:g} s cannot be; give more than 0 s.")
    if isinstance(show, str):
        show = HandShow(show)
    return Shot(scene, show, make_object(show, scene, hidden), seconds, hidden)


def make_renderer(shot: Shot, index: int) -> FrameRenderer:
    """The renderer of one camera of the shot."""
    scene, camera = shot.scene, shot.scene.camera(index)
    background = background_image(scene.settings.background, camera, scene.settings.distance_m, scene.seed)
    painter = shot.scene_object.painter(camera, scene.settings.shading, camera_seed(scene, index))
    return renderer_of(scene, index, painter, background)


def renderer_of(scene: Scene, index: int, painter: Painter, background: Image) -> FrameRenderer:
    """The renderer of one camera of the scene, which sees what `painter` paints before `background` (3, H, W)."""
    settings = scene.settings
    optics = Optics(settings.psf_sigma_px, settings.noise_mid_grey, settings.noise_read)
    shutter = Shutter(1e-9 * scene.exposure_ns, 1e-9 * scene.row_time_ns)
    exposure = Exposure(shutter, shutter.exposure_s, settings.lamp, settings.controls)
    return FrameRenderer(painter, background, optics, exposure, camera_seed(scene, index))


def camera_seed(scene: Scene, index: int) -> int:
    """Seed of everything random in one camera's pictures."""
    return 1000 * scene.seed + index


def save_shot(shot: Shot, folder: Path) -> None:
    """Write ``shot.json``, the rig file and the settings of its nodes: on this machine only, and open, because the
    folder may be given to others and no key should be. Raises OSError."""
    scene = shot.scene
    firsts = [FIRST_PORT + 10 * index for index in range(len(scene.names))]
    ports = tuple(NodePorts(first, first + 1, first + 2, first + 3) for first in firsts)
    for index, name in enumerate(scene.names):
        save_settings(folder / f"{name}.json", node_settings(scene, index, ports=ports[index], trust="open"))
    rig = build_rig(scene, ports, write_held(shot.scene_object, folder))
    save_rig(folder / RIG_NAME, with_start_pose(rig, shot.scene_object))
    write_document(folder / SHOT_NAME, ShotFile(shot.scene_object.name, shot.seconds, scene.seed, sorted(shot.hidden),
                                                scene.settings, shot.show))
