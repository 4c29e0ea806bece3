"""The alignment: another tracker's world in the rig, from two streams of one motion."""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.calibration.registry import Calibration, InForce, Observed
from rhot_app.calibration.registry import Command as CalibrateCommand
from rhot_app.calibration.report import Figure, Report
from rhot_app.errors import CalibrationError, input_file, positive_number
from rhot_app.options import add_json_argument, add_out_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.proposal import Command, Proposal
    from rhot_app.calibration.report import Array, Value
    from rhot_app.charts import Chart
    from rhot_app.objects.alignment.alignment_file import Alignment
    from rhot_app.objects.alignment.drift import Drift
    from rhot_app.objects.alignment.fit import OffsetSearch
    from rhot_app.objects.alignment.motion_stream import MotionStream
    from rhot_app.objects.alignment.report import AlignmentSolution, Coverage
    from rhot_app.progress import Progress

LONGEST_SEARCH_S = 60.0
"""s: clocks that differ by more have no common time: correct one of them first."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate alignment``."""
    parser.add_argument("--foreign", type=input_file, required=True, metavar="CSV",
                        help="the other tracker's poses, t,x,y,z,qw,qx,qy,qz in s and m, with that header")
    parser.add_argument("--rig-points", type=input_file, required=True, metavar="CSV",
                        help="positions of a fingertip or tag on that tracker, t,x,y,z in s and m, rig frame")
    parser.add_argument("--search", type=positive_number, default=1.0, metavar="S",
                        help="search the time offset within this, either way (default: 1 s)")
    add_out_argument(parser, "write the alignment")
    parser.add_argument("--check", type=input_file, metavar="FILE",
                        help="solve nothing: say whether the streams still agree with this alignment, or it is stale")
    add_json_argument(parser)
    add_examples(parser, "rhot calibrate alignment --foreign tracker.csv --rig-points tip.csv --out alignment.json",
                 "rhot calibrate alignment --foreign tracker.csv --rig-points tip.csv --check alignment.json")


def instead(args: argparse.Namespace) -> int | None:
    """With ``--check``: print whether the alignment is stale; 2 when it is."""
    if not 0.0 < args.search <= LONGEST_SEARCH_S:
        raise CalibrationError(f"--search {args.search:g}: give a time from 0 to {LONGEST_SEARCH_S:g} s.")
    if args.check is not None and args.out is not None:
        raise CalibrationError("--check writes nothing; leave --out away, or leave --check away to align anew.")
    return None if args.check is None else _check(args.check, *_streams(args), as_json=args.json)


def _streams(args: argparse.Namespace) -> tuple[MotionStream, MotionStream]:
    from rhot_app.objects.alignment.motion_stream import read_stream
    from rhot_app.objects.stream import HEADER

    return read_stream(args.foreign, HEADER), read_stream(args.rig_points, HEADER[:4])


def observe(args: argparse.Namespace, progress: Progress) -> Observed:
    """Both streams."""
    return Observed((StreamRecording.of(*_streams(args)), args.search))


def write(args: argparse.Namespace, result: AlignmentResult, now: InForce | None) -> str:
    """The alignment's file."""
    from rhot_app.objects.alignment.alignment_file import save_alignment, to_alignment

    if args.out is None:
        return ""
    save_alignment(args.out, to_alignment(result.solution, result.created))
    return str(args.out)


def _check(path: Path, foreign: MotionStream, rig: MotionStream, *, as_json: bool) -> int:
    """Raises CalibrationError without a file or overlap."""
    from rhot_app.objects.alignment.alignment_file import load_alignment
    from rhot_app.objects.alignment.drift import DriftMonitor

    test = DriftMonitor.test_streams(load_alignment(path), foreign, rig)
    if test is None:
        raise CalibrationError(f"{path}: the streams have too little in common by this alignment's time offset to test "
                               "it. Record both at once for 20 s, with times of one clock.")
    holds = f"The alignment holds: within 10 s it is off by {1e3 * test.distance_m:.1f} mm, which chance explains."
    if as_json:
        print(json.dumps({"stale": test.stale, "distance_mm": 1e3 * test.distance_m, "offset_ms": 1e3 * test.offset_s,
                          "statistic": test.statistic, "limit": test.limit, "sentence": test.sentence or holds}))
    elif not test.stale:
        print(holds)
    if test.stale:
        print(f"rhot: {test.sentence}", file=sys.stderr)
    return 2 if test.stale else 0


# -- what is said of the result, and what it changes -------------------------------------------------------------------

def report(solved: AlignmentResult, now: InForce | None) -> Report:
    """Where the other world is, how well both agree, and how they moved."""
    from rhot_app.estimation.se3 import quaternion_from_rotation

    result = solved.solution
    fit, coverage = result.fit, result.coverage
    return Report(
        result.verdict, (
            *_figures(1e3 * fit.rig_from_foreign[:3, 3], 1e3 * fit.tracker_from_body[:3, 3], 1e3 * fit.offset_s,
                      1e3 * fit.rms_m, (1e3 * result.place_sd_m, 1e3 * result.point_sd_m, 1e3 * result.offset_sd_s)),
            Figure("turn of the other world, ±", math.degrees(result.rotation_sd_rad), "degrees",
                   key="sd.rotation_deg"),
            Figure("samples that agree", 100.0 * fit.inlier_ratio, "%", decimals=0),
            Figure("motion, along three axes", 1e3 * coverage.spread_m, "mm", decimals=0, key="coverage.spread_mm"),
            Figure("motion, turns", [math.degrees(turn) for turn in coverage.turn], "degrees", decimals=0,
                   key="coverage.rotation_deg"),
            Figure("motion, speed", 1e3 * coverage.speed_m_s, "mm/s", decimals=0, key="coverage.speed_mm_s")),
        fields={
            "rig_from_foreign": {"rotation_wxyz": quaternion_from_rotation(fit.rig_from_foreign[:3, :3]),
                                 "translation_m": fit.rig_from_foreign[:3, 3]},
            "inlier_ratio": fit.inlier_ratio, "samples": len(fit.errors)},
        charts=charts_of(result, solved.search))


def _figures(place_mm: Value, point_mm: Value, offset_ms: float | None,
             rms_mm: float | None, sd: tuple[float | None, float | None, float | None] = (None,) * 3) -> list[Figure]:
    """The figures that an alignment in use has as well; `sd` of the first three."""
    return [Figure("its origin in the rig", place_mm, "mm", sd[0], 1, sd_key="sd.position_mm"),
            Figure("fingertip on the tracker", point_mm, "mm", sd[1], 1, "point_in_tracker_mm", "sd.point_mm"),
            Figure("time offset", offset_ms, "ms", sd[2], 1, "time_offset_ms", "sd.time_offset_ms"),
            Figure("what is left, rms", rms_mm, "mm", key="rms_mm")]


def charts_of(result: AlignmentSolution, search: OffsetSearch) -> tuple[Chart, ...]:
    """The residuals over the speed, and the time offsets tried."""
    import numpy as np

    from rhot_app.charts import Chart, Curve

    fit = result.fit
    speed, error = np.linalg.norm(fit.velocity, axis=1), np.linalg.norm(fit.errors, axis=1)
    tried = np.isfinite(search.median_m)
    return (Chart("What is left between both; a delay is a slope", "speed, mm/s", "distance, mm",
                  (Curve("agree", 1e3 * speed[fit.inlier], 1e3 * error[fit.inlier], "faint dots"),
                   Curve("do not", 1e3 * speed[~fit.inlier], 1e3 * error[~fit.inlier], "faint dots"))),
            Chart("Time offsets tried", "offset, ms", "median distance, mm",
                  (Curve("median", 1e3 * search.offsets_s[tried], 1e3 * search.median_m[tried]),)))


@dataclass(frozen=True, eq=False)
class StreamRecording:
    """A movement of both: the other tracker's `foreign` poses (N, 4, 4) m at `foreign_s` (N,) s, and `places` (M, 3) m
    of the marker in the rig at `rig_s` (M,) s, both by the master's clock. Equal only to itself."""

    foreign_s: Array
    foreign: Array
    rig_s: Array
    places: Array

    @classmethod
    def of(cls, foreign: MotionStream, rig: MotionStream) -> StreamRecording:
        """Of two streams."""
        import numpy as np

        assert foreign.rotations is not None
        poses = np.tile(np.eye(4), (len(foreign.times_s), 1, 1))
        poses[:, :3, :3], poses[:, :3, 3] = foreign.rotations, foreign.positions
        return cls(foreign.times_s, poses, rig.times_s, rig.positions)

    @property
    def coverage(self) -> Coverage | None:
        """The motion so far; None of too few samples."""
        import numpy as np

        from rhot_app.objects.alignment.motion_stream import SAMPLES
        from rhot_app.objects.alignment.report import coverage_of_motion

        if len(self.foreign_s) < SAMPLES or len(self.rig_s) < SAMPLES:
            return None
        velocity = np.gradient(self.places, self.rig_s, axis=0)
        calm = np.linalg.norm(velocity, axis=1)
        calm_enough = calm <= np.quantile(calm, 0.98)  # a jump of a marker is no speed
        return coverage_of_motion(self.foreign[:, :3, :3], self.places, velocity[calm_enough])


@dataclass(frozen=True, eq=False)
class AlignmentResult:
    """A solved alignment, its search, the one that was in use `before` and its test, None when there was none, and when
    it was solved, ISO 8601."""

    solution: AlignmentSolution
    search: OffsetSearch
    before: Alignment | None
    drift: Drift | None
    created: str


def in_use(now: InForce | None) -> Alignment | None:
    """The alignment beside the rig; one that cannot be read counts as none: the new one replaces it."""
    from rhot_app.objects.alignment.alignment_file import load_alignment

    path = _path(now)
    if path is None or not path.exists():
        return None
    try:
        return load_alignment(path)
    except CalibrationError:
        return None


def _path(now: InForce | None) -> Path | None:
    from rhot_app.objects.alignment.alignment_file import alignment_path

    return None if now is None or now.path is None else alignment_path(now.path)


def solve(recording: StreamRecording, search_s: float, now: InForce | None, *, progress: Progress) -> AlignmentResult:
    """The alignment, its time offset sought within `search_s` either way. Raises CalibrationError as `align` does."""
    from rhot_app.objects.alignment.drift import DriftMonitor
    from rhot_app.objects.alignment.fit import align
    from rhot_app.objects.alignment.motion_stream import MotionStream
    from rhot_app.objects.alignment.report import judge_alignment

    foreign = MotionStream.of_poses(recording.foreign_s, recording.foreign)
    rig = MotionStream(recording.rig_s, recording.places)
    fit, search = align(foreign, rig, search_s, progress)
    before = in_use(now)
    drift = None if before is None else DriftMonitor.test_streams(before, foreign, rig)
    created = datetime.now(UTC).isoformat(timespec="seconds")
    return AlignmentResult(judge_alignment(fit, search), search, before, drift, created)


@dataclass(frozen=True, slots=True)
class AlignmentChange:
    """Another alignment in the file beside the rig."""

    before: Alignment | None
    after: Alignment
    path: Path | None

    def use(self, command: Command) -> None:
        """Write it; raises CalibrationError."""
        from rhot_app.objects.alignment.alignment_file import save_alignment

        if self.path is None:
            raise CalibrationError("This rig came from no file, so there is no place beside it. Save the rig first.")
        save_alignment(self.path, self.after)

    def restore(self, command: Command) -> None:
        """What was there before, or no file; raises CalibrationError."""
        from rhot_app.objects.alignment.alignment_file import save_alignment

        assert self.path is not None
        if self.before is not None:
            save_alignment(self.path, self.before)
            return
        try:
            self.path.unlink(missing_ok=True)
        except OSError as exc:
            raise CalibrationError(f"{self.path}: cannot be removed ({exc.strerror}).") from exc

    @property
    def way_back(self) -> str:
        """The file is replaced."""
        return "The alignment in use can be brought back here, until this window closes."


def propose(result: AlignmentResult, now: InForce) -> Proposal:
    """The new alignment beside the one that was in use, for the file beside the rig."""
    from rhot_app.calibration.proposal import Proposal, Row
    from rhot_app.objects.alignment.alignment_file import to_alignment

    before, path = result.before, _path(now)
    old = _figures(None, None, None, None) if before is None else _figures(
        [1e3 * value for value in before.rig_from_foreign.translation_m],
        [1e3 * value for value in before.tracker_from_body.translation_m], 1e3 * before.time_offset_s,
        None if before.rms_m is None else 1e3 * before.rms_m)
    said, known = report(result, now), {one.name: one.brief for one in old}
    drift = result.drift
    state = ("none" if before is None else "not tested" if drift is None else
             f"stale: {1e3 * drift.distance_m:.1f} mm off" if drift.stale else "holds")
    rows = tuple(Row(one.name, known.get(one.name, ""), one.brief) for one in said.figures if one.name)
    return Proposal(CALIBRATION.reason, said.verdict, (Row("alignment in use", state, "just solved"), *rows),
                    changes=(AlignmentChange(before, to_alignment(result.solution, result.created), path),),
                    afterwards="" if path is None else f"It is in {path.name}, beside the rig.")


CALIBRATION = Calibration(
    "alignment", "Alignment with another tracker", "Where a Vive tracker's world is in the rig, from a movement of "
    "both.", "alignment with another tracker",
    CalibrateCommand("alignment", "where another tracker's world is in the rig, from two streams of one motion",
                     add_arguments, observe, ("tracker",), write, instead),
    solve=solve, report=report, propose=propose, solver="rhot_app.objects.alignment.fit")
