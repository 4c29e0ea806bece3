"""The lamp: neutral by default, warm when told, swinging with the mains, and burning out what it overexposes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from simulator_solids import NEUTRAL, OPTICS, STILL, Gliding, balls

from rhot_app.geometry.camera import CameraModel, intrinsics_row
from rhot_app.simulator.render.camera_controls import Lamp, flicker_gain, lamp_gains, level_gain
from rhot_app.simulator.render.exposure_samples import Shutter
from rhot_app.simulator.render.render import Exposure, FrameRenderer
from rhot_app.simulator.render.solids_painter import SolidsPainter
from rhot_node.detect.image import YuvImage, from_i420

WIDTH, HEIGHT = 96, 64
CAMERA = CameraModel(WIDTH, HEIGHT, intrinsics_row([530.0, 530.0, 47.5, 31.5]), np.eye(4), np.eye(4))


def picture(lamp: Lamp, shutter: Shutter = STILL, nominal_s: float = STILL.exposure_s) -> YuvImage:
    """A white ball before mid grey."""
    background = np.full((3, HEIGHT, WIDTH), 100.0, np.float32)
    painter = SolidsPainter(balls([0.01], [(0.0, 0.0, 0.0)], [True]), CAMERA, 0.0, 1)
    camera = FrameRenderer(painter, background, OPTICS, Exposure(shutter, nominal_s, lamp, NEUTRAL), 1)
    return from_i420(camera.render(Gliding((0.0, 0.0, 0.6)), 0.0, 0)[0].copy(), WIDTH, HEIGHT)


def test_gains_are_neutral_at_6500_and_those_of_a_black_body_elsewhere() -> None:
    np.testing.assert_allclose(lamp_gains(Lamp()), 1.0)
    np.testing.assert_allclose(lamp_gains(Lamp(brightness=0.8)), 0.8)
    warm, cold = lamp_gains(Lamp(kelvin=3000.0)), lamp_gains(Lamp(kelvin=9000.0))
    assert warm[0] > 1.5 > 1.0 > warm[1] > 0.7 > 0.4 > warm[2] > 0.2
    assert cold[0] < 1.0 < cold[2]
    # Equal luminance: the shares of red, green and blue in it are those of sRGB.
    assert warm @ (0.2126, 0.7152, 0.0722) == pytest.approx(1.0, abs=0.02)


def test_gains_change_smoothly_over_the_splines_joints() -> None:
    for kelvin in (2222.0, 4000.0):
        below, above = lamp_gains(Lamp(kelvin=kelvin - 0.5)), lamp_gains(Lamp(kelvin=kelvin + 0.5))
        np.testing.assert_allclose(below, above, atol=0.004)


def test_brightness_and_exposure_act_on_linear_light() -> None:
    plain, dim = picture(Lamp()), picture(Lamp(brightness=0.5))
    short = picture(Lamp(), Shutter(0.5 * STILL.exposure_s, STILL.row_time_s))
    for other in (dim, short):
        assert other.y[:8].mean() == pytest.approx(0.5 ** (1 / 2.2) * plain.y[:8].mean(), abs=0.5)
        assert other.y[31, 47] == pytest.approx(0.5 ** (1 / 2.2) * 255.0, abs=12.0)


def test_a_warm_lamp_turns_grey_towards_red_and_burns_white_out() -> None:
    warm = picture(Lamp(kelvin=3000.0))
    assert warm.v[:4].mean() > 140.0 and warm.u[:4].mean() < 115.0
    assert picture(Lamp(brightness=3.0)).y[31, 47] == 255


def test_mains_flicker_bands_the_rows_unless_the_exposure_is_whole_periods() -> None:
    lamp = Lamp(mains_hz=50.0, flicker=0.3)
    rows = Shutter(0.004, 200e-6)  # 64 rows take 12.8 ms, more than a period of 100 Hz
    banded = picture(lamp, rows, 0.004).y[:, :30].mean(axis=1)
    times = 200e-6 * np.arange(HEIGHT)
    expected = 100.0 * level_gain(flicker_gain(lamp, times, 0.004))
    assert np.ptp(expected) > 15.0
    np.testing.assert_allclose(banded, expected, atol=1.2)
    whole = picture(lamp, Shutter(0.010, 200e-6), 0.010).y[:, :30].mean(axis=1)
    assert np.ptp(whole) < 2.5
    assert flicker_gain(lamp, np.zeros(1), 0.010)[0] == pytest.approx(1.0, abs=1e-9)
    assert math.isclose(float(flicker_gain(lamp, np.zeros(1), 1e-9)[0]), 1.3, rel_tol=1e-6)
