"""``rhot calibrate colours``: colour models from boxes on the paint in pictures."""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.calibration.commands.output import show
from rhot_app.errors import CalibrationError, input_file
from rhot_app.options import add_json_argument, add_out_argument
from rhot_node.errors import PictureError
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    import numpy as np

    from rhot_app.calibration.colour.colours import ColourReport
    from rhot_app.calibration.colour.paint_region import PaintRegion
    from rhot_app.calibration.verdict import Finding
    from rhot_node.detect.image import YuvImage

EPILOG = """Boxes are x,y,w,h in pixels of the picture, (0, 0) at its top-left corner: nothing but paint inside, and as
much of it as is plainly visible; 10 x 8 px are enough. A marker may have several boxes in a picture, each a --sample
of its own: they add up. Of a box that is smaller, the paint round it is taken too. Every other name makes another
marker; NAME@2 takes the second --image, and adds to the samples of NAME. Pictures that show more of the room tell more
of what else has the colours.

Without --markers every name makes a marker: thumb, index, middle, ring, little and wrist are worn on the hand, others
are free points. With --markers the named markers of that file get new colours, and nothing else changes.

With --json: "markers" (per marker "chroma", "range", "coverage_percent", "lost_percent", "samples", "pictures",
"area_px"), "separability" ("rows", "columns", "percent", "sentences"), "room" ("hue_px", "rivals"),
"failures", "free_paints", "verdict", "grade", "warnings", "findings", "written"."""

PIXELS_MAX = 16_000_000
"""Of a picture: every lamp is tried on it. Four times as many take a minute and 1.8 GB."""

_SAMPLE = re.compile(r"(?P<name>[^=@]+)(?:@(?P<picture>\d+))?=(?P<box>[^=]+)")
_NAME = re.compile(r"[A-Za-z0-9_.-]{1,32}")


@dataclass(frozen=True, slots=True)
class BoxArgument:
    """NAME[@PICTURE]=x,y,w,h: a name, the picture's number from 0, and the box's upper-left corner and size, px."""

    text: str
    name: str
    picture: int
    box: tuple[int, int, int, int]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Define the command's options."""
    parser.epilog = EPILOG
    parser.add_argument("--image", type=Path, action="append", required=True, metavar="PATH",
                        help="a picture as the camera gives it, or a film's frame, as in hand.mp4@2.5 for second 2.5; "
                             "several are numbered 1, 2, ...")
    parser.add_argument("--sample", action="append", required=True, metavar="NAME=x,y,w,h",
                        help="a box on the paint of marker NAME (NAME@2=...: in the second picture)")
    parser.add_argument("--markers", type=input_file, metavar="BASE", help="marker file whose markers are learnt anew")
    parser.add_argument("--skin", action="append", default=[], metavar="x,y,w,h",
                        help="a box on bare skin (@2=x,y,w,h: in the second picture)")
    add_out_argument(parser, "marker file to write", required=True, metavar="MARKERS")
    add_json_argument(parser)
    add_examples(
        parser, "rhot calibrate colours --image hand.png --sample thumb=310,204,12,10 --out markers.json",
        "rhot calibrate colours --image hand.png --sample wrist=90,40,14,14 --markers rhot6.json --out mine.json")


def run(args: argparse.Namespace) -> int:
    """Learn, judge, print and write. Raises CalibrationError or SettingsError before anything is printed."""
    from rhot_app.calibration.colour.colours import solve_colours
    from rhot_app.calibration.colour.samples import ColourSamples
    from rhot_app.calibration.verdict import with_findings
    from rhot_app.progress import ProgressLine
    from rhot_node.markers import load_markers, save_markers

    if not args.out.parent.is_dir():
        raise CalibrationError(f"--out {args.out}: the folder {args.out.parent} does not exist; create it first.")
    base = load_markers(args.markers) if args.markers else None
    images, unreadable = _read_all(args.image)
    collector = ColourSamples()
    enlarged = []
    for (name, picture), boxes in _samples(args.sample).items():
        shown, *_ = [_image(box, images, args.image) for box in boxes]
        region = collector.add(name, shown, [_corners(box) for box in boxes])
        enlarged += _enlarged(f"{name} in picture {picture + 1}", shown, [_corners(box) for box in boxes], region)
    for image in images:
        if not isinstance(image, PictureError):
            collector.keep_view(image)
    skin = _skin([parse_box(f"skin{text}" if text.startswith("@") else f"skin={text}", "--skin") for text in args.skin],
                 images, args.image)
    line = ProgressLine("colours", sys.stderr)
    report = solve_colours(collector.samples, collector.views, skin=skin, base=base, progress=line.report)
    line.finish()
    verdict, written = with_findings(report.verdict, [*unreadable, *_note_enlarged(enlarged)]), ""
    if report.verdict.acceptable:
        try:
            save_markers(args.out, report.markers)
        except OSError as exc:
            raise CalibrationError(f"--out {args.out}: cannot be written ({exc.strerror}).") from exc
        written = str(args.out)
    fields = {**report.to_json(), "images": [str(path) for path in args.image]}
    return show(fields, _lines(report), verdict, as_json=args.json, written=written)


def parse_box(text: str, option: str) -> BoxArgument:
    """Read NAME[@PICTURE]=x,y,w,h. Raises CalibrationError that shows how it must look."""
    match = _SAMPLE.fullmatch(text.strip())
    form, example = ("NAME=x,y,w,h", "thumb=310,204,12,10") if option == "--sample" else ("x,y,w,h", "310,204,12,10")
    wanted = f"{option} {text!r} is not {form} with whole pixels, such as {example}."
    if match is None:
        raise CalibrationError(wanted)
    try:
        x, y, width, height = (int(part) for part in match["box"].split(","))
    except ValueError:
        raise CalibrationError(wanted) from None
    name = match["name"].strip()
    if not _NAME.fullmatch(name):
        raise CalibrationError(f"{option} {text!r}: a marker's name has 1 to 32 letters, digits, '-', '_' or '.'.")
    if width < 1 or height < 1:
        raise CalibrationError(f"{option} {text!r}: a box of {width} x {height} px holds nothing.")
    picture = int(match["picture"] or 1) - 1
    return BoxArgument(text, name, picture, (x, y, width, height))


def _samples(texts: list[str]) -> dict[tuple[str, int], list[BoxArgument]]:
    """All boxes by marker and picture."""
    samples: dict[tuple[str, int], list[BoxArgument]] = {}
    for box in (parse_box(text, "--sample") for text in texts):
        samples.setdefault((box.name, box.picture), []).append(box)
    return samples


def _enlarged(what: str, image: YuvImage, boxes: list[tuple[int, int, int, int]], region: PaintRegion) -> list[str]:
    """From and to how many colour pixels boxes were enlarged that were too small to learn from by themselves."""
    import numpy as np

    from rhot_node.detect.colour import SAMPLES_MIN, box_mask

    held = int(np.count_nonzero(box_mask(image, boxes)))
    return [f"{what} from {held} to {np.count_nonzero(region.sample)}"] if held < SAMPLES_MIN else []


def _note_enlarged(enlarged: list[str]) -> list[Finding]:
    from rhot_app.calibration.colour.paint_region import ENOUGH
    from rhot_app.calibration.verdict import Finding, Grade
    from rhot_node.detect.colour import SAMPLES_MIN

    return [Finding("enlarged", Grade.GOOD, f"{SAMPLES_MIN} colour pixels are needed, so small boxes were enlarged to "
                    f"the same paint round them: {', '.join(enlarged)}.", "",
                    f"{ENOUGH} of paint are enough in one box.")] if enlarged else []


def _read_all(paths: list[Path]) -> tuple[list[YuvImage | PictureError], list[Finding]]:
    """All pictures, or why one cannot be decoded, which the findings tell; some must remain."""
    from rhot_app.calibration.verdict import Finding, Grade

    images = [_read(path) for path in paths]
    damaged = [image for image in images if isinstance(image, PictureError)]
    if len(damaged) == len(paths):
        raise CalibrationError(f"--image {damaged[0]}")
    return images, [Finding("file", Grade.FAIR, str(each), "The file is damaged.",
                            "The others were used without it; take it again.") for each in damaged]


def _read(path: Path) -> YuvImage | PictureError:
    """The picture, or why it cannot be decoded. Raises CalibrationError for one that is missing or tiny."""
    from rhot_app.calibration.lens.film import frame_at, names_frame
    from rhot_node.detect.image import from_bgr
    from rhot_node.pictures import read_picture

    if not names_frame(path) and not path.is_file():
        raise CalibrationError(f"--image {path}: there is no such file (a pipe or a device is none).")
    try:
        bgr = frame_at(path) if names_frame(path) else read_picture(path)
    except PictureError as exc:
        return exc
    if bgr.shape[0] * bgr.shape[1] > PIXELS_MAX:
        raise CalibrationError(f"--image {path} has {bgr.shape[1]} x {bgr.shape[0]} px; colours are learnt from "
                               f"pictures of at most {PIXELS_MAX // 1_000_000} megapixels. Scale it down, or take one "
                               "as the node sees it.")
    if min(bgr.shape[:2]) < 16:
        raise CalibrationError(f"--image {path}: {bgr.shape[1]} x {bgr.shape[0]} px is too small to show a marker.")
    return from_bgr(bgr)


def _image(box: BoxArgument, images: list[YuvImage | PictureError], paths: list[Path]) -> YuvImage:
    """The picture that a box lies in; raises CalibrationError unless it does, wholly."""
    if not 0 <= box.picture < len(images):
        raise CalibrationError(f"{box.text!r} asks for picture {box.picture + 1}, and there "
                               f"{'is' if len(images) == 1 else 'are'} {len(images)}; give another --image.")
    image = images[box.picture]
    if isinstance(image, PictureError):
        raise CalibrationError(f"--image {image} {box.text!r} is in it.")
    (width, height), (x, y, wide, high) = image.size, box.box
    if x < 0 or y < 0 or x + wide > width or y + high > height:
        raise CalibrationError(f"{box.text!r} reaches outside {paths[box.picture]}, which has {width} x {height} px.")
    return image


def _corners(box: BoxArgument) -> tuple[int, int, int, int]:
    x, y, width, height = box.box
    return x, y, x + width, y + height


def _skin(boxes: list[BoxArgument], images: list[YuvImage | PictureError], paths: list[Path]) -> np.ndarray:
    import numpy as np

    from rhot_app.calibration.colour.colours import NO_COLOURS
    from rhot_node.detect.colour import box_mask, colours_of

    found = [NO_COLOURS]
    for box in boxes:
        image = _image(box, images, paths)
        found.append(colours_of(image, box_mask(image, [_corners(box)])))
    return np.concatenate(found)


def _lines(report: ColourReport) -> list[str]:
    """The tables for people: every marker's model, and the separability matrix in percent."""
    lines = [f"{'marker':<12} {'Cb':>6} {'Cr':>6} {'hue ±':>7} {'chroma >=':>9} {'luma':>8} {'covered %':>9} "
             f"{'pictures':>8} {'lost %':>6}"]
    chosen = {marker.id: marker.chroma for marker in report.markers.markers}
    for one, covered, lost in zip(report.samples, report.separability.coverage, report.rehearsal.lost, strict=True):
        chroma = chosen[one.name]
        lines.append(f"{one.name:<12} {chroma.cb:6.1f} {chroma.cr:6.1f} {chroma.hue_tolerance_deg:7.1f} "
                     f"{chroma.magnitude_min:9.1f} {chroma.luma_min:4d}-{chroma.luma_max:<3d} {100 * covered:9.1f} "
                     f"{one.frames:8d} {100 * lost:6.1f}")
    columns = (*report.names, *report.separability.others)
    lines += ["", "taken for     " + " ".join(f"{name[:9]:>9}" for name in columns) + "   (% of the column)"]
    for name, row in zip(report.names, report.separability.matrix, strict=True):
        lines.append(f"{name:<13} " + " ".join(f"{100 * share:9.1f}" for share in row))
    if max(one.frames for one in report.samples) == 1:
        lines += ["", "Every colour was learnt from one picture. Boxes in others (NAME@2), with the marker in another "
                  "place and turned, make the models safer."]
    return lines
