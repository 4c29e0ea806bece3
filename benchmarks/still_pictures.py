"""Single moments of a recorded bare hand as `rhot track` takes two pictures, changed as other people's may be.

    python benchmarks/still_pictures.py [--every 6] [--json FILE]

Frames from 13 to 119 of ../shared/data/bare_hand_stereo, each held still for two seconds, with the bones that it shows.
Turned, mirrored and scaled pictures have a rig to match. Truth is what the landmarks of another program in both cameras
triangulate to: so this is agreement, not accuracy. `worst called TRACKING`: of all states on the way. Needs the hand
networks.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "tests" / "recording")]

from recorded_landmarks import FOLDER, FPS, WHOLE, recording  # noqa: E402
from tables import arguments, publish, table  # noqa: E402

from rhot_app.estimation.se3 import quaternion_from_rotation  # noqa: E402
from rhot_app.export.landmark_track import landmark_rig_of, states_of_log, with_measured_bones  # noqa: E402
from rhot_app.geometry.camera import CameraModel  # noqa: E402
from rhot_app.hand.anatomy import load_hand  # noqa: E402
from rhot_app.project import CameraPose, Intrinsics, Rig  # noqa: E402
from rhot_app.recording.landmark_log import HandFilm, write_hand_log  # noqa: E402
from rhot_app.sources.frame_sets import STILL_FRAMES  # noqa: E402
from rhot_app.state import Condition  # noqa: E402
from rhot_node.files import resource_path  # noqa: E402
from rhot_node.landmark_search import landmarked  # noqa: E402
from rhot_node.landmarks.networks import HandNetworks, open_hand_networks  # noqa: E402
from rhot_node.pictures import decode_picture, open_video  # noqa: E402

Image = NDArray[np.uint8]
SETTLED = 8
"""Pictures after which the networks find the same in the same picture."""


@dataclass(frozen=True)
class Change:
    """`picture` changes an image; its pixels are `pixels` (3, 3) times those before, homogeneous, about the centre of
    the first one. `size`: of the new image, by the old one's."""

    picture: Callable[[Image], Image]
    pixels: np.ndarray
    size: float = 1.0
    mirrored: bool = False


SIZE = 720
QUARTER = np.array([[0.0, -1.0, SIZE - 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def scaled(factor: float, margin: int = 0) -> Change:
    shift = 0.5 * factor - 0.5 + margin
    pixels = np.array([[factor, 0.0, shift], [0.0, factor, shift], [0.0, 0.0, 1.0]])

    def picture(image: Image) -> Image:
        small = cv2.resize(image, None, fx=factor, fy=factor,
                           interpolation=cv2.INTER_AREA if factor < 1.0 else cv2.INTER_LINEAR)
        return np.asarray(cv2.copyMakeBorder(small, *[margin] * 4, cv2.BORDER_CONSTANT, value=(90, 100, 110)), np.uint8)
    return Change(picture, pixels, factor + 2 * margin / SIZE)


def toned(tone: Callable[[np.ndarray], np.ndarray]) -> Change:
    return Change(lambda image: (255.0 * tone(image / 255.0)).astype(np.uint8), np.eye(3))


def compressed(image: Image) -> Image:
    return decode_picture(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 30])[1].tobytes())


CHANGES = {
    "as filmed": Change(lambda image: image, np.eye(3)),
    "mirrored, a left hand": Change(lambda image: np.ascontiguousarray(image[:, ::-1]),
                                    np.array([[-1.0, 0.0, SIZE - 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
                                    mirrored=True),
    "turned by 90 degrees": Change(lambda image: np.asarray(cv2.rotate(image, cv2.ROTATE_90_CLOCKWISE)), QUARTER),
    "turned by 180 degrees": Change(lambda image: np.asarray(cv2.rotate(image, cv2.ROTATE_180)), QUARTER @ QUARTER),
    "half as large": scaled(0.5), "twice as large": scaled(2.0), "a third, in a grey picture": scaled(1 / 3, 240),
    "brightness 0.3": toned(lambda part: 0.3 * part), "gamma 0.45": toned(lambda part: part**0.45),
    "JPEG of quality 30": Change(compressed, np.eye(3))}


def changed_rig(change: Change) -> tuple[Rig, np.ndarray]:
    """The rig whose cameras take the changed pictures, and where its hand is (T, 21, 3) m."""
    rig, flip, nodes = recording().rig, np.diag([-1.0 if change.mirrored else 1.0, 1.0, 1.0]), []
    for node in rig.nodes:
        lens = node.intrinsics
        factor = float(np.sqrt(abs(np.linalg.det(change.pixels[:2, :2]))))
        turn = np.eye(3)
        turn[:2, :2] = change.pixels[:2, :2] / factor  # of the camera's axes, and of its tangential distortion
        fx, fy = factor * np.abs(turn[:2, :2]) @ [lens.fx, lens.fy]
        cx, cy, _ = change.pixels @ [lens.cx, lens.cy, 1.0]
        k1, k2, p1, p2, k3 = lens.distortion
        along_x, along_y = turn[:2, :2] @ [p2, p1]
        size = round(change.size * lens.width)
        local = CameraModel.from_rig(lens, node.pose).camera_from_world
        rotation, shift = turn @ local[:3, :3] @ flip, turn @ local[:3, 3]
        w, x, y, z = quaternion_from_rotation(rotation.T).tolist()
        a, b, c = (-rotation.T @ shift).tolist()
        nodes.append(msgspec.structs.replace(
            node, pose=CameraPose((w, x, y, z), (a, b, c)),
            intrinsics=Intrinsics(size, size, float(fx), float(fy), float(cx), float(cy),
                                  (k1, k2, float(along_y), float(along_x), k3))))
    hand = load_hand(resource_path("hands", "left.json" if change.mirrored else "right.json"))
    rig = msgspec.structs.replace(rig, nodes=tuple(nodes), hand=hand)
    return landmark_rig_of(rig, [node.name for node in nodes]), recording().places @ flip


def trial(rig: Rig, images: list[Image], truth: np.ndarray, networks: HandNetworks, folder: Path) -> list[Any]:
    """Condition, median and greatest distance of the joints, mm, and the greatest median of a state called TRACKING."""
    films = []
    for image in images:
        networks.reset()
        hands = [tuple(landmarked(hand, (image.shape[1], image.shape[0])) for hand in networks.find(image))
                 for _ in range(SETTLED)]
        films.append(HandFilm(np.arange(STILL_FRAMES) / FPS, [*hands, *hands[-1:] * (STILL_FRAMES - SETTLED)]))
    log = folder / "still.rhotlog"
    write_hand_log(log, rig, films)
    states = list(states_of_log(with_measured_bones(rig, log)[0], log))
    off = [1e3 * np.linalg.norm(state.joint_positions - truth, axis=1) for state in states]
    sure = [float(np.median(one)) for state, one in zip(states, off, strict=True)
            if state.condition is Condition.TRACKING]
    return [states[-1].condition, float(np.median(off[-1])), float(off[-1].max()), max(sure, default=0.0)]


def main() -> int:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--every", type=int, default=6, help="frames from one moment to the next")
    args = parser.parse_args()
    pictures = []
    for c in range(2):
        film, own = open_video(FOLDER / f"cam{c}_first120.mp4"), []
        while (read := film.read())[0]:
            own.append(read[1])
        pictures.append(own[WHOLE:])
    networks, rows = open_hand_networks(), []
    with tempfile.TemporaryDirectory() as folder:
        for name, change in CHANGES.items():
            rig, truth = changed_rig(change)
            trials = [trial(rig, [change.picture(own[k]) for own in pictures], truth[k], networks, Path(folder))
                      for k in range(0, len(truth), args.every)]
            conditions, median, worst, sure = zip(*trials, strict=True)
            rows.append([name, len(trials), float(np.mean(np.isfinite(median))),
                         conditions.count(Condition.TRACKING) / len(trials), float(np.nanmedian(median)),
                         float(np.nanmax(median)), float(np.nanmax(worst)), max(sure)])
            print(name, file=sys.stderr)
    publish(args, rows, table(["pictures", "moments", "found", "TRACKING", "median mm", "worst moment mm",
                               "worst joint mm", "worst called TRACKING mm"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
