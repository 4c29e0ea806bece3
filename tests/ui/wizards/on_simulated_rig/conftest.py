"""The simulated rig for the wizards' tests: real nodes, a real engine, and a stage on which anything can be shown."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from PySide6.QtWidgets import QWidget
from wizard_hands import Hands
from wizard_rig import FakeMemory

from rhot_app.engine.process import started_processes
from rhot_app.project import Rig, load_rig, save_rig
from rhot_app.simulator.nodes.remote import TwinRemote
from rhot_app.ui.backend.contract import TwinChoice
from rhot_app.ui.backend.session import Session
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards.framework.plan import WIZARDS
from rhot_app.ui.wizards.launcher import Launcher


class SimulatedRig:
    """Processes, the rig as they were started with, and a hand on the twin's stage."""

    def __init__(self, directory: Path) -> None:
        self.session = Session(directory)
        try:
            opened = self.session.open_twin(TwinChoice("still"), lambda text, fraction: None)
        except BaseException:
            self.session.close()
            raise
        self.truth = opened.rig
        self.path = Path(opened.rig_path)
        self.stage = TwinRemote(directory)

    def use(self, rig: Rig) -> None:
        """Have engine and file go by another rig, as a beginner's would be."""
        save_rig(self.path, rig)
        asker = self.session.asker()
        asker.command("set_rig", timeout_s=60.0, document=msgspec.to_builtins(rig))
        asker.close()

    @property
    def saved(self) -> Rig:
        """What the rig file says."""
        return load_rig(self.path)

    def close(self) -> None:
        """End everything."""
        self.stage.close()
        self.session.close()
        assert started_processes(self.session._place) == []


@pytest.fixture(scope="module")
def simulated_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimulatedRig]:
    """One for all tests of a module: it takes seconds to start, and while it runs it takes half a processor."""
    rig = SimulatedRig(tmp_path_factory.mktemp("rig"))
    yield rig
    rig.close()


@pytest.fixture
def open_on_rig(themed: Any, simulated_rig: SimulatedRig) -> Iterator[Any]:
    """Opens a wizard by its module's name on the simulated rig, as the Calibrate menu does; returns hands on it."""
    window = QWidget()
    session = simulated_rig.session
    launcher = Launcher(session.asker, session.client, lambda: DARK, FakeMemory(), window)

    def open_(module: str) -> Hands:
        failures: list[str] = []
        launcher.failed.connect(failures.append)
        launcher.open(next(wizard for wizard in WIZARDS if wizard.module == module))
        Hands.wait(lambda: launcher.wizard is not None or failures, 30.0)
        assert launcher.wizard is not None, failures
        return Hands(launcher.wizard)

    yield open_
    launcher.close()
    simulated_rig.use(simulated_rig.truth)
    window.deleteLater()
