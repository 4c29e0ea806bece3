"""The colour calibration: colour models of the markers from their paint in pictures."""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.calibration.registry import Calibration, Command, InForce, Observed
from rhot_app.calibration.report import Figure, Report, Table
from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.errors import CalibrationError, input_file
from rhot_app.options import add_json_argument, add_out_argument
from rhot_node.errors import PictureError
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    import numpy as np

    from rhot_app.calibration.check.health import HealthFigures
    from rhot_app.calibration.colour.colours import ColourResult
    from rhot_app.calibration.colour.paint_region import PaintRegion
    from rhot_app.calibration.colour.samples import MarkedPicture, PaintSamples
    from rhot_app.calibration.proposal import Proposal
    from rhot_app.charts import Chart
    from rhot_app.progress import Progress
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


def observe(args: argparse.Namespace, progress: Progress) -> Observed:
    """The boxes' paint. Raises CalibrationError or SettingsError."""
    from rhot_app.calibration.colour.samples import ColourSamples
    from rhot_node.markers import load_markers

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
    return Observed((collector.samples, collector.views, {"skin": skin, "base": base}),
                    findings=(*unreadable, *_note_enlarged(enlarged)),
                    fields={"images": [str(path) for path in args.image]})


def solve(samples: Sequence[PaintSamples], views: Sequence[MarkedPicture], known: Mapping[str, Any],
          now: InForce | None, *, progress: Progress) -> ColourResult:
    """The models; `known` are the further arguments of `solve_colours`. Raises CalibrationError."""
    from rhot_app.calibration.colour.colours import solve_colours

    return solve_colours(samples, views, progress=progress, **known)


def write(args: argparse.Namespace, result: ColourResult, now: InForce | None) -> str:
    """The marker set."""
    from rhot_node.markers import save_markers

    save_markers(args.out, result.markers)
    return str(args.out)


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
    from rhot_node.detect.colour import SAMPLES_MIN

    return [Finding("enlarged", Grade.GOOD, f"{SAMPLES_MIN} colour pixels are needed, so small boxes were enlarged to "
                    f"the same paint round them: {', '.join(enlarged)}.", "",
                    f"{ENOUGH} of paint are enough in one box.")] if enlarged else []


def _read_all(paths: list[Path]) -> tuple[list[YuvImage | PictureError], list[Finding]]:
    """All pictures, or why one cannot be decoded, which the findings tell; some must remain."""
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


# -- what is said of the result, and what it changes -------------------------------------------------------------------

def report(result: ColourResult, now: InForce | None) -> Report:
    """Every marker's model, which colours are taken for which, what else in the room has them, and the hues."""
    import msgspec
    import numpy as np

    from rhot_app.calibration.colour.illuminant import SAME

    apart, room = result.separability, result.room
    chosen = {marker.id: marker for marker in result.markers.markers}
    markers = []
    for one, covered, lost in zip(result.samples, apart.coverage, result.rehearsal.lost, strict=True):
        marker, chroma = chosen[one.name], chosen[one.name].chroma
        markers.append((
            Figure("marker", one.name, key="id"), Figure("", marker.role, key="role"),
            Figure("", msgspec.to_builtins(chroma), key="chroma"),
            Figure("", msgspec.to_builtins(marker.range), key="range"), Figure("", one.rgb, key="display_rgb"),
            Figure("Cb", chroma.cb, decimals=1), Figure("Cr", chroma.cr, decimals=1),
            Figure("hue ±", chroma.hue_tolerance_deg, "°", decimals=1),
            Figure("chroma at least", chroma.magnitude_min, decimals=1),
            Figure("luma", f"{chroma.luma_min}-{chroma.luma_max}"),
            Figure("covered", round(100.0 * covered, 2), "%", decimals=1, key="coverage_percent"),
            Figure("pictures", one.frames, decimals=0, key="pictures"),
            Figure("lost", round(100.0 * lost, 1), "%", decimals=1, key="lost_percent"),
            Figure("", len(one.colours), key="samples"), Figure("", round(4.0 * one.area, 1), key="area_px")))
    columns = (*result.names, *apart.others)
    matrix = tuple((Figure("taken for", name), *(Figure(column, 100.0 * share, "%", decimals=1)
                                                 for column, share in zip(columns, shares, strict=True)))
                   for name, shares in zip(result.names, apart.matrix, strict=True))
    few = max(one.frames for one in result.samples) == 1
    rivals = {name: None if rival is None else {
        "picture": rival.picture + 1, "x": round(rival.x, 1), "y": round(rival.y, 1), "area_px": round(rival.area_px),
        "passing_px": round(rival.passing_px), "merit": round(rival.merit, 3)}
        for name, rival in zip(result.names, room.rivals, strict=True)}
    return Report(
        result.verdict, tables=(Table("markers", tuple(markers)), Table("", matrix)),
        notes=("Every colour was learnt from one picture. Boxes in others (NAME@2), with the marker in another place "
               "and turned, make the models safer.",) if few else (),
        fields={
            "separability": {"rows": result.names, "columns": columns, "percent": np.round(100.0 * apart.matrix, 2),
                             "sentences": apart.sentences},
            "room": {"hue_step_deg": 360 // len(room.hue_px), "hue_from_deg": -180, "hue_px": np.round(room.hue_px, 1),
                     "rivals": rivals},
            "failures": [{"marker": one.marker, "picture": one.picture + 1, "outcome": one.outcome,
                          "cause": one.cause.code, "sentence": one.cause.sentence, "warmth": one.lamp.temperature_shift,
                          "brightness": one.lamp.brightness, "tracked": one.tracked, "same_lamp": one.lamp == SAME}
                         for one in result.rehearsal.failures],
            "free_paints": result.free},
        charts=(hue_chart(result),))


HEADROOM = 1.05
"""Of the chart above the highest column, logarithmically."""


def hue_chart(result: ColourResult) -> Chart:
    """Which hues the room has, and which of them each marker's bounds let through."""
    import numpy as np

    from rhot_app.charts import Chart, Curve, hex_of

    room = result.room.hue_px
    step_deg = 360.0 / len(room)
    left = -180.0 + step_deg * np.arange(len(room))
    x = np.stack([left, left + step_deg], axis=1).ravel()
    top = 10.0 ** (HEADROOM * np.log10(max(float(room.max()), 10.0)))
    chosen = {marker.id: marker for marker in result.markers.markers}
    curves = [Curve("the room", x, np.repeat(np.maximum(room, 1.0), 2))]
    for one in result.samples:
        marker = chosen[one.name]
        middle = float(np.degrees(marker.chroma.hue_rad))
        low, high = middle - marker.chroma.hue_tolerance_deg, middle + marker.chroma.hue_tolerance_deg
        for turn in (-360.0, 0.0, 360.0):  # a band across red is drawn at both ends
            ends = np.clip(np.array([low + turn, high + turn]), -180.0, 180.0)
            if ends[1] > ends[0]:
                name = one.name if low + turn < middle + turn <= 180.0 and middle + turn > -180.0 else ""
                curves.append(Curve(name, ends, np.ones(2), "band", np.full(2, top), hex_of(one.rgb)))
    return Chart("Colours of the room and of the markers", "hue (angle of chroma), °",
                 "pixels per picture", tuple(curves), log_y=True)


def propose(result: ColourResult, now: InForce) -> Proposal:
    """The rig with the new marker set, and every node whose settings are known with the very same."""
    import msgspec

    from rhot_app.calibration.proposal import NodeChange, Row, proposed

    rig, markers = now.rig, msgspec.to_builtins(result.markers)
    changes: list[NodeChange] = []
    rows: list[Row] = []
    for node in rig.nodes:
        if node.node_id in now.node_settings:
            before = now.node_settings[node.node_id]["markers"]
            changes.append(NodeChange(node.node_id, {"markers": before}, {"markers": markers}))
            rows.append(Row(f"colours in camera {node.name}", "the rig's" if before == msgspec.to_builtins(rig.markers)
                            else "not the rig's", "the new ones"))
        elif not node.text_datagrams:
            rows.append(Row(f"colours in camera {node.name}", "not known", "not changed: the node does not answer"))
    after = msgspec.structs.replace(rig, markers=result.markers)
    made = proposed(CALIBRATION.reason, Report(result.verdict), rig, after, changes=tuple(changes), rows=tuple(rows))
    shown = {f"{old.id}: colour": (old.display_rgb, new.display_rgb)
             for old, new in zip(rig.markers.markers, result.markers.markers, strict=True)}
    return replace(made, rows=tuple(replace(row, swatches=shown.get(row.what)) for row in made.rows))


WEAK_QUALITY = 0.45
"""A marker as plain as it should be has 0.8 to 1."""

DOUBLED_PART = 0.3
"""Of the pictures in which something else may have a marker's colour."""


def check(figures: HealthFigures) -> list[Finding]:
    """Whether a colour is hardly told from its surroundings, or something else has it."""
    return [*_weak(figures), *_doubled(figures)]


def _weak(figures: HealthFigures) -> list[Finding]:
    weak = [one for one in figures.qualities if one.quality < WEAK_QUALITY]
    if not weak:
        return []
    worst = min(weak, key=lambda one: one.quality)
    names = ", ".join(dict.fromkeys(one.marker for one in weak))
    return [Finding("weak_colour", Grade.FAIR, f"The colour of {names} is hardly told from its surroundings (quality "
                    f"{worst.quality:.2f} in camera {worst.camera}).", "The light has changed, or the paint is dirty.",
                    "Give more light, or learn the colours again (Calibrate menu).")]


def _doubled(figures: HealthFigures) -> list[Finding]:
    worst = max((one for one in figures.qualities if one.ambiguous > DOUBLED_PART), key=lambda one: one.ambiguous,
                default=None)
    if worst is None:
        return []
    return [Finding("doubled_colour", Grade.FAIR, f"In {100 * worst.ambiguous:.0f} % of its pictures camera "
                    f"{worst.camera} sees something else in the colour of {worst.marker}.", "",
                    "Take it out of the picture, or choose another paint (Calibrate menu).")]


CALIBRATION = Calibration(
    "colours", "Colours of the markers", "Which colour each marker has, and what may be mistaken for it.",
    "colour calibration",
    Command("colours", "the markers' colours, from boxes on their paint in pictures", add_arguments, observe,
            write=write),
    solve=solve, report=report, propose=propose, check=check, solver="rhot_app.calibration.colour.colours")
