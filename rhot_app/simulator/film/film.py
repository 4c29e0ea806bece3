"""Film a shot to disk: both cameras' frames as raw YUV recordings, one process per camera, and the truth.

Beside them lie a rig file and each node's settings with ports of their own, so that the shot can be played to real
daemons on one machine (docs/twin.md).
"""

from __future__ import annotations

import contextlib
import functools
import multiprocessing
import shutil
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from rhot_app.errors import SimulatorError
from rhot_app.simulator.film.shot import Shot, make_renderer, save_shot
from rhot_app.simulator.film.truth import FrameTruth, save_truth, true_object
from rhot_node.capture.yuv import YuvWriter

T = TypeVar("T")

Progress = Callable[[int, int], None]
"""Called with (frames done, frames in all)."""

Report = Callable[[int], None]
"""Called by a camera's work with the number of its frames that are done; calls may be frequent."""

_REPORT_FRAMES = 8


@dataclass(frozen=True, slots=True)
class _Done:
    """A worker's last word: what it has made, or why it could not."""

    result: Any
    fault: str = ""


def for_each_camera(shot: Shot, work: Callable[[Shot, int, Report], T], progress: Progress | None) -> tuple[T, ...]:
    """What `work(shot, camera, report)` gives for each camera; it is pickled into a process of its own.

    Raises SimulatorError when one fails with an OSError or SimulatorError, or dies; the others are then ended.
    """
    context = multiprocessing.get_context("spawn")
    count = len(shot.scene.names)
    total = sum(len(shot.scene.frame_times_ns(k, shot.seconds)) for k in range(count))
    pipes: list[Connection] = []
    workers = []
    try:
        for index in range(count):
            ours, theirs = context.Pipe(duplex=False)
            worker = context.Process(target=_run, args=(shot, index, work, theirs), daemon=True)
            worker.start()
            theirs.close()
            pipes.append(ours)
            workers.append(worker)
        return _gather(pipes, total, progress)
    finally:
        for worker in workers:
            worker.terminate()
            worker.join()


def _gather(pipes: list[Connection], total: int, progress: Progress | None) -> tuple[Any, ...]:
    """Frame counts, then the last word, from every worker."""
    done: dict[int, Any] = {}
    frames = [0] * len(pipes)
    while len(done) < len(pipes):
        for pipe in wait([pipe for k, pipe in enumerate(pipes) if k not in done]):
            index = pipes.index(pipe)  # type: ignore[arg-type]
            try:
                message = pipes[index].recv()
            except EOFError:
                raise SimulatorError(f"the renderer of camera {index + 1} died; is there enough memory?") from None
            if not isinstance(message, _Done):
                frames[index] = message
            elif message.fault:
                raise SimulatorError(f"camera {index + 1} could not be rendered: {message.fault}")
            else:
                done[index] = message.result
        if progress is not None:
            progress(total if len(done) == len(pipes) else sum(frames), total)
    return tuple(done[k] for k in range(len(pipes)))


def _run(shot: Shot, index: int, work: Callable[[Shot, int, Report], Any], pipe: Connection) -> None:
    """One worker's process."""
    def report(number: int) -> None:
        if number % _REPORT_FRAMES == 0:
            pipe.send(number)

    with contextlib.suppress(BrokenPipeError, KeyboardInterrupt):
        try:
            pipe.send(_Done(work(shot, index, report)))
        except (OSError, SimulatorError) as exc:
            pipe.send(_Done(None, str(exc)))


TRUTH_NAME = "truth.npz"


def film(shot: Shot, folder: Path, progress: Progress | None = None) -> None:
    """Render the shot into the new `folder`: one recording per camera, ``truth.npz``, ``rig.json``, ``shot.json``, and
    the nodes' settings in ``NAME.json``, their ports those of the rig file.

    The folder appears only when all is complete; an interrupt or error leaves nothing behind. Raises SimulatorError.
    """
    with new_folder(folder) as work:
        cameras = for_each_camera(shot, functools.partial(_write_frames, work), progress)
        save_truth(work / TRUTH_NAME, true_object(shot.scene_object, shot.seconds, cameras))
        save_shot(shot, work)


@contextlib.contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """A hidden folder that becomes `folder` when the block ends, or vanishes when it fails. Raises SimulatorError when
    `folder` exists or has no place."""
    if folder.exists():
        raise SimulatorError(f"{folder} exists already; choose another folder or remove it.")
    if not folder.parent.is_dir():
        raise SimulatorError(f"{folder.parent} is not a folder; create it first.")
    work = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
    try:
        yield work
        work.chmod(0o755)
        work.replace(folder)
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _write_frames(folder: Path, shot: Shot, index: int, report: Report) -> FrameTruth:
    """All frames of one camera, and their truth."""
    scene, preset = shot.scene, shot.scene.preset
    times = scene.frame_times_ns(index, shot.seconds)
    renderer = make_renderer(shot, index)
    visible = []
    with YuvWriter(folder / scene.names[index], preset.width, preset.height, scene.exposure_ns,
                   scene.row_time_ns) as writer:
        for number, t_ns in enumerate(times):
            frame, fractions = renderer.render(shot.scene_object.source, 1e-9 * t_ns, number)
            writer.append(t_ns, frame)
            visible.append(fractions.copy())
            report(number)
    return FrameTruth(1e-9 * np.array(times), np.array(visible))
