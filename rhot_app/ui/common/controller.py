"""What the window does: opens rigs, gives commands, watches over the engine. Holds no widgets.

Everything that waits runs as a `Job`; `step()` is called by the window's timer and never waits.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal

from rhot_app.engine.status import Advice
from rhot_app.errors import RhotError
from rhot_app.project import Rig
from rhot_app.ui.backend.contract import Backend, CommandClient, Listener, Opened, TwinChoice, TwinPace
from rhot_app.ui.backend.live import SILENCE_S, Live
from rhot_app.ui.common.job import Job, Progress
from rhot_app.ui.language import tr

# -- The window's client of the engine ---------------------------------------------------------------------------------

class EngineLink(QObject):
    """`client` is None while no engine is wanted. `failed` hears of every command that fails, as a sentence."""

    def __init__(self, backend: Backend, failed: Callable[[str], None], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._backend = backend
        self._failed = failed
        self._jobs: list[Job] = []
        self.client: Listener | None = None

    def open(self) -> None:
        """A fresh client in place of the last one."""
        self.close()
        self.client = self._backend.client()

    def close(self) -> None:
        """Disconnect, if connected."""
        if self.client is not None:
            self.client.close()
            self.client = None

    def command(self, name: str, **args: Any) -> None:
        """Give a command; only its failure is heard of."""
        self.work(lambda client: client.command(name, **args), lambda answer: None)

    def work(self, op: Callable[[CommandClient], Any], done: Callable[[Any], None],
             failed: Callable[[str], None] | None = None) -> None:
        """Ask something short in a worker, by a client of its own; nothing happens while no engine is wanted.

        `done(result)` or `failed(sentence)` follow in the window's thread; `failed` is the link's own by default.
        """
        if self.client is None:
            return

        def ask() -> Any:
            with contextlib.closing(self._backend.command_client()) as client:
                return op(client)

        self._jobs = [job for job in self._jobs if job.running]
        self._jobs.append(Job(lambda progress: ask(), done, failed or self._failed, None, self).start())

    def wait(self, timeout_s: float) -> None:
        """Let what is under way come to its end, at most `timeout_s` in all."""
        end_s = time.monotonic() + timeout_s
        for job in self._jobs:
            job.wait(max(0.0, end_s - time.monotonic()))


# -- The controller ----------------------------------------------------------------------------------------------------

SAMPLE_S = 0.1
RESTART_TRIES = 3
RESTART_FORGET_S = 60.0
TWIN_CHECK_S = 0.5
LOOK_S = 1.0
RESTART_TWIN = "twin"
RESTART_ENGINE = "engine"
_CLOSE_WAIT_S = 15.0


class Controller(QObject):
    """`rig_changed` after another rig (or none) is open, `busy_changed` while something long runs, `failed` with a
    sentence when it failed."""

    rig_changed = Signal()
    busy_changed = Signal()
    failed = Signal(str)

    def __init__(self, backend: Backend, parent: QObject | None = None,
                 clock: Callable[[], float] = time.monotonic) -> None:
        """`clock` gives the seconds of the engine's clock, by which everything in the window is timed."""
        super().__init__(parent)
        self.backend = backend
        self.clock = clock
        self.live = Live(clock)
        self.opened: Opened | None = None
        self.twin_choice = TwinChoice()
        self.link = EngineLink(backend, self._on_command_failed, self)
        self._job: Job | None = None
        self.busy: tuple[str, float] | None = None
        self.problem = ""
        self.background: Advice | None = None
        """What is done beside the tracking."""
        self._restarts: list[float] = []
        self._restarting = False
        self._was_running = False
        self.twin_gone = False
        self.twin_pace: TwinPace | None = None
        self._next_sample = self._next_twin_check = self._next_look = 0.0
        self._attaching: Job | None = None
        self._known_engine = False  # one that runs was closed, or is none that appeared meanwhile
        self._begin_after_opening = False

    # -- opening and closing ---------------------------------------------------------------------------------------

    @property
    def rig(self) -> Rig | None:
        """The rig that is open."""
        return self.opened.rig if self.opened is not None else None

    @property
    def running(self) -> bool:
        """Whether the nodes were told to stream."""
        status = self.live.status
        return bool(status is not None and status.running and not self.engine_gone)

    @property
    def recording(self) -> bool:
        """Whether a log is being written."""
        return self.live.status is not None and bool(self.live.status.log_path)

    @property
    def engine_gone(self) -> bool:
        """Whether a rig is open but its engine has fallen silent."""
        return self.opened is not None and self.live.silent_for_s() > SILENCE_S

    def attach(self) -> None:
        """Attach to the engine that runs already."""
        self._open(tr("Attaching to the running engine …"), self.backend.attach)

    def open_rig(self, path: Path) -> None:
        """Open a rig file."""
        self._open(tr("Opening the rig …"), lambda progress: self.backend.open_rig(path, progress))

    def open_twin(self, choice: TwinChoice, *, begin: bool = True) -> None:
        """Start the simulated rig; `begin` starts the tracking as soon as it is there."""
        self.twin_choice = choice
        self._begin_after_opening = begin
        self._open(tr("Starting the simulated rig …"), lambda progress: self.backend.open_twin(choice, progress))

    def _open(self, text: str, op: Callable[[Callable[[str, float], None]], Opened]) -> None:
        if self._job is not None:
            return
        self._forget_rig()
        self._start_job(text, lambda progress: op(progress.report), self._on_opened)

    def _start_job(self, text: str, op: Callable[[Progress], Any], done: Callable[[Any], None]) -> None:
        self.problem = ""
        self._set_busy((text, 0.0))
        self._job = Job(op, done, self._on_failed, lambda t, f: self._set_busy((t, f)), self).start()

    def _on_opened(self, opened: Opened) -> None:
        self._job = None
        self._set_busy(None)
        self.link.open()
        self.opened = opened
        self.live.clear()
        self.twin_gone = self._restarting = False
        self._was_running = opened.running
        self.rig_changed.emit()
        if (self._begin_after_opening or opened.begin) and not opened.running:
            self.start()
        self._begin_after_opening = False

    def _on_failed(self, sentence: str) -> None:
        self._job = None
        self._begin_after_opening = False
        self._set_busy(None)
        if not self._restarting:
            self.failed.emit(sentence)
        self._restarting = False
        self.problem = sentence

    def _forget_rig(self) -> None:
        self.opened = self.twin_pace = None
        self.live.clear()
        self.link.close()
        self.problem = ""
        self.rig_changed.emit()

    @property
    def working(self) -> bool:
        """Whether something is being opened, restarted or closed."""
        return self._job is not None

    def cancel(self) -> None:
        """Give up what is being opened; whatever it has started is ended."""
        if self._job is None:
            return
        job = self._job
        job.cancel()
        self._begin_after_opening = self._restarting = False

        def end_all(progress: Progress) -> str:
            self.backend.give_up()
            job.wait(_CLOSE_WAIT_S)
            return self.backend.close()

        self._start_job(tr("Cancelling …"), end_all, self._on_closed)

    def close_rig(self) -> None:
        """Back to the first page; ends what the app started."""
        if self._job is not None:
            return
        self._forget_rig()
        self._start_job(tr("Closing the rig …"), lambda progress: self.backend.close(), self._on_closed)

    def _on_closed(self, left_running: str) -> None:
        self._job = None
        self._known_engine = True  # until none runs any more
        self._set_busy(None)
        if left_running:
            self.problem = left_running

    def shut_down(self) -> str:
        """End everything that the app started, and wait for it; what is left running on purpose, as a sentence."""
        if self._job is not None:
            self._job.cancel()
        sentence = self.backend.close()
        if self._job is not None:
            self._job.wait(_CLOSE_WAIT_S)
        self.link.wait(_CLOSE_WAIT_S)
        self.link.close()
        return self.backend.close() or sentence

    # -- commands --------------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Tell the nodes to stream."""
        self._was_running = True
        self.link.command("start")

    def stop(self) -> None:
        """Tell the nodes to stop."""
        self._was_running = False
        self.link.command("stop")

    def start_or_stop(self) -> None:
        """The toolbar's first button; nothing happens without a rig and an engine that answers."""
        if self.opened is not None and not self.engine_gone:
            if self.running:
                self.stop()
            else:
                self.start()

    def record(self, path: Path, *, video: bool = False) -> None:
        """Write the raw log of all datagrams to `path`; with `video` the nodes record their frames."""
        self.link.command("record", path=str(path), video=video)

    def stop_recording(self) -> None:
        """End the log."""
        self.link.command("record_stop")

    def set_preview(self, on: bool) -> None:
        """Have the nodes send pictures, or not: nobody looks while the panel is hidden."""
        if self.opened is not None and not self.engine_gone:
            self.link.command("preview", on=on)

    def save_rig(self, done: Callable[[str], None]) -> None:
        """Have the engine write its rig to the file it came from; `done` hears the file's path."""
        self.link.work(lambda client: client.command("save_rig"), lambda answer: done(str(answer.get("path", ""))))

    def take_rig(self, opened: Opened) -> None:
        """Show another rig that the engine has gone over to."""
        self.opened = opened
        self.rig_changed.emit()

    def _on_command_failed(self, sentence: str) -> None:
        if not self.engine_gone:
            self.failed.emit(sentence)

    # -- every tick ------------------------------------------------------------------------------------------------

    def step(self) -> None:
        """Pull what arrived, sample the windows ten times a second, watch over engine and simulated nodes."""
        if self.opened is None:
            self._look_for_engine(self.clock())
        if self.link.client is None or self.opened is None:
            return
        try:
            self.live.step(self.link.client)
        except RhotError as exc:
            self.problem = str(exc)
        now = self.clock()
        if now >= self._next_sample:
            self._next_sample = max(self._next_sample + SAMPLE_S, now)
            self.live.sample(round(1e9 * now))
        if now >= self._next_twin_check:
            self._next_twin_check = now + TWIN_CHECK_S
            self.twin_gone = self.opened.simulated and not self.backend.twin_alive()
            self.twin_pace = self.backend.twin_pace() if self.opened.simulated else None
        if self.engine_gone:
            self._restart(now)
        elif self.live.status is not None:
            self._was_running = self.live.status.running

    def _look_for_engine(self, now: float) -> None:
        """Attach to an engine that somebody starts while no rig is open, such as ``rhot replay``, once it answers."""
        if now < self._next_look or self._job is not None or self._attaching is not None:
            return
        self._next_look = now + LOOK_S
        found = self.backend.found()
        self._known_engine &= found
        if found and not self._known_engine:
            self._attaching = Job(lambda progress: self.backend.attach(progress.report), self._attached,
                                  lambda sentence: self._attached(None), None, self).start()

    def _attached(self, opened: Opened | None) -> None:
        self._attaching = None
        if opened is not None and self.opened is None and self._job is None:
            self._on_opened(opened)

    def _restart(self, now: float) -> None:
        """Start a vanished engine again, a few times in a minute and then no more until asked."""
        if self._job is not None or self.opened is None:
            return
        self._restarts = [t for t in self._restarts if now - t < RESTART_FORGET_S]
        if len(self._restarts) >= RESTART_TRIES:
            return
        self._restarts.append(now)
        self._restarting = True
        path, start = self.opened.rig_path, self._was_running
        self._start_job(tr("The engine stopped. Starting it again …"),
                        lambda progress: self.backend.restart_engine(path, start, progress.report), self._on_opened)

    def press(self, key: str) -> None:
        """The button of a notice."""
        if key == RESTART_TWIN:
            self.open_twin(self.twin_choice)
        elif key == RESTART_ENGINE:
            self._restarts = []

    def _set_busy(self, busy: tuple[str, float] | None) -> None:
        self.busy = busy
        self.busy_changed.emit()
