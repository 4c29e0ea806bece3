"""Markers or landmarks beside contours: is the hand tracked better by both than by either alone?

    python benchmarks/mixed_hand.py [--frames 60] [--seeds 3] [--only CASES] [--found] [--json FILE]

A hand is drawn before a wall, at rest until it is found and then moving, and tracked live by the nodes' search of the
pictures, by its markers, and by both. The cases are `fingertips`, a painted thumb and index finger on a hand that is
bare otherwise, and `landmarks`, what a detector reports of 21 joints with the measured errors
(`tests/landmark_detector.py`). In a case with `-file` the hand is as its file says. Otherwise the drawn hand's
bones are off by 5 % and its radii by 8 %, before clutter, and the size is estimated.

All start from the true pose of the hand at rest; with `--found`, markers from what they find and contours from a pose
that is shown. Errors and consistency
are of the moving hand: `in 3 sigma` is the part of the joints' errors within their stated 3 sigma. `start s` is the
time until the hand at rest is tracked. Searches beside the frames end before the next frame, so their time is not in
it.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "barehand"), str(ROOT / "benchmarks")]

from bare_hand import CHI2_3, MOTIONS, mistaken  # noqa: E402
from bare_scenes import DISTANCE_M, near, rig_of  # noqa: E402
from landmark_detector import Hand, detected_landmarks  # noqa: E402
from pictures import capsules_of, picture, two_cameras, wall  # noqa: E402
from shipped_rig import RIGHT_HAND  # noqa: E402

from rhot_app.barehand.start import start_pose_file  # noqa: E402
from rhot_app.barehand.surface import ray_to_capsule, surface_of  # noqa: E402
from rhot_app.evaluation.contour_tracker import FIRST_NS, PERIOD_NS, SearchedNodes  # noqa: E402
from rhot_app.geometry.camera import CameraModel  # noqa: E402
from rhot_app.hand.kinematics import forward  # noqa: E402
from rhot_app.hand.model import HandModel, build_model  # noqa: E402
from rhot_app.hand.skeleton import TIP_ROLES, HandPose  # noqa: E402
from rhot_app.project import Rig, TrackerSettings  # noqa: E402
from rhot_app.simulator.scene.motion_file import load_motion  # noqa: E402
from rhot_app.state import HandState  # noqa: E402
from rhot_app.tracking.contours.tracker import ContourEstimator  # noqa: E402
from rhot_app.tracking.markers.estimator import Estimator  # noqa: E402
from rhot_app.tracking.scene import make_tracker  # noqa: E402
from rhot_app.tracking.tracker import CameraObservations, Tracker  # noqa: E402
from rhot_node.detect.foreground import Foreground, learn_background, skin_foreground  # noqa: E402
from rhot_node.files import resource_path  # noqa: E402
from rhot_node.markers import MarkerSet, load_markers  # noqa: E402
from rhot_node.wire.messages import MarkerFlag  # noqa: E402

Array = NDArray[np.float64]

FPS = 1e9 / PERIOD_NS
STILL = 20  # frames of the hand at rest
PAINTED = (0, 1)  # thumb and index finger
CASES = "fingertips", "landmarks", "fingertips-file", "landmarks-file"
OBSERVED = "markers", "contours", "both"


class Film(NamedTuple):
    """What the nodes get: `empty` (C) pictures without a hand, `images` (T, C), `seen` (T, C) of the markers, and the
    truth: the hand and its poses (T)."""

    rig: Rig
    model: HandModel
    poses: list[HandPose]
    empty: list[NDArray[np.uint8]]
    images: list[list[NDArray[np.uint8]]]
    seen: list[list[CameraObservations]]


def markers_of(case: str) -> MarkerSet:
    """The painted thumb and index finger, or the landmarks."""
    if case.startswith("landmarks"):
        return load_markers(resource_path("markers", "landmarks21.json"))
    painted = load_markers(resource_path("markers", "rhot6.json"))
    return msgspec.structs.replace(painted, markers=tuple(
        one for one in painted.markers if one.role in [TIP_ROLES[finger] for finger in PAINTED]))


def film(case: str, seed: int, frames: int) -> Film:
    """The pictures and markers of one hand."""
    rng, own = np.random.default_rng(seed), case.endswith("-file")
    cameras, hand, markers = two_cameras(distance=DISTANCE_M), RIGHT_HAND, markers_of(case)
    rig = msgspec.structs.replace(rig_of(cameras, hand if own else mistaken(hand, rng)), markers=markers)
    model = build_model(hand)
    surface = surface_of(model)
    moving = load_motion(MOTIONS[seed % len(MOTIONS)], model, np.array([0.0, 0.0, DISTANCE_M]), seed)
    times = np.maximum(np.arange(STILL + frames) - STILL, 0) / FPS
    poses = [moving.pose(t_s) for t_s in times]
    walls = [wall(camera, 10 * seed + k, clutter=not own) for k, camera in enumerate(cameras)]
    paint = {} if case.startswith("landmarks") else {
        finger: tuple(float(value) for value in one.display_rgb)
        for one in markers.markers for finger in PAINTED if one.role == TIP_ROLES[finger]}
    images = [[picture(surface, pose.world_from_palm, pose.angles, camera, walls[c], 1000 * seed + k,
                       blur_px=0.8 if own else 1.5, paint=paint) for c, camera in enumerate(cameras)]
              for k, pose in enumerate(poses)]
    true = Hand(model, np.array([pose.world_from_palm for pose in poses]), np.array([pose.angles for pose in poses]),
                np.arange(len(poses)) / FPS)
    found = detected_landmarks(msgspec.structs.replace(rig, hand=hand), true, seed)
    seen = [found[k * len(cameras):(k + 1) * len(cameras)] for k in range(len(poses))]
    if paint:
        for pose, frame in zip(poses, seen, strict=True):
            for camera, one in zip(cameras, frame, strict=True):
                _hide(one, *capsules_of(surface, pose.world_from_palm, pose.angles), camera, surface.group)
    return Film(rig, model, poses, [np.clip(one, 0, 255).astype(np.uint8) for one in walls], images, seen)


def _hide(one: CameraObservations, centres: Array, radii: Array, camera: CameraModel, group: NDArray[np.int64]) -> None:
    """Mark the painted fingertips as lost that another part of the hand covers."""
    o = camera.centre
    for m, finger in enumerate(PAINTED):
        tip = int(np.flatnonzero(group == finger)[-1])
        way = 0.5 * (centres[tip, 0] + centres[tip, 1]) - o
        far = float(np.linalg.norm(way))
        u = way / far
        hits = [ray_to_capsule(o, u, centres, radii, k) for k in range(len(radii)) if k != tip]
        if any(0.0 < hit < far - radii[tip].max() for hit in hits):
            one.pixels[m], one.flags[m] = np.nan, int(MarkerFlag.LOST)


def give_start(tracker: Tracker, pose: HandPose) -> None:
    """Have the tracker find `pose` wherever it looks for a hand at rest."""
    if isinstance(tracker, ContourEstimator):
        search = tracker._finder.found

        def found() -> tuple[HandPose, int] | None:
            newest = tracker.newest_frames()[0]
            at_rest = newest is not None and 0 <= newest.t_row0_master_ns - FIRST_NS < STILL * PERIOD_NS
            return (pose, newest.t_row0_master_ns) if newest is not None and at_rest else search()

        tracker._finder.found = found  # type: ignore[method-assign]
    else:
        assert isinstance(tracker, Estimator)
        tracker._starter.pose_of = lambda *_: pose  # type: ignore[method-assign]


def track(shown: Film, observe: str, case: str, start: HandPose | None) -> list[HandState | None]:
    """The last state after every step, None while the hand is not tracked."""
    rig = msgspec.structs.replace(shown.rig, tracker=TrackerSettings(
        "estimator", observe=observe, float_scale=not case.endswith("-file"),
        start_poses=(start_pose_file(near(shown.poses[0])),)))
    tracker, states = make_tracker(rig), []
    nodes = None
    if start is not None:
        give_start(tracker, start)
    if observe != "markers":
        nodes = SearchedNodes(tracker, foreground_of(shown), len(rig.markers.ids))
        for number in range(-3, 0):
            nodes.step(number, shown.empty)
    for number, (images, seen) in enumerate(zip(shown.images, shown.seen, strict=True)):
        newest = None
        if nodes is not None:
            count = len(nodes.states)
            nodes.step(number, images, seen=seen if observe == "both" else None)
            nodes.tracker.wait()  # type: ignore[attr-defined]
            newest = nodes.states[-1] if len(nodes.states) > count else None
        else:
            t_ns = FIRST_NS + number * PERIOD_NS
            for one in seen:
                tracker.ingest(replace(one, t_row0_master_ns=t_ns, t_receive_ns=t_ns))
                newest = tracker.solve() or newest
        states.append(newest if newest is not None and newest.tracked else None)
    return states


def foreground_of(shown: Film) -> list[Foreground]:
    """What the nodes learn of the empty scene."""
    return [learn_background(skin_foreground(), [empty]) for empty in shown.empty]


def figures(shown: Film, states: list[HandState | None]) -> dict[str, float]:
    """Errors of the joints and angles of the tracked states of the moving hand, and when it was first tracked."""
    joints, angles, nees = [], [], []
    begun = next((number for number, state in enumerate(states) if state is not None), np.nan)
    moving = states[STILL:]
    for state in moving:
        if state is None:
            continue
        pose = shown.poses[round((state.t_master_ns - FIRST_NS) / PERIOD_NS)]
        error = state.joint_positions - forward(shown.model, pose).joints
        joints.append(1e3 * float(np.mean(np.linalg.norm(error, axis=1))))
        angles.append(float(np.mean(np.degrees(np.abs(state.angles - pose.angles)))))
        nees += [float(e @ np.linalg.solve(c + 1e-12 * np.eye(3), e))
                 for e, c in zip(error, state.joint_covariances, strict=True)]
    start_s = float(begun + 1) / FPS
    if not joints:
        return dict.fromkeys(("joint mm", "p95 mm", "angle deg", "in 3 sigma"), np.nan) | {
            "tracked": 0.0, "start s": start_s}
    return {"joint mm": float(np.mean(joints)), "p95 mm": float(np.percentile(joints, 95)),
            "angle deg": float(np.mean(angles)), "in 3 sigma": float(np.mean(np.array(nees) < CHI2_3)),
            "tracked": len(joints) / len(moving), "start s": start_s}


def main() -> int:
    """Print the table, write JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--only", default=",".join(CASES))
    parser.add_argument("--observe", default=",".join(OBSERVED))
    parser.add_argument("--found", action="store_true")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    found: dict[str, dict[str, list[dict[str, float]]]] = {}
    print(f"{'case':16s} {'observed':9s} {'figure':11s} {'median':>7s} {'p95':>7s} {'worst (seed)':>13s}")
    for case in arguments.only.split(","):
        runs: dict[str, list[dict[str, float]]] = {name: [] for name in arguments.observe.split(",")}
        for seed in range(arguments.seeds):
            shown = film(case, seed, arguments.frames)
            for observe, own in runs.items():
                start = None if arguments.found else shown.poses[0]
                own.append(figures(shown, track(shown, observe, case, start)))
        found[case] = runs
        for observe, own in runs.items():
            for figure in own[0]:
                values, low = np.array([one[figure] for one in own]), figure in ("in 3 sigma", "tracked")
                if np.isnan(values).all():
                    print(f"{case:16s} {observe:9s} {figure:11s} {'-':>7s} {'-':>7s} {'-':>7s}", flush=True)
                    continue
                worst = int(np.nanargmin(values) if low else np.nanargmax(values))
                print(f"{case:16s} {observe:9s} {figure:11s} {np.nanmedian(values):7.2f} "
                      f"{np.nanpercentile(values, 5 if low else 95):7.2f} {values[worst]:7.2f} ({worst})", flush=True)
    if arguments.json is not None:
        arguments.json.write_text(json.dumps(found, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
