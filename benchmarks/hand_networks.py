"""The hand networks on a recorded hand: distance from MediaPipe's own landmarks, time, and noise.

    python benchmarks/hand_networks.py [--data ../shared/data/bare_hand_stereo] [--json FILE]

Of both cameras' pictures: the distance of each landmark from that in the recording's tables, which MediaPipe made; the
processor's time of a picture, in one thread; the part of the tables' frames with a hand. Then the standard deviation of
a landmark, per axis and as a part of the region's side, when the region of the same picture moves, turns and grows a
little: a network errs in another way in each. It is the source of `HAND_SIGMA` in rhot_node/landmarks/networks.py.
"""

from __future__ import annotations

import csv
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENCV_FOR_THREADS_NUM", "1")  # before OpenCV loads

import numpy as np
from numpy.typing import NDArray
from tables import arguments, publish, table

from rhot_node.errors import KeypointError
from rhot_node.landmarks.install import installed_folder, read_network
from rhot_node.landmarks.networks import HAND_PX, MODELS, HandNetworks, Region, landmarks_in, open_hand_networks
from rhot_node.landmarks.runtime import RUNTIMES, best_runtime, open_network
from rhot_node.pictures import open_video

Array = NDArray[np.float64]

DATA = Path(__file__).parents[1].parent / "shared" / "data" / "bare_hand_stereo"
CAMERAS = 2
SAMPLES = 12
SHIFT, TURN, GROWTH = 0.03, 0.03, 0.015
"""Standard deviations by which a region is changed: a part of its side, rad, and a part of its side. The recorded
hand's own regions change so from picture to picture."""


def main() -> int:
    """Print both tables, write JSON."""
    parser = arguments(__doc__)
    parser.add_argument("--data", type=Path, default=DATA)
    args = parser.parse_args()
    if not args.data.is_dir() or installed_folder() is None:
        print(f"{args.data} is not there." if installed_folder() else
              "The hand networks are not installed: rhot-node landmarks install.", file=sys.stderr)
        return 2
    rows = []
    for model in MODELS:
        for runtime in RUNTIMES:
            try:
                networks = [open_hand_networks(model=model, runtime=runtime) for _ in range(CAMERAS)]
            except KeypointError as exc:
                print(exc, file=sys.stderr)
                continue
            rows += [{"model": model, "runtime": runtime, "camera": k} | compared(args.data, k, one)
                     for k, one in enumerate(networks)]
    noise = [{"model": model} | spread(args.data, model) for model in MODELS]
    publish(args, {"compared": rows, "noise": noise},
            *(table(list(part[0]), [list(row.values()) for row in part]) for part in (rows, noise)))
    return 0


def pictures(folder: Path, camera: int) -> Iterator[NDArray[np.uint8]]:
    """Those of the film of a camera."""
    video = open_video(folder / f"cam{camera}_first120.mp4")
    while True:
        there, picture = video.read()
        if not there:
            break
        yield np.asarray(picture, np.uint8)
    video.release()


def compared(folder: Path, camera: int, networks: HandNetworks) -> dict[str, Any]:
    """A film's hands against its table."""
    with (folder / f"landmarks_c{camera}.csv").open() as file:
        rows = {int(row["frame"]): np.array([[float(row[f"{axis}{k}"]) for axis in "xy"] for k in range(21)])
                for row in csv.DictReader(file)}
    apart, cost_s, found = [], [], 0
    for number, picture in enumerate(pictures(folder, camera)):
        begun = time.process_time()
        hands = networks.find(picture)
        cost_s.append(time.process_time() - begun)
        if number in rows and hands:
            found += 1
            apart.append(np.linalg.norm(hands[0].landmarks - rows[number], axis=1))
    return {"median px": float(np.median(apart)), "p95 px": float(np.percentile(apart, 95)),
            "ms a picture": 1e3 * float(np.median(cost_s)), "found %": 100.0 * found / len(rows)}


def spread(folder: Path, model: str) -> dict[str, Any]:
    """How much landmarks differ with the region that they are looked for in."""
    rng, parts = np.random.default_rng(0), []
    where = installed_folder()
    assert where is not None
    runtime = best_runtime()
    hand = open_network(read_network(where, f"hand_landmark_{model}.tflite"), runtime, 1)
    for camera in range(CAMERAS):
        networks = open_hand_networks(model=model, runtime=runtime)
        for number, picture in enumerate(pictures(folder, camera)):
            for one in networks.find(picture):
                if number % 4:
                    continue
                samples = [landmarks_in(hand, picture, changed(one.region, rng))[0] for _ in range(SAMPLES)]
                parts.append(np.std(samples, axis=0, ddof=1) / one.region.side)
    sd = np.sqrt(np.mean(np.square(parts), axis=(0, 2)))  # of each landmark
    return {"sd, part of the side": float(np.sqrt(np.mean(sd**2))), "median landmark": float(np.median(sd)),
            "best": float(sd.min()), "worst": float(sd.max()), "px of the input": HAND_PX * float(np.median(sd))}


def changed(region: Region, rng: np.random.Generator) -> Region:
    """A region nearby."""
    return Region(region.centre + SHIFT * region.side * rng.normal(size=2),
                  region.side * float(np.exp(GROWTH * rng.normal())), region.turn + TURN * rng.normal())


if __name__ == "__main__":
    sys.exit(main())
