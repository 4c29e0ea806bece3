"""``rhot calibrate bones``: the hand's lengths from a recorded minute of movement, or entered by hand."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.commands.output import show
from rhot_app.calibration.registry import BONES
from rhot_app.calibration.report import Figure, Report, Table
from rhot_app.errors import CalibrationError, input_file
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.hand.bones_report import BonesReport
    from rhot_app.calibration.hand.marker_places import MarkerTracks
    from rhot_app.calibration.proposal import Proposal
    from rhot_app.hand.anatomy import HandAnatomy
    from rhot_app.progress import Progress
    from rhot_app.project import Rig


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
    result, seats = _move(args) if recorded else (_enter(args, lengths), None)
    written = ""
    if args.out is not None and result.verdict.acceptable:
        try:
            save_hand(args.out, result.hand)
        except OSError as exc:
            raise CalibrationError(f"--out {args.out}: cannot be written ({exc.strerror}).") from exc
        written = str(args.out)
    said = report(result)
    if seats is not None:
        said = replace(said, notes=(*said.notes, *seats.lines()), fields={**said.fields, **seats.to_json()})
    return show(said, as_json=args.json, written=written)


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
    worn, painted = roles_of(rig)
    roles = worn | roles
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


# -- what is said of the result, and what it changes -------------------------------------------------------------------

NAMES = {"movement": "measured by movement", "reach": "measured by movement", "entered": "measured with a ruler",
         "landmarks": "measured from landmarks"}
"""Of a hand in a rig, by the method."""


def solve_log(log: Path, rig: Rig, base: HandAnatomy, *, progress: Progress) -> BonesReport:
    """The hand from a recording. Raises CalibrationError."""
    from rhot_app.calibration.hand.bones import solve_bones
    from rhot_app.calibration.hand.marker_places import tracks_of
    from rhot_app.calibration.recorded_observations import read_instants

    progress("reading the recording", 0.0)
    _, instants = read_instants(log, rig)
    roles, painted = roles_of(rig)
    tracks = tracks_of(instants.times_s, instants.positions, rig.markers.ids, roles, painted=painted)
    return solve_bones(tracks, base, progress=progress)


def roles_of(rig: Rig) -> tuple[dict[str, str], frozenset[str]]:
    """The places of markers that have one, and the markers that are painted round a finger."""
    markers = rig.markers.markers
    return ({marker.id: marker.role for marker in markers if marker.role is not None},
            frozenset(marker.id for marker in markers if marker.shape in ("capsule", "band")))


def report(result: BonesReport) -> Report:
    """The size of the hand, its bones and reaches, and where its markers sit."""
    bones = tuple((Figure("bone", bone.name), Figure("length", bone.length_mm, "mm", decimals=1, key="length_mm"),
                   Figure("±", bone.std_mm, "mm", decimals=1, key="std_mm"),
                   Figure("", bone.usual_std_mm, key="usual_std_mm"), Figure("known", bone.known.word),
                   Figure("", bone.known.value, key="known")) for bone in result.bones)
    reaches = tuple((Figure("reach of", reach.finger),
                     Figure("length", reach.length_mm, "mm", decimals=1, key="length_mm"),
                     Figure("±", reach.std_mm, "mm", decimals=1, key="std_mm")) for reach in result.reaches)
    spots = tuple((Figure("marker", spot.marker), Figure("on", spot.place, key="place"),
                   Figure("along", spot.along_mm, "mm", decimals=1, key="along_mm"),
                   Figure("across", spot.across_mm, "mm", decimals=1, key="across_mm"),
                   Figure("above", spot.above_mm, "mm", decimals=1, key="above_mm"),
                   Figure("", spot.std_mm, key="std_mm")) for spot in result.markers)
    rigid = tuple((Figure("rigid", f"{pair.first} - {pair.second}"),
                   Figure("", (pair.first, pair.second), key="markers"),
                   Figure("distance", pair.distance_mm, "mm", pair.std_mm, key="distance_mm", sd_key="std_mm"))
                  for pair in result.rigid)
    return Report(
        result.verdict, (Figure("size", 100.0 * result.size, "%", 100.0 * result.size_std),),
        (Table("bones", bones, by_name=True), Table("reach", reaches, by_name=True),
         Table("markers", spots, by_name=True), Table("rigid_distances", rigid)), fields={
            "name": result.hand.name, "method": result.method, "side": result.hand.side, "size": result.size,
            "size_std": result.size_std, "residual_mm": result.residual_mm, "noise_mm": result.noise_mm,
            "error_mm": result.error_mm, "seconds": result.seconds, "instants": result.instants})


def propose(result: BonesReport, rig: Rig) -> Proposal:
    """The rig with this hand."""
    import msgspec

    from rhot_app.calibration.proposal import proposed

    after = msgspec.structs.replace(rig, hand=msgspec.structs.replace(result.hand, name=NAMES[result.method]))
    return proposed(BONES.reason, report(result), rig, after)
