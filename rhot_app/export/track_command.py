"""``rhot track``: a bare hand in recorded videos, by landmark networks or by its contours."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.errors import RecordingError, input_file
from rhot_app.export import bare_hand_command
from rhot_app.export.bare_hand_command import film_offsets, named, offset_fields, offset_sentences, opened_videos
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.project import Rig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot track``."""
    parser.add_argument("videos", nargs="*", default=[], metavar="CAMERA=VIDEO",
                        help="a camera of the rig and its video; paths alone take the rig's cameras in order. A video "
                             "is a film, a picture, or a folder of pictures or of raw frames")
    bare_hand_command.add_arguments(parser)
    parser.add_argument("--observe", choices=("landmarks", "contours"), default=None,
                        help="what is looked for: the landmarks of the installed hand networks, or the hand's contours "
                             "(default: contours where the rig's tracker observes these alone, else landmarks)")
    parser.add_argument("--bones", choices=("measured", "rig"), default="measured",
                        help="the hand's bones: measured from the landmarks of two cameras (default), or as the rig "
                             "has them")
    parser.add_argument("--log", type=Path, metavar="FILE",
                        help="write the landmarks as a raw log, too, which the app replays beside the films' pictures")
    parser.add_argument("--smooth", action="store_true", help="every state uses what came after it as well")
    add_examples(parser, "rhot track left=left.mp4 right=right.mp4 --rig desk.json --out hand.csv --overlay hand.mp4",
                 "rhot track hand.mp4 --overlay hand-tracked.mp4")


def run(args: argparse.Namespace) -> int:
    """Track, and say what came of it. Raises KeypointError, RecordingError, ExportError and RigError."""
    from rhot_app.project import load_rig

    rig = None if args.rig is None else load_rig(args.rig)
    observe = args.observe or ("contours" if rig is not None and rig.tracker.observe == "contours" else "landmarks")
    if observe == "landmarks":
        return _by_landmarks(args, rig)
    if rig is None:
        raise RecordingError("--observe contours needs a calibrated rig; give it with --rig.")
    if args.log is not None:
        raise RecordingError("--log: only landmarks are kept; take --observe landmarks, or leave --log out.")
    if args.smooth:
        raise RecordingError("--smooth: only landmarks are smoothed; take --observe landmarks, or leave --smooth out.")
    args.videos = with_names(args.videos, rig)
    return bare_hand_command.run(args)


def with_names(given: list[str], rig: Rig) -> list[str]:
    """All videos as CAMERA=VIDEO; paths alone take the cameras in the rig's order. Raises RecordingError."""
    names = [node.name for node in rig.nodes]
    if not given:
        raise RecordingError(f"give a video of a camera, as in {names[0]}=hand.mp4.")
    if any("=" in text and not Path(text).exists() for text in given):
        return given
    if len(given) > len(names):
        raise RecordingError(f"{len(given)} videos, but the rig has {len(names)} cameras: {', '.join(names)}.")
    return [f"{name}={text}" for name, text in zip(names, given, strict=False)]


def _by_landmarks(args: argparse.Namespace, rig: Rig | None) -> int:
    said = []
    if args.start is not None:
        raise RecordingError("--start is of contours: add --observe contours, or leave it out; landmarks need none.")
    if args.adapt is not None and args.bones == "rig":
        raise RecordingError("--adapt writes the bones that are measured; leave --bones rig out.")
    if args.background or args.background_seconds is not None:
        said.append("Landmarks need no background: what was given of it is not used.")
    paths = args.videos
    if rig is not None:
        given = named(with_names(args.videos, rig), "", rig)
        paths = list(given.values())
    for path in paths if rig is not None or len(paths) == 1 else ():
        input_file(path)  # refused before numba is loaded
    from rhot_app.export.landmark_track import (
        LandmarkRun,
        assumed_rig,
        landmark_rig_of,
        landmark_sentences,
        track_landmarks,
    )

    if rig is None:
        rig = assumed_rig(paths)
        lens = rig.nodes[0].intrinsics
        said.append(f"Without --rig the lens is assumed to see {lens.ASSUMED_DEG:.0f} degrees across (focal length "
                    f"{lens.fx:.0f} px) and the hand to be of usual size; distances are wrong by as much as these are.")
        given = {rig.nodes[0].name: paths[0]}
    from rhot_app.progress import ProgressLine
    from rhot_node.compiled import announce_compilation
    from rhot_node.landmarks.networks import open_hand_networks

    open_hand_networks()  # without them nothing is begun
    rig = landmark_rig_of(rig, tuple(given))
    offsets = film_offsets(args, rig, given)
    said += offset_sentences(args, offsets)
    videos = opened_videos(args, rig, given, offsets)
    announce_compilation()
    line = ProgressLine("tracking")
    summary = track_landmarks(rig, videos, LandmarkRun(
        either_side=args.rig is None, measure=args.bones == "measured", unknown_size=args.unknown_size,
        smooth=args.smooth, out=args.out, pictures=args.overlay, kept=args.log, hand_file=args.adapt,
        again=args.force), line.report)
    line.finish()
    if args.rig is None:
        said.append(f"The networks find mostly {summary.side} hands, so a {summary.side} hand is tracked.")
    document = summary.document() | {"out": args.out and str(args.out), "overlay": args.overlay and str(args.overlay),
                                     "log": args.log and str(args.log),
                                     "hand_file": str(args.adapt) if summary.adapted else None,
                                     "notes": said, **offset_fields(offsets)}
    print(json.dumps(document) if args.json else "\n".join([*said, *landmark_sentences(document)]))
    return 0
