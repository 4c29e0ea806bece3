"""Film a scene to disk: both cameras' frames as raw YUV recordings, one process per camera, and the truth.

Beside them lie a rig file and each node's settings with ports of their own, so that the shot can be played to real
daemons on one machine (docs/twin.md).
"""

from __future__ import annotations

import contextlib
import multiprocessing
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Final, Literal

import msgspec
import numpy as np

from rhot_app.errors import SimulatorError
from rhot_app.hand.model import build_model
from rhot_app.project import save_rig
from rhot_app.simulator.background import background_image
from rhot_app.simulator.body import HandBody, build_body
from rhot_app.simulator.moments import Shutter
from rhot_app.simulator.motion import Motion, load_motion
from rhot_app.simulator.nodes import NodePorts
from rhot_app.simulator.render import Exposure, FrameRenderer, Optics
from rhot_app.simulator.scene import Scene, TwinSettings, build_rig, make_scene, node_settings
from rhot_app.simulator.solids_painter import SolidsPainter
from rhot_app.simulator.truth import FrameTruth, save_truth, true_hand
from rhot_node.capture.yuv import YuvWriter
from rhot_node.config import save_settings
from rhot_node.files import read_document, write_document

TRUTH_NAME = "truth.npz"
RIG_NAME = "rig.json"
SHOT_NAME = "shot.json"
FIRST_PORT = 47810  # of the first node of a shot; ten more for each further one, beside those of real nodes

FORMAT: Final = "rhot-shot"
VERSION: Final = 1

Progress = Callable[[int, int], None]
"""Called with (frames done, frames in all)."""

_REPORT_FRAMES = 8


class ShotFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """``shot.json``: what a folder of frames shows."""

    motion: str
    seconds: float
    seed: int
    hidden: list[str]
    settings: TwinSettings
    format: Literal["rhot-shot"] = FORMAT
    version: Literal[1] = VERSION


def read_shot(folder: Path) -> tuple[ShotFile, Scene]:
    """What was filmed into `folder`, and its scene. Raises SimulatorError when it holds no complete shot."""
    shot = read_document(folder / SHOT_NAME, ShotFile, format_name=FORMAT, version=VERSION, error=SimulatorError)
    return shot, make_scene(shot.settings, shot.seed)


@dataclass(frozen=True)
class Shot:
    """What is filmed: a scene, a motion in it, for how long, and which markers (ids) are left unpainted."""

    scene: Scene
    motion: Motion
    seconds: float
    hidden: frozenset[str] = frozenset()

    def body(self) -> HandBody:
        """The hand that wears the scene's markers."""
        return build_body(build_model(self.scene.hand), self.scene.markers, self.hidden)


def make_shot(scene: Scene, motion: str, seconds: float, hidden: frozenset[str] = frozenset()) -> Shot:
    """A shot of the motion with this name or file. Raises SimulatorError, RigError."""
    if not seconds > 0.0:
        raise SimulatorError(f"a recording of {seconds:g} s cannot be; give more than 0 s.")
    model = build_model(scene.hand)
    return Shot(scene, load_motion(motion, model, scene.centre, scene.seed), seconds, hidden)


def make_renderer(shot: Shot, index: int) -> FrameRenderer:
    """The renderer of one camera of the shot."""
    scene = shot.scene
    settings, camera = scene.settings, scene.camera(index)
    seed = 1000 * scene.seed + index
    background = background_image(settings.background, camera, settings.distance_m, scene.seed)
    painter = SolidsPainter(shot.body(), camera, background, settings.shading, seed)
    optics = Optics(settings.psf_sigma_px, settings.noise_mid_grey, settings.noise_read)
    shutter = Shutter(1e-9 * scene.exposure_ns, 1e-9 * scene.row_time_ns)
    exposure = Exposure(shutter, shutter.exposure_s, settings.lamp, settings.controls)
    return FrameRenderer(painter, background, optics, exposure, seed)


def film(shot: Shot, folder: Path, progress: Progress | None = None) -> None:
    """Render the shot into the new `folder`: one recording per camera, ``truth.npz``, ``rig.json``, ``shot.json``.

    The nodes' settings are in ``NAME.json``, their ports those of the rig file. The folder appears only when all is
    complete; an interrupt or error leaves nothing behind. Raises SimulatorError.
    """
    if folder.exists():
        raise SimulatorError(f"{folder} exists already; choose another folder or remove it.")
    if not folder.parent.is_dir():
        raise SimulatorError(f"{folder.parent} is not a folder; create it first.")
    work = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
    try:
        cameras = _film_cameras(shot, work, progress)
        save_truth(work / TRUTH_NAME, true_hand(shot.motion, shot.body(), shot.seconds, cameras))
        _save_nodes(shot.scene, work)
        write_document(work / SHOT_NAME, ShotFile(shot.motion.name, shot.seconds, shot.scene.seed,
                                                  sorted(shot.hidden), shot.scene.settings))
        work.chmod(0o755)
        work.replace(folder)
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _save_nodes(scene: Scene, folder: Path) -> None:
    """The rig file and the settings of its nodes."""
    firsts = [FIRST_PORT + 10 * index for index in range(len(scene.names))]
    ports = tuple(NodePorts(first, first + 1, first + 2) for first in firsts)
    for index, name in enumerate(scene.names):
        save_settings(folder / f"{name}.json", node_settings(scene, index, ports=ports[index]))
    save_rig(folder / RIG_NAME, build_rig(scene, ports))


def _film_cameras(shot: Shot, folder: Path, progress: Progress | None) -> tuple[FrameTruth, ...]:
    context = multiprocessing.get_context("spawn")
    count = len(shot.scene.names)
    total = sum(len(shot.scene.frame_times_ns(k, shot.seconds)) for k in range(count))
    pipes: list[Connection] = []
    workers = []
    try:
        for index in range(count):
            ours, theirs = context.Pipe(duplex=False)
            worker = context.Process(target=_film_camera, args=(shot, index, folder, theirs), daemon=True)
            worker.start()
            theirs.close()
            pipes.append(ours)
            workers.append(worker)
        return _gather(pipes, total, progress)
    finally:
        for worker in workers:
            worker.terminate()
            worker.join()


def _gather(pipes: list[Connection], total: int, progress: Progress | None) -> tuple[FrameTruth, ...]:
    """Frame counts, then a FrameTruth or a sentence about what went wrong, from every worker."""
    done: dict[int, FrameTruth] = {}
    frames = [0] * len(pipes)
    while len(done) < len(pipes):
        for pipe in wait([pipe for k, pipe in enumerate(pipes) if k not in done]):
            index = pipes.index(pipe)  # type: ignore[arg-type]
            try:
                message = pipes[index].recv()
            except EOFError:
                raise SimulatorError(f"the renderer of camera {index + 1} died; is there enough memory?") from None
            if isinstance(message, str):
                raise SimulatorError(f"camera {index + 1} could not be rendered: {message}")
            if isinstance(message, FrameTruth):
                done[index] = message
                frames[index] = len(message.times_s)
            else:
                frames[index] = message
        if progress is not None:
            progress(sum(frames), total)
    return tuple(done[k] for k in range(len(pipes)))


def _film_camera(shot: Shot, index: int, folder: Path, pipe: Connection) -> None:
    """One worker: all frames of one camera, and their truth into the pipe."""
    with contextlib.suppress(BrokenPipeError, KeyboardInterrupt):
        try:
            pipe.send(_write_frames(shot, index, folder, pipe))
        except (OSError, SimulatorError) as exc:
            pipe.send(str(exc))


def _write_frames(shot: Shot, index: int, folder: Path, pipe: Connection) -> FrameTruth:
    scene, preset = shot.scene, shot.scene.preset
    times = scene.frame_times_ns(index, shot.seconds)
    renderer = make_renderer(shot, index)
    visible = []
    with YuvWriter(folder / scene.names[index], preset.width, preset.height, scene.exposure_ns,
                   scene.row_time_ns) as writer:
        for number, t_ns in enumerate(times):
            frame, fractions = renderer.render(shot.motion, 1e-9 * t_ns, number)
            writer.append(t_ns, frame)
            visible.append(fractions.copy())
            if number % _REPORT_FRAMES == 0:
                pipe.send(number)
    return FrameTruth(1e-9 * np.array(times), np.array(visible))
