"""Two bare hands at once: is each tracked as well as if it were alone?

    python benchmarks/two_bare_hands.py [--frames 60] [--seeds 3] [--only CASES] [--json FILE]

A right and a left hand are drawn before a wall, in their start poses until both are tracked and then moving, and
tracked live by the nodes' search of the pictures. The cases are

* `alone`: the right hand, before a rig that has no other one;
* `apart`: both move side by side;
* `crossing`: they change places, and the left one passes 5 cm in front of the right one;
* `leaving`: the left one goes out of both pictures and comes back.

`joint mm` are of the tracked states of the moving hand, `tracked` is their share, while the hand is in both pictures.
`swapped` is the share of frames in which a hand is estimated nearer to where the other one is, `in 3 sigma` the
part of the joints' errors within their stated 3 sigma. Both hands begin in their start poses. Searches beside
the frames end before the next frame, so their time is not in it.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "barehand"), str(ROOT / "benchmarks")]

from bare_hand import CHI2_3  # noqa: E402
from bare_scenes import DISTANCE_M, model_and_surface, near, rig_of  # noqa: E402
from pictures import picture_of, taken, two_cameras, wall  # noqa: E402
from shipped_rig import LEFT_HAND  # noqa: E402
from tables import arguments, publish, table  # noqa: E402

from rhot_app.evaluation.contour_tracker import FIRST_NS, PERIOD_NS, SearchedNodes  # noqa: E402
from rhot_app.hand.kinematics import forward  # noqa: E402
from rhot_app.hand.skeleton import HandPose  # noqa: E402
from rhot_app.project import Rig  # noqa: E402
from rhot_app.simulator.scene.motion_file import load_motion  # noqa: E402
from rhot_app.state import HandState  # noqa: E402
from rhot_app.tracking.scene import make_tracker  # noqa: E402
from rhot_node.detect.foreground import learn_background, skin_foreground  # noqa: E402

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

FPS = 1e9 / PERIOD_NS
SIDES = "right", "left"
MOTIONS = ("grasp", "spread"), ("pinch", "grasp"), ("spread", "pinch")  # of right and left hand, by seed
ASIDE_M = 0.1  # of each hand from the middle
IN_FRONT_M = 0.05
OUT_M = 0.35  # so much farther to the left, no camera sees a hand
STILL = 20  # frames for the start
CASES = "alone", "apart", "crossing", "leaving"


class Film(NamedTuple):
    """`empty` (C) pictures without a hand, `images` (T, C), poses (T) of each hand by side, and which frames (T,) show
    it by side."""

    rig: Rig
    poses: dict[str, list[HandPose]]
    shown: dict[str, NDArray[np.bool_]]
    empty: list[Picture]
    images: list[list[Picture]]


def places(case: str, side: str, frames: int) -> Array:
    """(frames, 3) m, from the middle."""
    way = np.clip(np.linspace(-0.3, 1.3, frames), 0.0, 1.0)
    way = 3.0 * way**2 - 2.0 * way**3
    out, sign = np.zeros((frames, 3)), 1.0 if side == "right" else -1.0
    out[:, 0] = sign * ASIDE_M
    if case == "crossing":
        out[:, 0] *= 1.0 - 2.0 * way
    if case == "leaving" and side == "left":
        out[:, 0] -= OUT_M * np.sin(np.pi * np.clip(np.linspace(-0.3, 1.3, frames), 0.0, 1.0)) ** 2
    return out


def film(case: str, seed: int, frames: int, still: int = STILL) -> Film:
    """The pictures of one or both hands."""
    cameras, sides = two_cameras(distance=DISTANCE_M), SIDES[:1] if case == "alone" else SIDES
    poses, shown = {}, {}
    for number, side in enumerate(sides):
        model, _ = model_and_surface(side)
        moving = load_motion(MOTIONS[seed % len(MOTIONS)][number], model, np.array([0.0, 0.0, DISTANCE_M]), seed)
        way = places(case, side, frames)
        way = np.vstack([np.tile(way[0], (still, 1)), way])
        poses[side] = [_moved(moving.pose(max(k - still, 0) / FPS), way[k]) for k in range(still + frames)]
        shown[side] = np.abs(way[:, 0]) < ASIDE_M + 0.02
    if case == "crossing":
        for front, behind in zip(poses["left"], poses["right"], strict=True):
            front.world_from_palm[2, 3] = behind.world_from_palm[2, 3] - IN_FRONT_M
    walls = [wall(camera, 10 * seed + k, False) for k, camera in enumerate(cameras)]
    images = [[picture_of([(model_and_surface(side)[1], poses[side][k]) for side in sides], camera, walls[c], k)
               for c, camera in enumerate(cameras)] for k in range(still + frames)]
    rig = rig_of(cameras, shown=[near(one[0], number) for number, one in enumerate(poses.values())])
    rig = msgspec.structs.replace(rig, tracker=msgspec.structs.replace(rig.tracker, kind="estimator",
                                                                       observe="contours"))
    if case != "alone":
        rig = msgspec.structs.replace(rig, other_hand=LEFT_HAND)
    return Film(rig, poses, shown, [taken(one, 0) for one in walls], images)


def _moved(pose: HandPose, by: Array) -> HandPose:
    world = pose.world_from_palm.copy()
    world[:3, 3] += by
    return HandPose(world, pose.angles)


def track(shown: Film, *, forget: bool = False) -> list[HandState | None]:
    """The last state after every frame."""
    nodes = SearchedNodes(make_tracker(shown.rig), [learn_background(skin_foreground(), [one]) for one in shown.empty],
                          len(shown.rig.markers.ids), forget=forget)
    for number in range(-3, 0):
        nodes.step(number, shown.empty)
    states = []
    for number, images in enumerate(shown.images):
        count = len(nodes.states)
        nodes.step(number, images)
        states.append(nodes.states[-1] if len(nodes.states) > count else None)
    return states


def figures(shown: Film, states: list[HandState | None], still: int = STILL) -> dict[str, float]:
    """Errors of each hand's joints, and how often it is tracked."""
    out: dict[str, float] = {}
    centres = {side: np.array([forward(model_and_surface(side)[0], pose).joints.mean(axis=0) for pose in poses])
               for side, poses in shown.poses.items()}
    for side, poses in shown.poses.items():
        model = model_and_surface(side)[0]
        own = [None if state is None else state if side == "right" else state.other for state in states]
        errors, nees, swapped, tracked = [], [], 0, 0
        for k in range(still, len(states)):
            state = own[k]
            if state is None or not state.tracked:
                continue
            n = round((state.t_master_ns - FIRST_NS) / PERIOD_NS)
            error = state.joint_positions - forward(model, poses[n]).joints
            away = [float(np.linalg.norm(state.joint_positions.mean(axis=0) - one[n])) for one in centres.values()]
            swapped += int(min(away) < float(np.linalg.norm(state.joint_positions.mean(axis=0) - centres[side][n])))
            if not shown.shown[side][k]:
                continue
            tracked += 1
            errors.append(1e3 * float(np.mean(np.linalg.norm(error, axis=1))))
            nees += [float(e @ np.linalg.solve(c + 1e-12 * np.eye(3), e))
                     for e, c in zip(error, state.joint_covariances, strict=True)]
        begun = next((k for k, state in enumerate(own) if state is not None and state.tracked), np.nan)
        seen = int(np.count_nonzero(shown.shown[side][still:]))
        out |= {f"{side} joint mm": float(np.mean(errors)) if errors else np.nan,
                f"{side} p95 mm": float(np.percentile(errors, 95)) if errors else np.nan,
                f"{side} in 3 sigma": float(np.mean(np.array(nees) < CHI2_3)) if errors else np.nan,
                f"{side} tracked": tracked / seen, f"{side} swapped": swapped / (len(states) - still),
                f"{side} start s": (begun + 1) / FPS}
    return out


def main() -> int:
    """Print the table, write JSON."""
    parser = arguments(__doc__)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--only", default=",".join(CASES))
    args = parser.parse_args()
    found: dict[str, list[dict[str, float]]] = {}
    rows = []
    for case in args.only.split(","):
        found[case] = []
        for seed in range(args.seeds):
            shown = film(case, seed, args.frames)
            found[case].append(figures(shown, track(shown)))
        for figure in found[case][0]:
            values, low = np.array([one[figure] for one in found[case]]), figure.endswith(("in 3 sigma", "tracked"))
            if np.isnan(values).all():
                rows.append([case, figure, np.nan, np.nan, np.nan, 0])
                continue
            worst = int(np.nanargmin(values) if low else np.nanargmax(values))
            rows.append([case, figure, float(np.nanmedian(values)),
                         float(np.nanpercentile(values, 5 if low else 95)), float(values[worst]), worst])
    publish(args, found, table(["case", "figure", "median", "p95", "worst", "its seed"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
