"""An export in a process of its own, so that a window stays quick meanwhile; and its first rows, to look at before."""

from __future__ import annotations

import contextlib
import itertools
import multiprocessing
import os
import signal
from multiprocessing.connection import Connection
from pathlib import Path

from rhot_app.errors import ExportError, RhotError
from rhot_app.export.export import Exported, check_options, export_log
from rhot_app.export.frames import in_frame
from rhot_app.export.gaps import GapFiller
from rhot_app.export.plan import ExportOptions
from rhot_app.export.recording import TrackedLog
from rhot_app.export.resample import Resampler
from rhot_app.export.states import HandStates, joined
from rhot_app.progress import Progress, silent
from rhot_app.project import Rig

_LOOK_S = 0.1
_END_S = 10.0


def export_apart(log: Path, out: Path, format_name: str, options: ExportOptions,
                 progress: Progress = silent, rig: Rig | None = None) -> Exported:
    """`export_log` in another process; `rig` None is the log's own. An existing `out` is written over. Raises
    ExportError with its sentence.

    An exception raised from `progress`, which is asked ten times a second, ends the export; nothing is left of it.
    """
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    child = context.Process(target=_export, args=(there, log, out, format_name, options, rig), daemon=True)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # an interrupt within its imports would be told
    try:
        child.start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    there.close()
    last = ("starting", 0.0)
    try:
        while True:
            if not here.poll(_LOOK_S):
                progress(*last)
                continue
            kind, value = here.recv()
            if kind == "done":
                done: Exported = value
                return done
            if kind == "failed":
                raise ExportError(value)
            last = value
            progress(*last)
    except EOFError as exc:
        raise ExportError(f"{out}: the export's process died; is there enough memory?") from exc
    except BaseException:
        here.close()  # the other process asks before it renames its file; an interrupt alone can be lost in an import
        with contextlib.suppress(ProcessLookupError):
            os.kill(child.pid or 0, signal.SIGINT)
        raise
    finally:
        child.join(_END_S)
        child.kill()
        here.close()


def _export(there: Connection, log: Path, out: Path, format_name: str, options: ExportOptions,
            rig: Rig | None) -> None:
    """The other process."""
    def report(text: str, fraction: float) -> None:
        try:
            there.send(("progress", (text, fraction)))
        except BrokenPipeError:
            raise KeyboardInterrupt from None

    with contextlib.suppress(BrokenPipeError, KeyboardInterrupt):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        try:
            exported = export_log(log, out, format_name=format_name, rig=rig, options=options, again=True,
                                  progress=report)
            there.send(("done", exported))
        except (RhotError, OSError) as exc:
            there.send(("failed", str(exc)))


def first_states(log: Path, format_name: str, options: ExportOptions, count: int,
                 rig: Rig | None = None) -> HandStates:
    """The first `count` states or fewer as they would be exported; `rig` None is the log's own. Raises as `export_log`
    does."""
    check_options(format_name, options)
    with TrackedLog(log, rig, options.tracker, smooth=options.smooth) as tracked:
        (block, *_) = itertools.islice(tracked.blocks(), 1)
        if options.rate_hz is not None:
            resampler = Resampler(options.rate_hz, 1.0 / (tracked.camera_rate_hz or options.rate_hz))
            block = next(resampler.take(block), block)
        if options.fill_s is not None:
            filler = GapFiller(options.fill_s)
            block = joined([*filler.take(block), *filler.finish()])
        return in_frame(block.where(slice(count)), options.frame)
