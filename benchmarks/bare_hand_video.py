"""The bare hand in a real stereo video, from nothing, against the image points of a landmark network.

    python benchmarks/bare_hand_video.py ../shared/data/bare_hand_stereo [--from 13] [--to 120] [--square-m 0.0385]

The unit of the video's extrinsics is a chessboard square of unknown size: `--square-m` makes the hand as large as the
default hand file. Errors are parts of the hand's size in the image, the largest distance of two landmarks.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "barehand")]

from bare_scenes import rig_of, right_hand  # noqa: E402

from rhot_app.barehand.overlay import overlay  # noqa: E402
from rhot_app.barehand.tracker import BareHandTracker  # noqa: E402
from rhot_app.geometry.camera import CameraModel  # noqa: E402
from rhot_app.geometry.transforms import inverse, rigid  # noqa: E402
from rhot_node.detect.foreground import learn_skin  # noqa: E402


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
    return CameraModel(720, 720, np.array([lens[0][0], lens[1][1], lens[0][2], lens[1][2], *lens[3]]), inverse(local),
                       local)


def landmarks(path: Path) -> dict[int, np.ndarray]:
    with path.open() as file:
        return {int(row["frame"]): np.array([[float(row[f"x{k}"]), float(row[f"y{k}"])] for k in range(21)])
                for row in csv.DictReader(file)}


def film(path: Path) -> list[np.ndarray]:
    capture = cv2.VideoCapture(str(path))
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
    parser.add_argument("--overlay", type=Path, help="write the last images with the tracked contour there (PNG)")
    arguments = parser.parse_args()
    cameras = [camera_of(arguments.folder, c, arguments.square_m) for c in (0, 1)]
    points = [landmarks(arguments.folder / f"landmarks_c{c}.csv") for c in (0, 1)]
    films = [film(arguments.folder / f"cam{c}_first120.mp4") for c in (0, 1)]
    first = [frames[arguments.first] for frames in films]
    tracker = BareHandTracker(rig_of(cameras, right_hand()), foreground=[learn_skin(image) for image in first])
    print("found" if tracker.find(first, round(1e9 * arguments.first / 30.0)) else "no hand found")
    worst, median = [], []
    for k in range(arguments.first, arguments.last):
        images = [frames[k] for frames in films]
        state = tracker.step(images, [round(1e9 * k / 30.0)] * 2)
        if k not in points[0] or k not in points[1]:
            continue
        errors = []
        for c in (0, 1):
            size = np.linalg.norm(points[c][k][:, None] - points[c][k], axis=2).max()
            errors.append(np.linalg.norm(cameras[c].project(state.joint_positions) - points[c][k], axis=1) / size)
        worst.append(np.max(errors))
        median.append(np.median(errors))
    print(f"frames {len(worst)}, tracked {np.mean(np.array(worst) < 0.1):.0%}, worst joint {np.median(worst):.2f}, "
          f"median joint {np.median(median):.3f}, contour found {np.nanmean(tracker.fit.support):.2f}")
    if arguments.overlay is not None:
        shown = [overlay(frames[arguments.last - 1], frame, tracker.filter.newest.state)
                 for frames, frame in zip(films, tracker.frames, strict=True) if frame is not None]
        cv2.imwrite(str(arguments.overlay), np.hstack(shown)[..., ::-1])


if __name__ == "__main__":
    main()
