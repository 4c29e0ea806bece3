"""Every picture of the guide is taken by a test, so that one command renews it."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "docs" / "screenshots"
TESTS: dict[str, list[str]] = runpy.run_path(str(FOLDER / "update.py"))["tests_by_picture"]()


@pytest.mark.parametrize("picture", sorted(path.stem for path in FOLDER.glob("*.png")))
def test_a_test_takes_it(picture: str) -> None:
    assert TESTS.get(picture), "docs/screenshots/update.py finds no test that takes this picture"


def test_no_picture_has_no_test() -> None:
    assert "no such picture" not in TESTS and TESTS["settings"] == ["tests/ui/test_settings_dialog.py::test_pictures"]
