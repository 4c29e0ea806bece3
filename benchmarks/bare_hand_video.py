"""The bare hand in a real stereo video by its contours, against the image points of a landmark network.

    python benchmarks/bare_hand_video.py ../shared/data/bare_hand_stereo [--from 13] [--to 120] [--square-m 0.0385]
        [--templates]

`--templates` follows the same images a second time, by contours and then by templates of the first tracked images.
It begins at the pose that fits the first image's landmarks.

The unit of the video's extrinsics is a chessboard square of unknown size: `--square-m` makes the hand as large as the
default hand file. Errors are parts of the hand's size in the image, the largest distance of two landmarks.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import cv2
import msgspec
import numpy as np

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "barehand")]

from bare_scenes import rig_of  # noqa: E402

from rhot_app.articulated.bodies import hand_bodies  # noqa: E402
from rhot_app.barehand.tracker import BareHandTracker  # noqa: E402
from rhot_app.export.overlay import overlay  # noqa: E402
from rhot_app.geometry.camera import CameraModel, intrinsics_row  # noqa: E402
from rhot_app.geometry.transforms import inverse, rigid  # noqa: E402
from rhot_app.hand.kinematics import forward  # noqa: E402
from rhot_app.hand.skeleton import HandPose  # noqa: E402
from rhot_app.handfit.session import HandFit  # noqa: E402
from rhot_app.handfit.state import Anchor  # noqa: E402
from rhot_app.project import CameraCalibration, Rig  # noqa: E402
from rhot_app.tracking.kinds.templates import LayeredTrack, picture_frames  # noqa: E402
from rhot_node.detect.foreground import learn_skin  # noqa: E402
from rhot_node.pictures import open_video  # noqa: E402


def numbers(path: Path) -> list[list[float]]:
    """Rows of numbers of a .dat file; a comment ends them."""
    rows = []
    for line in path.read_text().splitlines():
        if line.startswith("#"):
            break
        try:
            values = [float(word) for word in line.split()]
        except ValueError:
            continue
        if values:
            rows.append(values)
    return rows


def camera_of(folder: Path, index: int, square_m: float) -> CameraModel:
    lens, place = numbers(folder / f"c{index}.dat"), numbers(folder / f"rot_trans_c{index}.dat")
    left, _, right = np.linalg.svd(np.array(place[:3]))
    local = rigid(left @ right, square_m * np.array(place[3:6]).ravel())
    row = intrinsics_row([lens[0][0], lens[1][1], lens[0][2], lens[1][2], *lens[3]])
    return CameraModel(720, 720, row, inverse(local), local)


def landmarks(path: Path) -> dict[int, np.ndarray]:
    with path.open() as file:
        return {int(row["frame"]): np.array([[float(row[f"x{k}"]), float(row[f"y{k}"])] for k in range(21)])
                for row in csv.DictReader(file)}


def film(path: Path) -> list[np.ndarray]:
    capture = open_video(path)
    frames: list[np.ndarray] = []
    while True:
        read, image = capture.read()
        if not read:
            return frames
        frames.append(np.ascontiguousarray(image[..., ::-1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--from", dest="first", type=int, default=13)
    parser.add_argument("--to", dest="last", type=int, default=120)
    parser.add_argument("--square-m", type=float, default=0.0385)
    parser.add_argument("--templates", action="store_true", help="by contours and templates, too")
    parser.add_argument("--overlay", type=Path, help="write the last images with the tracked contour there (PNG)")
    arguments = parser.parse_args()
    cameras = [camera_of(arguments.folder, c, arguments.square_m) for c in (0, 1)]
    points = [landmarks(arguments.folder / f"landmarks_c{c}.csv") for c in (0, 1)]
    films = [film(arguments.folder / f"cam{c}_first120.mp4") for c in (0, 1)]
    first = [frames[arguments.first] for frames in films]
    rig = rig_of(cameras)
    tracker = BareHandTracker(rig, known_size=False, foreground=[learn_skin(image) for image in first])
    t_ns = round(1e9 * arguments.first / 30.0)
    begin = pose_of(rig, first, [one[arguments.first] for one in points])
    joints = forward(tracker.model, begin).joints
    away = [np.linalg.norm(camera.project(joints) - one[arguments.first], axis=1)
            for camera, one in zip(cameras, points, strict=True)]
    print(f"the start fits its landmarks to px: median {np.median(away):.1f}, worst {np.max(away):.1f}")
    ways = ("contours", "contours and templates") if arguments.templates else ("contours",)
    for way in ways:  # from the same pose, in the same images
        tracker.start(begin, t_ns)
        follow(rig, tracker, cameras, films, points, arguments, way)


def pose_of(rig: Rig, images: list[np.ndarray], points: list[np.ndarray]) -> HandPose:
    """The pose whose joints fit the image points (21, 2) px of each camera."""
    fit = HandFit(msgspec.structs.replace(rig, calibration=CameraCalibration("the video's own")))
    fit.add_pictures(dict(enumerate(images)))
    instant = fit.state.instants[0]
    for camera, own in enumerate(points):
        for joint, (x, y) in enumerate(own):
            instant = instant.with_anchor(Anchor(camera, joint, (float(x), float(y))))
    fit.take(fit.state.change(0, instant), "landmarks")
    fit.fit_to_anchors()
    return fit.state.instants[0].pose


def follow(rig: Rig, tracker: BareHandTracker, cameras: list[CameraModel], films: list[list[np.ndarray]],
           points: list[dict[int, np.ndarray]], arguments: argparse.Namespace, way: str) -> None:
    layered, begun = None, False
    worst, median, pixels, away_mm = [], [], [], []
    for k in range(arguments.first, arguments.last):
        images, t_ns = [frames[k] for frames in films], round(1e9 * k / 30.0)
        tracker.step(images, [t_ns] * 2)
        if way != "contours":  # the templates' update follows that of the contours, at the same instant
            if layered is None:
                bodies, _ = hand_bodies(tracker.surface)
                layered = LayeredTrack("hand", bodies, tracker.model.limits, tracker.process, cameras, outline=False)
                begun = True
            for frame in picture_frames(rig, images, [t_ns] * 2):
                knot = tracker.filter.newest
                gated = layered.gate(frame, knot.state, knot.covariance)
                if not begun and gated.residual is not None:
                    knot = tracker.filter.add(knot.t_s, [gated.residual, *gated.beside], (knot.state, knot.covariance),
                                              gated.initial)
                layered.learn(frame, knot.state, knot.covariance, begun)
            begun = False
        state = tracker.state()
        if k not in points[0] or k not in points[1]:
            continue
        errors = []
        for c in (0, 1):
            size = np.linalg.norm(points[c][k][:, None] - points[c][k], axis=2).max()
            pixels.append(np.linalg.norm(cameras[c].project(state.joint_positions) - points[c][k], axis=1))
            errors.append(pixels[-1] / size)
        rays = [camera.undistort(one[k]) for camera, one in zip(cameras, points, strict=True)]
        places = cv2.triangulatePoints(*(camera.camera_from_world[:3] for camera in cameras), *(one.T for one in rays))
        away_mm.append(1e3 * np.median(np.linalg.norm(state.joint_positions - (places[:3] / places[3]).T, axis=1)))
        worst.append(np.max(errors))
        median.append(np.median(errors))
    found = tracker.slice_counts.sum(axis=(0, 1))
    print(f"{way}: to the landmarks, px: median {np.median(pixels):.1f}, p95 {np.percentile(pixels, 95):.1f}, worst "
          f"{np.max(pixels):.1f}" + ("" if layered is None else f"; templates {len(layered.templates.templates)}"))
    print(f"to the triangulated landmarks, median joint, mm: median {np.median(away_mm):.1f}, p95 "
          f"{np.percentile(away_mm, 95):.1f}, worst {np.max(away_mm):.1f}")
    print(f"frames {len(worst)}, tracked {np.mean(np.array(worst) < 0.1):.0%}, worst joint {np.median(worst):.2f}, "
          f"median joint {np.median(median):.3f}, contour found {np.divide(*found):.2f}")
    if arguments.overlay is not None:
        shown = [overlay(frames[arguments.last - 1], frame, tracker.filter.newest.state)
                 for frames, frame in zip(films, tracker.frames, strict=True) if frame is not None]
        name = arguments.overlay.with_stem(f"{arguments.overlay.stem}-{way.replace(' ', '-')}")
        cv2.imwrite(str(name), np.hstack(shown)[..., ::-1])


if __name__ == "__main__":
    main()
