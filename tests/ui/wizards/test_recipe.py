"""The recipe in `rhot_app.ui.wizards` is true: a toy calibration made by it is opened, clicked through and used."""

from __future__ import annotations

import pkgutil
import re
import sys

import pytest
import toy
import toy_calibration
from PySide6.QtCore import Qt
from wizard_hands import Hands
from wizard_rig import RigBackend

from rhot_app import rig_history
from rhot_app.project import load_rig
from rhot_app.ui import actions, main_window, wizards
from rhot_app.ui.wizards import launcher
from rhot_app.ui.wizards.framework import definition
from rhot_app.ui.wizards.framework.definition import WIZARDS, Wizard

ROW = Wizard(*toy_calibration.TOY)


@pytest.fixture
def bench(make_bench, tmp_path, monkeypatch):
    """The main window with the toy's row at the end of the menu."""
    monkeypatch.setitem(sys.modules, "rhot_app.ui.wizards.toy", toy)
    for module in (actions, main_window, launcher, definition):
        monkeypatch.setattr(module, "WIZARDS", (*WIZARDS, ROW))
    bench = make_bench(RigBackend(tmp_path / "desk.json"))
    bench.track()
    return bench


def test_a_step_is_tested_without_a_window():
    step = toy.GreyStep()
    step.accept_observation(80.0)
    assert [step.capture() for _ in range(3)] == [True] * 3
    assert step.view().done and toy_calibration.mean_level(step.levels, progress=lambda text, fraction: None) == 80.0


def test_a_calibration_by_the_recipe_is_in_the_menu_and_works(bench):
    window = bench.window
    action = window.actions_.wizards[-1]
    window.menus.calibrate.aboutToShow.emit()
    assert action.text() == "Toy …\tnot yet"
    action.trigger()
    bench.until(lambda: window.wizards.wizard is not None)
    hands = Hands(window.wizards.wizard)
    hands.until(lambda: hands.window.step.now is not None)
    for _ in range(toy.ENOUGH):
        hands.key(Qt.Key.Key_Space)
    hands.next()
    level = hands.solved()
    hands.next()
    table = hands.window.page.table
    assert [table.item(0, column).text() for column in (0, 2)] == ["grey level", f"{level:.0f}"], "the report's figure"
    hands.use()
    hands.next()
    bench.until(lambda: window.wizards.wizard is None)
    window.menus.calibrate.aboutToShow.emit()
    assert action.text() == "Toy …\ttoday"
    assert load_rig(bench.backend.path).name == f"grey {level:.0f}"
    assert [one.replaced_by for one in rig_history.versions(bench.backend.path)] == [toy_calibration.TOY.reason]


def test_what_the_wizard_shows_is_what_a_command_would_print():
    said = toy_calibration.report(80.0)
    assert said.lines() == ["grey level  80"] and said.to_json()["level"] == 80.0
    assert said.to_json()["verdict"] == "Good: grey level 80"


def test_every_module_and_class_of_the_recipe_is_there():
    names = re.findall(r"(?<!`)`((?:rhot_app|models|framework)\.[\w.]+)`", wizards.__doc__)
    assert len(names) > 8
    for name in names:
        pkgutil.resolve_name(name if name.startswith("rhot_app") else f"rhot_app.ui.wizards.{name}")
