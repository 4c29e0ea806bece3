"""The bare hand in recorded videos by its contours: `rhot track --observe contours`, as a table and as pictures."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.errors import RecordingError, input_file, positive_number
from rhot_app.options import (
    add_force_argument,
    add_json_argument,
    add_offset_argument,
    add_out_argument,
    add_rig_argument,
)

if TYPE_CHECKING:
    from rhot_app.project import Rig
    from rhot_app.sources.film_offset import FilmOffset
    from rhot_app.sources.frame_sets import CameraVideo


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments that landmarks and contours share."""
    add_rig_argument(parser, "the calibrated rig, with the hand's side")
    background = parser.add_mutually_exclusive_group()
    background.add_argument("--background", action="append", default=[], metavar="NAME=FILE",
                            help="for contours: a video of the same scene without a hand; once for each camera")
    background.add_argument("--background-seconds", default=None, metavar="S",
                            help="for contours: the videos show no hand for so long at their beginning (default: the "
                                 "background is not known, the hand is recognised by the colour of skin)")
    parser.add_argument("--start", default=None, metavar="FRAME|POSE.json",
                        help="for contours: the frame, from 0, in which the hand is in the rig's start pose; or a file "
                             "with the pose that it takes (default: followed from where it takes the rig's)")
    parser.add_argument("--fps", type=positive_number, default=None, metavar="N",
                        help="frames per second of ordinary videos, instead of what the files say, and of pictures")
    began = parser.add_mutually_exclusive_group()
    began.add_argument("--offset", choices=("sound", "flash"), default=None,
                       help="find out when each film began, by the sound of all or by a light that goes on once")
    add_offset_argument(began, "a camera's times, where the videos did not begin together")
    parser.add_argument("--unknown-size", action="store_true",
                        help="estimate the hand's size, too, unless all its bones are measured")
    add_out_argument(parser, "write the states as .csv, .parquet or .npz")
    parser.add_argument("--overlay", type=Path, metavar="PLACE",
                        help="draw what was found: a film (.avi, .mp4), or a new folder for PNG files")
    parser.add_argument("--adapt", type=Path, metavar="FILE",
                        help="write the hand in the videos, measured or adapted, as a hand file; what FILE was "
                             "before is kept in FILE.history")
    add_force_argument(parser, "write over files that exist")
    add_json_argument(parser, "print the summary as one JSON object")


def run(args: argparse.Namespace) -> int:
    """Track, and say what came of it. Raises RecordingError, ExportError and RigError."""
    import msgspec

    from rhot_app.progress import ProgressLine
    from rhot_app.project import load_rig

    rig, start_frame = with_start(load_rig(args.rig), args.start)
    given, empty_given = named(args.videos, "", rig), named(args.background, "--background", rig)
    for path in (*given.values(), *empty_given.values()):
        input_file(path)  # refused before numba is loaded
    from rhot_app.export.bare_hand import learn_backgrounds, track_videos
    from rhot_app.sources.frame_sets import checked_seconds, open_videos
    from rhot_node.compiled import announce_compilation

    rig = msgspec.structs.replace(rig, nodes=tuple(node for node in rig.nodes if node.name in given),
                                  depth=type(rig.depth)())
    offsets = film_offsets(args, rig, given)
    videos = opened_videos(args, rig, given, offsets)
    announce_compilation()
    foreground, empty_s = None, 0.0
    if args.background:
        empty = open_videos(rig, empty_given, args.fps)
        if len(empty) < len(videos):
            missing = next(node.name for node in rig.nodes if node.name not in {video.camera for video in empty})
            raise RecordingError(f"--background: camera {missing} has none; give one for every camera.")
        foreground = learn_backgrounds(empty)
    elif args.background_seconds is not None:
        empty_s = checked_seconds(args.background_seconds, "--background-seconds")
        _check_empty(videos, empty_s)
        foreground = learn_backgrounds(videos, empty_s)
    line = ProgressLine("tracking")
    summary = track_videos(rig, videos, foreground, known_size=not args.unknown_size, empty_s=empty_s,
                           start_frame=start_frame, out=args.out, pictures=args.overlay, again=args.force,
                           hand_file=args.adapt, progress=line.report)
    line.finish()
    document = summary.document() | {"out": args.out and str(args.out), "overlay": args.overlay and str(args.overlay),
                                     "hand_file": str(args.adapt) if args.adapt and summary.adapted else None,
                                     **offset_fields(offsets)}
    print(json.dumps(document) if args.json else "\n".join([*offset_sentences(args, offsets), *sentences(document)]))
    return 0


def with_start(rig: Rig, start: str | None) -> tuple[Rig, int | None]:
    """The rig with the start pose of a file, or the number of the frame with the rig's start pose. Raises RigError."""
    import msgspec

    from rhot_app.project import load_start_pose

    if start is None or start.isdecimal():
        return rig, None if start is None else int(start)
    poses = load_start_pose(input_file(start)), *rig.tracker.start_poses[1:]
    return msgspec.structs.replace(rig, tracker=msgspec.structs.replace(rig.tracker, start_poses=poses)), None


def _check_empty(videos: Sequence[CameraVideo], seconds: float) -> None:
    """Raises RecordingError where the videos cannot begin with so many seconds without a hand."""
    from rhot_app.sources.frame_sets import overlap

    if not seconds > 0.0:
        raise RecordingError(f"--background-seconds {seconds:g}: give a number above 0, the seconds without a hand at "
                             "the beginning.")
    first, last = overlap(videos)
    if round(1e9 * seconds) >= last - first:
        raise RecordingError(f"--background-seconds {seconds:g}: the videos show only {1e-9 * (last - first):.2f} s "
                             "together, so no time is left for the hand. Give fewer seconds, or videos of the empty "
                             "scene with --background.")


def named(given: Sequence[str], option: str, rig: Rig) -> dict[str, str]:
    """What an option, or a word without one (""), says of each camera, as NAME=VALUE. Raises RecordingError."""
    names = [node.name for node in rig.nodes]
    option = f"{option} " if option else ""
    found: dict[str, str] = {}
    for text in given:
        name = max((name for name in names if text.startswith(f"{name}=")), key=len, default=text.partition("=")[0])
        value = text[len(name) + 1:]
        if not value:
            raise RecordingError(f"{option}{text}: give a camera and its value, as in {option}{names[0]}=...")
        if name not in names:
            raise RecordingError(f"{option}{text}: there is no camera {name!r} here; there are {', '.join(names)}.")
        if name in found:
            raise RecordingError(f"{option}{text}: camera {name} is named twice.")
        found[name] = value
    return found


def film_offsets(args: argparse.Namespace, rig: Rig, given: dict[str, str]) -> dict[str, FilmOffset]:
    """By --offset, when each film began after that of the rig's first camera; nothing without. Raises
    RecordingError."""
    if args.offset is None:
        return {}
    from rhot_app.progress import ProgressLine
    from rhot_app.sources.film_offset import offsets_of

    line = ProgressLine("offsets")
    found = offsets_of({node.name: input_file(given[node.name]) for node in rig.nodes if node.name in given},
                       args.offset, line.report)
    line.finish()
    return found


def offset_fields(offsets: Mapping[str, FilmOffset]) -> dict[str, Any]:
    """The summary's fields of `film_offsets`."""
    if not offsets:
        return {}
    return {"offsets_s": {name: one.seconds for name, one in offsets.items()},
            "offsets_std_s": {name: one.std_s for name, one in offsets.items()}}


def offset_sentences(args: argparse.Namespace, offsets: Mapping[str, FilmOffset]) -> list[str]:
    """The same for a person."""
    from rhot_app.sources.film_offset import offset_sentence

    return [offset_sentence(offsets, args.offset)] if offsets else []


def opened_videos(args: argparse.Namespace, rig: Rig, given: dict[str, str],
                  offsets: Mapping[str, FilmOffset]) -> list[CameraVideo]:
    """The videos of cameras on one clock, by --fps, --offset-s and `film_offsets`, in the rig's order. Raises
    RecordingError."""
    from rhot_app.sources.frame_sets import FPS, checked_seconds, on_one_clock, open_videos

    if args.fps is not None and not FPS[0] <= args.fps <= FPS[1]:
        raise RecordingError(f"--fps {args.fps:g}: give the frames per second, from {FPS[0]:g} to {FPS[1]:g}.")
    return on_one_clock(open_videos(rig, given, args.fps), {
        name: checked_seconds(text, f"--offset-s {name}")
        for name, text in named(args.offset_s, "--offset-s", rig).items()}
        | {name: one.seconds for name, one in offsets.items()})


def sentences(document: dict[str, Any]) -> list[str]:
    """The summary for a person."""
    from rhot_app.export.bare_hand import closing_sentences

    count, tracked = document["frame_sets"], document["tracked"]
    out = [f"{count} frame sets, {document['frames_left_out']} frames outside the time that all videos show."]
    if not tracked:
        out.append("No hand took the start pose and held it. Is it the rig's (or --start's), by a hand of the rig's "
                   "side, and the background known?")
    else:
        times = document["starts"]
        out.append(f"A hand in {100 * tracked:.0f} % of them; found {times} time{'' if times == 1 else 's'}.")
    if document["step_p50_ms"] is not None:
        out.append(f"Following the hand into the next set took {document['step_p50_ms']:.0f} ms (median), "
                   f"{document['step_p99_ms']:.0f} ms (99 %).")
    if document["adapted"]:
        one = document["adapted"]
        out.append(f"Hand adapted by {one['key_frames']} key frames: lengths by {one['lengths_percent']:.1f} ± "
                   f"{one['lengths_sd_percent']:.1f} %, radii by {one['radii_percent']:.1f} ± "
                   f"{one['radii_sd_percent']:.1f} % (rms).")
    return [*out, *closing_sentences(document)]
