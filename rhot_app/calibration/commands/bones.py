"""``rhot calibrate bones``: the hand's lengths from a recorded minute of movement, or entered by hand."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.calibration.commands.output import add_json_argument, show

if TYPE_CHECKING:
    from rhot_app.calibration.bones_report import BonesReport
    from rhot_app.calibration.marker_places import MarkerTracks
    from rhot_app.hand.anatomy import HandAnatomy


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate bones``."""
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--log", type=Path, metavar="LOG",
                        help="a raw log in which the hand moves freely for a minute")
    source.add_argument("--tsv", type=Path, metavar="FILE", help="a Qualisys TSV export with markers on a hand")
    parser.add_argument("--rig", type=Path, metavar="RIG",
                        help="calibrated rig for the log (default: the log's own)")
    parser.add_argument("--roles", nargs="+", default=[], metavar="NAME=ROLE",
                        help="where markers sit, as m1=index_tip m2=index_medial m3=palm_1 m4=wrist")
    parser.add_argument("--hand", type=Path, metavar="BASE",
                        help="hand file to begin from (default: the rig's hand, or the adult hand of the project)")
    parser.add_argument("--side", choices=("right", "left"), help="which hand it is (default: the base hand's)")
    parser.add_argument("--set", nargs="+", default=[], metavar="BONE=MM", dest="lengths",
                        help="enter lengths by hand, as index.proximal=41")
    parser.add_argument("--out", type=Path, metavar="HAND", help="write the hand file here")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Solve or enter, report; the hand is written only with ``--out`` and a verdict that allows it."""
    from rhot_app.calibration.bones import solve_bones
    from rhot_app.calibration.bones_entry import enter_bones
    from rhot_app.errors import CalibrationError
    from rhot_app.hand.anatomy import save_hand
    from rhot_app.progress import ProgressLine

    lengths = {name: _number(name, value) for name, value in _pairs(args.lengths, "--set index.proximal=41")}
    recorded = args.log is not None or args.tsv is not None
    if recorded == bool(lengths):
        raise CalibrationError("give one of --log LOG, --tsv FILE (the hand moves freely for a minute) or "
                               "--set BONE=MM (lengths measured with a ruler).")
    if recorded:
        tracks, worn = _tracks(args)
        report = solve_bones(tracks, _base(args, worn), progress=ProgressLine("bones").report)
    else:
        report = enter_bones(_base(args, None), lengths)
    written = ""
    if args.out is not None and report.verdict.acceptable:
        try:
            save_hand(args.out, report.hand)
        except OSError as exc:
            raise CalibrationError(f"{args.out}: cannot be written ({exc.strerror}).") from exc
        written = str(args.out)
    return show(report.to_json(), _lines(report), report.verdict, as_json=args.json, written=written)


def _tracks(args: argparse.Namespace) -> tuple[MarkerTracks, HandAnatomy | None]:
    """The markers of the recording, and the hand of its rig if there is one."""
    from rhot_app.calibration.marker_places import tracks_of

    roles = dict(_pairs(args.roles, "--roles m1=index_tip"))
    if args.tsv is not None:
        from rhot_app.recording.qualisys import read_qualisys

        points = read_qualisys(args.tsv)
        return tracks_of(points.times_s, points.positions, points.names, roles), None
    from rhot_app.project import load_rig
    from rhot_app.recording.observation_table import read_instants

    rig, instants = read_instants(args.log, None if args.rig is None else load_rig(args.rig))
    markers = rig.markers.markers
    roles = {marker.id: marker.role for marker in markers if marker.role is not None} | roles
    painted = frozenset(marker.id for marker in markers if marker.shape in ("capsule", "band"))
    return tracks_of(instants.times_s, instants.positions, rig.markers.ids, roles, painted=painted), rig.hand


def _base(args: argparse.Namespace, worn: HandAnatomy | None) -> HandAnatomy:
    """The hand to begin from: the file's, else the rig's, else the shipped one of this side."""
    import msgspec

    from rhot_app.hand.anatomy import load_hand
    from rhot_node.files import resource_path

    if args.hand is not None:
        base = load_hand(args.hand)
    else:
        base = worn or load_hand(resource_path("hands", f"{args.side or 'right'}.json"))
    return base if args.side is None else msgspec.structs.replace(base, side=args.side)


def _pairs(words: list[str], example: str) -> list[tuple[str, str]]:
    from rhot_app.errors import CalibrationError

    found = []
    for word in words:
        name, equals, value = word.partition("=")
        if not (name and equals and value):
            raise CalibrationError(f"{word!r} is not of the form NAME=VALUE; write for example {example}.")
        found.append((name, value))
    return found


def _number(name: str, text: str) -> float:
    from rhot_app.errors import CalibrationError

    try:
        return float(text)
    except ValueError:
        raise CalibrationError(f"{name}: {text!r} is not a number of millimetres.") from None


def _lines(report: BonesReport) -> list[str]:
    """The figures for people."""
    lines = [f"{'bone':18}{'length':>9}{'+-':>7}  mm"]
    lines += [f"{bone.name:18}{bone.length_mm:9.1f}{bone.std_mm:7.1f}  {bone.known.value}" for bone in report.bones]
    lines += [f"{'reach ' + reach.finger:18}{reach.length_mm:9.1f}{reach.std_mm:7.1f}" for reach in report.reaches]
    lines += [f"marker {spot.marker} on {spot.place}: along {spot.along_mm:.1f}, across {spot.across_mm:.1f}, "
              f"above {spot.above_mm:.1f} mm" for spot in report.markers]
    lines += [f"rigid: {pair.first} - {pair.second} {pair.distance_mm:.2f} +- {pair.std_mm:.2f} mm"
              for pair in report.rigid]
    return lines
