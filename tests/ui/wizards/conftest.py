"""Wizards' windows on a rig without processes; all are closed in the end, and every client with them."""

from __future__ import annotations

from pathlib import Path

import pytest
from fake_backend import InProcessSolver
from fake_engine import synthetic_rig
from patience import PATIENCE_S
from wizard_hands import Hands
from wizard_rig import FakeSettingsStore

from rhot_app.calibration import kinds
from rhot_app.calibration.registry import Calibration, InForce, calibrations, find_calibration
from rhot_app.project import save_rig
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards.framework.definition import WizardContext
from rhot_app.ui.wizards.framework.window import WizardWindow
from rhot_app.ui.wizards.launcher import make_wizard


def wizards(folder):
    """Yields what opens the wizard of that name in a window, on the rig of a client and a file of it."""
    opened = []

    def open_(name, client, *, make=make_wizard, listen=None, make_solver=InProcessSolver, in_file=True):
        path = folder / "desk.json" if in_file else None
        if path is not None:
            save_rig(path, client.rig)
        context = WizardContext(find_calibration(name) or Calibration(name, name, "", name),
                                InForce(client.rig, path, client.told), client.connect, DARK, FakeSettingsStore(),
                                listen, make_solver)
        hands = Hands(WizardWindow(make(context), context))
        hands.path, hands.client, hands.rig, hands.memory = path, client, client.rig, context.memory
        opened.append(hands)
        return hands

    yield open_
    for hands in opened:
        assert hands.window.end().wait(PATIENCE_S)
        hands.until(lambda client=hands.client: client.connected == client.closed)
        hands.window.deleteLater()


@pytest.fixture
def open_wizard(themed, tmp_path):
    """Opens windows of one test."""
    yield from wizards(tmp_path)


@pytest.fixture(scope="module")
def open_shared(themed, tmp_path_factory):
    """Opens windows that all tests of a module share."""
    yield from wizards(tmp_path_factory.mktemp("wizard"))


@pytest.fixture
def new_kinds(monkeypatch):
    """The calibrations of new_kinds stand beside the app's own."""
    monkeypatch.setattr(kinds, "__path__", [*kinds.__path__, str(Path(__file__).parent / "new_kinds")])
    calibrations.cache_clear()
    yield
    calibrations.cache_clear()


@pytest.fixture
def wizard_rig_file(tmp_path):
    """A rig's file."""
    save_rig(tmp_path / "desk.json", synthetic_rig())
    return tmp_path / "desk.json"
