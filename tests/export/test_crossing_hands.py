"""A recorded hand and its mirrored copy before one camera pair, made to cross: each is tracked as itself.

Both cameras' pictures are turned so that the pair is its own mirror image: the left picture, mirrored, is then what the
right camera sees of a mirrored, left hand. The right hand stays where it was filmed. The left one is cut out and moved
across it, in front of it, so that the right one is hidden in the middle.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest
from recorded_landmarks import FOLDER, FPS, WHOLE, needs_recording, recording
from test_track_command import LEFT, needs_networks, table_of

from rhot_app.__main__ import main
from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.geometry.camera import CameraModel
from rhot_app.project import CameraPose, Intrinsics, Rig, RigNode, TrackerSettings, landmark_markers, save_rig
from rhot_node.pictures import open_video

WIDTH, HEIGHT, FOCAL = 960, 720, 750.0
LENS = Intrinsics(WIDTH, HEIGHT, FOCAL, FOCAL, 0.5 * (WIDTH - 1), 0.5 * (HEIGHT - 1))
FROM_PX, TO_PX = 230.0, -230.0
"""px of the left hand's middle from the right one's, in the first frame and in the last one."""

FOUND = 10
"""Frames until both hands are found."""

APART_PX = 120.0
"""px between the hands' middles from which each is whole."""


@dataclass(frozen=True)
class Pair:
    """The pair that is its own mirror image, the left camera first: `numbers` of the recording's cameras, `turns`
    (3, 3) new_from_old, and the rig of both hands."""

    numbers: tuple[int, int]
    turns: tuple[np.ndarray, np.ndarray]
    rig: Rig

    def cameras(self) -> list[CameraModel]:
        return [CameraModel.from_rig(node.intrinsics, node.pose) for node in self.rig.nodes]


def symmetric_pair() -> Pair:
    nodes = recording().rig.nodes
    world = [np.linalg.inv(CameraModel.from_rig(node.intrinsics, node.pose).camera_from_world) for node in nodes]
    numbers = (0, 1) if world[0][:3, 0] @ (world[1] - world[0])[:3, 3] > 0.0 else (1, 0)
    left, right = (world[number][:3, 3] for number in numbers)
    x = (right - left) / np.linalg.norm(right - left)
    ahead = recording().places.mean(axis=(0, 1)) - 0.5 * (left + right)
    z = ahead - (ahead @ x) * x
    angle = math.atan2(0.5 * float(np.linalg.norm(right - left)), float(np.linalg.norm(z)))
    z /= np.linalg.norm(z)
    turns, made = [], []
    for c, (number, turn) in enumerate(zip(numbers, (angle, -angle), strict=True)):
        axes = np.array([math.cos(turn) * x - math.sin(turn) * z, np.cross(z, x),
                         math.cos(turn) * z + math.sin(turn) * x])
        turns.append(axes @ world[number][:3, :3])
        w, i, j, k = quaternion_from_rotation(axes.T).tolist()
        a, b, d = world[number][:3, 3].tolist()
        made.append(RigNode(c + 1, ("left", "right")[c], LENS, CameraPose((w, i, j, k), (a, b, d))))
    rig = Rig("both hands", tuple(made), landmark_markers(both=True), recording().rig.hand, other_hand=LEFT,
              tracker=TrackerSettings("estimator", observe="landmarks"))
    return Pair((numbers[0], numbers[1]), (turns[0], turns[1]), rig)


def turned(pair: Pair) -> tuple[list[np.ndarray], list[list[np.ndarray]]]:
    """Of each camera, left first: the landmarks (T, 21, 2) px in its turned pictures, and these, from WHOLE on."""
    pixels = [np.array([camera.project(one) for one in recording().places]) for camera in pair.cameras()]
    pictures = []
    for number, turn in zip(pair.numbers, pair.turns, strict=True):
        lens = recording().rig.nodes[number].intrinsics
        old = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
        new = np.array([[FOCAL, 0.0, LENS.cx], [0.0, FOCAL, LENS.cy], [0.0, 0.0, 1.0]])
        maps = cv2.initUndistortRectifyMap(old, np.array(lens.distortion), turn, new, (WIDTH, HEIGHT), cv2.CV_32FC1)
        film = open_video(FOLDER / f"cam{number}_first120.mp4")
        shown = []
        for frame in range(WHOLE + len(recording().places)):
            there, picture = film.read()
            assert there
            if frame >= WHOLE:
                shown.append(cv2.remap(picture, *maps, cv2.INTER_LINEAR))
        film.release()
        pictures.append(shown)
    return pixels, pictures


def triangulated(cameras: list[CameraModel], pixels: list[np.ndarray]) -> np.ndarray:
    """(T, 21, 3) m (Hartley and Zisserman 2004, 12.2)."""
    rows = []
    for camera, seen in zip(cameras, pixels, strict=True):
        rays = camera.undistort(seen.reshape(-1, 2)).reshape(seen.shape)
        rows.append(rays[..., None] * camera.camera_from_world[2] - camera.camera_from_world[:2])
    last = np.linalg.svd(np.concatenate(rows, axis=-2))[2][..., 3, :]
    return last[..., :3] / last[..., 3:]


@needs_recording
@needs_networks
@pytest.mark.study("rhot_app/tracking/kinds/landmarks.py", "rhot_app/export/landmark_track.py", "rhot_node/landmarks")
def test_a_film_beside_its_mirrored_copy_is_two_hands_that_cross(tmp_path: Path) -> None:
    pair = symmetric_pair()
    pixels, pictures = turned(pair)
    count = len(pixels[0])
    wanted = np.linspace(FROM_PX, TO_PX, count)
    mirrored = [(LENS.width - 1.0) * np.array([1.0, 0.0]) + other * [-1.0, 1.0] for other in reversed(pixels)]
    middle = np.mean([own.mean(axis=1)[:, 0] - other.mean(axis=1)[:, 0]
                      for own, other in zip(pixels, mirrored, strict=True)], axis=0)
    shift = np.round(middle + wanted).astype(int)  # of both pictures alike
    words = ["track"]
    left_hand = []
    for c, node in enumerate(pair.rig.nodes):
        moved = mirrored[c] + shift[:, None, None] * np.array([1.0, 0.0])
        left_hand.append(moved)
        path = tmp_path / f"{node.name}.avi"
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), FPS, (WIDTH, HEIGHT))
        for t in range(count):
            picture, source = pictures[c][t].copy(), np.ascontiguousarray(pictures[1 - c][t][:, ::-1])
            move = np.array([[1.0, 0.0, shift[t]], [0.0, 1.0, 0.0]])
            mask = np.zeros((HEIGHT, WIDTH), np.uint8)
            own = mirrored[c][t]
            outline = np.vstack([own, 1.7 * own[0] - 0.7 * own[9]])  # and some of the forearm
            cv2.fillConvexPoly(mask, cv2.convexHull(outline.astype(np.float32)).astype(np.int32), 255)
            mask = cv2.warpAffine(cv2.dilate(mask, np.ones((41, 41), np.uint8)), move, (WIDTH, HEIGHT))
            picture[mask > 0] = cv2.warpAffine(source, move, (WIDTH, HEIGHT))[mask > 0]
            writer.write(picture)
        writer.release()
        words.append(f"{node.name}={path}")
    save_rig(tmp_path / "rig.json", pair.rig)
    assert main([*words, "--rig", str(tmp_path / "rig.json"), "--out", str(tmp_path / "hands.csv")]) == 0
    truths = [triangulated(pair.cameras(), one) for one in (pixels, left_hand)]
    for own, other, prefix in ((truths[0], truths[1], ""), (truths[1], truths[0], "other_")):
        times, places = table_of(tmp_path / "hands.csv", prefix)
        frames = np.round(times * FPS).astype(int)
        off, wrong = (np.median(np.linalg.norm(places - hand[frames], axis=2), axis=1) for hand in (own, other))
        with (tmp_path / "hands.csv").open() as file:
            sure = np.array([row[f"{prefix}condition"] == "TRACKING" for row in csv.DictReader(file)])
        assert sure.sum() > 5 and np.nanmax(off[sure]) < 0.05, "what is not seen is not called so"
        before = (frames >= FOUND) & (wanted[frames] > APART_PX)
        after = wanted[frames] < -APART_PX
        later = after & (frames >= np.flatnonzero(wanted < -APART_PX)[0] + 0.5 * FPS)
        assert np.isfinite(off[before | later]).mean() > 0.95, "both are tracked"
        assert not (wrong < off)[before | later].any() and np.nanmedian(off[before | later]) < 0.02
        assert (wrong < off)[after].sum() <= 0.5 * FPS, "the wrong hand for half a second at most"
