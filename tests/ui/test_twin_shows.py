"""What the simulated hand does is chosen from the Rig menu, and from every wizard."""

from __future__ import annotations

from pathlib import Path

import pytest

from rhot_app.calibration.registry import calibration
from rhot_app.errors import SimulatorError
from rhot_app.ui.backend.session import key_of, show_named
from rhot_app.ui.simulated_rig_menus import TITLE


def ticked(bench):
    return [key for key, action in bench.window.twin_shows.actions.items() if action.isChecked()]


def test_a_click_has_the_simulated_hand_do_something_else(tracking):
    menu = tracking.window.actions_.shows
    assert menu.menuAction().isVisible() and menu in [
        entry.menu() for entry in tracking.window.menus.rig.actions()]
    menu.aboutToShow.emit()
    tracking.until(lambda: ticked(tracking) == ["hand:grasp"])
    waves = next(entry for entry in menu.actions() if entry.text() == "Waves")
    waves.trigger()
    tracking.until(lambda: tracking.backend.shown == "hand:wave" and ticked(tracking) == ["hand:wave"])
    one_marker = next(entry.menu() for entry in menu.actions() if entry.text() == "Shows one marker at")
    next(entry for entry in one_marker.actions() if entry.text() == "40 cm").trigger()
    tracking.until(lambda: tracking.backend.shown == "marker:0.4" and ticked(tracking) == ["marker:0.4"])


def test_what_is_refused_is_told(tracking):
    tracking.backend.refuse = "the simulated rig gave no answer in 180 s."
    tracking.window.twin_shows.actions["board"].trigger()
    tracking.until(lambda: tracking.said("no answer in 180 s"))
    assert ticked(tracking) == []


def test_a_wizard_offers_it_too(tracking):
    wizards = tracking.window.wizards
    wizards.open(calibration("depth"))
    tracking.until(lambda: wizards.wizard is not None and wizards.wizard.frame.twin_button.isVisible())
    menu = wizards.wizard.frame.twin_button.menu()
    assert menu.title() == TITLE
    next(entry for entry in menu.actions() if entry.text() == "Shows a ruler").trigger()
    tracking.until(lambda: tracking.backend.shown == "ruler")
    wizards.wizard.reject()
    tracking.until(lambda: wizards.wizard is None)


def test_a_real_rig_has_no_such_menu(tracking, tmp_path: Path):
    bench = tracking
    bench.close_rig()
    assert not bench.window.actions_.shows.menuAction().isVisible()
    bench.window.open_rig(tmp_path / "two_pis.json")
    bench.until(lambda: bench.controller.rig is not None)
    assert not bench.window.actions_.shows.menuAction().isVisible()
    bench.window.wizards.open(calibration("depth"))
    bench.until(lambda: bench.window.wizards.wizard is not None)
    assert not bench.window.wizards.wizard.frame.twin_button.isVisible()
    bench.window.wizards.wizard.reject()
    bench.until(lambda: bench.window.wizards.wizard is None)
    bench.close_rig()


def test_every_choice_is_something_that_the_twin_can_show(tracking):
    for key in tracking.window.twin_shows.actions:
        assert key_of(show_named(key)) == key
    with pytest.raises(SimulatorError):
        show_named("elephant")
