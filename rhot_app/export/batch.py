"""Many logs at once: each as if it were alone, by processes here or by a Dask cluster, and never twice for nothing.

What was done is noted in ``batch.json`` in the output folder: a log whose size, time and order are the same as there is
left as it is. A log that cannot be tracked, or kills its worker, is reported and stops nobody else.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
import numpy as np

from rhot_app.errors import ExportError, RhotError, require
from rhot_app.export.export import export_log
from rhot_app.export.formats import all_formats
from rhot_app.export.plan import ExportOptions
from rhot_app.export.recording import TrackedLog
from rhot_app.state import Knowledge
from rhot_node.errors import NodeError
from rhot_node.files import read_document, read_input, write_atomically, write_document

MANIFEST: Final = "batch.json"
FORMAT: Final = "rhot-batch"

CERTIFICATE: Final = "certificate"
"""The `format` of a job whose log is a folder of recordings (``protocol.json``), and whose file is a certificate."""

Status = Literal["done", "losses", "failed", "interrupted"]


@dataclass(frozen=True, slots=True)
class BatchJob:
    """One log and the file that comes of it: an export in `format`, or with None a summary of what the tracker makes of
    the log. `rig`: another rig file than the log's own."""

    log: Path
    out: Path
    format: str | None
    rig: Path | None
    options: ExportOptions


@dataclass(frozen=True, slots=True)
class JobOutcome:
    """What came of a job. `message`: why it failed, or what was lost; `unchanged`: it was done before."""

    log: Path
    out: Path
    status: Status
    states: int = 0
    seconds: float = 0.0
    message: str = ""
    unchanged: bool = False


Report = Callable[[JobOutcome], None]
Ends = Generator[JobOutcome, None, None]


def jobs_of(logs: Sequence[Path], folder: Path, format_name: str | None, rig: Path | None,
            options: ExportOptions) -> list[BatchJob]:
    """The jobs of some logs, each named after its log. Raises ExportError when two would have the same name."""
    ending = ".json" if format_name in (None, CERTIFICATE) else all_formats()[str(format_name)].endings[0]
    named: dict[str, Path] = {}
    for log in logs:
        other = named.setdefault(log.stem, log.absolute())
        if other != log.absolute():
            raise ExportError(f"{other} and {log} would both become {log.stem}{ending}; rename one of them.")
    if f"{Path(MANIFEST).stem}{ending}" == MANIFEST and Path(MANIFEST).stem in named:
        raise ExportError(f"{named[Path(MANIFEST).stem]} would become {MANIFEST}, which is the list of what was done; "
                          "rename it.")
    for stem, log in named.items():
        if log == folder.absolute() / f"{stem}{ending}":
            raise ExportError(f"{log} is a recording, which is never written over; choose another --out.")
    rig = None if rig is None else rig.absolute()
    return [BatchJob(log, folder.absolute() / f"{stem}{ending}", format_name, rig, options)
            for stem, log in named.items()]


def run_job(job: BatchJob) -> JobOutcome:
    """Do one job; whatever goes wrong is in the outcome."""
    begun = time.monotonic()
    try:
        if job.format is None:
            states, losses = _summarise(job)
        elif job.format == CERTIFICATE:
            states, losses = _certify(job)
        else:
            done = export_log(job.log, job.out, format_name=job.format, rig=job.rig, options=job.options, again=True)
            states, losses = done.states, done.losses
        return JobOutcome(job.log, job.out, "losses" if losses else "done", states, time.monotonic() - begun,
                          "; ".join(losses))
    except (RhotError, NodeError, OSError) as exc:
        return JobOutcome(job.log, job.out, "failed", 0, time.monotonic() - begun, str(exc))
    except KeyboardInterrupt:
        return JobOutcome(job.log, job.out, "interrupted", 0, time.monotonic() - begun, "interrupted")
    except Exception as exc:  # the others must go on
        return JobOutcome(job.log, job.out, "failed", 0, time.monotonic() - begun, f"{type(exc).__name__}: {exc}")


def _summarise(job: BatchJob) -> tuple[int, tuple[str, ...]]:
    """Write what the tracker makes of a log as one JSON object; every key ends in its unit."""
    sums = _Sums()
    with TrackedLog(job.log, job.rig, job.options.tracker, smooth=job.options.smooth) as tracked:
        for block in tracked.blocks():
            sums.add(block.t_master_ns, block.marker_raw_positions, block.marker_knowledge == Knowledge.MEASURED)
        figures: dict[str, Any] = {
            "log": str(job.log), "created": tracked.created, "rig": tracked.rig.name,
            "tracker": tracked.rig.tracker.kind, "smoothed": job.options.smooth, "states": tracked.count,
            "tracked_fraction": tracked.tracked / tracked.count, "camera_rate_hz": tracked.camera_rate_hz,
            "losses": tracked.losses, **sums.figures(tracked.rig.markers.ids)}
        write_atomically(job.out, json.dumps(figures, indent=1).encode() + b"\n")
        return tracked.count, tuple(tracked.losses)


def _certify(job: BatchJob) -> tuple[int, tuple[str, ...]]:
    """Write the certificate of a folder of recordings: JSON, and HTML and PDF beside it. Without a rig it is that of
    the first log. Returns how many lines were judged."""
    from rhot_app.certificate.certify import certify, rig_of
    from rhot_app.certificate.recordings import read_protocol
    from rhot_app.certificate.report import to_html, to_pdf
    from rhot_app.project import load_rig

    protocol = read_protocol(job.log)
    made = certify(job.log, protocol, rig_of(job.log, protocol) if job.rig is None else load_rig(job.rig))
    write_atomically(job.out.with_suffix(".html"), to_html(made).encode())
    write_atomically(job.out.with_suffix(".pdf"), to_pdf(made))
    write_document(job.out, made)
    return len(made.lines) - made.count("not measured"), ()


class _Sums:
    """Means and spreads of markers, without keeping the states."""

    def __init__(self) -> None:
        self._first_ns: int | None = None
        self._last_ns = 0
        self._count = 0
        self._measured: Any = 0
        self._first: Any = 0.0
        self._second: Any = 0.0

    def add(self, t_ns: Any, positions: Any, measured: Any) -> None:
        """Take (N,) times, (N, M, 3) m and (N, M) which of them count."""
        self._first_ns = int(t_ns[0]) if self._first_ns is None else self._first_ns
        self._last_ns = int(t_ns[-1])
        known = np.where(measured[:, :, None], positions, 0.0)
        self._count += len(t_ns)
        self._measured = self._measured + measured.sum(axis=0)
        self._first = self._first + known.sum(axis=0)
        self._second = self._second + (known**2).sum(axis=0)

    def figures(self, ids: Sequence[str]) -> dict[str, Any]:
        """By marker: part of the states in which it was measured, its mean place, its spread about it."""
        duration_s = 1e-9 * (self._last_ns - (self._first_ns or 0))
        markers: dict[str, Any] = {}
        for row, name in enumerate(ids):
            count = int(self._measured[row])
            mean = self._first[row] / max(count, 1)
            spread = np.sqrt(np.maximum(self._second[row] / max(count, 1) - mean**2, 0.0))
            markers[name] = {"measured_fraction": count / self._count,
                             "mean_mm": (1e3 * mean).tolist() if count else None,
                             "sd_mm": (1e3 * spread).tolist() if count else None}
        return {"duration_s": duration_s, "state_rate_hz": (self._count - 1) / duration_s if duration_s else 0.0,
                "markers": markers}


def run_batch(jobs: Sequence[BatchJob], folder: Path, *, workers: int = 1, scheduler: str | None = None,
              again: bool = False, report: Report = lambda outcome: None) -> list[JobOutcome]:
    """Do all jobs and return what came of them, in their order; `report` is called with each as it ends.

    `workers` processes here (1: this one), or those of a Dask cluster whose `scheduler` has this address and whose
    workers see the same files. Raises ExportError when the folder or the cluster cannot be used.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        manifest = Manifest(folder)
    except OSError as exc:
        raise ExportError(f"{folder}: files cannot be written there ({exc.strerror}); choose another --out.") from exc
    found: dict[Path, JobOutcome] = {}
    for job in jobs:
        before = None if again else manifest.unchanged(job)
        if before is not None:
            found[job.log] = before
            report(before)
    waiting = [job for job in jobs if job.log not in found]
    orders = {job.log: (job, manifest.order(job)) for job in waiting}
    ends = (_on_cluster(waiting, scheduler) if scheduler is not None
            else _in_order(waiting) if workers == 1 else _here(waiting, workers))
    with contextlib.closing(ends):
        for outcome in ends:
            found[outcome.log] = outcome
            manifest.note(*orders[outcome.log], outcome)
            report(outcome)
    return [found[job.log] for job in jobs]


class _Done(msgspec.Struct, frozen=True):
    """A job: its log with size and time, a digest of all that decides about the result, and what came of it."""

    log: str
    size: int
    mtime_ns: int
    order: str
    states: int = 0
    message: str = ""


class _Manifest(msgspec.Struct, frozen=True):
    """``batch.json``: jobs by the names of their files."""

    done: dict[str, _Done]
    format: Literal["rhot-batch"] = FORMAT
    version: Literal[1] = 1


class Manifest:
    """What was done in an output folder, and of what."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / MANIFEST
        self._done: dict[str, _Done] = {}
        with contextlib.suppress(ExportError):  # no list, or a broken one: everything is done again
            self._done = read_document(self._path, _Manifest, format_name=FORMAT, version=1, error=ExportError).done

    def order(self, job: BatchJob) -> _Done | None:
        """What decides about a job's result, nothing done; None when its log or rig cannot be read."""
        try:
            files = sorted(job.log.iterdir()) if job.log.is_dir() else [job.log]
            logs, rig = [file.stat() for file in files], b"" if job.rig is None else read_input(job.rig)
        except (OSError, ValueError):
            return None
        how = json.dumps([version("rhot"), job.format, asdict(job.options)], sort_keys=True).encode() + rig
        return _Done(str(job.log), sum(log.st_size for log in logs), max((log.st_mtime_ns for log in logs), default=0),
                     hashlib.sha256(how).hexdigest())

    def unchanged(self, job: BatchJob) -> JobOutcome | None:
        """What came of the same job before, if its file is still there."""
        before = self._done.get(job.out.name)
        order = self.order(job)
        if before is None or order is None or not job.out.is_file():
            return None
        if before != msgspec.structs.replace(order, states=before.states, message=before.message):
            return None
        return JobOutcome(job.log, job.out, "losses" if before.message else "done", before.states, 0.0, before.message,
                          unchanged=True)

    def note(self, job: BatchJob, order: _Done | None, outcome: JobOutcome) -> None:
        """Remember a job that was done; `order` as it was before."""
        if outcome.status not in ("done", "losses") or order is None:
            return
        self._done[job.out.name] = msgspec.structs.replace(order, states=outcome.states, message=outcome.message)
        try:
            write_document(self._path, _Manifest(self._done))
        except OSError as exc:
            raise ExportError(f"{self._path}: cannot be written ({exc.strerror}).") from exc


def _in_order(jobs: Sequence[BatchJob]) -> Ends:
    """One after the other, by this process. An interrupted job is the last one."""
    for job in jobs:
        outcome = run_job(job)
        yield outcome
        if outcome.status == "interrupted":
            raise KeyboardInterrupt


def _here(jobs: Sequence[BatchJob], workers: int) -> Ends:
    """By processes of this computer. After one died, those that were not done are tried alone, to tell who kills it."""
    done: set[Path] = set()
    try:
        for outcome in _by_pool(jobs, min(workers, max(len(jobs), 1))):
            done.add(outcome.log)
            yield outcome
    except BrokenProcessPool:
        for job in jobs:
            if job.log not in done:
                try:
                    yield from _by_pool([job], 1)
                except BrokenProcessPool:
                    yield JobOutcome(job.log, job.out, "failed", message="its process died; is there enough memory?")


def _by_pool(jobs: Sequence[BatchJob], workers: int) -> Ends:
    """Raises BrokenProcessPool when a process dies."""
    if not jobs:
        return
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=_deaf_to_interrupts)
    try:
        yield from _ended(pool.submit(_interruptible, job) for job in jobs)
    except BaseException:
        for child in multiprocessing.active_children():  # an interrupt may have reached this process alone
            with contextlib.suppress(ProcessLookupError):
                os.kill(child.pid or 0, signal.SIGINT)
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _ended(futures: Iterable[Future[JobOutcome]]) -> Ends:
    for future in as_completed(list(futures)):
        yield future.result()


def _deaf_to_interrupts() -> None:
    """A worker that waits says nothing when the terminal interrupts everybody."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _interruptible(job: BatchJob) -> JobOutcome:
    """A job in a worker: an interrupt ends it, and it leaves nothing behind."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return run_job(job)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _on_cluster(jobs: Sequence[BatchJob], scheduler: str) -> Ends:
    """By the workers of a Dask cluster."""
    distributed = require("distributed", "a batch on a cluster", "cluster")
    try:
        client = distributed.Client(scheduler, timeout=10.0, set_as_default=False)
    except (OSError, ValueError) as exc:
        raise ExportError(f"no Dask scheduler answers at {scheduler} ({exc}). Start one with `dask scheduler`, workers "
                          "with `dask worker`.") from exc
    try:
        futures = {future: job for job in jobs for future in [client.submit(run_job, job, pure=False)]}
        for future in distributed.as_completed(list(futures), loop=client.loop):
            job = futures[future]
            error = future.exception()
            yield future.result() if error is None else JobOutcome(
                job.log, job.out, "failed", message=f"its worker failed ({type(error).__name__}: {error})")
    finally:
        client.close()
