"""A calibration is one file: a toy by the recipe in `rhot_app.ui.wizards` is in menu, command, history and health."""

from __future__ import annotations

import json
import math
import pkgutil
import re

import pytest
from PySide6.QtCore import Qt
from wizard_hands import Hands
from wizard_rig import RigBackend

from rhot_app import rig_history
from rhot_app.__main__ import main
from rhot_app.calibration.check.health import HealthFigures, MarkerQuality, findings_of
from rhot_app.calibration.registry import calibration
from rhot_app.project import load_rig
from rhot_app.ui import wizards

FIGURES = HealthFigures((math.nan,) * 3, "", (), (), (MarkerQuality("left", "index", 0.05, 0.0),))


@pytest.fixture(autouse=True)
def toy(new_kinds):
    """Its record."""
    return calibration("toy")


def test_it_is_in_the_menu_and_its_wizard_works(toy, make_bench, tmp_path):
    bench = make_bench(RigBackend(tmp_path / "desk.json"))
    bench.track()
    window = bench.window
    action = window.actions_.wizards[-1]
    window.menus.calibrate.aboutToShow.emit()
    assert action.text() == "Toy …\tnot yet"
    action.trigger()
    bench.until(lambda: window.wizards.wizard is not None)
    hands = Hands(window.wizards.wizard)
    assert hands.window.windowTitle() == "Toy"
    for _ in range(3):
        hands.until(lambda: hands.window.step._newest is not None)
        hands.key(Qt.Key.Key_Space)
    hands.next()
    level = hands.solved()
    hands.next()
    table = hands.window.page.table
    assert [table.text(0, column) for column in (0, 2)] == ["grey level", f"{level:.0f}"], "the report's figure"
    hands.use()
    hands.next()
    bench.until(lambda: window.wizards.wizard is None)
    window.menus.calibrate.aboutToShow.emit()
    assert action.text() == "Toy …\ttoday"
    assert load_rig(bench.backend.path).name == f"grey {level:.0f}"
    assert [one.replaced_by for one in rig_history.versions(bench.backend.path)] == [toy.reason]


def test_it_is_a_command(toy, wizard_rig_file, capsys):
    arguments = ["calibrate", "toy", "--level", "70", "90", "--rig", str(wizard_rig_file)]
    assert main([*arguments, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["level"] == 80.0 and said["verdict"] == "Good: grey level 80" and said["written"] is None
    assert main([*arguments, "--out", str(wizard_rig_file)]) == 0
    assert "grey level  80" in capsys.readouterr().out
    assert load_rig(wizard_rig_file).name == "grey 80"
    assert [one.replaced_by for one in rig_history.versions(wizard_rig_file)] == [toy.reason]
    assert main(["calibrate"]) == 2
    assert "how bright pictures are" in capsys.readouterr().err


def test_health_names_it_as_the_calibration_that_mends(toy):
    assert [(one.mender, one.finding.code) for one in findings_of(FIGURES) if one.mender == toy.name] == [
        ("toy", "dark")]


def test_every_module_and_class_that_the_recipe_names_is_there():
    names = re.findall(r"(?<!`)`((?:rhot_app|models|framework)\.[\w.]+)`", wizards.__doc__)
    assert len(names) > 8
    for name in names:
        pkgutil.resolve_name(name if name.startswith("rhot_app") else f"rhot_app.ui.wizards.{name}")
