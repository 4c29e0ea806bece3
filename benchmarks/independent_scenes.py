"""Detection rate, bias and jitter of the detector in pictures that share no code with the twin or the tests.

    python benchmarks/independent_scenes.py [--seed N] [--frames N] [--scenes N] [--layout L] [--size S] [--room R]
                                            [--shapes S] [--told shipped|disc] [--part scenes|returns]
                                            [--each] [--json FILE]

The pictures are those of `independent_drawing`: six discs and capsules of 12 to 40 px, from close together to spread
to the frame's edge, before five kinds of rooms. For each layout, size and room:

* stills: the detector is reset before each frame. Share of frames in which the first observation of every marker is
  within half its width of its true position.
* sequence: the same while the markers sway by less than 2 px a frame.
* bias: mean error of a marker that does not move, px, rms over positions and both axes together.
* jitter: standard deviation, px, rms over markers and axes, with the Cramer-Rao bound of one frame.

Then long sequences in which one or two markers vanish for a while and return. They give the share of frames in which
all visible markers are found, without the first frames of a return; the frames until a marker is found again; and the
frames in which a hidden marker is reported. Ends with code 1 when an aim is missed.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from itertools import product
from typing import Any

import msgspec
import numpy as np
from independent_drawing import LAYOUTS, MARKERS, ROOMS, SHAPES, SIZES, Scene, Shape, build_scene
from numpy.typing import NDArray
from tables import arguments, publish, table

from rhot_node.detect.fast import FastDetector
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerObservation

FOUND_AIM, BIAS_AIM, JITTER_AIM, RETURN_AIM = 0.99, 0.05, 1.15, 5  # share, px, of the bound, frames
SETTLE = 12  # frames that are not counted while the tracks of resting markers settle
STILLS = 8  # frames of each scene with a reset before them, at least
AWAY, APART = (8, 40), (12, 30)  # range of the frames for which a marker is hidden, and of those between two absences
BOTH = 0.3  # probability that a second marker is hidden with the first


@dataclass
class Scored:
    """The figures of one scene. `missed`: by marker, stills and frames of the sequence in which it was not found."""

    layout: str
    size: str
    room: str
    name: str
    stills: float
    sequence: float
    bias: list[float] = field(default_factory=list)
    variance: list[float] = field(default_factory=list)
    bound: list[float] = field(default_factory=list)
    missed: dict[str, int] = field(default_factory=dict)


def right(seen: MarkerObservation, shape: Shape) -> bool:
    """Whether an observation is within half the marker's width of its true position."""
    return seen.found and math.hypot(seen.x - shape.x, seen.y - shape.y) <= shape.radius


def judge(scene: Scene, kind: tuple[str, str, str], frames: int, rng: np.random.Generator,
          markers: MarkerSet = MARKERS) -> Scored:
    """Measure stills, a sequence and resting markers of one scene. `markers`: the detector's set."""
    detector, count = FastDetector(markers), len(scene.shapes)
    shares, missed = [], np.zeros(count, dtype=int)
    for length, still in ((STILLS, True), (frames, False)):
        hits = np.zeros((length, count), dtype=bool)
        detector.reset()
        for number in range(length):
            moment = 7.3 * number if still else number
            if still:
                detector.reset()
            seen = detector.detect(scene.picture(moment).expose(rng))
            hits[number] = [right(mark, shape) for mark, shape in zip(seen, scene.at(moment), strict=False)]
        shares.append(float(hits.all(axis=1).mean()))
        missed += (~hits).sum(axis=0)
    out = Scored(*kind, scene.name, shares[0], shares[1],
                 missed={name: int(times) for name, times in zip(MARKERS.ids, missed, strict=True) if times})
    keep_place(scene, detector, frames, rng, out)
    return out


def keep_place(scene: Scene, detector: FastDetector, frames: int, rng: np.random.Generator, out: Scored) -> None:
    """Add the mean error, the variance per axis and its bound of every resting marker that is found in most frames."""
    picture = scene.picture()
    detector.reset()
    errors = np.full((SETTLE + frames, len(scene.shapes), 2), np.nan)
    for number in range(len(errors)):
        for mark, shape in zip(detector.detect(picture.expose(rng)), scene.shapes, strict=False):
            if right(mark, shape):
                errors[number, mark.index] = mark.x - shape.x, mark.y - shape.y
    errors = errors[SETTLE:]
    for index in range(len(scene.shapes)):
        own = errors[np.isfinite(errors[:, index, 0]), index]
        if len(own) > frames // 2:
            out.bias.append(float(np.hypot(*own.mean(axis=0))))
            out.variance.append(float(own.var(axis=0, ddof=1).mean()))
            out.bound.append(float((scene.place_bound(index) ** 2).mean()))
        else:
            for figure in (out.bias, out.variance, out.bound):
                figure.append(math.nan)


def figures(scored: Sequence[Scored]) -> dict[str, float]:
    """Over scenes: share of stills and of sequences found, bias, worst bias, jitter, its bound and their ratio."""
    bias, variance, bound = (np.array([getattr(one, name) for one in scored]).ravel()
                             for name in ("bias", "variance", "bound"))
    jitter, least = math.sqrt(np.nanmean(variance)), math.sqrt(np.nanmean(bound))
    return {"stills": float(np.mean([one.stills for one in scored])),
            "sequence": float(np.mean([one.sequence for one in scored])),
            "bias": math.sqrt(np.nanmean(bias**2)), "worst": float(np.nanmax(bias)), "jitter": jitter, "bound": least,
            "ratio": jitter / least}


def meets(row: dict[str, float]) -> bool:
    """Whether figures meet all aims."""
    return min(row["stills"], row["sequence"]) >= FOUND_AIM and row["bias"] <= BIAS_AIM and row["ratio"] <= JITTER_AIM


def row_of(name: str, row: dict[str, float]) -> list[Any]:
    """Figures as a row of the table."""
    return [name, *(f"{100.0 * row[key]:.1f} %" for key in ("stills", "sequence")),
            *(row[key] for key in ("bias", "worst", "jitter", "ratio"))]


def scenes(args: argparse.Namespace) -> list[Scored]:
    """Measure scenes of all kinds."""
    told = MARKERS if args.told == "shipped" else msgspec.structs.replace(
        MARKERS, markers=tuple(msgspec.structs.replace(marker, shape="disc") for marker in MARKERS.markers))
    rng, everything = np.random.default_rng(args.seed), []
    for layout, size, room in product(args.layout or LAYOUTS, args.size or SIZES, args.room or ROOMS):
        for _ in range(args.scenes):
            scene = build_scene(layout, size, room, 1000 * args.seed + len(everything),
                                args.shapes or SHAPES[len(everything) % len(SHAPES)])
            everything.append(judge(scene, (layout, size, room), args.frames, rng, told))
    return everything


def scene_tables(everything: list[Scored], each: bool) -> list[str]:
    """By size, and all; with `each`, of every scene, layout and room, too, and what was missed."""
    rows = [row_of(f"{size} px" if size.isdigit() else size, figures([one for one in everything if one.size == size]))
            for size in dict.fromkeys(one.size for one in everything)]
    rows += [row_of("all", figures(everything)),
             ["aim", *(f"{100 * FOUND_AIM:g} %",) * 2, BIAS_AIM, None, None, JITTER_AIM]]
    if each:
        rows[:0] = [*(row_of(one.name, figures([one])) for one in everything),
                    *(row_of(value, figures([one for one in everything if getattr(one, column) == value]))
                      for column in ("layout", "room")
                      for value in dict.fromkeys(getattr(one, column) for one in everything))]
    printed = [table(["scenes", "all found: stills", "sequence", "bias rms, px", "worst marker", "jitter, px",
                      "jitter / bound"], rows)]
    if each and any(one.missed for one in everything):
        printed.append(table(["scene", "missed"], [
            [one.name, ", ".join(f"{name} {times}" for name, times in one.missed.items())]
            for one in everything if one.missed]))
    return printed


def absences(length: int, count: int, rng: np.random.Generator) -> NDArray[np.bool_]:
    """(F, M) whether a marker is hidden: one by one, or two, for a while."""
    hidden, begin = np.zeros((length, count), dtype=bool), int(rng.integers(*APART))
    while begin < length:
        end = begin + int(rng.integers(*AWAY))
        for index in rng.choice(count, 2 if rng.random() < BOTH else 1, replace=False):
            hidden[begin:end, index] = True
        begin = end + int(rng.integers(*APART))
    return hidden


@dataclass
class Returned:
    """The figures of a long sequence.

    `found`: share of frames with all visible markers found. `waits`: frames until each return was found, 1 when at
    once, 0 when never. `phantoms`: reports of a hidden marker, of `hidden` frames of hidden markers.
    """

    name: str
    found: float
    waits: list[int]
    phantoms: int
    hidden: int
    missed: dict[str, int]


def returning(scene: Scene, length: int, rng: np.random.Generator) -> Returned:
    """Follow a scene in which markers vanish and return."""
    detector, count = FastDetector(MARKERS), len(scene.shapes)
    hidden = absences(length, count, rng)
    hits, stated = np.zeros((length, count), dtype=bool), np.zeros((length, count), dtype=bool)
    for number in range(length):
        away = np.flatnonzero(hidden[number]).tolist()
        seen = detector.detect(scene.picture(number, away).expose(rng))[:count]
        hits[number] = [right(mark, shape) for mark, shape in zip(seen, scene.at(number), strict=True)]
        stated[number] = [mark.found for mark in seen]
    waits, excepted = [], hidden.copy()
    for index in range(count):
        for begin in np.flatnonzero(hidden[:-1, index] & ~hidden[1:, index]) + 1:
            excepted[begin:begin + RETURN_AIM, index] = True
            again = np.flatnonzero(hidden[begin:, index])
            stay = int(again[0]) if len(again) else length - begin
            found = np.flatnonzero(hits[begin:begin + stay, index])
            if len(found) or stay >= RETURN_AIM:
                waits.append(int(found[0]) + 1 if len(found) else 0)
    missed = (~hits & ~excepted).sum(axis=0)
    return Returned(scene.name, float((hits | excepted).all(axis=1).mean()), waits, int((stated & hidden).sum()),
                    int(hidden.sum()), {name: int(times) for name, times in zip(MARKERS.ids, missed, strict=True)
                                        if times})


def returns(args: argparse.Namespace) -> list[Returned]:
    """Long sequences of every layout and room, of 12 px, 16 px and mixed."""
    rng = np.random.default_rng(args.seed + 1)
    everything: list[Returned] = []
    for layout, room, size in product(args.layout or LAYOUTS, args.room or ROOMS, args.size or ("12", "16", "mixed")):
        scene = build_scene(layout, size, room, 1000 * args.seed + 500 + len(everything),
                            args.shapes or SHAPES[len(everything) % len(SHAPES)])
        everything.append(returning(scene, args.long, rng))
    return everything


def main() -> int:
    """Run, print the tables, write the JSON; 1 when an aim is missed."""
    parser = arguments(__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--frames", type=int, default=24, help="of a sequence, and of markers that keep their places")
    parser.add_argument("--scenes", type=int, default=1, help="of each layout, size and room")
    parser.add_argument("--long", type=int, default=200, help="frames of a sequence in which markers vanish")
    parser.add_argument("--layout", action="append", choices=tuple(LAYOUTS))
    parser.add_argument("--size", action="append", choices=SIZES)
    parser.add_argument("--room", action="append", choices=tuple(ROOMS))
    parser.add_argument("--shapes", choices=SHAPES, help="else each in turn")
    parser.add_argument("--told", choices=("shipped", "disc"), default="shipped",
                        help="what the detector takes the markers for: the set's shapes (capsules, a band), or discs")
    parser.add_argument("--part", choices=("scenes", "returns"), help="else both")
    parser.add_argument("--each", action="store_true", help="print every scene, too")
    args = parser.parse_args()
    result: dict[str, Any] = {"seed": args.seed, "frames": args.frames}
    printed, good = [], True
    if args.part != "returns":
        scored = scenes(args)
        result |= {"all": figures(scored), "scenes": [asdict(one) for one in scored]}
        good = meets(result["all"])
        printed += scene_tables(scored, args.each)
    if args.part != "scenes":
        returned = returns(args)
        result["returns"] = [asdict(one) for one in returned]
        waits = [wait for one in returned for wait in one.waits]
        found = float(np.mean([one.found for one in returned]))
        good = good and found >= FOUND_AIM and max(waits) <= RETURN_AIM and 0 not in waits
        printed.append(table([f"{len(returned)} sequences in which markers vanish and return", "result", "aim"], [
            ["frames with all visible markers found", f"{100.0 * found:.1f} %", f"{100 * FOUND_AIM:g} %"],
            [f"frames until a returned marker is found, worst of {len(waits)} returns", max(waits), RETURN_AIM],
            ["returned markers never found", waits.count(0), 0],
            [f"hidden markers reported, of {sum(one.hidden for one in returned)} frames",
             sum(one.phantoms for one in returned), 0]]))
    publish(args, result, *printed)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
