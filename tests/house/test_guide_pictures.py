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


def test_tests_are_found_by_what_they_save() -> None:
    assert TESTS["settings"] == ["tests/ui/test_settings_dialog.py::test_pictures"]
