"""Pictures of several cameras are put together by the numbers in their names."""

from __future__ import annotations

from pathlib import Path

import pytest

from rhot_app.calibration.lens.views import in_natural_order
from rhot_app.calibration.stereo.reading import match_files
from rhot_app.errors import CalibrationError


def named(*names: str) -> list[Path]:
    return [Path(name) for name in names]


def together(files: dict[str, list[Path]]) -> list[tuple[str | None, ...]]:
    return [tuple(None if path is None else path.name for path in shot.files) for shot in match_files(files).shots]


def test_the_order_in_which_files_are_named_does_not_matter() -> None:
    left, right = named("left10.jpg", "left2.jpg", "left1.jpg"), named("right1.jpg", "right10.jpg", "right2.jpg")
    assert together({"left": left, "right": right}) == [
        ("left1.jpg", "right1.jpg"), ("left2.jpg", "right2.jpg"), ("left10.jpg", "right10.jpg")]


def test_numbers_that_never_change_do_not_tell() -> None:
    assert together({"a": named("cam0_0001.png", "cam0_0002.png"), "b": named("cam1_0001.png", "cam1_0002.png")}) == [
        ("cam0_0001.png", "cam1_0001.png"), ("cam0_0002.png", "cam1_0002.png")]


def test_a_picture_without_partner_is_named_and_left_out() -> None:
    matched = match_files({"left": named("l1.png", "l2.png", "l3.png"), "right": named("r1.png", "r3.png", "r4.png")})
    assert [shot.name for shot in matched.shots] == ["1", "3"]
    assert [(each.name, each.code) for each in matched.alone] == [("l2.png", "no_partner"), ("r4.png", "no_partner")]


def test_three_cameras_need_two_of_them() -> None:
    rows = together({"a": named("a1", "a2", "a3"), "b": named("b1", "b2"), "c": named("c2", "c3")})
    assert rows == [("a1", "b1", None), ("a2", "b2", "c2"), ("a3", None, "c3")]


def test_names_without_common_numbers_are_taken_in_order_if_the_lists_are_as_long() -> None:
    left, right = named("a-1001.png", "a-1002.png"), named("b-2001.png", "b-2002.png")
    matched = match_files({"left": left, "right": right})
    assert not matched.by_number
    assert [shot.files for shot in matched.shots] == list(zip(left, right, strict=True))
    with pytest.raises(CalibrationError, match=r"different lengths \(left 2, right 1\)"):
        match_files({"left": left, "right": right[:1]})


def test_an_empty_list_is_named() -> None:
    with pytest.raises(CalibrationError, match="right: there are no pictures"):
        match_files({"left": named("l1.png"), "right": []})


def test_natural_order() -> None:
    assert [path.name for path in in_natural_order(named("p10", "p9", "p1"))] == ["p1", "p9", "p10"]
