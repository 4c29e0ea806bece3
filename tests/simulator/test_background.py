"""Backgrounds: repeatable, one room for both cameras, and what they are called."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rhot_app.errors import SimulatorError
from rhot_app.geometry.camera import CameraModel, intrinsics_row
from rhot_app.geometry.transforms import rigid
from rhot_app.simulator.scene.background import BACKGROUNDS, BEHIND_HAND_M, background_image

BASELINE_M, FOCAL = 0.075, 132.6
PINHOLE = CameraModel(160, 120, intrinsics_row([FOCAL, FOCAL, 79.5, 59.5]), np.eye(4), np.eye(4))


@pytest.mark.parametrize("name", BACKGROUNDS)
def test_background_repeats_by_seed_within_8_bits(name: str) -> None:
    image = background_image(name, PINHOLE, 0.6, 1)
    assert image.shape == (3, 120, 160) and image.dtype == np.float32
    assert image.min() >= 0.0 and image.max() <= 255.0
    np.testing.assert_array_equal(image, background_image(name, PINHOLE, 0.6, 1))
    assert np.abs(image - background_image(name, PINHOLE, 0.6, 2)).mean() > 1.0


def test_cloth_is_dark_and_almost_grey() -> None:
    image = background_image("cloth", PINHOLE, 0.6, 1)
    assert image.mean() < 60.0
    assert np.ptp(image.mean(axis=(1, 2))) < 12.0


def test_second_camera_sees_the_same_plane_shifted_by_its_disparity() -> None:
    distance = FOCAL * BASELINE_M / 8.0 - BEHIND_HAND_M  # a disparity of 8 px on the plane
    moved = rigid(np.eye(3), (BASELINE_M, 0.0, 0.0))
    right = replace(PINHOLE, world_from_camera=moved, camera_from_world=np.linalg.inv(moved))
    left_image, right_image = (background_image("clutter", camera, distance, 3) for camera in (PINHOLE, right))
    np.testing.assert_allclose(right_image[:, :, :-8], left_image[:, :, 8:], atol=0.1)


def test_unknown_background_is_refused_by_name() -> None:
    with pytest.raises(SimulatorError, match=r"beach.*cloth, clutter"):
        background_image("beach", PINHOLE, 0.6, 1)
