"""The records of calibrations: what is written into a rig's history leads back to one of them, and so do findings."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

from rhot_app.calibration.registry import CALIBRATIONS, COMMANDS, Calibration

ROOT = Path(__file__).parents[2]


def test_no_two_are_taken_for_each_other() -> None:
    for column in ("name", "title", "meaning"):
        assert len({getattr(one, column) for one in CALIBRATIONS}) == len(CALIBRATIONS)
    words = [word for command in COMMANDS for word in (command.word, *command.aliases)]
    assert len(set(words)) == len(words)
    for one in CALIBRATIONS:  # a history tells by the beginning of a reason what was done
        assert [other.name for other in CALIBRATIONS if one.reason.startswith(other.reason)] == [one.name]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.word)
def test_every_command_is_there(command) -> None:
    module = importlib.import_module(command.imported)
    assert callable(module.add_arguments) and callable(module.run)


@pytest.mark.parametrize("one", CALIBRATIONS, ids=lambda one: one.name)
def test_every_wizard_is_there_and_nobody_writes_its_reason_again(one: Calibration) -> None:
    assert (ROOT / "rhot_app" / "ui" / "wizards" / f"{one.name}.py").exists()
    again = [path.name for room in ("ui/wizards", "calibration/commands") for path in
             (ROOT / "rhot_app" / room).rglob("*.py") if re.search(rf'accept\([^)]*"{one.reason}', path.read_text())]
    assert not again
