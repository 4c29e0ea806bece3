"""The keypoint detector with networks that the test writes: what it finds, takes for nothing, and refuses."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest
from tiny_network import POINTS, SIDE, linear_network, place, spread_points

from rhot_node.config import NodeSettings
from rhot_node.detect.image import YuvImage, from_bgr
from rhot_node.detectors import DetectorChoice
from rhot_node.errors import KeypointError
from rhot_node.files import resource_path
from rhot_node.keypoints import KeypointDetector
from rhot_node.markers import load_markers

MARKERS = load_markers(resource_path("markers", "landmarks21.json"))
WIDTH, HEIGHT = 320, 240


def painted(blue: int, green: int, red: int) -> YuvImage:
    return from_bgr(np.full((HEIGHT, WIDTH, 3), (blue, green, red), np.uint8))


def test_points_of_the_input_are_points_of_the_image(tmp_path: Path) -> None:
    detector = KeypointDetector(place(tmp_path), MARKERS)
    found = detector.detect(painted(0, 0, 255))
    pixels = np.array([(one.x, one.y) for one in found])
    # the whole image is a square of its longer side, about its centre
    expected = (spread_points()[:, :2] - 0.5 * (SIDE - 1)) * WIDTH / SIDE + 0.5 * np.array([WIDTH - 1, HEIGHT - 1])
    inside = (expected[:, 1] >= -0.5) & (expected[:, 1] <= HEIGHT - 0.5)
    assert inside.sum() > 15
    np.testing.assert_allclose(pixels[inside], expected[inside], atol=1e-3)
    assert np.isnan(pixels[~inside]).all()
    assert all(one.quality > 0.9 for one, shown in zip(found, inside, strict=True) if shown)
    assert found[0].cov_xx == pytest.approx((0.01 * WIDTH) ** 2, rel=1e-3)


@pytest.mark.parametrize("image", [(255, 0, 0), (0, 0, 0), (255, 255, 255), (128, 128, 128)])
def test_an_improbable_object_is_none(tmp_path: Path, image: tuple[int, int, int]) -> None:
    """Another object, darkness, a burnt image: the network's points are there, but not likely."""
    detector = KeypointDetector(place(tmp_path), MARKERS)
    assert not any(one.found for one in detector.detect(painted(*image)))


def test_points_that_a_second_look_does_not_confirm_are_none(tmp_path: Path) -> None:
    """The network's points go with what is in the region: half of the image is dark, and the next region sees less."""
    weights = np.zeros((POINTS, 3, 3))
    weights[:, 0, :] = SIDE * np.linspace(-1.0, 1.0, POINTS)[:, None]
    network = linear_network(weights.reshape(-1, 3), spread_points().ravel(), (np.zeros(3), 10.0))
    detector = KeypointDetector(place(tmp_path, network=network), MARKERS)
    bgr = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    bgr[:, WIDTH // 3:WIDTH // 2] = 255
    assert not any(one.found for one in detector.detect(from_bgr(bgr)))


def test_the_region_follows_the_points(tmp_path: Path) -> None:
    """Points beside the middle of the input draw the region along, frame after frame, until it leaves the image."""
    shifted = spread_points() + np.array([3.0, 0.0, 0.0])
    network = linear_network(np.zeros((3 * POINTS, 3)), shifted.ravel(), (np.zeros(3), 10.0))
    detector = KeypointDetector(place(tmp_path, network=network, points__sigma="0.2"), MARKERS)
    middles = [np.nanmean([one.x for one in detector.detect(painted(0, 0, 255))]) for _ in range(3)]
    assert middles[0] < middles[1] < middles[2]
    detector.reset()
    assert np.nanmean([one.x for one in detector.detect(painted(0, 0, 255))]) == pytest.approx(middles[0])


def test_an_upright_region_turns_with_the_points(tmp_path: Path) -> None:
    """Points whose upright stands to the right in the input: a quarter turn with every look, so the second look is
    turned by a quarter against the first."""
    points = spread_points()
    points[0, :2], points[1, :2] = (20.0, 24.0), (30.0, 24.0)
    network = linear_network(np.zeros((3 * POINTS, 3)), points.ravel(), (np.zeros(3), 10.0))
    card = place(tmp_path, network=network, points__sigma="1.0", points__upright="[0, 1]")
    detector = KeypointDetector(card, MARKERS)
    directions = []
    for _ in range(2):
        found = detector.detect(painted(0, 0, 255))
        directions.append(np.arctan2(found[1].y - found[0].y, found[1].x - found[0].x))
    assert np.cos(directions[1] - directions[0]) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("changes", "says"), [
    ({"network__file": '"other.onnx"'}, "other.onnx: the network of tiny.toml cannot be read"),
    ({"network__sha256": f'"{"0" * 64}"'}, "is not the network that tiny.toml describes. Its SHA-256 is"),
    ({"points__count": "20"}, "has 21 landmarks, but the network of tiny.toml finds 20 points"),
    ({"points__numbers": "2"}, "gives 63 numbers; tiny.toml expects 21 points of 2"),
    ({"points__output": '"places"'}, "has no output 'places'; it has points, score"),
    ({"points__output": ""}, "has several outputs, and the card names none"),
    ({"network__layout": '"nhwc"'}, "does not take an image of 48 x 48 px in the layout nhwc"),
    ({"network__input_px": "[0, 48]"}, "tiny.toml: not a model card"),
    ({"licence": ""}, "missing required field `licence`"),
    ({"points__score_output": '"points"'}, "its score 'points' has 63 numbers, not one"),
])
def test_what_does_not_belong_together_is_refused_with_a_sentence(tmp_path: Path, changes: dict[str, str],
                                                                  says: str) -> None:
    with pytest.raises(KeypointError) as refused:
        KeypointDetector(place(tmp_path, **changes), MARKERS)
    assert says in str(refused.value)


@pytest.mark.parametrize("data", [b"", b"no network", b"\x08\x07" * 50])
def test_a_broken_network_is_refused(tmp_path: Path, data: bytes) -> None:
    with pytest.raises(KeypointError, match=r"tiny\.onnx: "):
        KeypointDetector(place(tmp_path, network=data), MARKERS)


def test_the_node_finds_the_card_by_its_name_and_says_what_is_wrong(tmp_path: Path,
                                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    settings = NodeSettings(node_id=1, name="left", markers=MARKERS, detector="keypoints:tiny")

    def otherwise(_: NodeSettings) -> KeypointDetector:
        raise AssertionError("the fast detector finds no landmarks")

    choice = DetectorChoice(otherwise)
    lost = choice.make(settings).detect(painted(0, 0, 255))
    assert len(lost) == POINTS and not any(one.found for one in lost)
    (trouble,) = choice.troubles()
    assert "there is no model card" in trouble.text and trouble.text.endswith("All markers are lost.")
    place(tmp_path / "rhot" / "keypoints")
    assert any(one.found for one in choice.make(settings).detect(painted(0, 0, 255)))
    assert choice.troubles() == []
    choice.make(msgspec.structs.replace(settings, detector="fast"))
    assert "finds no landmarks" in choice.troubles()[0].text
