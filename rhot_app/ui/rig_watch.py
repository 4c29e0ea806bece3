"""Whether the engine's rig still says what its file says, so that nobody closes the app on an unsaved calibration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from rhot_app.errors import RigError
from rhot_app.project import Rig, load_rig, parse_rig
from rhot_app.ui.backend.live import Client
from rhot_app.ui.controller import Controller
from rhot_app.ui.models.notice import Notice

LOOK_S = 1.5


@dataclass(frozen=True, slots=True)
class RigObservation:
    """The engine's rig at one moment; `edited` when its file says something else or cannot be read."""

    rig: Rig
    path: str
    edited: bool


def look_at_rig(client: Client) -> RigObservation:
    """Ask the engine and read the file. Waits; raises EngineError, RigError."""
    answer = client.command("rig")
    path = str(answer.get("path", ""))
    rig = parse_rig(msgspec.json.encode(answer["document"]), path or "the engine's rig")
    return RigObservation(rig, path, bool(path) and not _file_says(Path(path), rig))


def _file_says(path: Path, rig: Rig) -> bool:
    try:
        return load_rig(path) == rig
    except RigError:
        return False


class RigWatch:
    """Looks now and then, in a worker; the controller's rig follows what another client gave the engine."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._looking = False
        self._next_look = 0.0
        self.edited = False
        controller.rig_changed.connect(self.look_soon)

    def look_soon(self) -> None:
        """Look at the next step: something was changed or saved."""
        self._next_look = 0.0

    def step(self, now_s: float) -> None:
        """Begin to look when it is time; never waits."""
        if self._controller.opened is None:
            self.edited = False
        elif not self._looking and now_s >= self._next_look and not self._controller.engine_gone:
            self._looking = True
            self._next_look = now_s + LOOK_S
            opened = self._controller.opened
            self._controller.link.work(look_at_rig, lambda sight: self._take(sight, opened),
                                       lambda sentence: self._rest())

    def save(self, tell: Callable[[Notice], None]) -> None:
        """Have the engine write its rig to the file it came from, and `tell` where it was written."""
        self._controller.save_rig(lambda path: self._confirm(Path(path), tell))

    def _confirm(self, path: Path, tell: Callable[[Notice], None]) -> None:
        self.look_soon()
        tell(Notice("info", f"The rig was saved to {path}. What stood there before is kept in {path.name}.history."))

    def _rest(self) -> None:
        """An engine that does not answer is told of elsewhere."""
        self._looking = False

    def _take(self, sight: RigObservation, asked_for: object) -> None:
        self._looking = False
        opened = self._controller.opened
        if opened is None or opened is not asked_for:
            return
        self.edited = sight.edited
        if sight.rig != opened.rig or sight.path != opened.rig_path:
            self._controller.take_rig(replace(opened, rig=sight.rig, rig_path=sight.path))
