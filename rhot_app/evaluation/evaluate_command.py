"""``rhot evaluate live|compare|bare-hand``: the whole system against the truth it never saw, trackers side by side on
the same logs, and a tracker without markers on bare hands."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.errors import not_negative, positive_count
from rhot_app.options import add_json_argument, add_seconds_argument, add_seed_argument
from rhot_app.simulator.scene.scene_arguments import MOTION, SECONDS_MAX, add_scene_arguments, fields_of
from rhot_node.compiled import announce_compilation
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.simulator.scene.scene_file import SceneFields

_JUDGED_S = 0.1  # shorter is no run
_OF_PICTURES = ("background", "worn_paint", "uneven_paint", "glove_rgb", "lamp")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot evaluate`` and of its three commands."""
    commands = parser.add_subparsers(dest="evaluation", metavar="COMMAND", title="commands", required=True)
    for name, add, summary in (
            ("live", _add_live, "play a simulated run in real time to nodes and engine, and compare with its truth"),
            ("compare", _add_compare, "put the same raw logs through several trackers, without real time"),
            ("bare-hand", _add_bare_hand, "put a tracker without markers through the cases of a bare hand")):
        add(commands.add_parser(name, help=summary, description=f"{summary[0].upper()}{summary[1:]}."))
    add_examples(parser, "rhot evaluate live --motion pinch --seconds 10",
                 "rhot evaluate compare --motions rest,pinch --sketched")


def _add_live(parser: argparse.ArgumentParser) -> None:
    add_scene_arguments(parser)
    _add_run(parser, 20, "length of the run; its first second is not judged")
    parser.add_argument("--detector", default="fast", choices=("fast", "reference"),
                        help="the nodes' detector: fast, or reference, the thesis's pipeline")
    parser.add_argument("--frames", type=Path, metavar="DIR",
                        help="play this folder of `rhot simulate` instead of rendering; the scene is what it says")
    add_examples(parser, "rhot evaluate live --motion pinch --seconds 10",
                 "rhot evaluate live --scene clutter.json --loss 0.1 --json")


def _add_compare(parser: argparse.ArgumentParser) -> None:
    add_scene_arguments(parser, motion=False)
    _add_run(parser, 8, "length of each run; its first second is not judged")
    _add_seeds(parser, 5)
    parser.add_argument("--motions", action="append", metavar="M,M,...", default=None,
                        help="motions to compare on, also files and recordings (Qualisys .tsv, Leap Motion .csv); "
                             "repeatable (default: the scene file's, or rest,wave,grasp,pinch,fast)")
    parser.add_argument("--trackers", metavar="T,T,...", default="classic,estimator",
                        help="which trackers (default classic,estimator); the ratio is the last one's to the first's")
    parser.add_argument("--sketched", action="store_true",
                        help="logs without pictures: exact outlines, noise and bias put on, hidden parts counted; fast")
    parser.add_argument("--baseline", type=Path, metavar="FILE", default=None,
                        help="print the last tracker's ratios to the figures kept in FILE (benchmarks/baselines)")
    add_examples(parser, "rhot evaluate compare --sketched --motions rest,pinch",
                 "rhot evaluate compare --trackers classic,estimator --seeds 3 --json")


def _add_bare_hand(parser: argparse.ArgumentParser) -> None:
    add_seed_argument(parser, "the first run")
    add_seconds_argument(parser, "length of each run, from 2.5", 3.0)
    add_json_argument(parser)
    _add_seeds(parser, 10)
    parser.add_argument("--cases", metavar="TEXT", default=None, help="only the cases whose names begin with TEXT")
    add_examples(parser, "rhot evaluate bare-hand --cases matched --seeds 2", "rhot evaluate bare-hand --json")


def _add_run(parser: argparse.ArgumentParser, seconds: float, what: str) -> None:
    """What a run on observations has."""
    add_seconds_argument(parser, what, seconds)
    parser.add_argument("--loss", type=not_negative, default=0.0, metavar="P",
                        help="probability 0..1 that a datagram of observations is lost (default 0)")
    add_json_argument(parser)


def _add_seeds(parser: argparse.ArgumentParser, seeds: int) -> None:
    """What several runs have, whose logs are kept."""
    parser.add_argument("--seeds", type=positive_count, default=seeds, metavar="N",
                        help=f"how many seeds, beginning with --seed (default {seeds})")
    parser.add_argument("--logs", type=Path, metavar="DIR", default=None,
                        help="where logs are kept and found again (default ~/.cache/rhot/takes)")


def run(args: argparse.Namespace) -> int:
    """Render (or take) the frames, play them, compare, print. Raises RhotError."""
    return {"live": _live, "compare": _compare, "bare-hand": _bare_hand}[args.evaluation](args)


def _require(*rules: tuple[bool, str]) -> None:
    """Raises SimulatorError with the first rule that does not hold."""
    from rhot_app.errors import SimulatorError

    for holds, rule in rules:
        if not holds:
            raise SimulatorError(f"{rule}.")


def _scene_of_hand(args: argparse.Namespace) -> SceneFields:
    """The scene, of a hand with markers and nothing else. Raises SimulatorError, RigError."""
    fields = fields_of(args)
    shown = "a cube, too" if fields.show.get("cube") else fields.show.get("show", "hand").replace("_", "-")
    _require((shown == "hand", f"what is evaluated is a hand with markers alone, and the scene shows {shown}; choose "
              "another --scene, or `rhot evaluate bare-hand`"))
    return fields


def _live(args: argparse.Namespace) -> int:
    from rhot_app.evaluation.run import SETTLE_S, details, evaluate, evaluate_frames, table

    _require((SETTLE_S + _JUDGED_S <= args.seconds <= SECONDS_MAX or args.frames is not None,
              f"--seconds {args.seconds:g}: a run of so long cannot be judged: the first {SETTLE_S:g} s are not, and "
              f"it must end within {SECONDS_MAX:.0f} s"),
             (0.0 <= args.loss < 1.0, f"--loss is a probability from 0 to below 1, not {args.loss:g}"))
    fields = _scene_of_hand(args)
    with tempfile.TemporaryDirectory(prefix="rhot-") as work:
        options = {"loss": args.loss, "detector": args.detector}
        if args.frames is not None:
            figures = evaluate_frames(args.frames.absolute(), Path(work), **options)
        else:
            figures = evaluate(fields.scene(), fields.show.get("motion", MOTION), args.seconds, Path(work), **options)
    if args.json:
        print(json.dumps(figures))
    else:
        print(table([(figures["motion"], figures)]), details(figures), sep="\n\n")
    return 0


def _bare_hand(args: argparse.Namespace) -> int:
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
    least_s = LOSS_S[1] + SETTLE_S
    _require((bool(cases), f"--cases: none of {', '.join(case.name for case in CASES)} begins with {args.cases!r}"),
             (least_s <= args.seconds <= SECONDS_MAX, f"--seconds is from {least_s:g} to {SECONDS_MAX:.0f} here"))
    announce_compilation()
    line = ProgressLine("")
    found = list(evaluate_bare_hand(tracker, range(args.seed, args.seed + args.seeds), args.seconds,
                                    args.logs or data_sets_folder(), cases, line.report))
    line.report("evaluating", 1.0)
    line.finish()
    print(json.dumps(bare_hand_fields(found, args.seconds)) if args.json else bare_hand_table(found))
    return 0


def _motions_of(args: argparse.Namespace, usual: Sequence[str]) -> list[str]:
    """What is compared on. Raises SimulatorError for what is not there."""
    if args.motions is None:
        return list(usual)
    motions = [name.strip() for given in args.motions
               for name in ([given] if Path(given).is_file() else given.split(","))]
    _require((all(motions), f"--motions {','.join(args.motions)!r}: put commas between names of motions only"))
    lacking = next((name for name in motions if Path(name).suffix and not Path(name).is_file()), None)
    _require((lacking is None, f"--motions {lacking}: there is no such file; name a motion, or a recorded one's file"))
    return list(dict.fromkeys(motions))


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
    from rhot_app.simulator.scene.scene import twin_defaults

    names = [name.strip() for name in args.trackers.split(",")]
    unknown = next((name for name in names if name not in TRACKERS), None)
    least_s = SETTLE_S + _JUDGED_S
    _require((unknown is None, f"--trackers: there is no tracker {unknown!r}; it takes some of {', '.join(TRACKERS)}"),
             (least_s <= args.seconds <= SECONDS_MAX, f"--seconds is from {least_s:g} to {SECONDS_MAX:.0f}"),
             (0.0 <= args.loss < 1.0, "--loss is from 0 to below 1"))
    fields = _scene_of_hand(args)
    scene = fields.scene()
    unseen = next((name for name in _OF_PICTURES
                   if getattr(scene.settings, name) != getattr(twin_defaults(), name)), None)
    _require((not args.sketched or unseen is None,
              f"--sketched goes without pictures, in which the scene's {unseen} would show: leave out one of them"))
    motions = _motions_of(args, [fields.show["motion"]] if "motion" in fields.show else MOTIONS)
    wanted = orders(scene, motions, range(scene.seed, scene.seed + args.seeds), args.seconds,
                    network=Network(loss=args.loss), sketched=args.sketched)
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
