"""What the fast detector makes of motion, hiding, borders, decoys and absence."""

import math

import numpy as np
import pytest
from marker_rendering import SKIN, Canvas, Rgb, capsule, disc
from shipped_markers import RHOT6

from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import from_bgr
from rhot_node.detect.track import cover_of, new_tracks
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerFlag, MarkerObservation

RGB: dict[str, Rgb] = {marker.id: marker.display_rgb for marker in RHOT6.markers}
DOUBTS = MarkerFlag.PARTIAL | MarkerFlag.EDGE | MarkerFlag.AMBIGUOUS


def only(name: str) -> FastDetector:
    return FastDetector(MarkerSet(markers=(RHOT6.markers[RHOT6.ids.index(name)],)))


def error(seen: MarkerObservation, x: float, y: float) -> float:
    return math.hypot(seen.x - x, seen.y - y)


def sigma(seen: MarkerObservation) -> float:
    return math.sqrt(0.5 * (seen.cov_xx + seen.cov_yy))


def scene(places: dict[str, tuple[float, float]], size: tuple[int, int] = (320, 240)) -> Canvas:
    canvas = Canvas(*size)
    for name, (x, y) in places.items():
        canvas.paint(disc(x, y, 9), RGB[name], (x, y), 12, 0.25)
    return canvas


def test_all_colours_are_found_at_once_tracked_and_named() -> None:
    detector = FastDetector(RHOT6)
    rng = np.random.default_rng(1)
    places = {name: (40.0 + 47 * k, 60.0 + 31 * (k % 3)) for k, name in enumerate(RHOT6.ids)}
    first = detector.detect(scene(places).expose(rng))
    second = detector.detect(scene(places).expose(rng))
    for index, name in enumerate(RHOT6.ids):
        assert first[index].index == second[index].index == index
        assert error(second[index], *places[name]) < 0.2
        assert first[index].flags & MarkerFlag.ACQUIRED
        assert not second[index].flags & MarkerFlag.ACQUIRED


def test_absent_markers_are_stated_as_lost() -> None:
    seen = FastDetector(RHOT6).detect(scene({"ring": (100, 100)}).expose())
    for marker, observation in zip(RHOT6.markers, seen, strict=True):
        assert observation.found == (marker.id == "ring")
        if not observation.found:
            assert observation.flags == MarkerFlag.LOST
            assert math.isnan(observation.x)
            assert observation.quality == 0


def test_skin_and_noise_alone_are_nothing() -> None:
    rng = np.random.default_rng(2)
    canvas = Canvas(320, 240, (150, 110, 70)).paint(capsule((60, 200), (200, 60), 40), SKIN, (130, 130), 140, 0.4)
    assert not any(seen.found for seen in FastDetector(RHOT6).detect(canvas.expose(rng, noise=6.0)))


def test_specks_are_ignored() -> None:
    canvas = Canvas(160, 120)
    for x in range(10, 150, 14):
        canvas.paint(disc(x, 50, 1.5), RGB["ring"], (x, 50), 3)
    assert not only("ring").detect(canvas.expose())[0].found


def test_a_fast_marker_is_followed_by_prediction() -> None:
    detector = only("ring")
    rng = np.random.default_rng(3)
    for step in range(24):
        x = 320 + 250 * math.sin(0.17 * step)  # up to 43 px per frame
        seen = detector.detect(scene({"ring": (x, 60)}, (640, 120)).expose(rng))[0]
        assert error(seen, x, 60) < 0.25
        if step > 2:
            assert not seen.flags & MarkerFlag.ACQUIRED


def test_a_jump_out_of_the_window_is_found_in_the_same_frame() -> None:
    detector = only("ring")
    detector.detect(scene({"ring": (40, 40)}).expose())
    seen = detector.detect(scene({"ring": (280, 200)}).expose())[0]
    assert error(seen, 280, 200) < 3.0 * sigma(seen) < 1.0
    assert seen.flags & MarkerFlag.ACQUIRED
    assert error(detector.detect(scene({"ring": (280, 200)}).expose())[0], 280, 200) < 0.1


@pytest.mark.parametrize("decoy_radius", [12, 22])
def test_a_larger_blob_does_not_take_the_track_over(decoy_radius: float) -> None:
    detector = only("ring")
    for step in range(12):
        x = 40.0 + 8 * step
        canvas = scene({"ring": (x, 100)})
        if step > 2:
            canvas.paint(disc(200, 140, decoy_radius), RGB["ring"], (200, 140), decoy_radius + 3)
        seen = detector.detect(canvas.expose())[0]
        assert error(seen, x, 100) < 0.1


def test_a_decoy_in_the_window_neither_pulls_nor_passes_silently() -> None:
    detector = only("ring")
    detector.detect(scene({"ring": (100, 100)}).expose())
    canvas = scene({"ring": (100, 100)}).paint(disc(126, 100, 8), RGB["ring"], (126, 100), 11)
    seen = detector.detect(canvas.expose())[0]
    assert error(seen, 100, 100) < 0.1
    far = scene({"ring": (100, 100)}).paint(disc(110, 100, 8), RGB["ring"], (110, 100), 11)
    merged = detector.detect(far.expose())[0]
    assert merged.flags & MarkerFlag.AMBIGUOUS or error(merged, 100, 100) < 3 * sigma(merged)


def test_two_equal_blobs_are_two_candidates_that_are_both_followed() -> None:
    detector = only("ring")
    for step in range(12):
        x, y = 80.0 + step, 100.0 - 0.5 * step
        canvas = scene({"ring": (x, y)}).paint(disc(220, 100, 9), RGB["ring"], (220, 100), 12)
        seen = detector.detect(canvas.expose())
        assert len(seen) == 2
        assert min(error(mark, x, y) for mark in seen) < 0.1
        assert min(error(mark, 220, 100) for mark in seen) < 0.1
        assert all(sigma(mark) < 0.3 for mark in seen)  # which is the marker is in doubt, not where each is


def test_no_more_than_four_candidates_are_told_and_they_are_of_the_marker() -> None:
    canvas = scene({name: (40.0 + 45 * k, 40.0) for k, name in enumerate(RHOT6.ids)}, (320, 240))
    for k in range(6):
        canvas.paint(disc(30 + 50 * k, 150, 9), RGB["ring"], (30 + 50 * k, 150), 12)
    detector = FastDetector(RHOT6)
    for _ in range(12):
        seen = detector.detect(canvas.expose())
        assert [mark.index for mark in seen[:6]] == list(range(6))
        assert all(mark.found for mark in seen)
        assert {mark.index for mark in seen[6:]} == {RHOT6.ids.index("ring")}
    assert len(seen) == 6 + 3


def test_hiding_is_noticed_and_the_covariance_covers_it() -> None:
    detector = only("thumb")
    rng = np.random.default_rng(5)
    flagged = []
    for step in range(24):
        x = 114 - 3 * step
        canvas = scene({"thumb": (80, 80)}, (200, 160)).paint(capsule((x, 20), (x, 140), 9), SKIN, (x, 80), 70)
        seen = detector.detect(canvas.expose(rng))[0]
        if not seen.found:
            continue
        flagged.append(bool(seen.flags & MarkerFlag.PARTIAL))
        assert error(seen, 80, 80) < 0.3 + 3 * sigma(seen), step
        if seen.diameter < 15:
            assert seen.flags & MarkerFlag.PARTIAL
            assert seen.quality < 0.8
    assert any(flagged)
    assert not flagged[0]
    assert not flagged[-1]


def test_a_finger_across_the_marker_leaves_one_marker_not_half_of_it() -> None:
    detector = only("thumb")
    big = Canvas(160, 160).paint(disc(80, 80, 16), RGB["thumb"], (80, 80), 19)
    for _ in range(3):
        detector.detect(big.expose())
    seen = detector.detect(big.paint(capsule((80, 20), (80, 140), 5), SKIN, (80, 80), 70).expose())[0]
    assert seen.flags & MarkerFlag.PARTIAL
    assert error(seen, 80, 80) < 1.0


def test_honest_approach_is_not_hiding() -> None:
    detector = only("index")
    rng = np.random.default_rng(7)
    for step in range(44):
        radius = 9.0 * 0.98 ** min(step, 20) * 1.02 ** max(step - 20, 0)
        canvas = Canvas(160, 120).paint(disc(80, 60, radius), RGB["index"], (80, 60), radius + 3, 0.25)
        seen = detector.detect(canvas.expose(rng))[0]
        assert not seen.flags & DOUBTS, step
        assert error(seen, 80, 60) < 0.3
        assert sigma(seen) < 1.2


def test_the_frame_border_is_flagged_and_covered() -> None:
    detector = only("ring")
    for step in range(12):
        x = 32.0 - 3 * step
        seen = detector.detect(Canvas(200, 160).paint(disc(x, 80, 9), RGB["ring"], (x, 80), 12).expose())[0]
        assert bool(seen.flags & MarkerFlag.EDGE) == (x < 9.5)
        assert error(seen, x, 80) < 0.1 + 2.5 * sigma(seen)


def test_reset_forgets_and_all_blobs_does_not_disturb() -> None:
    detector = only("ring")
    image = scene({"ring": (80, 100)}).paint(disc(220, 100, 14), RGB["ring"], (220, 100), 17).expose()
    small = scene({"ring": (80, 100)}).expose()
    detector.detect(small)
    assert error(detector.detect(image)[0], 80, 100) < 0.1
    blobs = detector.all_blobs(image)
    assert [round(blob.diameter) for blob in blobs[0]] == [28, 18]
    assert error(detector.detect(image)[0], 80, 100) < 0.1
    detector.reset()
    assert error(detector.detect(image)[0], 220, 100) < 0.1


def test_hypotheses_survive_short_hiding() -> None:
    detector = only("ring")
    for _ in range(3):
        detector.detect(scene({"ring": (80, 100)}).expose())
    decoy = Canvas(320, 240).paint(disc(250, 190, 24), RGB["ring"], (250, 190), 27)
    seen = detector.detect(decoy.expose())[0]
    assert not seen.found or seen.flags & MarkerFlag.AMBIGUOUS


@pytest.mark.parametrize("column", [0, 1])
def test_a_marker_of_one_column_at_the_border_is_found_with_a_covariance(column: int) -> None:
    image = Canvas(160, 120).expose()
    rgb = np.zeros((1, 1, 3), np.uint8)
    rgb[:] = RGB["ring"][::-1]
    paint = from_bgr(np.repeat(np.repeat(rgb, 2, axis=0), 2, axis=1))
    rows = slice(20, 34)
    image.u[rows, column], image.v[rows, column] = paint.u[0, 0], paint.v[0, 0]
    image.y[40:68, 2 * column:2 * column + 2] = paint.y[0, 0]
    detector = only("ring")
    detector.detect(Canvas(160, 120).expose())  # what is found later is placed by its mask at first
    for _ in range(4):
        seen = detector.detect(image)[0]
        assert not seen.found or (math.isfinite(seen.cov_xx) and seen.cov_xx > 0.0)


def test_a_marker_that_went_farther_away_unseen_is_whole_again_after_a_while() -> None:
    detector = only("ring")

    def shown(radius: float) -> MarkerObservation:
        canvas = Canvas(320, 240).paint(disc(160, 120, radius), RGB["ring"], (160, 120), radius + 3, 0.25)
        return detector.detect(canvas.expose())[0]
    assert not [shown(9.0) for _ in range(8)][-1].flags & DOUBTS
    assert not detector.detect(Canvas(320, 240).expose())[0].found
    farther = [shown(7.8) for _ in range(60)]  # three quarters of the area: it may as well be half hidden
    assert farther[0].flags & MarkerFlag.PARTIAL and not farther[-1].flags & DOUBTS
    assert error(farther[-1], 160.0, 120.0) < 0.1


@pytest.mark.parametrize("away", [1.0, -1.0])
def test_a_marker_that_comes_nearer_or_goes_away_fast_is_in_plain_view(away: float) -> None:
    detector = only("ring")
    rng = np.random.default_rng(2)
    radii = [11.0] * 6 + [11.0 * math.exp(0.05 * away * k) for k in range(1, 15)]
    flagged = 0
    for radius in radii:
        canvas = Canvas(320, 240).paint(disc(160, 120, radius), RGB["ring"], (160, 120), radius + 3)
        flagged += bool(detector.detect(canvas.expose(rng))[0].flags & DOUBTS)
    assert flagged <= 2  # until it is known that it does


def test_a_marker_that_is_covered_slowly_from_one_side_is_half_hidden_not_farther_away() -> None:
    detector = only("ring")
    rng = np.random.default_rng(3)
    for cover in [0.0] * 6 + [2.5 * k for k in range(1, 12)]:
        canvas = Canvas(320, 240).paint(disc(160, 120, 22), RGB["ring"], (160, 120), 25)
        canvas.rgb[:, 130:round(138 + cover)] = SKIN
        seen = detector.detect(canvas.expose(rng))[0]
        assert seen.flags & DOUBTS or error(seen, 160.0, 120.0) < 0.5 + 2.5 * sigma(seen)
        assert seen.flags & DOUBTS or cover < 22.0


@pytest.mark.parametrize("factor", [0.99, 0.97, 0.95])
@pytest.mark.parametrize("turned", [True, False])
def test_a_marker_that_turns_away_is_plain(factor: float, turned: bool) -> None:
    """Its lengths shrink about a centroid that goes on as it moved."""
    detector = only("ring")
    rng = np.random.default_rng(5)
    flagged = 0
    for k in range(26):
        share, x, y = factor ** max(k - 6, 0), 120.0 + 1.5 * k, 120.0
        reach = 9.0 * share
        ends = ((x, y - reach), (x, y + reach)) if turned else ((x - reach, y), (x + reach, y))
        canvas = Canvas(320, 240).paint(capsule(*ends, 9.0), RGB["ring"], (x, y), 22)
        flagged += bool(detector.detect(canvas.expose(rng))[0].flags & DOUBTS)
    assert flagged == 0


@pytest.mark.parametrize(("drawn", "covered"), [(-1.0, True), (0.0, False), (0.4, False), (0.6, True), (1.0, True),
                                                 (1.4, True), (1.6, False)])
def test_a_cover_is_what_draws_the_centroid_more_than_half_as_far_as_it_should(drawn: float, covered: bool) -> None:
    """A rectangle of 24 x 12 px loses a quarter of its length: 3 px of its centroid if that is covered."""
    tracks, place = new_tracks(["disc"]), new_tracks(["disc"])
    for name, value in {"area": 288.0, "alive": 1.0, "missed": 0.0, "m_xx": 48.0, "m_yy": 12.0, "vx": 2.0}.items():
        tracks[name] = value
    place["x"] = 2.0 + 3.0 * drawn
    cover = cover_of(tracks[0], place[0], (27.0, 0.0, 12.0))
    assert (cover.x, cover.y) == pytest.approx((math.copysign(3.0, drawn) if covered else 0.0, 0.0))
    assert cover.moments == pytest.approx((48.0 if covered else 27.0, 0.0, 12.0))


def test_beside_a_whole_marker_a_speck_of_its_colour_is_no_piece_of_it() -> None:
    rng, detector = np.random.default_rng(6), only("ring")
    for k in range(8):
        canvas = Canvas(320, 240).paint(disc(160, 120, 16), RGB["ring"], (160, 120), 19)
        if k > 2:
            canvas.paint(disc(190, 120, 5), RGB["ring"], (190, 120), 8)
        seen = detector.detect(canvas.expose(rng))[0]
        assert not seen.flags & DOUBTS
        assert error(seen, 160.0, 120.0) < 0.1


def test_half_a_marker_is_not_joined_with_a_large_thing_of_its_colour() -> None:
    """Three fifths stay visible, right of a bar; left of that is a wall. Together they are half as large again."""
    rng, detector = np.random.default_rng(9), only("ring")
    marker = Canvas(320, 240).paint(disc(160, 120, 16), RGB["ring"], (160, 120), 19)
    for _ in range(5):
        whole = detector.detect(marker.expose(rng))[0]
    marker.rgb[:, :151], marker.rgb[:, 151:158] = RGB["ring"], SKIN
    seen = detector.detect(marker.expose(rng))[0]
    assert seen.flags & DOUBTS
    assert seen.diameter < whole.diameter
    assert error(seen, 160.0, 120.0) < 2.5 * sigma(seen)


@pytest.mark.parametrize("growth", [0.0, 0.05])
@pytest.mark.parametrize("at", [155, 160, 164])
def test_the_two_parts_of_a_marker_beside_a_thin_bar_are_one(at: int, growth: float) -> None:
    rng, detector = np.random.default_rng(10), only("ring")
    for k in range(8):
        radius = 16.0 * math.exp(0.5 * growth * k)
        canvas = Canvas(320, 240).paint(disc(160, 120, radius), RGB["ring"], (160, 120), radius + 3)
        if k == 7:
            canvas.rgb[:, at - 3:at + 3] = SKIN
        seen = detector.detect(canvas.expose(rng))[0]
    assert seen.flags & MarkerFlag.PARTIAL
    assert error(seen, 160.0, 120.0) < 2.0
    assert seen.diameter > 1.6 * radius  # of 2 without the bar; the larger part alone has less
