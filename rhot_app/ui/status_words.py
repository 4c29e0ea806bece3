"""The controller's state in words: the one word at the top, the sentences at the bottom."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from rhot_app.calibration.registry import find_calibration
from rhot_app.engine.status import Advice, EngineStatus, with_numbers
from rhot_app.errors import RigError
from rhot_app.project import Rig, load_rig, parse_rig
from rhot_app.ui.backend.contract import CommandClient, TwinPace
from rhot_app.ui.common.controller import RESTART_ENGINE, RESTART_TWIN, Controller
from rhot_app.ui.language import tr
from rhot_app.ui.models.notice import Notice
from rhot_app.ui.models.rows import bytes_text
from rhot_app.ui.models.words import NO_ENGINE, NO_RIG, STARTING, Look, condition_look
from rhot_app.ui.wizards.framework.definition import OPEN_WIZARD


def look_of(controller: Controller) -> Look:
    """The one word, its shape and its tone."""
    if controller.opened is None:
        return STARTING if controller.working else NO_RIG
    if controller.engine_gone:
        return NO_ENGINE
    status = controller.live.status
    return condition_look(status.condition) if status is not None else STARTING


def notices_of(controller: Controller) -> list[Notice]:
    """The sentences that hold at the moment; a quiet one beside those that last when there is nothing else to say."""
    notices: list[Notice] = []
    if controller.engine_gone:
        notices.append(_engine_notice(controller))
    elif controller.problem:
        notices.append(Notice("error", controller.problem, subject="tracking"))
    if controller.twin_gone:
        notices.append(Notice("error", tr("The simulated cameras have stopped."), tr("Start them again"), RESTART_TWIN,
                              subject="tracking"))
    if controller.opened is not None and not controller.opened.ours:
        notices.append(Notice("info", tr("This engine was started outside the app; closing the app lets it run on.")))
    status = controller.live.status
    if status is not None and not controller.engine_gone:
        notices += [_advice_notice(advice) for advice in status.advice]
        if status.log_path:
            notices.append(Notice("info", tr("Recording to {path} ({size}).", path=status.log_path,
                                             size=recording_text(status))))
    if controller.twin_pace is not None and controller.running:
        notices.append(_pace_notice(controller.twin_pace))
    if controller.background and controller.opened is not None:
        notices.append(_advice_notice(controller.background))
    if all(notice.lasting for notice in notices):
        notices.append(Notice("info", _quiet_sentence(controller, in_order=not notices)))
    return notices


def recording_text(status: EngineStatus) -> str:
    """Length and size of what is being recorded, e.g. "1:02, 3.2 MB"."""
    minutes, seconds = divmod(int(status.log_seconds), 60)
    return f"{minutes}:{seconds:02d}, {bytes_text(status.log_bytes)}"


def label_of(controller: Controller) -> tuple[str, str]:
    """What stands before the rig's name while something is recorded or replayed, and its tooltip; "" for nothing."""
    status = controller.live.status
    if status is None or controller.engine_gone:
        return "", ""
    if status.log_path:
        return (tr("REC {size}", size=recording_text(status)),
                tr("Recording to {path}. A click here, or B, sets a bookmark.", path=status.log_path))
    if status.replaying:
        return (tr("REPLAY {name}", name=Path(status.replaying).name),
                tr("An engine replays {path}; Start replays it again.", path=status.replaying))
    return "", ""


def _advice_notice(advice: Advice) -> Notice:
    """The engine's sentence, with the wizard that mends it as a button."""
    wizard = find_calibration(advice.mender)
    text = advice.text
    if advice.pattern:
        said = {name: tr(value) if isinstance(value, str) and " " in value else value
                for name, value in advice.values.items()}  # a name is no word
        text = tr(advice.pattern, **{name: with_numbers(value, said) for name, value in said.items()})
    if wizard is None:
        return Notice(advice.level, text, lasting=advice.lasting, subject=advice.subject)
    action = tr("Calibrate …") if advice.lasting else f"{tr(wizard.title)} …"
    return Notice(advice.level, text, action, f"{OPEN_WIZARD}{wizard.name}", advice.lasting,
                  advice.subject)


def _pace_notice(pace: TwinPace) -> Notice:
    return Notice("info", tr("This computer renders the simulated cameras at {achieved:.0f} of {preset:.0f} Hz; "
                             "the tracking is real all the same.", achieved=pace.achieved_hz,
                             preset=pace.preset_hz))


def _engine_notice(controller: Controller) -> Notice:
    if controller.working:
        return Notice("error", tr("The engine stopped. The app is starting it again; the nodes re-join by themselves."),
                      subject="tracking")
    reason = f" {controller.problem}" if controller.problem else ""
    return Notice("error", tr("The engine stopped and could not be started again.{reason}", reason=reason),
                  tr("Try again"), RESTART_ENGINE, subject="tracking")


def _quiet_sentence(controller: Controller, *, in_order: bool) -> str:
    if controller.opened is None and controller.working:
        return tr("One moment. Cancel ends what was started.")
    if controller.opened is None:
        return tr("Choose how to begin. F1 opens the guide.")
    if not controller.running:
        return tr("Press Start, or the space bar, to begin tracking.")
    look = look_of(controller)
    return tr("Everything is in order.") if look.tone == "good" and in_order else tr(look.meaning)


# -- Unsaved changes of the rig ----------------------------------------------------------------------------------------

LOOK_S = 1.5


@dataclass(frozen=True, slots=True)
class RigObservation:
    """The engine's rig at one moment; `edited` when its file says something else or cannot be read."""

    rig: Rig
    path: str
    edited: bool


def look_at_rig(client: CommandClient) -> RigObservation:
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


class RigFileWatch:
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
            self._controller.link.work(look_at_rig, lambda found: self._take(found, opened),
                                       lambda sentence: self._rest())

    def save(self, tell: Callable[[Notice], None]) -> None:
        """Have the engine write its rig to the file it came from, and `tell` where it was written."""
        self._controller.save_rig(lambda path: self._confirm(Path(path), tell))

    def _confirm(self, path: Path, tell: Callable[[Notice], None]) -> None:
        self.look_soon()
        tell(Notice("info", tr("The rig was saved to {path}. What stood there before is kept in {name}.history.",
                               path=path, name=path.name)))

    def _rest(self) -> None:
        """An engine that does not answer is told of elsewhere."""
        self._looking = False

    def _take(self, found: RigObservation, asked_for: object) -> None:
        self._looking = False
        opened = self._controller.opened
        if opened is None or opened is not asked_for:
            return
        self.edited = found.edited
        if found.rig != opened.rig or found.path != opened.rig_path:
            self._controller.take_rig(replace(opened, rig=found.rig, rig_path=found.path))
