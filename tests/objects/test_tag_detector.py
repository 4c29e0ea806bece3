"""The tag detector on rendered tags: corners without bias, covariances that hold, what it refuses and leaves alone."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from object_scenes import wide_cameras
from tag_pictures import render

from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.object_file import plate
from rhot_node.detect.tags import TagDetector, family_number
from rhot_node.errors import SettingsError
from rhot_node.wire.messages import FAMILIES

CAMERA = wide_cameras()[0]
COUNT = 24


def views(family: str, size_mm: float, noise: float, seed: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """(image, true corners) of tags 0.6 m away, turned at random."""
    rng, model = np.random.default_rng(seed), plate("tag", 1, 1, size_mm, 0.0, family, 10)
    for _ in range(COUNT):
        tilt, azimuth, roll = np.radians(rng.uniform(0.0, 50.0)), rng.uniform(0.0, 6.28), rng.uniform(0.0, 6.28)
        rotation = exp_so3(tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0.0])) @ exp_so3([np.pi, 0.0, 0.0])
        pose = rigid(rotation @ exp_so3([0.0, 0.0, roll]), [rng.uniform(-0.15, 0.15), rng.uniform(-0.1, 0.1), 0.6])
        corners = model.fiducials[0].corners() @ pose[:3, :3].T + pose[:3, 3]
        yield render(model, pose, CAMERA, rng, noise=noise), CAMERA.project(corners)


@pytest.mark.parametrize("noise", [2.0, 5.0])
@pytest.mark.parametrize(("family", "size_mm", "most_px"), [
    ("DICT_APRILTAG_36h11", 25.0, 0.14), ("DICT_APRILTAG_36h11", 45.0, 0.05), ("DICT_APRILTAG_36h11", 90.0, 0.04),
    ("DICT_4X4_50", 25.0, 0.11), ("DICT_4X4_50", 45.0, 0.05)])
def test_corners_have_no_bias_and_covariances_that_hold(family: str, size_mm: float, most_px: float,
                                                        noise: float) -> None:
    detector, errors, outward, squares = TagDetector([family]), [], [], []
    for image, true in views(family, size_mm, noise, 1):
        for found in detector.detect(image):
            assert (found.family, found.number) == (family_number(family), 10)
            error = np.array(found.corners).reshape(4, 2) - true
            away = true - true.mean(axis=0)
            errors.append(error)
            outward.append(np.sum(error * away, axis=1) / np.linalg.norm(away, axis=1))
            for one, (xx, xy, yy) in zip(error, np.array(found.covariances).reshape(4, 3), strict=True):
                squares.append(one @ np.linalg.solve([[xx, xy], [xy, yy]], one) / 2.0)
    rms, bias = np.sqrt(np.mean(np.square(errors))), np.mean(outward)
    assert len(errors) >= 0.9 * COUNT
    assert rms < most_px and abs(bias) < 0.03
    assert 0.2 < np.mean(squares) < 2.0


def test_cv2s_own_corners_are_biased() -> None:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), parameters)
    outward = []
    for image, true in views("DICT_APRILTAG_36h11", 45.0, 2.0, 1):
        corners, _, _ = detector.detectMarkers(image)
        away = true - true.mean(axis=0)
        outward.append(np.sum((corners[0][0] - true) * away, axis=1) / np.linalg.norm(away, axis=1))
    assert np.mean(outward) < -0.2, "the reason for lines fitted to the edges is gone"


def test_an_occluded_edge_widens_the_covariance_or_hides_the_tag() -> None:
    detector = TagDetector(["DICT_APRILTAG_36h11"])
    for image, true in views("DICT_APRILTAG_36h11", 90.0, 2.0, 2):
        covered = image.copy()
        middle = (0.75 * true[0] + 0.25 * true[1]).astype(int)
        cv2.circle(covered, (int(middle[0]), int(middle[1])), 8, 150, -1)
        for found in detector.detect(covered):
            error = np.array(found.corners).reshape(4, 2) - true
            variances = np.array(found.covariances).reshape(4, 3)[:, [0, 2]].sum(axis=1)
            assert (np.linalg.norm(error, axis=1) < 6.0 * np.sqrt(variances) + 0.1).all()


def test_several_families_are_found_and_an_empty_image_has_none() -> None:
    rng, detector = np.random.default_rng(1), TagDetector(["DICT_4X4_50", "DICT_APRILTAG_36h11", "DICT_4X4_50"])
    assert detector.detect(np.full((480, 640), 128, np.uint8)) == []
    rotation = exp_so3([np.pi, 0.0, 0.0])
    left = render(plate("a", 2, 1, 60.0, 20.0, "DICT_4X4_50", 3), rigid(rotation, [-0.1, 0.0, 0.6]), CAMERA, rng)
    model = plate("b", 1, 1, 80.0, 0.0, "DICT_APRILTAG_36h11", 7)
    right = render(model, rigid(rotation, [0.15, 0.0, 0.6]), CAMERA, rng)
    both = np.where(np.arange(640) < 340, left, right)
    found = [(one.family, one.number) for one in detector.detect(both)]
    assert found[0] == (20, 7), "the largest first"
    assert set(found) == {(0, 3), (0, 4), (20, 7)}
    with pytest.raises(SettingsError, match="DICT_9X9"):
        TagDetector(["DICT_9X9"])


def test_the_wires_families_are_cv2s_own_numbers() -> None:
    assert [getattr(cv2.aruco, name) for name in FAMILIES] == list(range(len(FAMILIES)))


def test_noise_and_every_shape_of_luma_raise_nothing() -> None:
    rng, detector = np.random.default_rng(3), TagDetector(["DICT_4X4_50"])
    for shape in ((480, 640), (16, 16), (1, 640), (3, 3)):
        detector.detect(rng.integers(0, 256, shape, dtype=np.uint8))


@pytest.mark.parametrize("paper_px", [10, 16, 20, 32])
def test_a_tag_on_a_narrow_paper_is_not_taken_for_its_paper(paper_px: int) -> None:
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    luma, detector = np.full((200, 200), 90, np.uint8), TagDetector(["DICT_APRILTAG_36h11"])
    tag = np.pad(cv2.aruco.generateImageMarker(family, 5, 64), paper_px, constant_values=230)
    luma[30:30 + len(tag), 30:30 + len(tag)] = tag
    found = detector.detect(cv2.GaussianBlur(luma, (0, 0), 0.7))
    assert [one.number for one in found] == [5]
    np.testing.assert_allclose(found[0].corners[:2], 29.5 + paper_px, atol=0.1)
