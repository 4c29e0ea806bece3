"""Opens wizards from the Calibrate menu: one at a time, over the main window."""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QAction, QIcon
from PySide6.QtWidgets import QMenu, QWidget

from rhot_app import rig_history
from rhot_app.calibration.proposal import Proposal
from rhot_app.calibration.registry import Calibration, InForce, calibrations
from rhot_app.errors import EngineError
from rhot_app.project import Rig, parse_rig
from rhot_app.ui.backend.contract import CommandClient, Connect, Listener
from rhot_app.ui.backend.solver import Solver
from rhot_app.ui.common.disposal import dispose
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.shapes import shape_icon
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.definition import Definition, SettingsStore, WizardContext
from rhot_app.ui.wizards.framework.window import WizardWindow
from rhot_app.ui.wizards.versions_dialog import VersionsDialog

if TYPE_CHECKING:  # they compile numerical code, which waits until it is wanted
    from rhot_app.handfit.session import HandFit
    from rhot_app.ui.handfit.window import HandFitWindow

_END_S = 5.0


def module_of(calibration: Calibration) -> str:
    """The module that has ``make_wizard(context)``: of what the calibration collects, or of its name."""
    return f"{__package__}.framework.collecting" if calibration.collect else f"{__package__}.{calibration.name}"


def make_wizard(context: WizardContext) -> Definition:
    """The pages of the context's calibration for the rig at hand."""
    made: Definition = importlib.import_module(module_of(context.calibration)).make_wizard(context)
    return made


class Launcher(QObject):
    """`rig_used` after a wizard or a restore has changed the rig; `failed` with a sentence when none could open."""

    rig_used = Signal()
    failed = Signal(str)

    def __init__(self, connect: Connect, listen: Callable[[], Listener], scheme: Callable[[], Scheme],
                 memory: SettingsStore, window: QWidget, make_solver: Callable[[], Solver] = Solver) -> None:
        super().__init__(window)
        self._make_solver = make_solver
        self._memory = memory
        self._connect = connect
        self._listen = listen
        self._scheme = scheme
        self._window = window
        self._job: Job | None = None
        self.twin_menu: Callable[[QWidget], QMenu | None] = lambda parent: None
        """Makes the menu of what the simulated hand does; None on a real rig."""
        self.wizard: WizardWindow | None = None
        self.versions: VersionsDialog | None = None
        self.fit: HandFitWindow | None = None

    def show_ages(self, actions: list[QAction], path: str) -> None:
        """A tick and the age of what is in force, for each wizard's action in the order of `calibrations`; titles
        alone without a rig."""
        if not path:
            for action, wizard in zip(actions, calibrations(), strict=True):
                action.setIcon(QIcon())
                action.setText(f"{tr(wizard.title)} …")
            return
        when = self.in_force(path)
        scheme = self._scheme()
        for action, wizard in zip(actions, calibrations(), strict=True):
            done = max((at for reason, at in when.items() if reason.startswith(wizard.reason)), default=None)
            shape, tone = ("tick", scheme.good) if done is not None else ("ring", scheme.neutral)
            action.setIcon(shape_icon(shape, tone))
            age = tr("not yet") if done is None else age_text(done)
            action.setText(f"{tr(wizard.title)} …\t{age}")

    def in_force(self, path: str) -> dict[str, datetime]:
        """When each thing of the rig at `path` was made that is in force, by its reason."""
        return {**self._noted(path), **rig_history.in_force(Path(path))} if path else {}

    def open(self, wizard: Calibration) -> None:
        """Ask engine and nodes how things stand, then show the wizard."""
        if self._job is None and self.wizard is None:
            self._job = Job(lambda progress: self._look(wizard), lambda now: self._show(wizard, now), self._not_opened,
                            None, self).start()

    def open_versions(self) -> None:
        """Show what can be brought back."""
        if self._job is None:
            self._job = Job(lambda progress: self._look(None), self._show_versions, self._not_opened, None,
                            self).start()

    def open_fit(self) -> None:
        """Show the window in which the hand is fitted to pictures."""
        if self._job is None and self.fit is None:
            self._job = Job(lambda progress: self._begin_fit(), self._show_fit, self._not_opened, None, self).start()

    def close(self) -> None:
        """The app is closing: no question, nothing left running."""
        if self.wizard is not None:
            self.wizard.end().wait(_END_S)
        if self.fit is not None:
            self.fit.end().wait(_END_S)

    def _look(self, wizard: Calibration | None) -> InForce:
        if wizard is not None:
            importlib.import_module(module_of(wizard))  # takes a moment the first time
        with contextlib.closing(self._connect()) as client:
            answer = client.command("rig")
            path = str(answer.get("path", ""))
            rig = parse_rig(msgspec.json.encode(answer["document"]), path or "the engine's rig")
            settings = _node_settings(client, rig) if wizard is not None else {}
        return InForce(rig, Path(path) if path else None, settings)

    def _show(self, wizard: Calibration, now: InForce) -> None:
        self._job = None
        context = WizardContext(wizard, now, self._connect, self._scheme(), self._memory, self._listen,
                                self._make_solver)
        self.wizard = WizardWindow(make_wizard(context), context, self._window)
        self.wizard.rig_used.connect(lambda rig: self.rig_used.emit())
        self.wizard.used.connect(lambda proposal, on: self._note(proposal, str(now.path or ""), on=on))
        self.wizard.finished.connect(self._forget)
        self.wizard.frame.offer_twin(self.twin_menu(self.wizard))
        self.wizard.open()

    def _note(self, proposal: Proposal, path: str, *, on: bool) -> None:
        """What leaves no trace in the rig's history, because it is kept by the nodes, is remembered by the app."""
        if proposal.rig is None:
            self._memory.remember(f"{proposal.reason} {path}", datetime.now(UTC).isoformat() if on else "")

    def _noted(self, path: str) -> dict[str, datetime]:
        found = {}
        for wizard in calibrations():
            with contextlib.suppress(ValueError):
                found[wizard.reason] = datetime.fromisoformat(self._memory.remembered(f"{wizard.reason} {path}"))
        return found

    def _forget(self) -> None:
        if self.wizard is not None:
            dispose(self.wizard)
            self.wizard = None

    def _show_versions(self, now: InForce) -> None:
        self._job = None
        if now.path is None:
            self.failed.emit(tr("This rig came from no file, so there are no earlier versions of it. Save it first."))
            return
        self.versions = VersionsDialog(now.path, now.rig, self._connect, self._scheme(), self._window)
        self.versions.rig_used.connect(lambda rig: self.rig_used.emit())
        self.versions.finished.connect(self._forget_versions)
        self.versions.open()

    def _forget_versions(self) -> None:
        if self.versions is not None:
            dispose(self.versions)
            self.versions = None

    def _begin_fit(self) -> tuple[InForce, HandFit]:
        from rhot_app.handfit.session import HandFit, warm_up

        now = self._look(None)
        fit = HandFit(now.rig)
        warm_up(now.rig)
        return now, fit

    def _show_fit(self, begun: tuple[InForce, HandFit]) -> None:
        from rhot_app.ui.handfit.live import fit_live

        self._job = None
        now, fit = begun
        self.fit = fit_live(fit, now.path, self._connect, self._listen, self._scheme(), self._memory, self._window)
        self.fit.used.connect(self.rig_used)
        self.fit.finished.connect(self._forget_fit)
        self.fit.open()

    def _forget_fit(self) -> None:
        if self.fit is not None:
            dispose(self.fit)
            self.fit = None

    def _not_opened(self, sentence: str) -> None:
        self._job = None
        self.failed.emit(sentence)


def _node_settings(client: CommandClient, rig: Rig) -> dict[int, dict[str, Any]]:
    """Settings by node id; a node that does not answer is left out, its picture will say why."""
    found: dict[int, dict[str, Any]] = {}
    for node in rig.nodes:
        if not node.text_datagrams:
            try:
                answer = client.command("node", node_id=node.node_id, request={"request": "settings"})
                found[node.node_id] = dict(answer["answer"]["settings"])
            except (EngineError, KeyError):
                continue
    return found


def age_text(when: datetime, now: datetime | None = None) -> str:
    """How long ago in words: "today", "yesterday", "5 days ago", "3 months ago"."""
    days = ((now or datetime.now(UTC)).astimezone().date() - when.astimezone().date()) // timedelta(days=1)
    if days <= 0:
        return tr("today")
    if days == 1:
        return tr("yesterday")
    if days < 60:
        return tr("{n} day ago", "{n} days ago", days)
    return tr("{n} month ago", "{n} months ago", days // 30)
