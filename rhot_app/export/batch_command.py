"""``rhot batch``: track or export many logs, by several processes or a cluster."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.errors import positive_count
from rhot_app.export.export_command import READ_WITH_LOSSES, add_export_arguments, options_of
from rhot_app.options import add_force_argument, add_out_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.export.batch import BatchJob, JobOutcome

FAILED = 2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot batch``."""
    parser.add_argument("paths", type=Path, nargs="+", metavar="LOG", help="raw logs; with --do certify folders")
    parser.add_argument("--do", choices=("track", "export", "certify"), required=True,
                        help="track: a JSON summary of each log; export: a file of --format; certify: a certificate of "
                             "each folder of recordings that rhot certify or the app made")
    add_out_argument(parser, "folder of the results, named after their logs; batch.json in it lists what is done",
                     required=True, metavar="DIR")
    parser.add_argument("--workers", type=positive_count, default=None, metavar="N",
                        help="processes (default: one per processor)")
    parser.add_argument("--scheduler", default=None, metavar="ADDRESS",
                        help="let the workers of this Dask scheduler do it, such as tcp://host:8786; they must see the "
                             "same files")
    add_force_argument(parser, "write anew also what was done before and has not changed")
    add_export_arguments(parser, "needed with --do export")
    add_examples(parser, "rhot batch monday.rhotlog tuesday.rhotlog --do track --out results",
                 "rhot batch monday.rhotlog tuesday.rhotlog --do export --format c3d --out results --workers 4")


def run(args: argparse.Namespace) -> int:
    """Do all, print a table; 2 when a log failed, 3 when one was read with losses."""
    from rhot_app.errors import ExportError
    from rhot_app.export.batch import CERTIFICATE, jobs_of, run_batch
    from rhot_app.export.export import check_options, format_of
    from rhot_app.progress import ProgressLine

    if args.do != "export" and args.format is not None:
        raise ExportError("--format belongs to --do export; leave --format out, or give --do export.")
    named = {"track": None, "certify": CERTIFICATE}
    name = named[args.do] if args.do in named else format_of(args.format, None)
    options = options_of(args)
    check_options(None if name == CERTIFICATE else name, options)
    workers = _processors() if args.workers is None else args.workers
    if args.scheduler is not None and args.workers is not None:
        raise ExportError("--workers is of this computer and --scheduler of a cluster; leave one of them out.")
    jobs = jobs_of(args.paths, args.out, name, args.rig, options)
    _compile(jobs)
    line = ProgressLine(f"{args.do}: {_logs(len(jobs))}")
    ended: list[JobOutcome] = []

    def report(outcome: JobOutcome) -> None:
        ended.append(outcome)
        line(len(ended), len(jobs))

    outcomes = run_batch(jobs, args.out, workers=workers, scheduler=args.scheduler, again=args.force, report=report)
    line.finish()
    print(table(outcomes))
    if any(outcome.status == "interrupted" for outcome in outcomes):
        raise KeyboardInterrupt
    if any(outcome.status == "failed" for outcome in outcomes):
        return FAILED
    return READ_WITH_LOSSES if any(outcome.status == "losses" for outcome in outcomes) else 0


def table(outcomes: list[JobOutcome]) -> str:
    """A line per log, and the sum."""
    width = max(len(outcome.log.name) for outcome in outcomes)
    lines = [f"{'log':{width}}  {'result':9} {'states':>7} {'s':>6}  file, or why not"]
    for outcome in outcomes:
        word = "unchanged" if outcome.unchanged else outcome.status
        what = outcome.message if outcome.status not in ("done", "losses") else str(outcome.out)
        lost = f" ({outcome.message})" if outcome.status == "losses" else ""
        lines.append(f"{outcome.log.name:{width}}  {word:9} {outcome.states:7} {outcome.seconds:6.1f}  {what}{lost}")
    counts = {status: sum(outcome.status == status for outcome in outcomes) for status in ("done", "losses", "failed")}
    lines.append(f"{_logs(len(outcomes))}: {counts['done']} whole, {counts['losses']} read with losses, "
                 f"{counts['failed']} failed")
    return "\n".join(lines)


def _logs(count: int) -> str:
    return f"{count} log{'' if count == 1 else 's'}"


def _processors() -> int:
    import os

    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _compile(jobs: list[BatchJob]) -> None:
    """Compile what is not compiled yet, once, before several processes would do so side by side."""
    from rhot_app.engine.pipeline import warm_up
    from rhot_app.errors import RhotError
    from rhot_app.export.recording import TrackedLog
    from rhot_node.compiled import announce_compilation, is_complete

    if is_complete():
        return
    announce_compilation()
    for job in jobs:
        try:
            with TrackedLog(job.log, job.rig, job.options.tracker) as tracked:
                warm_up(tracked.tracker, tracked.rig)
            return
        except RhotError:  # the table at the end says why
            continue
