"""Hands of a picture: the geometry with networks that know where the hands are, and the real ones where installed."""

from __future__ import annotations

import csv
import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from fake_networks import FakeNetworks, gradient, hand_at

from rhot_node.errors import KeypointError
from rhot_node.landmarks.install import installed_folder
from rhot_node.landmarks.networks import (
    HAND_PX,
    MODELS,
    REACQUISITION,
    SEARCH_EVERY,
    HandNetworks,
    next_region,
    open_hand_networks,
)
from rhot_node.landmarks.runtime import LITERT, RUNTIMES, best_runtime, open_network

FILM = Path(__file__).parents[2].parent / "shared" / "data" / "bare_hand_stereo"
BOARDS = Path(__file__).parents[2].parent / "shared" / "data" / "stereo_chessboard"
PICTURE = gradient()


def networks_for(fake: FakeNetworks, hands: int = 2) -> HandNetworks:
    return HandNetworks(fake.palm, fake.hand, hands)


def errors_px(found: np.ndarray, hand: np.ndarray) -> float:
    return float(np.abs(found - hand).max())


@pytest.mark.parametrize("turn", np.linspace(-math.pi, math.pi, 8))
@pytest.mark.parametrize("size", [12.0, 60.0, 110.0])
def test_a_hand_is_found_where_it_is(turn: float, size: float) -> None:
    fake = FakeNetworks([hand_at((330.0, 250.0), size, turn)])
    networks = networks_for(fake, 1)
    for picture in range(4):
        (found,) = networks.find(PICTURE)
        # half a pixel is MediaPipe's; the rest are the steps of the colours
        assert errors_px(found.landmarks, fake.hands[0]) < 0.8 + 0.01 * size
        along = found.landmarks - found.landmarks[9]
        np.testing.assert_allclose(found.world[:, :2] * np.linalg.norm(along[0]), along * np.linalg.norm(
            found.world[0, :2]), atol=1e-4 * size, err_msg="along the picture's axes")
        np.testing.assert_array_equal(found.world[:, 2], np.arange(21))
        assert (found.presence, found.right) == (pytest.approx(0.99), pytest.approx(0.9))
        if picture:  # the region is about the hand, upright
            assert abs(math.remainder(found.region.turn - turn, 2.0 * math.pi)) < 0.2
            assert np.linalg.norm(found.region.centre - fake.hands[0].mean(axis=0)) < 0.2 * found.region.side
    assert fake.palm_calls == 1


def test_a_large_picture_gives_the_same_hand() -> None:
    fake = FakeNetworks([hand_at((1100.0, 750.0), 350.0, 0.4)], (2000, 1500))
    networks, picture = networks_for(fake), gradient(2000, 1500)
    for _ in range(2):
        (found,) = networks.find(picture)
        assert found.region.side > 4.0 * HAND_PX, "more px than the network takes"
        assert errors_px(found.landmarks, fake.hands[0]) < 4.0  # half a step of the colours


def test_a_hand_is_followed() -> None:
    fake = FakeNetworks([hand_at((150.0, 240.0))])
    networks = networks_for(fake, 1)
    for step in range(20):
        fake.hands = [hand_at((150.0 + 15.0 * step, 240.0 + 2.0 * step), 60.0 + step, 0.1 * step)]
        (found,) = networks.find(PICTURE)
        assert errors_px(found.landmarks, fake.hands[0]) < 1.5
    assert fake.palm_calls == 1


def test_two_hands_keep_their_order_and_sides() -> None:
    fake = FakeNetworks([hand_at((160.0, 250.0)), hand_at((480.0, 250.0), 50.0)])
    fake.right = [0.95, 0.05]
    networks = networks_for(fake)
    order = [round(float(hand.right), 2) for hand in networks.find(PICTURE)]
    assert sorted(order) == [0.05, 0.95]
    for step in range(12):  # past each other, one above the other
        fake.hands = [hand_at((160.0 + 27.0 * step, 190.0), 40.0), hand_at((480.0 - 27.0 * step, 330.0), 40.0)]
        assert [round(float(hand.right), 2) for hand in networks.find(PICTURE)] == order


def test_not_more_hands_than_asked_for() -> None:
    fake = FakeNetworks([hand_at((x, 250.0), 30.0) for x in (100.0, 300.0, 500.0)])
    for most in (1, 2, 3):
        assert len(networks_for(fake, most).find(PICTURE)) == most


@pytest.mark.parametrize("apart", [3.0, 20.0, 55.0])
def test_two_palms_of_one_hand_are_one_hand(apart: float) -> None:
    fake = FakeNetworks([hand_at((330.0, 250.0))])
    fake.ghost = np.array([apart, 0.0])
    networks = networks_for(fake)
    for _ in range(2 * SEARCH_EVERY):
        assert len(networks.find(PICTURE)) == 1


def test_a_further_hand_is_searched_for_now_and_then() -> None:
    fake = FakeNetworks([hand_at((160.0, 250.0))])
    networks = networks_for(fake)
    for _ in range(10 * SEARCH_EVERY):
        networks.find(PICTURE)
    assert 9 <= fake.palm_calls <= 11
    fake.hands.append(hand_at((480.0, 250.0)))
    found = [len(networks.find(PICTURE)) for _ in range(SEARCH_EVERY)]
    assert found[-1] == 2
    calls = fake.palm_calls
    networks.find(PICTURE)
    assert fake.palm_calls == calls, "nobody is missing"


def test_an_empty_scene_is_searched_now_and_then_after_the_first_second() -> None:
    fake = FakeNetworks()
    networks = networks_for(fake)
    for _ in range(REACQUISITION + 20 * SEARCH_EVERY):
        assert networks.find(PICTURE) == ()
    assert REACQUISITION + 19 <= fake.palm_calls <= REACQUISITION + 21
    fake.hands.append(hand_at((330.0, 250.0)))
    assert [len(networks.find(PICTURE)) for _ in range(SEARCH_EVERY)][-1] == 1
    fake.hands.clear()
    calls = fake.palm_calls
    for _ in range(REACQUISITION):
        networks.find(PICTURE)
    assert fake.palm_calls == calls + REACQUISITION, "it was there a moment ago"


@pytest.mark.parametrize("shape", [(480, 640), (640, 480), (500, 500), (100, 1000)])
def test_every_place_of_a_picture_is_searched_in_a_part_of_it(shape: tuple[int, int]) -> None:
    fake, seen = FakeNetworks(), np.zeros(shape, bool)
    networks, sides = HandNetworks(lambda crop: parts.append(crop) or fake.palm(gradient()), fake.hand), []
    parts: list[np.ndarray] = []
    y, x = np.indices(shape)
    for _ in range(10):
        networks.find(np.stack([np.full(shape, 255), x * 255 // shape[1], y * 255 // shape[0]], -1).astype(np.uint8))
    for crop in parts[1::2]:
        inside = crop[..., 2] > 0.99
        places = crop[inside][:, :2] * shape
        low, high = places.min(axis=0), places.max(axis=0)
        seen[int(low[0]):int(high[0]) + 6, int(low[1]):int(high[1]) + 6] = True
        sides.append(max(high - low) / max(shape))
    assert seen.mean() > 0.99 and max(sides) < 0.65


@pytest.mark.parametrize("presence, found", [(0.49, 0), (0.51, 1)])
def test_a_hand_below_one_half_is_none(presence: float, found: int) -> None:
    fake = FakeNetworks([hand_at((330.0, 250.0))])
    networks = networks_for(fake)
    assert len(networks.find(PICTURE)) == 1
    fake.presence = [presence]
    assert len(networks.find(PICTURE)) == found
    fake.presence = [0.9]
    assert len(networks.find(PICTURE)) == 1, "found again at once"


def test_a_hand_that_leaves_is_lost() -> None:
    fake = FakeNetworks([hand_at((600.0, 250.0))])
    networks = networks_for(fake)
    for step in range(30):
        fake.hands = [hand_at((600.0 + 20.0 * step, 250.0))]
        found = networks.find(PICTURE)
    assert found == ()


def test_numbers_that_are_none_are_no_hand() -> None:
    fake = FakeNetworks([hand_at((330.0, 250.0))])
    networks = networks_for(fake)
    networks.find(PICTURE)
    fake.spoilt = True
    assert networks.find(PICTURE) == () and networks.find(PICTURE) == ()
    fake.spoilt = False
    assert len(networks.find(PICTURE)) == 1


def test_after_a_reset_hands_are_searched_for_anew() -> None:
    fake = FakeNetworks([hand_at((330.0, 250.0))])
    networks = networks_for(fake, 1)
    networks.find(PICTURE)
    networks.reset()
    networks.find(PICTURE)
    assert fake.palm_calls == 2


@pytest.mark.parametrize("shape, kind", [((4, 4, 4), np.uint8), ((4, 4), np.float32), ((4,), np.uint8)])
def test_what_is_no_picture_is_refused(shape: tuple[int, ...], kind: type) -> None:
    with pytest.raises(ValueError, match="picture"):
        networks_for(FakeNetworks()).find(np.zeros(shape, kind))


def test_the_next_region_holds_the_hand() -> None:
    hand = hand_at((330.0, 250.0), 60.0, 2.0)
    region = next_region(hand)
    into = region.from_input(100)
    own = (hand - into[:, 2]) @ np.linalg.inv(into[:, :2]).T
    assert own.min() > 0.0 and own.max() < 100.0
    assert own[0, 1] > own[9, 1] and abs(own[0, 0] - own[9, 0]) < 5.0, "upright"


# -- runtimes ----------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("runtime", [*RUNTIMES, "abacus"])
def test_a_network_that_is_none_is_refused(runtime: str) -> None:
    with pytest.raises(KeypointError):
        open_network(b"no network at all" * 100, runtime, 1)


def test_without_networks_the_sentence_says_how_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.setattr("rhot_node.landmarks.install.SERVICE_FOLDER", tmp_path / "none")
    with pytest.raises(KeypointError, match="landmarks install"):
        open_hand_networks()


# -- the real networks -------------------------------------------------------------------------------------------------

@pytest.fixture(params=RUNTIMES)
def runtime(request: pytest.FixtureRequest) -> str:
    if installed_folder() is None:
        pytest.skip("the hand networks are not installed: rhot-node landmarks install")
    if request.param == LITERT and best_runtime() != LITERT:
        pytest.skip("LiteRT is not installed")
    return str(request.param)


def test_opening_the_networks_writes_nothing_to_a_terminal(runtime: str) -> None:
    program = f"from rhot_node.landmarks.networks import open_hand_networks; open_hand_networks(runtime={runtime!r})"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")


@pytest.fixture
def pictures() -> Iterator[np.ndarray]:
    """Those of one camera of a recorded hand."""
    path = FILM / "cam1_first120.mp4"
    if not path.exists():
        pytest.skip(f"{path} is not there")
    video = cv2.VideoCapture(str(path))

    def read() -> Iterator[np.ndarray]:
        while True:
            there, picture = video.read()
            if not there:
                return
            yield picture
    yield read()
    video.release()


def table() -> dict[int, np.ndarray]:
    """Landmarks (21, 2) px by frame, as MediaPipe finds them."""
    with (FILM / "landmarks_c1.csv").open() as file:
        return {int(row["frame"]): np.array([[float(row[f"x{k}"]), float(row[f"y{k}"])] for k in range(21)])
                for row in csv.DictReader(file)}


def test_a_recorded_hand_is_where_mediapipe_finds_it(runtime: str, pictures: Iterator[np.ndarray]) -> None:
    expected, networks = table(), open_hand_networks(runtime=runtime)
    apart = []
    for number, picture in zip(range(24), pictures, strict=False):
        found = networks.find(picture)
        assert len(found) == (number in expected)
        if found:
            apart.append(np.linalg.norm(found[0].landmarks - expected[number], axis=1))
            assert found[0].right > 0.9 and found[0].presence > 0.9
            span = np.linalg.norm(found[0].world[5] - found[0].world[17])
            assert 0.03 < span < 0.1, "the knuckles of a hand of usual size"
    assert np.median(apart) < 1.0


def test_a_hand_is_found_however_the_picture_is_turned(runtime: str, pictures: Iterator[np.ndarray]) -> None:
    picture = next(pictures)
    (upright,) = open_hand_networks(runtime=runtime).find(picture)
    (turned,) = open_hand_networks(runtime=runtime).find(np.ascontiguousarray(picture[::-1, ::-1]))
    assert np.median(np.linalg.norm(719.0 - turned.landmarks - upright.landmarks, axis=1)) < 6.0
    np.testing.assert_allclose(turned.world, upright.world * [-1.0, -1.0, 1.0], atol=0.01)
    (mirrored,) = open_hand_networks(runtime=runtime).find(np.ascontiguousarray(picture[:, ::-1]))
    assert upright.right > 0.9 and mirrored.right < 0.1
    (grey,) = open_hand_networks(runtime=runtime).find(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))
    assert np.median(np.linalg.norm(grey.landmarks - upright.landmarks, axis=1)) < 6.0
    (large,) = open_hand_networks(runtime=runtime).find(cv2.resize(picture, (8000, 8000)))  # of 64 megapixels
    assert np.median(np.linalg.norm(large.landmarks * 0.09 - upright.landmarks, axis=1)) < 6.0


def test_a_right_and_a_left_hand_are_told_apart(runtime: str, pictures: Iterator[np.ndarray]) -> None:
    picture, networks = next(pictures), open_hand_networks(runtime=runtime)
    found = networks.find(np.ascontiguousarray(np.hstack([picture, picture[:, ::-1]])))
    assert len(found) == 2
    right, left = sorted(found, key=lambda hand: hand.landmarks[0, 0])
    assert right.right > 0.9 and left.right < 0.1
    assert np.median(np.linalg.norm(left.landmarks - [1439.0, 0.0] - right.landmarks * [-1.0, 1.0], axis=1)) < 6.0


def test_a_hand_that_fills_the_picture_is_none_or_inside_it(runtime: str, pictures: Iterator[np.ndarray]) -> None:
    expected, networks = table(), open_hand_networks(runtime=runtime)
    for number, picture in zip(range(20), pictures, strict=False):
        if number < 16:
            continue
        x, y = np.clip(expected[number].mean(axis=0) - 40.0, 0, 640).astype(int)
        for side in (80, 60):
            networks.reset()
            assert networks.find(cv2.resize(picture[y:y + side, x:x + side], (720, 720))) == ()


@pytest.mark.parametrize("model", MODELS)
def test_no_hand_is_found_where_there_is_none(runtime: str, model: str) -> None:
    rng = np.random.default_rng(1)
    networks = open_hand_networks(runtime=runtime, model=model)
    boards = [cv2.imread(str(path)) for path in sorted(BOARDS.glob("left0[12]*.jpg"))]  # a person holds them
    blank = [np.full(shape, 128, np.uint8) for shape in ((1, 1, 3), (1, 3000, 3), (0, 0, 3), (480, 640))]
    for picture in (*blank, rng.integers(0, 255, (480, 640, 3), np.uint8), PICTURE, *boards):
        networks.reset()
        assert networks.find(picture) == ()
