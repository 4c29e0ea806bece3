"""``rhot track``: a bare hand in recorded videos, by landmark networks or by its contours."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rhot_app.errors import RecordingError, input_file
from rhot_app.export import bare_hand_command
from rhot_app.export.bare_hand_command import named, open_all
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.project import Rig

ASSUMED_DEG: Final = 60.0
"""Horizontal field of view of a camera of which nothing is known: webcams have 55 to 70 degrees."""

CONTOUR_OPTIONS: Final = ("background", "background_seconds", "unknown_size", "adapt")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot track``."""
    parser.add_argument("videos", nargs="*", default=[], metavar="CAMERA=VIDEO",
                        help="a camera of the rig and its video; paths alone take the rig's cameras in order")
    bare_hand_command.add_arguments(parser, videos_by_option=False)
    parser.add_argument("--observe", choices=("landmarks", "contours"), default="landmarks",
                        help="what is looked for: the landmarks of the installed hand networks (default), or the "
                             "hand's contours")
    parser.add_argument("--bones", choices=("measured", "rig"), default="measured",
                        help="the hand's bones: measured from the landmarks of two cameras (default), or as the rig "
                             "has them")
    parser.add_argument("--smooth", action="store_true", help="every state uses what came after it as well")
    add_examples(parser, "rhot track left=left.mp4 right=right.mp4 --rig desk.json --out hand.csv --overlay hand.mp4",
                 "rhot track hand.mp4 --overlay hand-tracked.mp4")


def run(args: argparse.Namespace) -> int:
    """Track, and say what came of it. Raises KeypointError, RecordingError, ExportError and RigError."""
    if args.observe == "contours":
        if args.rig is None:
            raise RecordingError("--observe contours needs a calibrated rig; give it with --rig.")
        if args.smooth:
            raise RecordingError("--smooth: only landmarks are smoothed; leave --observe contours or --smooth out.")
        args.video = with_names(args, _rig(args))
        return bare_hand_command.run(args)
    wrong = next((option for option in CONTOUR_OPTIONS if getattr(args, option)), None)
    if wrong is not None:
        raise RecordingError(f"--{wrong.replace('_', '-')} is of contours: give --observe contours with it.")
    return _by_landmarks(args)


def _rig(args: argparse.Namespace) -> Rig:
    from rhot_app.project import load_rig

    return load_rig(args.rig)


def with_names(args: argparse.Namespace, rig: Rig) -> list[str]:
    """All videos as CAMERA=VIDEO; paths alone take the cameras in the rig's order. Raises RecordingError."""
    names = [node.name for node in rig.nodes]
    given = [*args.videos, *(args.video or [])]
    if not given:
        raise RecordingError(f"give a video of a camera, as in {names[0]}=hand.mp4.")
    if any("=" in text and not Path(text).exists() for text in given):
        return given
    if len(given) > len(names):
        raise RecordingError(f"{len(given)} videos, but the rig has {len(names)} cameras: {', '.join(names)}.")
    return [f"{name}={text}" for name, text in zip(names, given, strict=False)]


def _by_landmarks(args: argparse.Namespace) -> int:
    from rhot_app.export.landmark_track import landmark_rig_of, track_landmarks
    from rhot_app.progress import ProgressLine
    from rhot_app.sources.frame_sets import FPS, checked_seconds, on_one_clock
    from rhot_node.compiled import announce_compilation
    from rhot_node.landmarks.networks import open_hand_networks

    if args.fps is not None and not FPS[0] <= args.fps <= FPS[1]:
        raise RecordingError(f"--fps {args.fps:g}: give the frames per second, from {FPS[0]:g} to {FPS[1]:g}.")
    said = []
    if args.rig is None:
        rig = assumed_rig([*args.videos, *(args.video or [])])
        lens = rig.nodes[0].intrinsics
        said.append(f"Without --rig the lens is assumed to see {ASSUMED_DEG:.0f} degrees across (focal length "
                    f"{lens.fx:.0f} px) and the hand to be of usual size; distances are as wrong as these.")
        given = {rig.nodes[0].name: next(iter([*args.videos, *(args.video or [])]))}
    else:
        rig = _rig(args)
        given = named(with_names(args, rig), "", rig)
    for path in given.values():
        input_file(path)
    open_hand_networks()  # without them nothing is begun
    rig = landmark_rig_of(rig, tuple(given))
    videos = on_one_clock(open_all(rig, given, args.fps), {
        name: checked_seconds(text, f"--offset-s {name}")
        for name, text in named(args.offset_s, "--offset-s", rig).items()})
    announce_compilation()
    line = ProgressLine("tracking")
    summary = track_landmarks(rig, videos, measure=args.bones == "measured", smooth=args.smooth, out=args.out,
                              pictures=args.overlay, again=args.force, progress=line.report)
    line.finish()
    document = summary.document() | {"out": args.out and str(args.out), "overlay": args.overlay and str(args.overlay),
                                     "assumed": said}
    print(json.dumps(document) if args.json else "\n".join([*said, *sentences(document)]))
    return 0


def assumed_rig(videos: list[str]) -> Rig:
    """A rig of one camera whose lens is assumed, for one video. Raises RecordingError."""
    import cv2

    from rhot_app.errors import RhotError
    from rhot_app.hand.anatomy import load_hand
    from rhot_app.project import CameraPose, Intrinsics, Rig, RigNode
    from rhot_node.errors import PictureError
    from rhot_node.files import resource_path
    from rhot_node.markers import load_markers
    from rhot_node.pictures import open_video

    if len(videos) != 1:
        raise RecordingError(f"{len(videos)} videos need a calibrated rig with a camera for each; give it with --rig. "
                             "One video alone is tracked without.")
    try:
        path = input_file(videos[0])
        capture = open_video(path)
    except (RhotError, PictureError) as exc:
        raise RecordingError(str(exc)) from exc
    try:
        width, height = (int(capture.get(what)) for what in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
    finally:
        capture.release()
    if not (width > 0 and height > 0):
        raise RecordingError(f"{path}: no frame of it can be decoded. Is it a video, and complete?")
    focal = 0.5 * width / math.tan(0.5 * math.radians(ASSUMED_DEG))
    lens = Intrinsics(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1), (0.0, 0.0, 0.0, 0.0, 0.0))
    node = RigNode(1, "camera", lens, CameraPose((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    return Rig("one assumed camera", (node,), load_markers(resource_path("markers", "landmarks21.json")),
               load_hand(resource_path("hands", "right.json")))


def sentences(document: dict[str, Any]) -> list[str]:
    """The summary for a person."""
    out = [f"{document['frame_sets']} frame sets, {document['frames_left_out']} frames outside the time that all "
           "videos show.",
           "The networks found the hand in " + ", ".join(f"{100 * part:.0f} % of {camera}'s pictures"
                                                         for camera, part in document["found"].items()) + "."]
    if not document["tracked"]:
        return [*out, "No hand was tracked. Is the rig's hand of the right side, and are the videos in its cameras' "
                      "order?"]
    out += [f"A hand in {100 * document['tracked']:.0f} % of the frame sets.", document["bones"],
            f"Reprojection error of the joints: median {document['reprojection_px']:.1f} px, at the hand "
            f"{document['reprojection_mm']:.1f} mm."]
    if document["reprojection_large"]:
        out.append("That is large. Do not rely on the hand: check the rig's calibration, the cameras' order and the "
                   "hand's side and size.")
    out.append(f"Computed: {document['computed_per_s']:.1f} frame sets a second overall.")
    if document["lost_s"]:
        out.append("No hand at " + ", ".join(f"{a:.2f} to {b:.2f}" for a, b in document["lost_s"]) + " s.")
    return [*out, *(f"Written: {document[key]}" for key in ("out", "overlay") if document[key])]
