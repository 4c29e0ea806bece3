"""A real coloured cube in three calibrated cameras: faces near their masks' centroids, the yellow one at its place."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot_node.commands.detect_command import detect_all
from rhot_node.detect.fast import DOUBTFUL, FastDetector
from rhot_node.detect.image import from_bgr
from rhot_node.files import resource_path
from rhot_node.markers import load_markers
from rhot_node.wire.messages import MarkerObservation

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "trifinger_cube"
CUBE = load_markers(resource_path("markers", "trifinger_cube.json"))
CAMERAS = (60, 180, 300)
FAR_PX, FAR_SHARE = 8.0, 0.05

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"real images are not there ({FOLDER})")


def detect(camera: int, turns: int = 0, flip: bool = False) -> dict[str, MarkerObservation]:
    bgr = cv2.imread(str(FOLDER / f"camera{camera}.png"))
    assert bgr is not None
    bgr = np.ascontiguousarray(np.rot90(bgr[:, ::-1] if flip else bgr, turns))
    return dict(zip(CUBE.ids, FastDetector(CUBE).detect(from_bgr(np.asarray(bgr, dtype=np.uint8))), strict=False))


def mask_centroid(name: str, camera: int) -> np.ndarray | None:
    path = FOLDER / f"{name[0]}{camera}.png"
    if not path.exists():
        return None
    alpha = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert alpha is not None
    ys, xs = np.nonzero(alpha[:, :, 3] > 127)
    return np.array([xs.mean(), ys.mean()])


@pytest.mark.parametrize("camera", CAMERAS)
def test_every_visible_face_is_found_near_its_mask(camera: int) -> None:
    seen = detect(camera)
    faces = 0
    for name in CUBE.ids:
        truth = mask_centroid(name, camera)
        if truth is not None:
            faces += 1
            assert seen[name].found
            assert np.hypot(seen[name].x - truth[0], seen[name].y - truth[1]) < 3.0, name
    assert faces == 3


def test_a_face_does_not_jump_while_the_picture_moves() -> None:
    bgr = cv2.imread(str(FOLDER / "camera60.png"))
    assert bgr is not None
    rng, detector, green = np.random.default_rng(0), FastDetector(CUBE), CUBE.ids.index("green")
    places = []
    for k in range(60):
        dx, dy = 40.0 * np.sin(k / 6.0), 30.0 * np.sin(k / 5.0)
        moved = cv2.warpAffine(bgr, np.array([[1.0, 0.0, dx], [0.0, 1.0, dy]]), (540, 540), flags=cv2.INTER_AREA,
                               borderMode=cv2.BORDER_REFLECT)
        seen = detector.detect(from_bgr(np.clip(moved + rng.normal(0.0, 3.0, moved.shape), 0, 255).astype(np.uint8)))
        if seen[green].found and not seen[green].flags & DOUBTFUL:
            places.append((seen[green].x - dx, seen[green].y - dy))
    assert len(places) > 30
    assert np.percentile(np.hypot(*(np.array(places) - np.median(places, axis=0)).T), 90) < 0.8


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_face_that_a_bar_crosses_is_not_called_plain_far_off(camera: int) -> None:
    """The bar hides up to half of a face, and moves by 5 px a frame: see `benchmarks/moved_cube.py`.

    `FAR_SHARE` is what lies beyond the 95th percentile that it prints. Of 180 observations a camera, 15, 13 and 14
    were far (8 %) while every cover counted as a turn, and 7 at most (4 %) are now that the two are told apart.
    """
    bgr = cv2.imread(str(FOLDER / f"camera{camera}.png"))
    assert bgr is not None
    rng, detector, first = np.random.default_rng(0), FastDetector(CUBE), dict[int, MarkerObservation]()
    far: list[bool] = []
    for start in range(150, 450, 5):
        covered = bgr.astype(np.float64)
        covered[:, start:start + 36] = (90, 120, 160)
        noisy = np.clip(covered + rng.normal(0.0, 3.0, bgr.shape), 0, 255).astype(np.uint8)
        seen = detector.detect(from_bgr(noisy))[:len(CUBE.ids)]
        first = first or {mark.index: mark for mark in seen if mark_is_visible(mark, camera)}
        far += [seen[index].found and not seen[index].flags & DOUBTFUL
                and np.hypot(seen[index].x - at.x, seen[index].y - at.y) > FAR_PX for index, at in first.items()]
    assert len(far) == 3 * 60
    assert np.mean(far) < FAR_SHARE


def test_a_face_beside_another_holds_while_the_light_is_halved() -> None:
    """The green face of camera 60, beside the cyan one: in `benchmarks/moved_cube.py` the 95th percentile of its errors
    is 0.47 px, and 0.63 px where coverage beyond the paint counts by half a pixel."""
    bgr = cv2.imread(str(FOLDER / "camera60.png"))
    assert bgr is not None
    green, off = CUBE.ids.index("green"), []
    for seed in range(6):
        rng, detector, first = np.random.default_rng(seed), FastDetector(CUBE), np.zeros(2)
        for k in range(60):
            dimmed = (0.75 + 0.25 * np.cos(k / (5 + seed))) * bgr
            noisy = np.clip(dimmed + rng.normal(0.0, 3.0, bgr.shape), 0, 255).round().astype(np.uint8)
            seen = detector.detect(from_bgr(noisy))[green]
            assert seen.found and not seen.flags & DOUBTFUL
            place = np.array([seen.x, seen.y])
            first = place if k == 0 else first
            off.append(np.hypot(*(place - first)))
    assert np.percentile(off, 95) < 0.55


def mark_is_visible(mark: MarkerObservation, camera: int) -> bool:
    return mark.found and mask_centroid(CUBE.ids[mark.index], camera) is not None


@pytest.mark.parametrize("camera", CAMERAS)
def test_the_faces_are_found_in_a_turned_and_mirrored_picture_too(camera: int) -> None:
    plain, turned = detect(camera), detect(camera, turns=2, flip=True)
    for name in CUBE.ids:
        if mask_centroid(name, camera) is not None:
            assert turned[name].x == pytest.approx(plain[name].x, abs=0.2)
            assert turned[name].y == pytest.approx(539 - plain[name].y, abs=0.2)


def test_the_yellow_face_triangulates_to_the_cube() -> None:
    rows = []
    for camera in CAMERAS:
        intrinsics, distortion, camera_from_world = calibration(FOLDER / f"camera_calib_{camera}.yml")
        yellow = detect(camera)["yellow"]
        x, y = cv2.undistortPoints(np.array([[[yellow.x, yellow.y]]]), intrinsics, distortion).reshape(2)
        rows += [x * camera_from_world[2] - camera_from_world[0], y * camera_from_world[2] - camera_from_world[1]]
    point = np.linalg.svd(np.array(rows))[2][-1]
    point = point[:3] / point[3]
    assert abs(point[0] + 0.014) < 0.010
    assert abs(point[1] + 0.024) < 0.010


def calibration(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Intrinsics, distortion and camera_from_world of a calibration file (lists of numbers under named keys)."""
    lists: dict[str, list[float]] = {}
    key = ""
    for line in path.read_text().splitlines():
        if line and not line.startswith((" ", "-")):
            key = line.split(":")[0]
            lists[key] = []
        elif line.strip().startswith("- "):
            lists[key].append(float(line.strip()[2:]))
    return (np.array(lists["camera_matrix"]).reshape(3, 3), np.array(lists["distortion_coefficients"]),
            np.array(lists["tf_world_to_camera"]).reshape(4, 4))


def test_the_command_reports_the_whole_folder_as_stills() -> None:
    report = detect_all(FOLDER, CUBE, "fast")
    named = {frame["file"]: frame for frame in report["frames"]}
    for camera in CAMERAS:
        frame = named[f"camera{camera}.png"]
        assert (frame["width"], frame["height"]) == (540, 540)
        for entry, (name, seen) in zip(frame["markers"], detect(camera).items(), strict=True):
            assert entry["id"] == name
            if seen.found:
                assert entry["x"] == pytest.approx(seen.x, abs=0.3)
