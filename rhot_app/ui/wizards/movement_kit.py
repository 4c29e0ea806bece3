"""What every wizard with recorded movements needs: the states, a folder for the logs, and an end that tidies up."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from rhot_app.errors import EngineError
from rhot_app.ui.backend.contract import Asker
from rhot_app.ui.wizards.models.movement import Coach, MovementStep
from rhot_app.ui.wizards.movement_page import MovementPage
from rhot_app.ui.wizards.plan import Kit
from rhot_app.ui.wizards.state_feed import StateFeed

PageT = TypeVar("PageT", bound=MovementPage)


class Movements:
    """Makes the pages of recorded movements; `end` is the plan's `put_back`."""

    def __init__(self, kit: Kit) -> None:
        if kit.listen is None:
            raise EngineError("this window cannot hear the hand; open the wizard from the main window.")
        self.states = StateFeed(kit.listen)
        self._connect = kit.connect
        self._folder = Path(tempfile.mkdtemp(prefix="rhot-wizard-"))
        self._steps: list[MovementStep] = []

    def page(self, title: str, sentence: str, seconds: float, coach: Callable[[], Coach]) -> MovementPage:
        """A page that records `seconds` of a movement; see `MovementStep`."""
        return self.page_of(MovementPage, title, sentence, seconds, coach)

    def page_of(self, make: Callable[[MovementStep, Callable[[], Asker], StateFeed], PageT], title: str, sentence: str,
                seconds: float, coach: Callable[[], Coach]) -> PageT:
        """The same on a page that shows more."""
        step = MovementStep(title, sentence, seconds, self._folder, coach, self.states.recent)
        self._steps.append(step)
        return make(step, self._connect, self.states)

    def end(self) -> None:
        """End a recording that still runs, and throw the logs away. In a worker."""
        self.states.stop()
        if any(step.phase in ("beginning", "recording", "ending") for step in self._steps):
            asker = self._connect()
            try:
                asker.command("record_stop")
            finally:
                asker.close()
        shutil.rmtree(self._folder, ignore_errors=True)
