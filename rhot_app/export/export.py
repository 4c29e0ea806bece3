"""Exports a recording: one pass through the tracker, into a file that appears only when it is whole."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from rhot_app.errors import ExportError, refuse_existing
from rhot_app.export.formats import all_formats
from rhot_app.export.frames import in_frame
from rhot_app.export.gaps import FilledGap, GapFiller, checked_fill
from rhot_app.export.plan import ExportOptions, Plan, Writer
from rhot_app.export.recording import RATE_AFTER_S, TrackedLog
from rhot_app.export.resample import Resampler, checked_rate
from rhot_app.export.states import HandStates
from rhot_app.progress import Progress, silent, within
from rhot_app.project import Rig
from rhot_app.tracking.smoothing import NOT_SMOOTHED
from rhot_node.files import replacing


@dataclass(frozen=True, slots=True)
class Exported:
    """What came of an export. `losses`: what of the log could not be read; `notes`: what the format could not hold."""

    path: Path
    states: int
    losses: tuple[str, ...]
    notes: tuple[str, ...]


def format_of(name: str | None, out: Path | None) -> str:
    """The format that is asked for by its name or ending, or by the ending of the file to write. Raises
    ExportError."""
    if name is not None:
        name = next((found for found, one in all_formats().items() if f".{name}" in one.endings), name)
        if name not in all_formats():
            raise ExportError(f"there is no format {name!r}; choose one of {', '.join(all_formats())}.")
        allowed = all_formats()[name].endings
        if out is not None and out.suffix.lower() not in allowed:
            raise ExportError(f"{out}: a {name} file ends in {' or '.join(allowed)}; change the file's name or the "
                              "format.")
        return name
    if out is None:
        raise ExportError(f"the format is missing; give --format with one of {', '.join(all_formats())}.")
    for found, one in all_formats().items():
        if out.suffix.lower() in one.endings:
            return found
    endings = ", ".join(dict.fromkeys(ending for one in all_formats().values() for ending in one.endings))
    raise ExportError(f"{out}: no format has the ending {out.suffix!r}; give the file one of {endings}.")


def export_log(log: Path, out: Path, *, format_name: str | None = None, rig: Rig | Path | None = None,
               options: ExportOptions | None = None, again: bool = False, progress: Progress = silent) -> Exported:
    """Track a raw log and write `out`; `format_name` None goes by its ending.

    Raises ExportError, RecordingError or RigError with a sentence; nothing is written then, and nothing is left of an
    export that is interrupted. An existing file is only written over `again`.
    """
    options = options or ExportOptions()
    name = format_of(format_name, out)
    check_options(name, options)
    check_place(log, out, again)
    if options.fill_s is not None and not all_formats()[name].says_knowledge:
        check_place(log, gaps_path(out), again)
    with TrackedLog(log, rig, options.tracker, within(progress, 0.0, 0.98), smooth=options.smooth) as tracked:
        notes = _write(tracked, name, options, out, lambda: progress(f"writing {out.name}", 0.99))
        if not tracked.tracked:
            notes.append(f"the hand is tracked in none of the {tracked.count} states")
        notes += [sentence.removesuffix(".") for sentence in tracked.warnings]
        progress(f"exported {log.name}", 1.0)
        return Exported(out, tracked.count, tuple(tracked.losses), tuple(notes))


def check_options(name: str | None, options: ExportOptions) -> None:
    """Refuse what no log could be exported with; `name` None is no format. Raises ExportError."""
    if options.smooth and options.tracker == "classic":
        raise ExportError(NOT_SMOOTHED)
    if options.rate_hz is not None:
        checked_rate(options.rate_hz)
    if options.fill_s is not None:
        checked_fill(options.fill_s)
    chosen = None if name is None else all_formats()[name]
    if chosen is not None and options.units not in (None, chosen.units) and not chosen.units_free:
        raise ExportError(f"{name} files are in {chosen.units}, as their readers expect; leave --units out.")


def check_place(log: Path, out: Path, again: bool, option: str = "--out") -> None:
    """Refuse before anything is tracked what cannot be written; `option` named it. Raises ExportError."""
    if out.absolute() == log.absolute() or (out.exists() and log.exists() and out.samefile(log)):
        raise ExportError(f"{out} is the recording itself, which is never written over; choose another {option}.")
    if out.parent.exists() and not out.parent.is_dir():
        raise ExportError(f"{out}: {out.parent} is not a folder; choose another {option}.")
    if not out.parent.is_dir():
        raise ExportError(f"{out}: the folder {out.parent} does not exist; create it first.")
    if out.is_dir():
        raise ExportError(f"{out} is a folder; name a file in it.")
    refuse_existing(out, ExportError, option, force=again)


def gaps_path(out: Path) -> Path:
    """Where the gaps are listed that were filled in a file which cannot say how its values are known."""
    return out.with_name(f"{out.name}.filled.csv")


def _write(tracked: TrackedLog, name: str, options: ExportOptions, out: Path, ready: Callable[[], None]) -> list[str]:
    filler = None if options.fill_s is None else GapFiller(options.fill_s)
    writer: Writer | None = None
    plan: Plan | None = None

    def end() -> None:
        """Beside the file, the table of its gaps, where the file itself cannot mark them."""
        ready()
        if not all_formats()[name].says_knowledge:
            gaps_path(out).unlink(missing_ok=True)  # of a file that is written over
            if filler is not None and filler.filled and plan is not None:
                _list_gaps(gaps_path(out), filler.filled, plan)

    with whole_file(out, end) as path:
        try:
            for plan, states in _prepared(tracked, name, options, path, filler):
                writer = writer or all_formats()[name].writer(plan)
                writer.add(in_frame(states, options.frame))
            assert writer is not None  # else there were no states, and that is an error
            writer.finish()
        finally:
            if writer is not None:
                with contextlib.suppress(OSError):  # a full disk has been reported already
                    writer.close()
    if filler is not None and filler.filled:
        writer.notes.append(_filled_note(filler.filled, None if all_formats()[name].says_knowledge else gaps_path(out)))
    return writer.notes


def _filled_note(filled: list[FilledGap], beside: Path | None) -> str:
    hand = sum(one.last - one.first + 1 for one in filled if not one.what.startswith("marker_"))
    where = "the columns of knowledge mark them" if beside is None else f"{beside.name} lists them"
    return f"{len(filled)} gaps were filled, those of the hand in {hand} states; {where}"


def _list_gaps(path: Path, filled: list[FilledGap], plan: Plan) -> None:
    """The table of what was filled in: frames count from 1, as in the file itself; s since its first state."""
    with replacing(path) as file:
        file.write(b"what,first_frame,last_frame,begin_s,end_s\n")
        for one in sorted(filled, key=lambda gap: (gap.first, gap.what)):
            begin_s, end_s = (1e-9 * (t_ns - plan.first_ns) for t_ns in (one.begin_ns, one.end_ns))
            file.write(f"{one.what},{one.first + 1},{one.last + 1},{begin_s:.6f},{end_s:.6f}\n".encode())


def _prepared(tracked: TrackedLog, name: str, options: ExportOptions, path: Path,
              filler: GapFiller | None) -> Iterator[tuple[Plan, HandStates]]:
    """The states as the format has them, at their own times or at a rate, with their gaps filled, each with the plan
    of the file."""
    held: list[HandStates] = []  # until the cameras' rate is known
    resampler: Resampler | None = None
    plan: Plan | None = None
    uniform = all_formats()[name].uniform or options.rate_hz is not None
    for block in _ended(tracked.blocks()):
        if block is not None:
            held.append(block)
        first_ns = int(held[0].t_master_ns[0]) if held else 0
        if uniform and resampler is None and block is not None and (
                int(block.t_master_ns[-1]) - first_ns < 1e9 * RATE_AFTER_S):
            continue
        if plan is None:
            camera_hz = tracked.camera_rate_hz or 1.0
            rate_hz = options.rate_hz or max(float(round(camera_hz)), 1.0)
            resampler = Resampler(rate_hz, 1.0 / camera_hz) if uniform else None
            plan = Plan(path, tracked.rig, options.frame, options.units or all_formats()[name].units, options.hand,
                        rate_hz if uniform else None, tracked.path.name, tracked.created, first_ns, options.smooth,
                        tracked.wall_clock_offset_ns)
        for states in held:
            for given in [states] if resampler is None else resampler.take(states):
                for filled in [given] if filler is None else filler.take(given):
                    yield plan, filled
        held = []
    if filler is not None and plan is not None:
        for filled in filler.finish():
            yield plan, filled


def _ended(blocks: Iterator[HandStates]) -> Iterator[HandStates | None]:
    """The blocks, then None."""
    yield from blocks
    yield None


@contextlib.contextmanager
def whole_file(out: Path, ready: Callable[[], None]) -> Iterator[Path]:
    """A hidden file that becomes `out` when the block ends, or vanishes when it fails, or when `ready` raises, which is
    asked last. Raises ExportError where the disk refuses."""
    path: Path | None = None
    try:
        handle, hidden = tempfile.mkstemp(dir=out.parent, prefix=f".{out.stem}.", suffix=out.suffix)
        os.close(handle)
        path = Path(hidden)
        yield path
        with path.open("rb+") as file:
            os.fsync(file.fileno())
        path.chmod(0o644)
        ready()
        path.replace(out)
    except OSError as exc:
        raise ExportError(f"{out}: cannot be written ({exc.strerror or exc}). Nothing was left of it; make room, or "
                          "choose another place.") from exc
    finally:
        if path is not None:
            path.unlink(missing_ok=True)
