"""Bias, jitter and honesty of the fast detector's positions, on supersampled markers with blur, shading and noise."""

import math

import msgspec
import numpy as np
import pytest
from marker_rendering import SKIN, Canvas, Rgb, band, capsule, disc
from shipped_markers import RHOT6

from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerFlag, MarkerObservation

CLOTH: Rgb = (60, 90, 130)
GREY: Rgb = (120, 122, 118)
Offset = tuple[float, float]


def only(name: str, flat: bool = False) -> tuple[FastDetector, Rgb]:
    """A detector of one marker, whose drawing is shaded as something `flat` or as something round, and its paint."""
    marker = next(marker for marker in RHOT6.markers if marker.id == name)
    marker = msgspec.structs.replace(marker, shape="disc") if flat else marker
    return FastDetector(MarkerSet(markers=(marker,))), marker.display_rgb


def offsets(count: int, seed: int = 0) -> list[Offset]:
    return [tuple(pair) for pair in np.random.default_rng(seed).uniform(-1, 1, (count, 2)).tolist()]


def see(name: str, canvas: Canvas, rng: np.random.Generator | None = None, flat: bool = False) -> MarkerObservation:
    detector, _ = only(name, flat)
    seen = detector.detect(canvas.expose(rng))[0]
    assert seen.found
    return seen


def fingertip(name: str, offset: Offset, backdrop: Rgb) -> tuple[Canvas, Offset]:
    """A painted distal phalanx, 16 px wide, on a skin-coloured finger; its centre."""
    x, y = 56 + offset[0], 45.5 + offset[1]
    _, rgb = only(name)
    canvas = Canvas(112, 96, backdrop).paint(capsule((x - 46, y + 34.5), (x - 6, y + 4.5), 8), SKIN, (x - 6, y + 4), 60)
    return canvas.paint(capsule((x - 6, y + 4.5), (x + 6, y - 4.5), 8), rgb, (x, y), 20, 0.25), (x, y)


def nees(seen: MarkerObservation, truth: Offset) -> float:
    error = np.array([seen.x - truth[0], seen.y - truth[1]])
    covariance = np.array([[seen.cov_xx, seen.cov_xy], [seen.cov_xy, seen.cov_yy]])
    return float(error @ np.linalg.solve(covariance, error))


@pytest.mark.parametrize("name", ["thumb", "middle", "little"])
@pytest.mark.parametrize("radius", [6.0, 8.0, 10.0])
def test_disc_has_no_bias_under_shading(name: str, radius: float) -> None:
    _, rgb = only(name)
    for x, y in offsets(4):
        seen = see(name, Canvas(112, 96).paint(disc(50 + x, 44 + y, radius), rgb, (50, 44), radius + 3, 0.25),
                   flat=True)
        assert math.hypot(seen.x - 50 - x, seen.y - 44 - y) < 0.04
        assert seen.diameter == pytest.approx(2 * radius, rel=0.02)
        assert seen.quality > 0.9


@pytest.mark.parametrize("name", ["index", "ring", "thumb", "little"])
@pytest.mark.parametrize("backdrop", [GREY, CLOTH])
def test_skin_on_one_side_and_cloth_on_the_other_do_not_shift_a_fingertip(name: str, backdrop: Rgb) -> None:
    for offset in offsets(3):
        canvas, truth = fingertip(name, offset, backdrop)
        seen = see(name, canvas)
        assert math.hypot(seen.x - truth[0], seen.y - truth[1]) < (0.15 if name == "little" else 0.09)


@pytest.mark.parametrize("lamp", [(1.0, 0.88, 0.75), (0.8, 0.92, 1.0), (0.6, 0.6, 0.6)])
def test_another_lamp_does_not_shift_the_position(lamp: Rgb) -> None:
    canvas, truth = fingertip("ring", (0.3, -0.4), GREY)
    canvas.rgb *= lamp
    seen = see("ring", canvas)
    assert math.hypot(seen.x - truth[0], seen.y - truth[1]) < 0.09


def test_a_small_shaded_disc_is_placed_within_its_covariance() -> None:
    _, rgb = only("index")
    for x, y in offsets(4):
        seen = see("index", Canvas(112, 96).paint(disc(50 + x, 44 + y, 4.0), rgb, (50, 44), 7, 0.25))
        assert nees(seen, (50 + x, 44 + y)) < 6.0
        assert math.hypot(seen.x - 50 - x, seen.y - 44 - y) < 0.2


@pytest.mark.parametrize(("name", "limit"), [("index", 0.04), ("middle", 0.06)])
def test_jitter_is_small_and_its_covariance_honest(name: str, limit: float) -> None:
    rng = np.random.default_rng(8)
    errors, scores = [], []
    for offset in offsets(6, seed=2):
        canvas, truth = fingertip(name, offset, GREY)
        detector, _ = only(name)
        frames = [detector.detect(canvas.expose(rng))[0] for _ in range(10)][3:]
        points = np.array([(seen.x, seen.y) for seen in frames])
        errors.append(points - points.mean(axis=0))
        scores += [nees(seen, truth) for seen in frames]
    jitter = np.sqrt(np.mean(np.square(np.concatenate(errors)), axis=0))
    assert (jitter < limit).all()
    assert 0.5 < np.mean(scores) < 4.5  # 2 for two honest degrees of freedom


def test_covariance_follows_the_camera_noise() -> None:
    finger, truth = fingertip("ring", (0.1, 0.2), GREY)
    _, rgb = only("ring")
    plain = Canvas(112, 96).paint(disc(56.1, 45.7, 8), rgb, (56.1, 45.7), 11, 0.25)  # the noise is all there is
    deviations = []
    for noise in (2.0, 12.0):
        rng = np.random.default_rng(4)
        for canvas, place in ((finger, truth), (plain, (56.1, 45.7))):
            detector, _ = only("ring", flat=True)
            frames = [detector.detect(canvas.expose(rng, noise))[0] for _ in range(30)][12:]
            assert 0.3 < np.mean([nees(seen, place) for seen in frames]) < 4.5
        deviations.append(math.sqrt(frames[-1].cov_xx))
    assert deviations[1] > 2.0 * deviations[0]


def wrist(offset: Offset, radius: float, tilt_deg: float, turn: float) -> tuple[Canvas, Offset]:
    """A band on a forearm, 25 % shaded; the projection of its centre."""
    x, y = 80 + offset[0], 64 + offset[1]
    tilt = math.radians(tilt_deg)
    _, rgb = only("wrist")
    canvas = Canvas(160, 128).paint(band(x, y, radius, 4 * radius, tilt, turn), SKIN, (80, 64), 60)
    return canvas.paint(band(x, y, radius, 0.88 * radius, tilt, turn), rgb, (80, 64), 2 * radius, 0.25), (x, y)


@pytest.mark.parametrize("radius", [10.0, 20.0])
@pytest.mark.parametrize("turn", [0.0, 0.4, -1.2])
@pytest.mark.parametrize("tilt_deg", [-50, 0, 15, 35, 55])
def test_a_tilted_band_is_placed_on_its_axis(radius: float, turn: float, tilt_deg: int) -> None:
    for offset in offsets(1, seed=tilt_deg + 60):
        canvas, truth = wrist(offset, radius, tilt_deg, turn)
        seen = see("wrist", canvas)
        assert math.hypot(seen.x - truth[0], seen.y - truth[1]) < 0.3
        assert not seen.flags & MarkerFlag.PARTIAL


def test_the_plain_centroid_of_a_tilted_band_is_pixels_off() -> None:
    canvas, truth = wrist((0.2, -0.3), 20.0, 30.0, 0.0)
    marker = RHOT6.markers[RHOT6.ids.index("wrist")]
    plain = MarkerSet(markers=(type(marker)(id="wrist", chroma=marker.chroma, display_rgb=marker.display_rgb),))
    seen = FastDetector(plain).detect(canvas.expose())[0]
    assert seen.y - truth[1] == pytest.approx(math.pi / 4 * 20.0 * math.sin(math.radians(30.0)), abs=0.3)


def test_band_covariance_is_honest_and_wider_along_the_axis() -> None:
    rng = np.random.default_rng(6)
    scores = []
    for offset in offsets(5, seed=9):
        canvas, truth = wrist(offset, 20.0, 30.0, 0.0)
        detector, _ = only("wrist")
        frames = [detector.detect(canvas.expose(rng))[0] for _ in range(8)][2:]
        scores += [nees(seen, truth) for seen in frames]
        assert frames[-1].cov_yy > frames[-1].cov_xx
    assert 0.3 < np.mean(scores) < 4.5


def test_a_half_hidden_band_falls_back_with_a_covariance_that_covers_it() -> None:
    detector, _ = only("wrist")
    canvas, truth = wrist((0.0, 0.0), 20.0, 30.0, 0.0)
    detector.detect(canvas.expose())
    canvas.paint(capsule((92, 20), (92, 110), 11), SKIN, (92, 64), 70)
    seen = detector.detect(canvas.expose())[0]
    assert seen.flags & MarkerFlag.PARTIAL
    assert nees(seen, truth) < 9.0


def test_odd_frame_sizes_and_a_changed_size_are_taken() -> None:
    detector, rgb = only("ring")
    for width, height in ((112, 96), (90, 70)):
        image = Canvas(width, height).paint(disc(40, 35, 8), rgb, (40, 35), 11).expose()
        assert detector.detect(image)[0].x == pytest.approx(40, abs=0.04)
    tiny = YuvImage(*(np.full(size, 128, dtype=np.uint8) for size in ((2, 2), (1, 1), (1, 1))))
    assert not detector.detect(tiny)[0].found
