"""``rhot evaluate``: the whole system against the truth it never saw, or trackers side by side on the same logs."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from rhot_app.errors import not_negative, positive_count, positive_number
from rhot_app.simulator.scene.scene_arguments import SECONDS_MAX, add_scene_arguments, scene_of
from rhot_node.compiled import announce_compilation
from rhot_node.terminal import add_examples

_OF_COMPARE = ("motions", "recording", "seeds", "trackers", "sketched", "logs", "baseline")
_JUDGED_S = 0.1  # shorter is no run
_OF_PICTURES = ("background", "worn", "uneven", "glove", "lamp", "kelvin", "mains")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot evaluate``."""
    add_scene_arguments(parser)
    parser.set_defaults(motion=None)  # so that one that --compare would pass over is seen
    parser.add_argument("--seconds", type=positive_number, default=None, metavar="S",
                        help="length of a run; its first second is not judged (default 20, with --compare 8)")
    parser.add_argument("--loss", type=not_negative, default=0.0, metavar="P",
                        help="probability 0..1 that a datagram of observations is lost (default 0)")
    parser.add_argument("--detector", default="fast", choices=("fast", "reference"),
                        help="the nodes' detector: fast, or reference, the thesis's pipeline")
    parser.add_argument("--frames", type=Path, metavar="DIR",
                        help="play this folder of `rhot simulate` instead of rendering; the scene is what it says")
    parser.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    group = parser.add_argument_group("comparing trackers on the same raw logs, without real time (docs/comparison.md)")
    group.add_argument("--compare", action="store_true", help="put the same logs through every tracker")
    group.add_argument("--motions", metavar="M,M,...", default=None,
                       help="motions to compare on (default rest,wave,grasp,pinch,fast)")
    group.add_argument("--recording", metavar="FILE", default=None,
                       help="compare on this recording as well (Qualisys .tsv, Leap Motion .csv)")
    group.add_argument("--seeds", type=positive_count, default=None, metavar="N",
                       help="how many seeds, beginning with --seed (default 5)")
    group.add_argument("--trackers", metavar="T,T,...", default=None,
                       help="which trackers (default classic,estimator); the ratio is the last one's to the first's")
    group.add_argument("--sketched", action="store_true", default=None,
                       help="logs without pictures: exact outlines, noise and bias put on, hidden parts counted; fast")
    group.add_argument("--baseline", type=Path, metavar="FILE", default=None,
                       help="print the last tracker's ratios to the figures kept in FILE (benchmarks/baselines)")
    group.add_argument("--logs", type=Path, metavar="DIR", default=None,
                       help="where logs are kept and found again (default ~/.cache/rhot/takes)")
    bare = parser.add_argument_group("a tracker without markers on a bare hand, without real time (docs/twin.md)")
    bare.add_argument("--bare-hand", action="store_true",
                      help="matched and mismatched hands, lost cameras, random starts, live; takes --seeds (default "
                           "10), --seconds (from 2.5, default 3), --seed, --logs and --json")
    bare.add_argument("--cases", metavar="TEXT", default=None, help="only the cases whose names begin with TEXT")
    add_examples(parser, "rhot evaluate --motion pinch --seconds 10",
                 "rhot evaluate --compare --motions rest,pinch --sketched")


def run(args: argparse.Namespace) -> int:
    """Render (or take) the frames, play them, compare, print."""
    if args.bare_hand:
        return _bare_hand(args)
    if args.compare:
        return _compare(args)
    if args.cases is not None:
        from rhot_app.errors import SimulatorError

        raise SimulatorError("--cases is of --bare-hand, which is not there; add it, or leave --cases out.")
    stray = next((name for name in _OF_COMPARE if getattr(args, name) is not None), None)
    if stray is not None:
        from rhot_app.errors import SimulatorError

        raise SimulatorError(f"--{stray} is of --compare, which is not there; add it, or leave --{stray} out.")
    return _evaluate(args)


def _evaluate(args: argparse.Namespace) -> int:
    from rhot_app.errors import SimulatorError
    from rhot_app.evaluation.run import SETTLE_S, details, evaluate, evaluate_frames, table

    seconds = 20.0 if args.seconds is None else args.seconds
    if not SETTLE_S + _JUDGED_S <= seconds <= SECONDS_MAX and args.frames is None:
        raise SimulatorError(f"a run of {seconds:g} s cannot be judged: the first {SETTLE_S:g} s are not, and it must "
                             f"end within {SECONDS_MAX:.0f} s.")
    if not 0.0 <= args.loss < 1.0:
        raise SimulatorError(f"--loss is a probability from 0 to below 1, not {args.loss:g}.")
    with tempfile.TemporaryDirectory(prefix="rhot-") as work:
        options = {"loss": args.loss, "detector": args.detector}
        if args.frames is not None:
            figures = evaluate_frames(args.frames.absolute(), Path(work), **options)
        else:
            figures = evaluate(scene_of(args), args.motion or "grasp", seconds, Path(work), **options)
    if args.json:
        print(json.dumps(figures))
    else:
        print(table([(figures["motion"], figures)]), details(figures), sep="\n\n")
    return 0


def _bare_hand(args: argparse.Namespace) -> int:
    from rhot_app.errors import SimulatorError
    from rhot_app.evaluation.bare_hand import CASES, LOSS_S, SETTLE_S, Case, EvaluatedTracker, evaluate_bare_hand
    from rhot_app.evaluation.bare_hand_table import bare_hand_fields, bare_hand_table
    from rhot_app.evaluation.contour_tracker import ContourTracker, LiveContourTracker
    from rhot_app.evaluation.data_sets import data_sets_folder
    from rhot_app.progress import ProgressLine
    from rhot_app.project import Rig

    def tracker(rig: Rig, case: Case) -> EvaluatedTracker:
        if case.live:
            return LiveContourTracker(rig, known_size=case.known_size)
        return ContourTracker(rig, known_size=case.known_size, waits=case.start == "shown")

    cases = [case for case in CASES if args.cases is None or case.name.startswith(args.cases)]
    seeds, seconds = 10 if args.seeds is None else args.seeds, 3.0 if args.seconds is None else args.seconds
    for good, rule in ((not args.compare, "--bare-hand and --compare exclude each other"),
                       (cases, f"--cases: none of {', '.join(case.name for case in CASES)} begins with {args.cases!r}"),
                       (seeds >= 1, "--seeds is 1 or more"),
                       (LOSS_S[1] + SETTLE_S <= seconds <= SECONDS_MAX,
                        f"--seconds is from {LOSS_S[1] + SETTLE_S:g} to {SECONDS_MAX:.0f} with --bare-hand")):
        if not good:
            raise SimulatorError(f"{rule}.")
    announce_compilation()
    line = ProgressLine("")
    found = list(evaluate_bare_hand(tracker, range(args.seed, args.seed + seeds), seconds,
                                    args.logs or data_sets_folder(), cases, line.report))
    line.report("evaluating", 1.0)
    line.finish()
    print(json.dumps(bare_hand_fields(found, seconds)) if args.json else bare_hand_table(found))
    return 0


def _motions_of(args: argparse.Namespace, usual: Sequence[str]) -> list[str]:
    """What is compared on. Raises SimulatorError for what is not there, or would be passed over."""
    from rhot_app.errors import SimulatorError

    if args.motion is not None:
        raise SimulatorError(f"--compare takes --motions, a list: write --motions {args.motion} instead of --motion.")
    named = [] if args.motions is None else [name.strip() for name in args.motions.split(",")]
    motions = list(usual) if args.motions is None else list(dict.fromkeys(named))
    if not all(motions):
        raise SimulatorError(f"--motions {args.motions!r}: put commas between names of motions only.")
    if args.recording is not None and not Path(args.recording).is_file():
        raise SimulatorError(f"--recording {args.recording}: there is no such file; name a recorded motion.")
    return motions if args.recording is None else [*motions, args.recording]


def _compare(args: argparse.Namespace) -> int:
    from rhot_app.errors import SimulatorError
    from rhot_app.evaluation.compare import (
        LEGEND,
        MOTIONS,
        TRACKERS,
        as_fields,
        baseline_table,
        compare,
        consistency_table,
        orders,
        read_baseline,
        table,
    )
    from rhot_app.evaluation.data_sets import data_sets_folder
    from rhot_app.evaluation.run import SETTLE_S
    from rhot_app.progress import ProgressLine
    from rhot_app.simulator.film.node_log import Network

    unseen = [name for name in _OF_PICTURES if getattr(args, name) is not None]
    if args.sketched and unseen:
        raise SimulatorError(f"--sketched goes without pictures, in which --{unseen[0]} would show: leave out one of "
                             "them.")
    if args.frames is not None or args.detector != "fast":
        raise SimulatorError("--compare films its own logs with the fast detector: leave out --frames and --detector.")
    names = [name.strip() for name in ("classic,estimator" if args.trackers is None else args.trackers).split(",")]
    seeds = 5 if args.seeds is None else args.seeds
    unknown = [name for name in names if name not in TRACKERS]
    if unknown:
        raise SimulatorError(f"--trackers: there is no tracker {unknown[0]!r}; it takes some of {', '.join(TRACKERS)}.")
    seconds = 8.0 if args.seconds is None else args.seconds
    least_s = SETTLE_S + _JUDGED_S
    for good, rule in ((least_s <= seconds <= SECONDS_MAX, f"--seconds is from {least_s:g} to {SECONDS_MAX:.0f}"),
                       (seeds >= 1, "--seeds is 1 or more"),
                       (0.0 <= args.loss < 1.0, "--loss is from 0 to below 1")):
        if not good:
            raise SimulatorError(f"{rule}.")
    motions = _motions_of(args, MOTIONS)
    wanted = orders(scene_of(args), motions, range(args.seed, args.seed + seeds), seconds,
                    network=Network(loss=args.loss), sketched=bool(args.sketched))
    baseline = None if args.baseline is None else read_baseline(args.baseline)
    folder = args.logs or data_sets_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as exc:
        raise SimulatorError(f"--logs {folder}: logs cannot be kept there ({exc.strerror}); choose another folder."
                             ) from exc
    announce_compilation()
    line = ProgressLine("")
    result = compare(wanted, folder, {name: TRACKERS[name] for name in names},
                     lambda title: ProgressLine(f"filming {title}"), line.report)
    line.report("comparing", 1.0)
    line.finish()
    if result.outdated:
        print(f"{result.outdated} logs in {folder} were filmed with another detector or twin than today's; "
              "remove them, or choose another --logs, to film anew.", file=sys.stderr)
    tables = [table(result), LEGEND, consistency_table(result)]
    if baseline is not None:
        tables.append(baseline_table(result, baseline))
    print(json.dumps(as_fields(result)) if args.json else "\n\n".join(tables))
    return 0
