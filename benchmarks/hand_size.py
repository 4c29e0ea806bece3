"""How well shapes of a hand show its size, of people whose habits and proportions are not those of the hand file.

    python benchmarks/hand_size.py [--people 25] [--seed 1] [--json FILE]

Each person has a size (10 % about the file's), bones that differ by a share of their length, each for itself, and a
mean pose that is some standard deviations of the natural pose off it; the shapes scatter about that mean, within the
joints' limits. Markers are located to 0.5 mm. The true size is that of the mean length of all fingers with their
metacarpals. Printed: how far `tracking.markers.hand_size` is off, and what it states.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray
from tables import arguments, publish, table

from rhot_app.hand.anatomy import FingerAnatomy, HandAnatomy
from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.project import Rig
from rhot_app.tracking.locate import Located
from rhot_app.tracking.markers.hand_size import GRID, HandSize
from rhot_app.tracking.markers.marker_model import USUAL_SIZE_SD, MarkerModel, compile_markers

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from synthetic_node import synthetic_rig

Array = NDArray[np.float64]

NOISE_M = 5e-4
BEYOND_RAD = math.radians(8.0)
DRAWS = 3000


@dataclass(frozen=True)
class People:
    """`bones`: how far each bone is off, as a share; `habit`: how far the mean pose is off and `within`: how far shapes
    are off that, in standard deviations of the natural pose."""

    shapes: int
    bones: float
    habit: float
    within: float


GROUPS = (
    People(1, 0.0, 0.0, 1.0), People(8, 0.0, 0.0, 1.0), People(8, 0.03, 0.0, 1.0), People(8, 0.05, 0.0, 1.0),
    People(8, 0.0, 0.5, 1.0), People(8, 0.0, 1.0, 0.5), People(1, 0.05, 0.7, 0.7), People(2, 0.05, 0.7, 0.7),
    People(8, 0.05, 0.7, 0.7))


def main() -> int:
    """Print a line per group of people, write JSON."""
    parser = arguments(__doc__)
    parser.add_argument("--people", type=int, default=25, help="in each group (default 25)")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    rig, lines = synthetic_rig(), []
    markers = compile_markers(rig)
    for group in GROUPS:
        rng = np.random.default_rng(args.seed)
        found = np.array([learnt(group, rig, markers, rng) for _ in range(args.people)])
        error, stated = found[:, 0] - found[:, 2], found[:, 1]
        lines.append({"shapes": group.shapes, "bones": group.bones, "habit": group.habit, "within": group.within,
                      "error_percent": 100.0 * rms(error), "worst_percent": float(100.0 * np.abs(error).max()),
                      "stated_percent": 100.0 * rms(stated), "in_sd": rms(error / stated),
                      "worst_in_sd": float(np.abs(error / stated).max())})
    publish(args, lines, table([name.replace("_", " ") for name in lines[0]], [list(line.values()) for line in lines]))
    return 0


def learnt(group: People, rig: Rig, markers: MarkerModel, rng: np.random.Generator) -> tuple[float, float, float]:
    """Of one person: the logarithm of the size, its standard deviation, and the truth."""
    log_scale, size = USUAL_SIZE_SD * rng.normal(), HandSize(
        markers.dh, markers.limits, markers.pose_prior, markers.paint_variance)
    hand = person(rig.hand, group.bones, rng)
    worn = compile_markers(msgspec.structs.replace(rig, hand=hand)).dh
    spread = np.linalg.cholesky(np.linalg.inv(markers.pose_prior.information))
    mean = np.clip(markers.pose_prior.mean + group.habit * (spread @ rng.normal(size=21)), *markers.limits.T)
    for _ in range(group.shapes):
        angles, points = pose(mean, group.within * spread, markers.limits, rng), np.empty((len(markers.roles), 3))
        forward_arrays(worn, np.eye(4), angles, empty_frames(worn), points)
        points = math.exp(log_scale) * points + NOISE_M * rng.normal(size=points.shape)
        size.look(Located(0, points, np.tile(NOISE_M**2 * np.eye(3), (len(points), 1, 1)),
                          np.ones(len(points), np.bool_)), np.eye(4), angles)
        for _ in GRID:
            size.work()
    size.settle()
    found, variance = size.known
    return found, math.sqrt(variance), log_scale + math.log(reach(hand) / reach(rig.hand))


def person(hand: HandAnatomy, bones: float, rng: np.random.Generator) -> HandAnatomy:
    """The hand with each length off by a share of itself."""
    fingers = {name: _other(finger, bones, rng) for name, finger in hand.fingers.items()}
    return msgspec.structs.replace(hand, fingers=fingers)


def _other(finger: FingerAnatomy, bones: float, rng: np.random.Generator) -> FingerAnatomy:
    first, second, last, x, y = (1.0 + bones * rng.normal(size=5)).tolist()
    return msgspec.structs.replace(
        finger, base_mm=(x * finger.base_mm[0], y * finger.base_mm[1], finger.base_mm[2]),
        bones_mm=(first * finger.bones_mm[0], second * finger.bones_mm[1], last * finger.bones_mm[2]),
        marker_mm=last * finger.marker_mm)


def reach(hand: HandAnatomy) -> float:
    """Mean length of the fingers with their metacarpals, mm."""
    return float(np.mean([sum(finger.bones_mm) + math.hypot(*finger.base_mm) for finger in hand.fingers.values()]))


def pose(mean: Array, spread: Array, limits: Array, rng: np.random.Generator) -> Array:
    """(21,) rad drawn about `mean`: the first of many draws that hardly leaves the `limits` (21, 2), else the best."""
    best, least = mean, math.inf
    for _ in range(DRAWS):
        angles = mean + spread @ rng.normal(size=21)
        bounded = np.clip(angles, *limits.T)
        beyond = float(np.abs(angles - bounded).max())
        if beyond < least:
            best, least = bounded, beyond
        if beyond < BEYOND_RAD:
            break
    return best


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    sys.exit(main())
