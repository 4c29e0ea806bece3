"""Lens blur, colour planes and noise of the simulated sensor."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot_app.simulator.render.camera_controls import Controls, development
from rhot_app.simulator.render.sensor import Sensor, psf_kernel
from rhot_node.detect.image import YuvImage, from_i420

WIDTH, HEIGHT = 96, 64
NEUTRAL = Controls()


def expose(image: np.ndarray, *, background: np.ndarray | None = None, psf: float = 0.7, noise: float = 0.0,
           box: tuple[int, int, int, int] | None = None, seed: int = 1, controls: Controls = NEUTRAL) -> YuvImage:
    """One exposure of `image` (3, H, W) over a black background."""
    background = np.zeros_like(image) if background is None else background
    sensor = Sensor(background, psf, development(controls, noise, 0.5 * noise), seed)
    out = np.empty(WIDTH * HEIGHT * 3 // 2, np.uint8)
    sensor.expose(image, (0, 0, WIDTH, HEIGHT) if box is None else box, out)
    return from_i420(out, WIDTH, HEIGHT)


def test_planes_are_opencvs_full_range_bt601_with_the_mean_chroma_of_four() -> None:
    rgb = np.random.default_rng(1).uniform(20, 230, (3, HEIGHT, WIDTH)).astype(np.float32)
    ours = expose(rgb, psf=0.0)
    ycc = cv2.cvtColor((rgb.transpose(1, 2, 0) / 255.0).astype(np.float32), cv2.COLOR_RGB2YCrCb) * 255.0
    assert np.abs(ours.y - ycc[:, :, 0]).max() <= 0.51
    means = ycc.reshape(HEIGHT // 2, 2, WIDTH // 2, 2, 3).mean(axis=(1, 3))
    assert np.abs(ours.v - (means[:, :, 1] - 127.5 + 128.0)).max() <= 0.6
    assert np.abs(ours.u - (means[:, :, 2] - 127.5 + 128.0)).max() <= 0.6


def test_point_spread_is_a_gaussian_of_the_wanted_width_also_at_the_border() -> None:
    image = np.random.default_rng(2).uniform(0, 255, (3, HEIGHT, WIDTH)).astype(np.float32)
    ours = expose(image, psf=0.7)
    luma = np.tensordot([0.299, 0.587, 0.114], image, axes=1)
    taps = psf_kernel(0.7)
    expected = cv2.sepFilter2D(luma, -1, taps, taps, borderType=cv2.BORDER_REPLICATE)
    assert np.abs(ours.y - expected).max() <= 0.52
    offsets = np.arange(-3, 4)
    assert (taps * offsets**2).sum() == pytest.approx(0.49, rel=0.02)


def test_only_the_box_is_developed_and_the_next_frame_starts_clean() -> None:
    background = np.full((3, HEIGHT, WIDTH), 60.0, np.float32)
    sensor = Sensor(background, 0.7, development(NEUTRAL, 0.0, 0.0), 1)
    image = background.copy()
    image[:, 20:30, 40:50] = 200.0
    out = np.empty(WIDTH * HEIGHT * 3 // 2, np.uint8)
    sensor.expose(image, (40, 20, 50, 30), out)
    whole = expose(image, background=background)
    np.testing.assert_array_equal(from_i420(out, WIDTH, HEIGHT).y, whole.y)
    sensor.expose(background, (0, 0, 0, 0), out)
    assert set(from_i420(out, WIDTH, HEIGHT).y.ravel()) == {60}


@pytest.mark.parametrize("level", [40.0, 128.0, 200.0])
def test_noise_is_that_of_three_independent_channels(level: float) -> None:
    grey = np.full((3, HEIGHT, WIDTH), level, np.float32)
    frames = [expose(grey, noise=3.0, seed=seed) for seed in range(8)]
    read, shot = 1.5**2, (3.0**2 - 1.5**2) / 128.0
    sigma = np.sqrt(read + shot * level)
    quantised = 1.0 / 12.0
    for plane, weights, count in (("y", (0.299, 0.587, 0.114), 1), ("u", (0.168736, 0.331264, 0.5), 4),
                                  ("v", (0.5, 0.418688, 0.081312), 4)):
        values = np.array([getattr(frame, plane) for frame in frames], dtype=np.float64)
        expected = np.sqrt(sigma**2 * np.square(weights).sum() / count + quantised)
        assert values.std() == pytest.approx(expected, rel=0.04), plane
        assert values.mean() == pytest.approx(level if plane == "y" else 128.0, abs=0.1)
    luma = np.array([frame.y for frame in frames], dtype=np.float64) - level
    assert abs((luma[:, :, 1:] * luma[:, :, :-1]).mean()) < 0.1 * sigma**2
    assert abs((luma[1:] * luma[:-1]).mean()) < 0.1 * sigma**2


def grey_picture(rgb: tuple[float, float, float], controls: Controls) -> tuple[float, float, float]:
    """Mean Y, Cb, Cr of an even picture without noise."""
    picture = expose(np.tile(np.array(rgb, np.float32)[:, None, None], (1, HEIGHT, WIDTH)), controls=controls)
    return float(picture.y.mean()), float(picture.u.mean()), float(picture.v.mean())


def test_settings_act_as_a_camera_s() -> None:
    colour = (120.0, 90.0, 60.0)
    luma, cb, cr = grey_picture(colour, NEUTRAL)
    assert grey_picture(colour, Controls(saturation=0.0)) == pytest.approx((luma, 128.0, 128.0), abs=1.0)
    assert grey_picture(colour, Controls(saturation=2.0))[1:] == pytest.approx((2 * cb - 128, 2 * cr - 128), abs=1.6)
    assert grey_picture(colour, Controls(brightness=0.25)) == pytest.approx((luma + 32.0, cb, cr), abs=1.0)
    assert grey_picture(colour, Controls(contrast=1.5))[0] == pytest.approx(128.0 + 1.5 * (luma - 128.0), abs=1.0)
    # 2^(1/2.2) = 1.37 on red alone
    assert grey_picture(colour, Controls(red_gain=2.0))[0] == pytest.approx(luma + 0.299 * 0.37 * 120.0, abs=1.0)


def test_white_balance_cannot_bring_back_what_is_burnt_out() -> None:
    burnt = grey_picture((400.0, 300.0, 255.0), NEUTRAL)
    assert burnt == pytest.approx((255.0, 128.0, 128.0), abs=1.0)
    _, cb, _ = grey_picture((400.0, 300.0, 255.0), Controls(blue_gain=0.5))
    assert cb == pytest.approx(128.0 - 0.5 * 255.0 * (1.0 - 0.5 ** (1 / 2.2)), abs=1.0)


def test_gain_pays_with_noise() -> None:
    grey = np.full((3, HEIGHT, WIDTH), 128.0, np.float32)
    quiet, loud = (expose(grey, noise=3.0, controls=Controls(gain=gain)).y.astype(float).std() for gain in (1.0, 4.0))
    shot, read = 3.0**2 - 1.5**2, 1.5**2
    assert loud / quiet == pytest.approx(np.sqrt((4.0 * shot + 16.0 * read) / (shot + read)), rel=0.06)
