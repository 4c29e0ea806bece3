"""Processing time for six markers: this detector and the thesis's pipeline, in one run.

    python benchmarks/detection.py [--rounds N] [--size S] [--shapes S] [--seed N] [--processor] [--json FILE]

Three scenes of `independent_drawing`, 640x480, six markers (discs of 16 px): close together, spread to the frame's
border, and before texture. Both programs get the same frames and take turns, a ring of frames each, so that a busy
machine slows both alike. All code, OpenCV's too, uses one thread. The ring is larger than the caches.

* tracked: all six followed, their outlines fitted; the reference is the thesis's regions of interest.
* one, two hidden: absent from the pictures. The thesis's pipeline then searches the whole frame for them. The
  references are that search, and its regions of interest with all markers.
* all lost: the sum over all frames from the loss of all tracks until the last marker is found; the reference is one
  whole frame of the thesis's pipeline.
* cold start: the same for a new detector without tracks and without a known light.

`--processor` counts the processor's time instead of the clock's: on a busy machine long calls are interrupted, short
ones hardly ever. Ends with code 1 when an aim is missed.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from independent_drawing import MARKERS, SHAPES, SIZES, Array, Scene, build_scene
from independent_scenes import right
from tables import arguments, publish, table
from thesis_pipeline import ThesisPipeline

from rhot_node.detect.fast import SEARCH_STEP, FastDetector
from rhot_node.detect.image import YuvImage, to_bgr
from rhot_node.detect.search import ColourGate

SCENES = {"compact": ("compact", "grey"), "spread": ("spread", "grey"), "textured": ("hand", "blotches")}
RING = 64  # frames: 29 MB of YUV, 59 MB of BGR
SETTLE = 12  # frames until all markers are followed
HIDDEN = ((1,), (1, 4))  # markers that are absent
FOUND_WITHIN = 5  # frames
GIVE_UP = 60  # frames
AIMS = {"tracked": 5.0, "hidden": 4.0, "all lost": 10.0, "cold start": 4.0}

Clock = Callable[[], int]


class Timed:
    """Microseconds by name, of calls that take turns."""

    def __init__(self, clock: Clock) -> None:
        self.us: dict[str, list[float]] = {}
        self.clock = clock

    def call(self, name: str, work: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function and record its time under `name`."""
        start = self.clock()
        result = work(*arguments)
        self.us.setdefault(name, []).append(1e-3 * (self.clock() - start))
        return result


def frames_of(scene: Scene, hidden: tuple[int, ...]) -> tuple[list[YuvImage], list[Any]]:
    """A ring of frames, as YUV and as BGR; the markers sway so that the first frame may follow the last."""
    rng = np.random.default_rng(1)
    yuv = [scene.picture(_moment(k), hidden).expose(rng) for k in range(RING)]
    return yuv, [to_bgr(image) for image in yuv]


def _moment(frame: int) -> int:
    return min(frame, RING - frame)


def until_all_found(timed: Timed, name: str, detector: FastDetector, scene: Scene, yuv: list[YuvImage],
                    at: int) -> int:
    """Detect from frame `at` on until all markers are found at their true positions; returns the number of frames.

    The sum of their times is one entry.
    """
    one = Timed(timed.clock)
    for count in range(1, GIVE_UP + 1):
        frame = (at + count - 1) % RING
        seen = one.call(name, detector.detect, yuv[frame])
        if all(right(mark, shape) for mark, shape in zip(seen, scene.at(_moment(frame)), strict=False)):
            break
    timed.us.setdefault(name, []).append(sum(one.us[name]))
    return count


def measure(scene: Scene, rounds: int, clock: Clock) -> tuple[dict[str, Array], dict[str, int]]:
    """Microseconds per call or sum by stage, and the greatest number of frames by the kind of start."""
    timed, worst = Timed(clock), {"all lost": 0, "cold start": 0}
    yuv, bgr = frames_of(scene, ())
    room, gate, everything = np.empty_like(bgr[0]), ColourGate(MARKERS), range(len(MARKERS.markers))
    whole, regions, lacking = (ThesisPipeline(MARKERS) for _ in range(3))
    tracked, partly, lost, cold = (FastDetector(MARKERS) for _ in range(4))
    regions.full(bgr[-1])
    stages: list[tuple[str, Callable[..., Any], list[Any]]] = [
        ("read one BGR frame (copy)", lambda picture: np.copyto(room, picture), bgr),
        ("thesis, whole frame", whole.full, bgr[::8]),
        ("thesis, regions of interest", regions.regions, bgr),
        ("acquire: search for all six", lambda image: gate.blobs(image, everything, step=SEARCH_STEP), yuv),
        ("track, outlines fitted", tracked.detect, yuv)]
    hidden_frames = {f"{len(hidden)} hidden": frames_of(scene, hidden) for hidden in HIDDEN}
    for detector in (tracked, lost):
        for image in yuv[-SETTLE:]:
            detector.detect(image)
    for _ in range(rounds):
        for name, work, frames in stages:
            for frame in frames:
                timed.call(name, work, frame)
        for name, (partly_yuv, partly_bgr) in hidden_frames.items():
            for image in yuv[-SETTLE:]:
                partly.detect(image)
            for image in partly_yuv:
                timed.call(f"track, {name}", partly.detect, image)
            lacking.full(partly_bgr[-1])
            for picture in partly_bgr:
                timed.call(f"thesis, regions, {name}", lacking.regions, picture)
        for name, detector, lose in (("all lost", lost, lost.lose_all), ("cold start", cold, cold.reset)):
            for k in range(0, RING, 4):
                lose()
                worst[name] = max(worst[name], until_all_found(timed, name, detector, scene, yuv, k))
    return {name: np.array(taken) for name, taken in timed.us.items()}, worst


def ratios(taken: dict[str, Array]) -> dict[str, tuple[float, float]]:
    """How many times faster than the thesis's pipeline, by medians, and the aim."""
    p50 = {name: float(np.median(us)) for name, us in taken.items()}
    whole, regions, hidden = p50["thesis, whole frame"], p50["thesis, regions of interest"], AIMS["hidden"]
    out = {"tracked: than its regions of interest": (regions / p50["track, outlines fitted"], AIMS["tracked"])}
    for name in (f"{len(hidden)} hidden" for hidden in HIDDEN):
        out[f"{name}: than its regions in the same frames"] = (p50[f"thesis, regions, {name}"] / p50[f"track, {name}"],
                                                               hidden)
        out[f"{name}: than its regions with all six there"] = (regions / p50[f"track, {name}"], hidden)
    for name in ("all lost", "cold start"):
        out[f"{name} until all found: than one whole frame"] = (whole / p50[name], AIMS[name])
    return out


def main() -> int:
    """Run, print the tables, write the JSON; 1 when an aim is missed."""
    parser = arguments(__doc__)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--processor", action="store_true", help="the processor's time, not the clock's")
    parser.add_argument("--size", choices=SIZES, default="16", help="px")
    parser.add_argument("--shapes", choices=SHAPES, default="disc")
    parser.add_argument("--seed", type=int, default=3)
    args = parser.parse_args()
    cv2.setNumThreads(1)
    clock = time.thread_time_ns if args.processor else time.perf_counter_ns
    taken, worst = {}, {}
    for name, (layout, room) in SCENES.items():
        scene = build_scene(layout, args.size, room, args.seed, args.shapes)
        taken[name], worst[name] = measure(scene, max(args.rounds, 1), clock)
    faster = {name: ratios(us) for name, us in taken.items()}
    publish(args, {"us": {name: {stage: [float(np.percentile(one, share)) for share in (50, 99, 100)]
                                 for stage, one in us.items()} for name, us in taken.items()},
                   "ratios": faster, "frames_until_found": worst},
            table(["µs, median (99th percentile)", *SCENES],
                  [[stage, *(f"{np.median(us[stage]):.0f} ({np.percentile(us[stage], 99):.0f})"
                             for us in taken.values())] for stage in taken["compact"]]),
            table(["times faster than the thesis's pipeline", *SCENES, "aim"],
                  [[what, *(one[what][0] for one in faster.values()), aim]
                   for what, (_, aim) in faster["compact"].items()]
                  + [[f"{kind}: frames until all found", *(one[kind] for one in worst.values()), FOUND_WITHIN]
                     for kind in worst["compact"]]))
    return int(any(ratio < aim for one in faster.values() for ratio, aim in one.values())
               or max(frames for one in worst.values() for frames in one.values()) > FOUND_WITHIN)


if __name__ == "__main__":
    sys.exit(main())
