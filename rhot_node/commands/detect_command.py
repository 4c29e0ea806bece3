"""``rhot-node detect``: find the markers in every frame of an image, a folder of images, a recording or a video."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rhot_node.capture.paced import IMAGE_SUFFIXES, ImageFiles, ImageSource, VideoFile, image_files
from rhot_node.capture.yuv import HEADER_NAME, read_images
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage, from_bgr
from rhot_node.detect.reference import ReferenceDetector
from rhot_node.errors import CameraError
from rhot_node.markers import MarkerSet, load_markers
from rhot_node.terminal import add_examples
from rhot_node.wire.messages import MarkerFlag, MarkerObservation

NamedImage = tuple[str | None, YuvImage]

EPILOG = """Images are searched one by one, as unrelated stills: a folder's files need not follow each other in time.
Videos and recordings are sequences: markers are tracked from frame to frame, so that half-hidden ones are
recognised. --sequence and --stills say otherwise.

With --json one object is printed:
  {"path", "detector", "frames": [{"index", "file"?, "width", "height", "markers": [
    {"id", "x", "y", "size", "quality", "flags": [...], "candidates"?: [...], "blobs"?: [...]}]}]}
candidates: what else may be the marker; blobs: with --all; both lists of {"x", "y", "size", "quality", "flags"}.
x, y: px, (0, 0) at the centre of the top-left pixel, null when lost; size: equivalent diameter, px; quality: 0..1."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the command's options."""
    parser.add_argument("path", type=Path, metavar="PATH",
                        help="an image, a folder of images, a recording of raw YUV frames, or a video")
    parser.add_argument("--markers", type=Path, required=True, metavar="FILE",
                        help="marker file (JSON, see docs/markers.md)")
    parser.add_argument("--detector", choices=("fast", "reference"), default="fast",
                        help="fast (default), or reference: the thesis's own pipeline")
    parser.add_argument("--all", action="store_true", help="list every blob of each colour, too")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of a table")
    order = parser.add_mutually_exclusive_group()
    order.add_argument("--sequence", action="store_const", dest="sequence", const=True,
                       help="images follow each other in time: track from one to the next")
    order.add_argument("--stills", action="store_const", dest="sequence", const=False,
                       help="frames have nothing to do with each other: search each as a whole")
    parser.set_defaults(sequence=None)
    parser.epilog = EPILOG
    add_examples(parser, "rhot-node detect --markers rhot6.json hand.png",
                 "rhot-node detect --markers rhot6.json --all --json hand.mp4")


def run(args: argparse.Namespace) -> int:
    """Detect and print; returns 0. Raises NodeError before anything is printed."""
    markers = load_markers(args.markers)
    report = detect_all(args.path, markers, args.detector, list_blobs=args.all, sequence=args.sequence)
    if args.json:
        json.dump(report, sys.stdout, allow_nan=False)
        print()
    else:
        _print_table(report)
    return 0


def detect_all(path: Path, markers: MarkerSet, detector_name: str, *, list_blobs: bool = False,
               sequence: bool | None = None) -> dict[str, Any]:
    """The report that ``--json`` prints. `sequence`: whether frames follow each other in time; None: by kind of file.

    Raises CameraError when `path` is missing, cannot be decoded or has no frames.
    """
    detector: ReferenceDetector | FastDetector
    detector = ReferenceDetector(markers) if detector_name == "reference" else FastDetector(markers)
    images, in_time = _open(path)
    track = in_time if sequence is None else sequence
    frames = []
    for index, (file, image) in enumerate(images):
        if not track:
            detector.reset()
        observations = detector.detect(image)
        entries: list[dict[str, Any]] = [{"id": name, **_entry(seen)}
                                         for name, seen in zip(markers.ids, observations, strict=False)]
        for further in observations[len(entries):]:
            entries[further.index].setdefault("candidates", []).append(_entry(further))
        if list_blobs:
            for entry, blobs in zip(entries, detector.all_blobs(image), strict=True):
                entry["blobs"] = [_entry(blob) for blob in blobs]
        width, height = image.size
        frames.append({"index": index, **({"file": file} if file else {}), "width": width, "height": height,
                       "markers": entries})
    if not frames:
        raise CameraError(f"{path}: it has no frames. Is the file complete?")
    return {"path": str(path), "detector": detector_name, "frames": frames}


def _open(path: Path) -> tuple[Iterator[NamedImage], bool]:
    """The images of `path`, and whether they follow each other in time."""
    if not path.exists():
        raise CameraError(f"{path}: no such file or folder.")
    if (path / HEADER_NAME).exists():
        return ((None, image) for image in read_images(path)), True
    files = image_files(path)
    if path.is_dir() and not files:
        raise CameraError(f"{path}: a folder without images ({', '.join(sorted(IMAGE_SUFFIXES))}).")
    return _decoded(path, ImageFiles(files) if files else VideoFile(path), [file.name for file in files]), not files


def _decoded(path: Path, source: ImageSource, names: list[str]) -> Iterator[NamedImage]:
    index = 0
    try:
        while source.advance():
            bgr = source.image()
            name = names[index] if names else None
            if min(bgr.shape[:2]) < 2:
                raise CameraError(f"{path if name is None else name}: an image of {bgr.shape[1]} x {bgr.shape[0]} px "
                                  "is too small to show anything.")
            yield name, from_bgr(bgr)
            index += 1
    finally:
        source.close()


def _entry(seen: MarkerObservation) -> dict[str, Any]:
    flags = [flag.name.lower() for flag in MarkerFlag if flag in seen.flags and flag.name]
    if not seen.found:
        return {"x": None, "y": None, "size": None, "quality": 0.0, "flags": flags}
    return {"x": round(seen.x, 3), "y": round(seen.y, 3), "size": round(seen.diameter, 3),
            "quality": round(seen.quality, 3), "flags": flags}


def _print_table(report: dict[str, Any]) -> None:
    print(f"{'frame':<24} {'marker':<12} {'x px':>9} {'y px':>9} {'size px':>8} {'quality':>8}  flags")
    for frame in report["frames"]:
        name = frame.get("file", str(frame["index"]))
        for marker in frame["markers"]:
            _print_row(name, marker["id"], marker)
            for kind in ("candidate", "blob"):
                for one in marker.get(f"{kind}s", ()):
                    _print_row(name, f"  {kind}", one)


def _print_row(frame: str, label: str, entry: dict[str, Any]) -> None:
    flags = ", ".join(entry["flags"])
    if entry["x"] is None:
        print(f"{frame:<24} {label:<12} {'-':>9} {'-':>9} {'-':>8} {'-':>8}  {flags}")
    else:
        print(f"{frame:<24} {label:<12} {entry['x']:9.2f} {entry['y']:9.2f} {entry['size']:8.2f} "
              f"{entry['quality']:8.2f}  {flags}")
