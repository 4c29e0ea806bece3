"""Film a shot to disk: both cameras' frames as raw YUV recordings, one process per camera, and the truth.

Beside them lie a rig file and each node's settings with ports of their own, so that the shot can be played to real
daemons on one machine (docs/twin.md).
"""

from __future__ import annotations

import contextlib
import multiprocessing
import shutil
import tempfile
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection, wait
from pathlib import Path

import numpy as np

from rhot_app.errors import SimulatorError
from rhot_app.simulator.shot import Shot, make_renderer, save_shot
from rhot_app.simulator.truth import FrameTruth, save_truth, true_act
from rhot_node.capture.yuv import YuvWriter

TRUTH_NAME = "truth.npz"

Progress = Callable[[int, int], None]
"""Called with (frames done, frames in all)."""

_REPORT_FRAMES = 8


def film(shot: Shot, folder: Path, progress: Progress | None = None) -> None:
    """Render the shot into the new `folder`: one recording per camera, ``truth.npz``, ``rig.json``, ``shot.json``, and
    the nodes' settings in ``NAME.json``, their ports those of the rig file.

    The folder appears only when all is complete; an interrupt or error leaves nothing behind. Raises SimulatorError.
    """
    with new_folder(folder) as work:
        cameras = _film_cameras(shot, work, progress)
        save_truth(work / TRUTH_NAME, true_act(shot.act, shot.seconds, cameras))
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
            frame, fractions = renderer.render(shot.act.source, 1e-9 * t_ns, number)
            writer.append(t_ns, frame)
            visible.append(fractions.copy())
            if number % _REPORT_FRAMES == 0:
                pipe.send(number)
    return FrameTruth(1e-9 * np.array(times), np.array(visible))
