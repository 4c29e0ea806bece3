"""The bones calibration: the hand's lengths from a minute of movement, or entered by hand."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.registry import Calibration, Command, InForce, Observed
from rhot_app.calibration.report import Figure, Report, Table
from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.errors import CalibrationError, input_file
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.calibration.check.health import HealthFigures
    from rhot_app.calibration.hand.bones_result import BonesResult
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


def observe(args: argparse.Namespace, progress: Progress) -> Observed:
    """The markers of the recording, or what was entered, and the hand to begin from."""
    lengths = _lengths(args.lengths)
    recorded = args.log is not None or args.tsv is not None
    if recorded == bool(lengths):
        raise CalibrationError("give one of --log LOG, --tsv FILE (the hand moves freely for a minute) or "
                               "--set BONE=MM (lengths measured with a ruler).")
    if not recorded:
        return Observed((lengths, _base(args, None, "" if args.hand is not None else "measured with a ruler")))
    progress("reading the recording", 0.0)
    tracks, seats, worn = _tracks(args)
    source = args.log or args.tsv
    return Observed((tracks, _base(args, worn, f"measured from {source.name}")), notes=tuple(seats.lines()),
                    fields=seats.to_json())


def solve(measured: Path | MarkerTracks | Mapping[str, float], base: HandAnatomy, now: InForce | None, *,
          progress: Progress) -> BonesResult:
    """The hand from a recording with the rig in force, from markers, or from lengths in mm. Raises CalibrationError."""
    from rhot_app.calibration.hand.bones import enter_bones, solve_bones
    from rhot_app.calibration.hand.marker_places import tracks_of
    from rhot_app.calibration.recorded_observations import read_instants

    if isinstance(measured, Mapping):
        return enter_bones(base, measured)
    if isinstance(measured, Path):
        assert now is not None
        progress("reading the recording", 0.0)
        _, instants = read_instants(measured, now.rig)
        roles, painted = roles_of(now.rig)
        measured = tracks_of(instants.times_s, instants.positions, now.rig.markers.ids, roles, painted=painted)
    return solve_bones(measured, base, progress=progress)


def write(args: argparse.Namespace, result: BonesResult, now: InForce | None) -> str:
    """The hand file."""
    from rhot_app.hand.anatomy import save_hand

    if args.out is None:
        return ""
    save_hand(args.out, result.hand)
    return str(args.out)


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


def roles_of(rig: Rig) -> tuple[dict[str, str], frozenset[str]]:
    """The places of markers that have one, and the markers that are painted round a finger."""
    markers = rig.markers.markers
    return ({marker.id: marker.role for marker in markers if marker.role is not None},
            frozenset(marker.id for marker in markers if marker.shape in ("capsule", "band")))


def report(result: BonesResult, now: InForce | None) -> Report:
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


def propose(result: BonesResult, now: InForce) -> Proposal:
    """The rig with this hand."""
    import msgspec

    from rhot_app.calibration.proposal import proposed

    after = msgspec.structs.replace(now.rig, hand=msgspec.structs.replace(result.hand, name=NAMES[result.method]))
    return proposed(CALIBRATION.reason, report(result, now), now.rig, after)


RIGID_PART, RIGID_M = 0.03, 3e-3
"""How far the distance of two markers on one bone may change, and at least."""

REACH_PART = 0.05
"""By how much a tip may be further from the wrist than all bones in a row."""


def check(figures: HealthFigures) -> list[Finding]:
    """Whether markers on one bone have moved apart, and tips are farther away than the bones are long; this only where
    the cameras agree."""
    return [*_rigid(figures), *([] if figures.late or figures.apart else _reach(figures))]


def _rigid(figures: HealthFigures) -> list[Finding]:
    worst = max(figures.rigid, key=lambda one: abs(one.now_m - one.learnt_m), default=None)
    if worst is None or abs(worst.now_m - worst.learnt_m) <= max(RIGID_PART * worst.learnt_m, RIGID_M):
        return []
    figure = (f"{' and '.join(worst.markers)} sit on one bone; they were {1e3 * worst.learnt_m:.1f} mm apart and are "
              f"{1e3 * worst.now_m:.1f} mm now.")
    return [Finding("rigid_drift", Grade.FAIR, figure, "A marker slipped, or a camera was moved.",
                    "Press the markers on and measure the hand again (Calibrate menu).")]


def _reach(figures: HealthFigures) -> list[Finding]:
    far = [one for one in figures.reaches if one.seen_m > (1.0 + REACH_PART) * one.longest_m]
    if not far:
        return []
    worst = max(far, key=lambda one: one.seen_m / one.longest_m)
    figure = (f"{worst.marker} was {1e3 * worst.seen_m:.0f} mm from the wrist, but the bones between are only "
              f"{1e3 * worst.longest_m:.0f} mm long in all.")
    cause = "It sits elsewhere than the rig says, something else has its colour, or a camera was turned."
    if len(far) > 1:
        cause = "This hand is larger than the hand file says, or the rig's cameras stand further apart than it says."
    remedy = "Measure this hand (Calibrate menu)."
    return [Finding("reach", Grade.FAIR, figure, cause, remedy)]


CALIBRATION = Calibration(
    "bones", "Bones of the hand", "How long the bones are, from a minute of movement or by a ruler.",
    "bones calibration",
    Command("bones", "the hand's bones and where the markers sit, from a minute of free movement or a ruler",
            add_arguments, observe, write=write),
    solve=solve, report=report, propose=propose, check=check, solver="rhot_app.calibration.hand.bones")
