"""The certificate of a rig, from a folder of recordings. A missing step gives a line "not measured"."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Callable
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import msgspec
import numpy as np

from rhot_app.certificate.document import Certificate, Line, not_measured
from rhot_app.certificate.latency import LATENCY, TIMING, judge_latency, judge_timing
from rhot_app.certificate.lengths import DEPTH, ROD, judge_depth, judge_rod, read_distance
from rhot_app.certificate.recordings import CertifiedRecording, ProtocolFile, read_latencies, read_recording
from rhot_app.certificate.static import (
    HANDEDNESS,
    TITLE,
    UPRIGHT,
    judge_handedness,
    judge_static,
    judge_upright,
)
from rhot_app.errors import CertificateError, RecordingError
from rhot_app.progress import Progress, silent, within
from rhot_app.project import Rig
from rhot_app.recording.raw_log import LogReader

STEPS: dict[str, str] = {
    "static": "Rest the hand (palm to the cameras, fingers spread) or a board, and record 10 s.",
    "ruler": "Hold one marker still at eight distances or more, from 20 to 100 cm, and type each distance.",
    "rod": "Move a rod with two markers slowly through the whole volume for 20 s, turning it every way.",
    "flash": "Turn the cameras to the screen and let the patch flash for 20 s (Certificate in the app).",
    "plumb": "Hang the rod from a string, let it come to rest, and record 3 s.",
}
"""What the operator does, in order."""


def certify(folder: Path, protocol: ProtocolFile, rig: Rig, progress: Progress = silent) -> Certificate:
    """Judge every line; logs that `protocol` names stand in `folder`. Raises CertificateError for a log that is
    missing or none, and for a statement that does not fit the rig; then there is no certificate."""
    def read(log: str, start: float, end: float) -> CertifiedRecording:
        path = folder / log
        if not path.is_file():
            raise CertificateError(f"{path}: there is no such recording; record the step again, or take it out of the "
                                   "protocol.")
        return read_recording(path, rig, within(progress, start, end))

    lines: list[Line] = []
    static = None if protocol.static is None else read(protocol.static.log, 0.0, 0.15)
    lines.append(_missing("static", TITLE, "static") if static is None else judge_static(static, rig))
    lines.append(_depth(protocol, rig, read))
    latencies = {step.log: read_latencies(folder / step.log, rig)
                 for step in (protocol.static, protocol.rod, protocol.flash, protocol.plumb)
                 if step is not None and (folder / step.log).is_file()}
    lines.append(judge_timing(np.concatenate([one.seconds for one in latencies.values()])) if latencies else
                 _missing("timing", TIMING, "static"))
    rod = protocol.rod
    lines.append(_missing("rod", ROD, "rod") if rod is None else
                 judge_rod(read(rod.log, 0.5, 0.7), rod.markers, 1e-3 * rod.length_mm, rig))
    flash = protocol.flash
    lines.append(_missing("latency", LATENCY, "flash") if flash is None else
                 judge_latency(read(flash.log, 0.7, 0.85), flash.marker, flash.edges, latencies[flash.log]))
    plumb = protocol.plumb
    lines.append(_missing("upright", UPRIGHT, "plumb") if plumb is None else
                 judge_upright(read(plumb.log, 0.85, 1.0), plumb.upper, plumb.lower, rig))
    lines.append(_missing("handedness", HANDEDNESS, "static") if static is None or protocol.static is None else
                 judge_handedness(static, protocol.static.facing, rig))
    progress("certificate", 1.0)
    return Certificate(
        created=datetime.now(UTC).isoformat(timespec="seconds"), rig=rig.name,
        rig_sha256=hashlib.sha256(msgspec.json.encode(rig)).hexdigest(), simulated=protocol.simulated,
        program=f"rhot {version('rhot')}", lines=tuple(lines))


def rig_of(folder: Path, protocol: ProtocolFile) -> Rig:
    """The rig that the first log was recorded with. Raises CertificateError."""
    steps = [step for step in (protocol.static, *protocol.ruler, protocol.rod, protocol.flash, protocol.plumb)
             if step is not None]
    if not steps:
        raise CertificateError(f"{folder}: no step was recorded; there is nothing to certify.")
    try:
        with contextlib.closing(LogReader(folder / steps[0].log)) as reader:
            return reader.rig
    except RecordingError as exc:
        raise CertificateError(str(exc)) from exc


def _missing(code: str, title: str, step: str) -> Line:
    return not_measured(code, title, f"the step \"{step}\" was not recorded.", STEPS[step])


def _depth(protocol: ProtocolFile, rig: Rig, read: Callable[[str, float, float], CertifiedRecording]) -> Line:
    if not protocol.ruler:
        return _missing("depth", DEPTH, "ruler")
    count = len(protocol.ruler)
    return judge_depth([read_distance(read(one.log, 0.15 + 0.3 * k / count, 0.15 + 0.3 * (k + 1) / count), one.marker,
                                      1e-3 * one.distance_mm, rig) for k, one in enumerate(protocol.ruler)], rig)
