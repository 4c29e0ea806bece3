"""The simulated rig for the wizards' tests: real nodes, a real engine, and a digital twin that shows any scene."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from PySide6.QtWidgets import QWidget
from wizard_hands import Hands, opened
from wizard_rig import FakeSettingsStore

from rhot_app.calibration.registry import calibration
from rhot_app.project import Rig, load_rig, save_rig
from rhot_app.simulator.nodes.remote import TwinRemote
from rhot_app.ui.backend.contract import TwinChoice
from rhot_app.ui.backend.session import Session
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards.launcher import Launcher


class SimulatedRig:
    """Engine and nodes, the rig they were started with, and the twin that renders what the nodes see."""

    def __init__(self, directory: Path) -> None:
        self.session = Session(directory)
        try:
            opened = self.session.open_twin(TwinChoice("still"), lambda text, fraction: None)
        except BaseException:
            self.session.close()
            raise
        self.truth = opened.rig
        self.path = Path(opened.rig_path)
        self.twin = TwinRemote(directory)

    def use(self, rig: Rig) -> None:
        """Replace the rig of the engine and of the file, for example by an uncalibrated one."""
        save_rig(self.path, rig)
        client = self.session.command_client()
        client.command("set_rig", timeout_s=60.0, document=msgspec.to_builtins(rig))
        client.close()

    @property
    def saved(self) -> Rig:
        """The rig in the file."""
        return load_rig(self.path)

    def close(self) -> None:
        """End everything."""
        self.twin.close()
        self.session.close()
        assert not self.session.processes


@pytest.fixture(scope="module")
def simulated_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimulatedRig]:
    """One for all tests of a module: it takes seconds to start, and half a processor while it runs."""
    rig = SimulatedRig(tmp_path_factory.mktemp("rig"))
    yield rig
    rig.close()


@pytest.fixture
def rig_launcher(themed: Any, simulated_rig: SimulatedRig) -> Iterator[Launcher]:
    """What the Calibrate menu opens windows with, on the simulated rig; afterwards the rig is the true one again."""
    parent = QWidget()
    session = simulated_rig.session
    launcher = Launcher(session.command_client, session.client, lambda: DARK, FakeSettingsStore(), parent)
    yield launcher
    launcher.close()
    simulated_rig.use(simulated_rig.truth)
    parent.deleteLater()


@pytest.fixture
def open_on_rig(rig_launcher: Launcher) -> Callable[[str], Hands]:
    """Opens a wizard by its module's name, as the Calibrate menu does; returns hands on it."""

    def open_(module: str) -> Hands:
        rig_launcher.open(calibration(module))
        return Hands(opened(rig_launcher, "wizard"))

    return open_
