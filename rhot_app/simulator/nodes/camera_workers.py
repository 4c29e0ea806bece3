"""Work on every camera of a shot at once: one process per camera, their progress as one, and no process left behind."""

from __future__ import annotations

import contextlib
import multiprocessing
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from rhot_app.errors import SimulatorError
from rhot_app.simulator.nodes.shot import Shot

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
