"""The records of calibrations: what is written into a rig's history leads back to one of them, and so do findings."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from rhot_app.calibration.registry import ORDER, Calibration, calibrations

ROOT = Path(__file__).parents[2]


def test_no_two_are_taken_for_each_other() -> None:
    for column in ("name", "title", "meaning"):
        assert len({getattr(one, column) for one in calibrations()}) == len(calibrations())
    words = [word for one in calibrations() if one.command for word in (one.command.word, *one.command.aliases)]
    assert len(set(words)) == len(words)
    for one in calibrations():  # a history tells by the beginning of a reason what was done
        assert [other.name for other in calibrations() if one.reason.startswith(other.reason)] == [one.name]


@pytest.mark.parametrize("one", calibrations(), ids=lambda one: one.name)
def test_each_has_a_wizard_and_nobody_writes_its_reason_again(one: Calibration) -> None:
    wizard = ROOT / "rhot_app" / "ui" / "wizards" / one.name
    assert one.collect or wizard.with_suffix(".py").exists() or (wizard / "__init__.py").exists()
    again = [path.name for room in ("ui/wizards", "calibration") for path in (ROOT / "rhot_app" / room).rglob("*.py")
             if re.search(rf'accept\([^)]*"{one.reason}', path.read_text())]
    assert not again


def test_each_has_its_place_in_the_menu() -> None:
    assert tuple(one.name for one in calibrations()) == ORDER


def test_menus_and_help_wait_for_nothing_that_computes() -> None:
    code = "import sys; from rhot_app.calibration.registry import calibrations; calibrations(); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"cv2", "numba", "scipy"} & set(loaded)
