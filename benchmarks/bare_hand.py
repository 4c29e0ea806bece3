"""The bare hand on drawn sequences with known truth: joint and angle errors, consistency, processor time.

    python benchmarks/bare_hand.py [--frames 60] [--seeds 3] [--only NAMES]

The names are matched, shape, mismatched, one, lost and edges. `shape`: bones wrong by 5 % and radii by 8 %.
`mismatched`: the cameras' calibration is wrong, too, and the hand takes a pose that is shown. `lengths %` is what is
left of the bones' error at the end, rms. `edges`: how far the outline's edges are from the true contour, by what is
learnt: one by one, and the means along a side of a phalanx over all frames (`edges.SHADED_PX`,
`key_frames.EDGE_BIAS_PX`).

Times are of the process, in one thread, so that a busy machine changes them little. `ms an iteration` is what the
thesis's table 4.1 has, 146 ms: slices, edges on them, Jacobian and solution, of all cameras. `ms a step` is the last
two.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import dataclasses
import sys
import time
from pathlib import Path

import msgspec
import numpy as np

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "barehand")]

from bare_scenes import near, rig_of  # noqa: E402
from pictures import picture, two_cameras, wall  # noqa: E402
from shipped_rig import RIGHT_HAND  # noqa: E402
from tables import arguments, publish, table  # noqa: E402

from rhot_app.barehand.contour_residual import Contours  # noqa: E402
from rhot_app.barehand.contours import SILHOUETTE  # noqa: E402
from rhot_app.barehand.surface import FINGER_SIZE, HAND_SIZE, LENGTH, RADIUS, surface_of  # noqa: E402
from rhot_app.barehand.tracker import BareHandTracker  # noqa: E402
from rhot_app.estimation.filter import gauss_newton_step  # noqa: E402
from rhot_app.estimation.residual import stack  # noqa: E402
from rhot_app.estimation.se3 import exp_so3  # noqa: E402
from rhot_app.geometry.camera import CameraModel  # noqa: E402
from rhot_app.geometry.transforms import inverse  # noqa: E402
from rhot_app.hand.anatomy import HandAnatomy  # noqa: E402
from rhot_app.hand.kinematics import forward  # noqa: E402
from rhot_app.hand.model import build_model  # noqa: E402
from rhot_app.hand.motion.hand_state import STATE  # noqa: E402
from rhot_app.simulator.scene.motion_file import load_motion  # noqa: E402
from rhot_node.detect.edges import find_edges, noise_of  # noqa: E402
from rhot_node.detect.foreground import learn_background, learn_skin, skin_foreground  # noqa: E402

FPS = 60.0
MOTIONS = "grasp", "spread", "pinch"
BATCHES, CALLS = 5, 20  # of which the quickest batch counts: other work on the machine only adds
CHI2_3 = 14.16  # 99.73 % of a chi-squared variable of 3 degrees of freedom: 3 sigma


def mistaken(hand: HandAnatomy, rng: np.random.Generator) -> HandAnatomy:
    """The hand with bones wrong by 5 % (standard deviation) and radii by 8 %."""
    fingers = {}
    for name, finger in hand.fingers.items():
        bones = tuple(float(v) for v in np.array(finger.bones_mm) * (1.0 + 0.05 * rng.standard_normal(3)))
        radii = tuple(float(v) for v in np.array(finger.radii_mm) * (1.0 + 0.08 * rng.standard_normal(3)))
        fingers[name] = msgspec.structs.replace(finger, bones_mm=bones, radii_mm=radii,
                                                marker_mm=min(finger.marker_mm, bones[2]))
    return msgspec.structs.replace(hand, fingers=fingers)


def moved(camera: CameraModel, rng: np.random.Generator) -> CameraModel:
    """The camera as a calibration says that errs by 0.2 degrees and 1 mm."""
    world = camera.world_from_camera.copy()
    world[:3, :3] = world[:3, :3] @ exp_so3(np.radians(0.2) * rng.standard_normal(3))
    world[:3, 3] += 1e-3 * rng.standard_normal(3)
    return dataclasses.replace(camera, world_from_camera=world, camera_from_world=inverse(world))


def iteration_ms(tracker: BareHandTracker, images: list[np.ndarray]) -> dict[str, float]:
    """Processor time of one search of all images and one Gauss-Newton step, by the parts of Rehg's table 4.1."""
    knot, residuals = tracker.filter.newest, [Contours([one for one in tracker.frames if one is not None]),
                                              *tracker.constraints]
    frames = {c: frame for c, frame in enumerate(tracker.frames) if frame is not None}

    def rows() -> tuple[np.ndarray, ...]:
        return stack([one.linearise(knot.state) for one in residuals], tracker.process.size, True)[:3]

    error, jacobian, variances = rows()
    here = np.zeros(tracker.process.size)
    parts = {"slices": lambda: [tracker.expected_contour(c, knot.state, knot.covariance) for c in frames],
             "edges": lambda: [frame.observe(find_edges(images[c], frame.slices, tracker.foreground[c],
                                                        tracker.noise[c])) for c, frame in frames.items()],
             "Jacobian": rows,
             "solution": lambda: gauss_newton_step(knot.covariance, jacobian, error, variances, here)}
    found = {}
    for name, part in parts.items():
        times = []
        for _ in range(BATCHES):
            begun = time.process_time()
            for _ in range(CALLS):
                part()
            times.append(1e3 * (time.process_time() - begun) / CALLS)
        found[f"{name} ms"] = min(times)
    step = found["Jacobian ms"] + found["solution ms"]
    return {"ms a step": step, "ms an iteration": found["slices ms"] + found["edges ms"] + step, **found}


def run(case: str, motion: str, seed: int, frames: int) -> dict[str, float]:
    rng, bad, calibrated = np.random.default_rng(seed), case in ("shape", "mismatched"), case != "mismatched"
    hand, cameras = RIGHT_HAND, two_cameras()
    model = build_model(hand)
    surface = surface_of(model)
    walls = [wall(camera, 10 * seed + k, bad) for k, camera in enumerate(cameras)]
    moving = load_motion(motion, model, np.array([0.0, 0.0, 0.55]), seed)
    believed = mistaken(hand, rng) if bad else hand
    rig = rig_of(cameras if calibrated else [moved(camera, rng) for camera in cameras], believed,
                 [near(moving.pose(0.0), seed)])
    tracker: BareHandTracker | None = None
    joints, angles, nees, times, found = [], [], [], [], True
    for k in range(frames):
        pose = moving.pose(k / FPS)
        images = [picture(surface, pose.world_from_palm, pose.angles, camera, walls[c], 1000 * seed + k,
                          blur_px=1.5 if bad else 0.8) for c, camera in enumerate(cameras)]
        t_ns = round(1e9 * k / FPS)
        if tracker is None:
            foreground = None
            if bad:
                foreground = [learn_skin(image, learn_background(
                    skin_foreground(), [np.clip(empty, 0, 255).astype(np.uint8)]))
                    for image, empty in zip(images, walls, strict=True)]
            tracker = BareHandTracker(rig, foreground=foreground, known_size=not bad)
            if case == "mismatched":
                found = tracker.begin(images, t_ns)
            if case != "mismatched" or not found:
                tracker.start(pose, t_ns)
        shown = [images[0], None] if case == "one" or (case == "lost" and 10 <= k < 40) else images
        begun = time.process_time()
        state = tracker.step(shown, [t_ns] * 2)
        times.append(time.process_time() - begun)
        error = state.joint_positions - forward(model, pose).joints
        joints.append(1e3 * np.linalg.norm(error, axis=1))
        angles.append(np.degrees(np.abs(state.angles - pose.angles)))
        nees.append([e @ np.linalg.solve(c + 1e-12 * np.eye(3), e)
                     for e, c in zip(error, state.joint_covariances, strict=True)])
    taken = 1e3 * np.array(times[2:])
    assert tracker is not None
    shape = tracker.filter.newest.state[STATE.shape]
    true, file = (np.log([bone for finger in one.fingers.values() for bone in finger.bones_mm])
                  for one in (hand, believed))
    left = true - file - shape[HAND_SIZE] - shape[FINGER_SIZE] - shape[LENGTH:RADIUS]
    return {**iteration_ms(tracker, images),
            "lengths %": 100.0 * float(np.sqrt(np.mean(left**2))), "joint mm": float(np.mean(joints)),
            "p95 mm": float(np.percentile(joints, 95)),
            "angle deg": float(np.mean(angles)), "in 3 sigma": float(np.mean(np.array(nees) < CHI2_3)),
            "ms": float(np.median(taken)), "p99 ms": float(np.percentile(taken, 99)), "found": float(found)}


def edges(motion: str, seed: int, frames: int) -> dict[str, float]:
    """Errors of the outline's edges, rms px, and their squares by the stated variances, on average."""
    cameras, rig_hand = two_cameras(), RIGHT_HAND
    tracker = BareHandTracker(rig_of(cameras, rig_hand))
    walls = [wall(camera, 10 * seed + c, False) for c, camera in enumerate(cameras)]
    moving = load_motion(motion, tracker.model, np.array([0.0, 0.0, 0.55]), seed)
    found: dict[str, list[tuple[float, ...]]] = {"skin": [], "background": []}
    for k in range(frames):
        pose = moving.pose(4.0 * k / FPS)
        tracker.start(pose, 0)
        state, covariance = tracker.filter.newest.state, 1e-6 * np.eye(tracker.process.size)
        for c, camera in enumerate(cameras):
            image = picture(tracker.surface, pose.world_from_palm, pose.angles, camera, walls[c], 1000 * seed + k)
            frame = tracker.expected_contour(c, state, covariance)
            true, _, good = frame.predict(state)
            outline = np.flatnonzero(good & (frame.points.behind == SILHOUETTE))
            for name, known in (("skin", learn_skin(image)), ("background", learn_background(
                    skin_foreground(), [np.clip(walls[c], 0, 255).astype(np.uint8)]))):
                seen = find_edges(image, frame.slices, known, noise_of(image))
                for s in outline[seen.number[outline] > 0]:
                    off = seen.offset[s, :seen.number[s]] - true[s]
                    e = int(np.argmin(np.abs(off)))
                    if abs(off[e]) < 3.0:
                        found[name].append((off[e], seen.sd[s, e], c, frame.points.capsule[s], frame.points.kind[s]))
    figures = {}
    for name, rows in found.items():
        error, sd, *side = np.array(rows).T
        _, which, count = np.unique(side, axis=1, return_inverse=True, return_counts=True)
        means = (np.bincount(which.ravel(), error) / count)[count >= frames]
        figures |= {f"{name}: px": float(np.sqrt(np.mean(error**2))), f"{name}: squared by sd": float(
            np.mean((error / sd) ** 2)), f"{name}: along sides px": float(np.sqrt(np.mean(means**2)))}
    return figures


def main() -> int:
    """Run all cases and print their table."""
    parser = arguments(__doc__)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--only", default="matched,shape,mismatched,one,lost")
    args = parser.parse_args()
    found = {case: [edges(MOTIONS[seed % len(MOTIONS)], seed, args.frames) if case == "edges" else
                    run(case, MOTIONS[seed % len(MOTIONS)], seed, args.frames) for seed in range(args.seeds)]
             for case in args.only.split(",")}
    rows = []
    for case, runs in found.items():
        for figure in runs[0]:
            values = np.array([one[figure] for one in runs])
            low = figure in ("in 3 sigma", "found")
            worst = int(np.argmin(values) if low else np.argmax(values))
            rows.append([case, figure, float(np.median(values)), float(np.percentile(values, 5 if low else 95)),
                         float(values[worst]), worst])
    publish(args, found, table(["case", "figure", "median", "p95", "worst", "its seed"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
