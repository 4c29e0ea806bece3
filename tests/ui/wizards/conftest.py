"""Wizards' windows on a rig without processes; all are closed in the end, and every client with them."""

from __future__ import annotations

import pytest
from fake_backend import InProcessSolver
from patience import PATIENCE_S
from wizard_hands import Hands
from wizard_rig import FakeSettingsStore

from rhot_app.project import save_rig
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards.framework.definition import WizardContext
from rhot_app.ui.wizards.framework.window import WizardWindow


def wizards(folder):
    """Yields what opens ``make_wizard(context)`` in a window, on the rig of an asker and a file of it."""
    opened = []

    def open_(make_wizard, asker, *, listen=None, make_solver=InProcessSolver, in_file=True):
        path = folder / "desk.json" if in_file else None
        if path is not None:
            save_rig(path, asker.rig)
        context = WizardContext(asker.rig, path, asker.connect, DARK, FakeSettingsStore(), asker.told, listen,
                                make_solver)
        hands = Hands(WizardWindow(make_wizard(context), context))
        hands.path, hands.asker, hands.rig, hands.memory = path, asker, asker.rig, context.memory
        opened.append(hands)
        return hands

    yield open_
    for hands in opened:
        assert hands.window.end().wait(PATIENCE_S)
        hands.until(lambda asker=hands.asker: asker.connected == asker.closed)
        hands.window.deleteLater()


@pytest.fixture
def open_wizard(themed, tmp_path):
    """Opens windows of one test."""
    yield from wizards(tmp_path)


@pytest.fixture(scope="module")
def open_shared(themed, tmp_path_factory):
    """Opens windows that all tests of a module share."""
    yield from wizards(tmp_path_factory.mktemp("wizard"))
