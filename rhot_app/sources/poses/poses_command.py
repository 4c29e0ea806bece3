"""``rhot poses``: listen to another tracker's poses, say how good they are, and record them."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.errors import SourceError, refuse_existing
from rhot_app.options import add_force_argument, add_json_argument, add_out_argument, add_seconds_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.sources.poses.source import ForeignPose, PoseSource



def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot poses``."""
    parser.add_argument("--source", required=True, metavar="SOURCE",
                        help="openvr, libsurvive, run:PROGRAM, tcp:HOST:PORT, udp:PORT, or a CSV file")
    parser.add_argument("--tracker", default="", metavar="NAME",
                        help="the tracker's serial number or role (default: the only one)")
    add_seconds_argument(parser, "how long to listen; a CSV file is read whole", 20.0)
    add_out_argument(parser, "write the tracked poses as CSV")
    add_force_argument(parser)
    add_json_argument(parser)
    add_examples(parser, "rhot poses --source openvr --seconds 60 --out tracker.csv",
                 "rhot poses --source tcp:192.168.0.5:4000 --tracker LHR-1")


def run(args: argparse.Namespace) -> int:
    """Listen, print, write. Raises SourceError, or ObjectError for a file; nothing is written then."""
    from rhot_app.objects.pose import Validity
    from rhot_app.sources.poses.open_source import open_source
    from rhot_node.compiled import announce_compilation
    from rhot_node.files import require_replaceable

    if args.out is not None:
        if not args.out.parent.is_dir():
            raise SourceError(f"{args.out}: there is no folder {args.out.parent}. Make it first, or name another.")
        try:
            require_replaceable(args.out)
        except OSError as exc:
            raise SourceError(f"{args.out}: cannot be written ({exc.strerror}).") from exc
        refuse_existing(args.out, SourceError, force=args.force)
    source = open_source(args.source, args.tracker)
    try:
        poses = listen(source, args.seconds)
        name, notice = source.name, source.notice
    finally:
        source.close()
    tracked = [pose for pose in poses if pose.validity is Validity.TRACKED]
    if len(tracked) < 2:
        raise SourceError(notice or f"{name}: there was no pose within {args.seconds:g} s.")
    announce_compilation("some seconds")
    if args.out is not None:
        write_poses(args.out, tracked)
    fields = {"source": name, **figures(poses), "notice": notice,
              "written": str(args.out) if args.out is not None else None}
    print(json.dumps(fields) if args.json else "\n".join(_lines(fields)))
    return 0


def listen(source: PoseSource, seconds: float) -> list[ForeignPose]:
    """The poses of the next `seconds`, or until the source ends."""
    from rhot_app.progress import ProgressLine
    from rhot_app.sources.poses.followed import POLL_S

    line, found = ProgressLine("listening"), list(source.poll())
    began = time.monotonic()
    while not source.ended and (elapsed := time.monotonic() - began) < seconds:
        line.report(source.notice or "listening", elapsed / seconds)
        time.sleep(POLL_S)
        found += source.poll()
    return found


def figures(poses: Sequence[ForeignPose]) -> dict[str, Any]:
    """Rate, jitter, gaps, noise and outliers of two or more tracked poses."""
    import numpy as np

    from rhot_app.objects.pose import Validity
    from rhot_app.objects.stream import SAMPLES, noise_of
    from rhot_app.sources.poses.source import PoseGate

    tracked = [pose for pose in poses if pose.validity is Validity.TRACKED]
    gate = PoseGate("tracker")
    for pose in tracked:
        gate.take(pose)
    times_s = 1e-9 * np.array([pose.t_master_ns for pose in tracked], dtype=np.float64)
    steps_s = np.diff(times_s)
    sd = np.full(6, np.nan)
    if len(tracked) >= SAMPLES:
        sd = np.sqrt(np.diag(noise_of(np.array([pose.world_from_body for pose in tracked]))))
    return {"poses": len(poses), "tracked": len(tracked), "seconds": float(times_s[-1] - times_s[0]),
            "rate_hz": float((len(times_s) - 1) / (times_s[-1] - times_s[0])),
            "jitter_ms": 1e3 * float(np.std(steps_s)), "longest_gap_ms": 1e3 * float(steps_s.max()),
            "rejected_ratio": gate.rejected_ratio,
            "noise_mm": 1e3 * float(sd[0]) if len(tracked) >= SAMPLES else None,
            "noise_deg": float(np.degrees(sd[3])) if len(tracked) >= SAMPLES else None}


def write_poses(path: Path, poses: Sequence[ForeignPose]) -> None:
    """Write the CSV that ``rhot calibrate alignment --foreign`` reads. Raises SourceError."""
    from rhot_app.estimation.se3 import quaternion_from_rotation
    from rhot_app.objects.stream import HEADER
    from rhot_node.files import write_atomically

    rows = [",".join(HEADER)]
    for pose in poses:
        place, turn = pose.world_from_body[:3, 3], quaternion_from_rotation(pose.world_from_body[:3, :3])
        numbers = ",".join(f"{value:.9g}" for value in (*place, *turn))
        rows.append(f"{1e-9 * pose.t_master_ns:.9f},{numbers}")
    try:
        write_atomically(path, "\n".join([*rows, ""]).encode())
    except OSError as exc:
        raise SourceError(f"{path}: cannot be written ({exc.strerror}); nothing was changed.") from exc


def _lines(fields: dict[str, Any]) -> list[str]:
    lines = [f"{fields['source']}: {fields['tracked']} of {fields['poses']} poses tracked in {fields['seconds']:.1f} s",
             f"rate        {fields['rate_hz']:.1f} Hz, steps ± {fields['jitter_ms']:.2f} ms, longest "
             f"{fields['longest_gap_ms']:.0f} ms",
             f"outliers    {100 * fields['rejected_ratio']:.2f} % rejected"]
    if fields["noise_mm"] is not None:
        lines.append(f"white noise {fields['noise_mm']:.3f} mm, {fields['noise_deg']:.4f} degrees")
    if fields["notice"]:
        lines.append(fields["notice"])
    if fields["written"]:
        lines.append(f"Written: {fields['written']}")
    return lines
