"""Flicker of mains light in frames of a rolling and of a global shutter."""

from __future__ import annotations

import numpy as np
import pytest
from colour_scenes import picture

from rhot_app.calibration.check.camera_advice import CameraAdvisor, FlickerWatch, measure_flicker, row_means
from rhot_app.errors import CalibrationError
from rhot_node.config import CameraSettings
from rhot_node.detect.image import YuvImage

ROWS = 480


def frames(mains_hz: float, depth: float, *, fps: float = 40.0, row_time_s: float = 48e-6, exposure_s: float = 4e-3,
           count: int = 60, noise: float = 0.05, seed: int = 1) -> tuple[list[np.ndarray], list[float]]:
    """Row means of a textured scene under a lamp whose light swings by `depth`; frame times jitter by 20 us."""
    rng = np.random.default_rng(seed)
    scene = 90.0 + 40.0 * np.sin(np.arange(ROWS) / 37.0) + rng.normal(0.0, 10.0, ROWS)
    times = np.arange(count) / fps + rng.normal(0.0, 2e-5, count)
    swing = depth * np.sinc(2.0 * mains_hz * exposure_s)
    at = times[:, None] + row_time_s * np.arange(ROWS)
    rows = scene * (1.0 + swing * np.cos(2.0 * np.pi * 2.0 * mains_hz * at + 0.7)) + rng.normal(0, noise, (count, ROWS))
    return list(rows), times.tolist()


@pytest.mark.parametrize("mains", [50.0, 60.0, 49.8, 60.2])
@pytest.mark.parametrize("row_time", [48e-6, 10e-6, None])
def test_flicker_is_seen_named_and_measured(mains: float, row_time: float | None) -> None:
    shown = row_time or 30e-6
    rows, times = frames(mains, 0.1, fps=33.0, row_time_s=shown)
    report = measure_flicker(rows, times, row_time, 4e-3, 33.0)
    assert report.mains_hz == round(mains, -1)
    assert report.depth == pytest.approx(0.1 * np.sinc(2.0 * mains * 4e-3), rel=0.25)
    assert report.bands == pytest.approx(2.0 * mains * ROWS * shown, rel=0.1, abs=0.3)


def test_a_steady_lamp_with_noise_and_a_hand_that_waves_is_no_flicker() -> None:
    rows, times = frames(50.0, 0.0, fps=33.0, noise=1.0)
    for row, t in zip(rows, times, strict=True):
        row[150:260] *= 1.0 + 0.2 * np.sin(2.0 * np.pi * 1.7 * t)
    report = measure_flicker(rows, times, 48e-6, 4e-3, 33.0)
    assert report.mains_hz is None and report.findings == ()


def test_an_exposure_of_whole_swings_shows_nothing() -> None:
    rows, times = frames(50.0, 0.3, exposure_s=10e-3)
    assert measure_flicker(rows, times, 48e-6, 10e-3, 40.0).mains_hz is None


@pytest.mark.parametrize(("mains", "fps", "expected"), [
    (50.0, 33.0, (10000.0, 20000.0, 30000.0)), (60.0, 35.0, (8333.3, 16666.7, 25000.0)), (50.0, 110.0, ())])
def test_the_remedy_is_an_exposure_over_which_the_lamp_averages_out(mains: float, fps: float,
                                                                    expected: tuple[float, ...]) -> None:
    rows, times = frames(mains, 0.15, fps=fps)
    report = measure_flicker(rows, times, 48e-6, 4e-3, fps)
    assert report.exposures_us == pytest.approx(expected, abs=0.1)
    (finding,) = report.findings
    assert "direct current" in finding.remedy
    if expected:
        assert f"{expected[0] / 1000:.2f}" in finding.remedy and "ms" in finding.remedy
        near = measure_flicker(rows, times, 48e-6, 9e-3, fps).findings[0]
        assert near.remedy.startswith("Set the exposure to")


def test_frames_of_a_global_shutter_differ_in_brightness() -> None:
    rows, times = frames(50.0, 0.08, fps=33.0, row_time_s=0.0)
    report = measure_flicker(rows, times, 0.0, 4e-3, 33.0)
    assert report.mains_hz == 50.0
    assert "from frame to frame" in report.findings[0].figure


def test_frames_in_step_with_the_mains_say_what_they_cannot_see() -> None:
    rows, times = frames(60.0, 0.2, fps=40.0)
    report = measure_flicker(rows, times, 48e-6, 4e-3, 40.0)
    assert report.mains_hz is None and np.isnan(report.depths[60.0])
    assert [finding.code for finding in report.findings] == ["flicker_unseen"]
    assert "60 Hz mains cannot be measured" in report.findings[0].figure


def test_too_few_frames_are_a_sentence() -> None:
    with pytest.raises(CalibrationError, match="too few"):
        measure_flicker([np.ones(480)] * 3, [0.0, 0.1, 0.2], None, 4e-3, 30.0)


def lit_frame(image: YuvImage, t: float, depth: float) -> YuvImage:
    at = t + 48e-6 * np.arange(image.y.shape[0])
    rows = image.y * (1.0 + depth * np.cos(2.0 * np.pi * 100.0 * at))[:, None]
    return YuvImage(np.clip(np.rint(rows), 0, 255).astype(np.uint8), image.u, image.v)


def test_the_advisor_joins_exposure_flicker_and_grey_into_one_verdict() -> None:
    advisor, settings = CameraAdvisor(), CameraSettings(fps=33.0, row_time_us=48.0)
    image = picture(clutter=[(270.0, 200.0, 30.0, (150, 120, 100))])
    for k in range(20):
        advice = advisor.update(lit_frame(image, k / 33.0, 0.1), k / 33.0, settings, grey=(255, 190, 285, 215))
        assert (advice.flicker is None) == (k < 7)
    assert advice.verdict.codes >= {"flicker", "white_balance"}
    assert "flicker" in advice.verdict.sentence
    advisor.restart()
    assert advisor.update(image, 0.0, settings).flicker is None


def test_the_watch_keeps_the_last_frames_only() -> None:
    watch = FlickerWatch(most=10)
    rows, times = frames(50.0, 0.2, fps=33.0, count=40)
    for row, t in zip(rows, times, strict=True):
        luma = np.repeat(np.rint(row).astype(np.uint8)[:, None], 8, axis=1)
        watch.add(YuvImage(luma, np.zeros((240, 4), np.uint8), np.zeros((240, 4), np.uint8)), t)
    assert watch.ready
    assert watch.report(48e-6, 4e-3, 33.0).mains_hz == 50.0
    assert len(row_means(picture())) == 240
