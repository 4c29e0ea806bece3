"""Why a marker is not found: the test of the detector that refuses it, said with its figures and the place."""

from __future__ import annotations

import numpy as np
import pytest
from colour_scenes import PAINTS, RADIUS, SKIN, picture, place
from marker_rendering import Canvas, Rgb, disc

from rhot_app.calibration.colour.cause import Cause, Explainer
from rhot_app.calibration.colour.paint_region import PaintRegion
from rhot_node.detect.colour import learn_chroma_from_pixels
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage
from rhot_node.markers import ChromaModel, Marker, MarkerSet

GREY: Rgb = (60, 62, 66)


def scene(*discs: tuple[float, float, float, Rgb], background: Rgb = GREY) -> YuvImage:
    """Discs of (x, y, radius, colour) before grey, 320 x 240 px."""
    canvas = Canvas(320, 240, background)
    for x, y, radius, rgb in discs:
        canvas.paint(disc(x, y, radius), rgb, (x, y), radius + 3)
    return canvas.expose(np.random.default_rng(1))


def region(x: float, y: float, radius: float) -> PaintRegion:
    """The paint of a disc."""
    row, column = np.mgrid[:120, :160]
    away = np.hypot(2 * column + 0.5 - x, 2 * row + 0.5 - y)
    return PaintRegion(away <= max(radius - 2.0, 1.5), away <= radius + 5.0)


def learnt(rgb: Rgb) -> ChromaModel:
    return learn_chroma_from_pixels(scene((100.0, 100.0, 20.0, rgb)), region(100.0, 100.0, 20.0).sample)


def markers(**colours: Rgb | ChromaModel) -> MarkerSet:
    return MarkerSet(markers=tuple(
        Marker(id=name, chroma=learnt(one) if isinstance(one, tuple) else one, display_rgb=(128, 128, 128))
        for name, one in colours.items()))


def why(markers: MarkerSet, image: YuvImage, **paint: PaintRegion) -> Cause:
    """Why the first marker is not found in a picture that was never seen before."""
    detector = FastDetector(markers)
    return Explainer(markers).why_lost(detector, image, detector.detect(image), 0, paint or None)


CYAN, BLUE, RED = PAINTS["ring"], PAINTS["little"], PAINTS["wrist"]
PALE: Rgb = (112, 132, 140)
AT = (100.0, 100.0)


def changed(**fields: float) -> ChromaModel:
    model = learnt(CYAN)
    return ChromaModel(**{**{name: getattr(model, name) for name in model.__struct_fields__}, **fields})


@pytest.mark.parametrize(("chroma", "rgb", "code", "said"), [
    (learnt(CYAN), PALE, "pale", "too pale or too dark: chroma up to"),
    (learnt(CYAN), RED, "hue", "has another hue, 10"),
    (changed(luma_max=100), CYAN, "bright", "too bright: luma 1"),
    (changed(luma_min=200), CYAN, "dark", "too dark: luma 1"),
], ids=["pale", "hue", "bright", "dark"])
def test_the_bound_of_the_colour_that_refuses_the_paint_is_named_with_both_figures(
        chroma: ChromaModel, rgb: Rgb, code: str, said: str) -> None:
    cause = why(markers(ring=chroma), scene((*AT, 9.0, rgb)), ring=region(*AT, 9.0))
    assert cause.code == code and said in cause.sentence and cause.remedy
    limit = {"pale": f"from {chroma.magnitude_min:.0f} on", "hue": f"± {chroma.hue_tolerance_deg:.0f}°",
             "bright": "at most 100", "dark": "at least 200"}[code]
    assert limit in cause.sentence


def test_paint_that_another_marker_takes_is_said_to_be_taken_for_that_one() -> None:
    near = changed(hue_tolerance_deg=60.0)
    cause = why(markers(ring=near, little=BLUE), scene((*AT, 9.0, BLUE)), ring=region(*AT, 9.0))
    assert cause.code == "other" and "taken for little" in cause.sentence


def test_a_marker_that_is_too_small_is_said_so_in_px() -> None:
    cause = why(markers(ring=CYAN), scene((*AT, 2.2, CYAN)), ring=region(*AT, 2.2))
    assert cause.code == "small" and "px², 24 px² are needed" in cause.sentence


def test_a_thing_that_is_too_large_is_said_so_with_its_share_of_the_picture() -> None:
    cause = why(markers(ring=CYAN), scene((160.0, 120.0, 70.0, CYAN)))
    assert cause.code == "large" and "20 % of the picture, less than 12 % is taken" in cause.sentence


def test_a_marker_of_which_the_border_leaves_too_little_is_said_to_be_cut() -> None:
    cause = why(markers(ring=CYAN), scene((100.0, 240.5, 3.5, CYAN)), ring=region(100.0, 240.5, 3.5))
    assert cause.code == "border" and "picture's border" in cause.sentence


def test_a_marker_that_runs_together_with_another_is_said_so_with_the_others_name_and_both_sizes() -> None:
    image = scene((*AT, 9.0, CYAN), (114.0, 100.0, 9.0, CYAN), (126.0, 100.0, 9.0, CYAN))
    cause = why(markers(ring=CYAN, little=BLUE), image, ring=region(*AT, 9.0), little=region(126.0, 100.0, 9.0))
    assert cause.code == "joined" and "in one piece with little" in cause.sentence
    assert cause.sentence.count("px²") == 2


def test_a_seam_between_two_colours_is_not_called_too_small() -> None:
    canvas = Canvas(320, 240, GREY)
    for row in range(40, 200):
        canvas.rgb[row, 100:103] = CYAN  # no pixel of chroma is all paint
    cause = why(markers(ring=CYAN), canvas.expose(np.random.default_rng(1)))
    assert cause.code == "thin" and "seam between two other colours" in cause.sentence


def test_a_likelier_thing_is_named_with_its_place_and_both_sizes() -> None:
    others = [(40.0 + 60.0 * k, 40.0, 20.0, CYAN) for k in range(4)]
    image, ring = scene((*AT, 5.0, CYAN), *others), markers(ring=CYAN)
    cause = why(ring, image, ring=region(*AT, 5.0))
    assert cause.code == "crowded" and "4 other objects of its colour are likelier, the first at" in cause.sentence
    detector = FastDetector(ring)
    seen = detector.detect(scene((*AT, 5.0, CYAN), (220.0, 40.0, 20.0, CYAN)))
    second = Explainer.why_second(seen, 0)
    assert second.code == "rival" and "at 220, 40" in second.sentence


def test_a_marker_behind_something_larger_that_the_search_took_is_said_with_where_that_is() -> None:
    image, ring = scene((*AT, 5.0, CYAN), (220.0, 40.0, 20.0, CYAN)), markers(ring=CYAN)
    detector = FastDetector(ring)
    first, *_ = detector.detect(image)
    cause = Explainer(ring).why_lost(detector, image, (first,), 0, {"ring": region(*AT, 5.0)})
    assert cause.code == "rival" and "at 220, 40 is larger" in cause.sentence


@pytest.mark.parametrize(("background", "code"), [(GREY, "hue"), ((112, 134, 143), "pale")])
def test_without_knowing_where_the_marker_is_the_picture_says_what_comes_nearest(background: Rgb, code: str) -> None:
    cause = why(markers(ring=CYAN), scene(background=background))
    assert cause.code == code, cause
    assert ("Nothing in the picture has its hue" in cause.sentence) == (code == "hue")


def test_a_marker_found_in_doubt_says_what_makes_it_doubtful() -> None:
    ring = markers(ring=CYAN)

    def doubt(image: YuvImage) -> Cause | None:
        return Explainer.doubt(FastDetector(ring).detect(image), 0)

    assert doubt(scene((*AT, 9.0, CYAN))) is None
    edge = doubt(scene((100.0, 236.0, 9.0, CYAN)))
    assert edge is not None and edge.code == "border"
    two = doubt(scene((*AT, 9.0, CYAN), (220.0, 40.0, 8.0, CYAN)))
    assert two is not None and two.code == "rival" and "at 220, 40" in two.sentence


def test_bare_skin_where_the_paint_should_be_is_said_to_have_another_hue() -> None:
    image = picture({**PAINTS, "ring": SKIN})
    ring = region(*place("ring"), RADIUS)
    cause = why(markers(ring=CYAN), image, ring=ring)
    assert cause.code == "hue" and "another hue, 12" in cause.sentence
