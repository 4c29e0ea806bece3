"""``rhot calibrate bones``: the hand's lengths from a recorded minute of movement, or entered by hand."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.commands.output import show
from rhot_app.errors import CalibrationError, input_file
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.hand.bones_report import BonesReport
    from rhot_app.calibration.hand.marker_places import MarkerTracks
    from rhot_app.hand.anatomy import HandAnatomy


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot calibrate bones``."""
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--log", type=input_file, metavar="LOG",
                        help="a raw log in which the hand moves freely for a minute")
    source.add_argument("--tsv", type=input_file, metavar="FILE", help="a Qualisys TSV export with markers on a hand")
    add_rig_argument(parser, "calibrated rig for the log (default: the log's own)")
    parser.add_argument("--roles", nargs="+", default=[], metavar="NAME=ROLE",
                        help="where markers sit, as m1=index_tip m2=index_medial m3=palm_1 m4=wrist")
    parser.add_argument("--hand", type=input_file, metavar="BASE",
                        help="hand file to begin from (default: the rig's hand, or the adult hand of the project)")
    parser.add_argument("--side", choices=("right", "left"), help="which hand it is (default: the base hand's)")
    parser.add_argument("--set", nargs="+", default=[], metavar="BONE=MM", dest="lengths",
                        help="enter lengths by hand, as index.proximal=41")
    parser.add_argument("--name", help="what the hand is called (default: after the recording; with --set: as before)")
    add_out_argument(parser, "write the hand file here", metavar="HAND")
    add_json_argument(parser)
    add_examples(parser, "rhot calibrate bones --log free.rhotlog --rig desk.json --out mine.json",
                 "rhot calibrate bones --set index.proximal=41 middle.proximal=46 --out mine.json")


def run(args: argparse.Namespace) -> int:
    """Solve or enter, report; the hand is written only with ``--out`` and a verdict that allows it."""
    from rhot_app.hand.anatomy import save_hand

    lengths = _lengths(args.lengths)
    recorded = args.log is not None or args.tsv is not None
    if recorded == bool(lengths):
        raise CalibrationError("give one of --log LOG, --tsv FILE (the hand moves freely for a minute) or "
                               "--set BONE=MM (lengths measured with a ruler).")
    if args.out is not None and not args.out.parent.is_dir():
        raise CalibrationError(f"--out {args.out}: the folder {args.out.parent} does not exist; create it first.")
    report, seats = _move(args) if recorded else (_enter(args, lengths), None)
    written = ""
    if args.out is not None and report.verdict.acceptable:
        try:
            save_hand(args.out, report.hand)
        except OSError as exc:
            raise CalibrationError(f"--out {args.out}: cannot be written ({exc.strerror}).") from exc
        written = str(args.out)
    fields = {"name": report.hand.name, **report.to_json()} | ({} if seats is None else seats.to_json())
    lines = _lines(report) + ([] if seats is None else seats.lines())
    return show(fields, lines, report.verdict, as_json=args.json, written=written)


@dataclass(frozen=True, slots=True)
class _Seats:
    """Where each marker of a recording was taken to sit: `given` by a role, `guessed` by its name, or not on a hand."""

    given: dict[str, str]
    guessed: dict[str, str]
    others: tuple[str, ...]

    def lines(self) -> list[str]:
        """For people."""
        found = []
        if self.guessed:
            found.append("Places guessed from the markers' names (--roles NAME=ROLE says otherwise): "
                         + ", ".join(f"{name} = {place}" for name, place in self.guessed.items()))
        if self.others:
            found.append(f"Taken not to sit on the hand: {', '.join(self.others)}")
        return found

    def to_json(self) -> dict[str, Any]:
        """Fields of the report."""
        places = {name: {"place": place, "guessed": guessed}
                  for seats, guessed in ((self.given, False), (self.guessed, True)) for name, place in seats.items()}
        return {"places": places, "not_on_hand": list(self.others)}


def _move(args: argparse.Namespace) -> tuple[BonesReport, _Seats]:
    """The hand of a recording."""
    from rhot_app.calibration.hand.bones import solve_bones
    from rhot_app.progress import ProgressLine

    line = ProgressLine("reading the recording")
    line.report("reading the recording", 0.0)
    tracks, seats, worn = _tracks(args)
    source = args.log or args.tsv
    report = solve_bones(tracks, _base(args, worn, f"measured from {source.name}"), progress=line.report)
    line.finish()
    return report, seats


def _enter(args: argparse.Namespace, lengths: dict[str, float]) -> BonesReport:
    """The hand of a ruler."""
    from rhot_app.calibration.hand.bones import enter_bones

    return enter_bones(_base(args, None, "" if args.hand is not None else "measured with a ruler"), lengths)


def _tracks(args: argparse.Namespace) -> tuple[MarkerTracks, _Seats, HandAnatomy | None]:
    """The markers of the recording, where they sit, and the hand of its rig if there is one."""
    from rhot_app.calibration.hand.marker_places import tracks_of

    roles = dict(_pairs(args.roles, "--roles m1=index_tip"))
    if args.tsv is not None:
        from rhot_app.recording.qualisys import read_qualisys

        points = read_qualisys(args.tsv)
        tracks = tracks_of(points.times_s, points.positions, points.names, roles)
        return tracks, _seats(tracks, points.names, roles), None
    from rhot_app.calibration.recorded_observations import read_instants
    from rhot_app.project import load_rig

    rig, instants = read_instants(args.log, None if args.rig is None else load_rig(args.rig))
    markers = rig.markers.markers
    roles = {marker.id: marker.role for marker in markers if marker.role is not None} | roles
    painted = frozenset(marker.id for marker in markers if marker.shape in ("capsule", "band"))
    tracks = tracks_of(instants.times_s, instants.positions, rig.markers.ids, roles, painted=painted)
    return tracks, _seats(tracks, rig.markers.ids, roles), rig.hand


def _seats(tracks: MarkerTracks, names: Sequence[str], roles: Mapping[str, str]) -> _Seats:
    places = {place.name: place.word for place in tracks.places}
    return _Seats({name: word for name, word in places.items() if name in roles},
                  {name: word for name, word in places.items() if name not in roles},
                  tuple(name for name in names if name not in places))


def _base(args: argparse.Namespace, worn: HandAnatomy | None, name: str) -> HandAnatomy:
    """The hand to begin from: the file's, else the rig's, else the shipped one of this side; `name` becomes its name,
    or its own stays when that is empty."""
    import msgspec

    from rhot_app.hand.anatomy import load_hand
    from rhot_node.files import resource_path

    if args.hand is not None:
        base = load_hand(args.hand)
    else:
        base = worn or load_hand(resource_path("hands", f"{args.side or 'right'}.json"))
    return msgspec.structs.replace(base, side=args.side or base.side, name=args.name or name or base.name)


def _pairs(words: list[str], example: str) -> list[tuple[str, str]]:
    found = []
    for word in words:
        name, equals, value = word.partition("=")
        if not (name and equals and value):
            raise CalibrationError(f"{word!r} is not of the form NAME=VALUE; write for example {example}.")
        found.append((name, value))
    return found


def _lengths(words: list[str]) -> dict[str, float]:
    """What was entered, mm by bone."""
    found: dict[str, float] = {}
    for name, text in _pairs(words, "--set index.proximal=41"):
        if name in found:
            raise CalibrationError(f"--set gives {name} twice.")
        try:
            found[name] = float(text)
        except ValueError:
            raise CalibrationError(f"{name}: {text!r} is not a number of millimetres.") from None
    return found


def _lines(report: BonesReport) -> list[str]:
    """The figures for people."""
    lines = [f"{'bone':18}{'length':>9}{'±':>7}  mm"]
    lines += [f"{bone.name:18}{bone.length_mm:9.1f}{bone.std_mm:7.1f}  {bone.known.word}" for bone in report.bones]
    lines += [f"{'reach ' + reach.finger:18}{reach.length_mm:9.1f}{reach.std_mm:7.1f}" for reach in report.reaches]
    lines += [f"marker {spot.marker} on {spot.place}: along {spot.along_mm:.1f}, across {spot.across_mm:.1f}, "
              f"above {spot.above_mm:.1f} mm" for spot in report.markers]
    lines += [f"rigid: {pair.first} - {pair.second} {pair.distance_mm:.2f} ± {pair.std_mm:.2f} mm"
              for pair in report.rigid]
    return lines
