"""Every wizard, dialog and window is opened and closed again and again: nothing hangs, and nothing of them stays."""

from __future__ import annotations

import ctypes
import gc
import os
import threading
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from OpenGL import GL
from person import wait
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QOffscreenSurface, QOpenGLContext
from PySide6.QtOpenGLWidgets import QOpenGLWidget
from PySide6.QtWidgets import QApplication, QDialog, QDoubleSpinBox, QVBoxLayout, QWidget
from wizard_rig import RigBackend

from rhot_app.calibration.registry import Calibration, calibrations
from rhot_app.sources.discovery import Search
from rhot_app.ui.common.disposal import plot_widget, release_style
from rhot_app.ui.dialogs import dialogs
from rhot_app.ui.dialogs.nodes_dialog import NodesDialog
from rhot_app.ui.dialogs.rig_dialog import RigDialog
from rhot_app.ui.main_window import MainWindow
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards.framework.window import WizardWindow

ROUNDS, MANY = 3, 100
NAMES = 4000
"""OpenGL numbers its objects from 1; windows on a rig take some hundred."""

MOST_GROWTH = 0.05  # of the memory after a tenth of the rounds


class Borrowed:
    """A client that its backend misses until it is closed."""

    def __init__(self, client: Any, missed: set[Borrowed]) -> None:
        self._client, self._missed = client, missed
        missed.add(self)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._client, name)

    def close(self) -> None:
        self._missed.discard(self)
        self._client.close()


class LendingBackend(RigBackend):
    """`missed`: the clients that nobody has closed yet."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.missed: set[Borrowed] = set()
        self.rig_client.answers = {name: {"known": False} for name in ("refined", "adapted", "measured")}

    def command_client(self) -> Any:
        return Borrowed(super().command_client(), self.missed)

    def client(self) -> Any:
        return Borrowed(super().client(), self.missed)


# -- what can be opened ------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Opener:
    """How something is opened, and where it is found while it is open."""

    name: str
    open: Callable[[MainWindow], Any]
    find: Callable[[MainWindow], Any]


def wizard(one: Calibration) -> Opener:
    return Opener(one.name, lambda window: window.wizards.open(one), lambda window: window.wizards.wizard)


def dialog(name: str, open_: Callable[[MainWindow], Any]) -> Opener:
    return Opener(name, open_, lambda window: getattr(window.dialogs, name))


def at_top(kind: type) -> Callable[[MainWindow], Any]:
    """Finds a window of that kind."""
    return lambda window: next((one for one in QApplication.topLevelWidgets() if isinstance(one, kind)), None)


OPENERS = (
    *map(wizard, calibrations()),
    dialog("tracker", lambda window: window.actions_.tracker.trigger()),
    dialog("networks", lambda window: window.actions_.networks.trigger()),
    dialog("outputs", lambda window: window.actions_.outputs.trigger()),
    dialog("mouse", lambda window: window.actions_.mouse.trigger()),
    dialog("layers", lambda window: window.actions_.layers.trigger()),
    dialog("guide", lambda window: window.actions_.guide.trigger()),
    Opener("versions", lambda window: window.wizards.open_versions(), lambda window: window.wizards.versions),
    Opener("fit", lambda window: window.wizards.open_fit(), lambda window: window.wizards.fit),
    Opener("recordings", lambda window: window.replays.list(), lambda window: window.replays.library),
    Opener("replay", lambda window: window.replays.open(Path("none.rhotlog")), lambda window: window.replays.window),
    Opener("rig", lambda window: window.show_rig_file("hand"), at_top(RigDialog)),
    dialog("settings", lambda window: window.actions_.settings.trigger()),
    dialog("about", lambda window: window.actions_.about.trigger()),
    dialog("export", lambda window: window.dialogs.export_recording(window.settings)))


# -- rounds ------------------------------------------------------------------------------------------------------------

def open_and_close(window: MainWindow, opener: Opener, *, escape: bool) -> weakref.ref[Any]:
    """One round; a reference to what was opened."""
    opener.open(window)
    wait(lambda: (shown := opener.find(window)) is not None and shown.isVisible(), told=lambda: opener.name)
    opened = opener.find(window)
    if escape and isinstance(opened, QDialog):
        opened.reject()
    else:
        opened.close()
    reference = weakref.ref(opened)
    del opened
    wait(lambda: opener.find(window) is None, told=lambda: f"{opener.name} stays")
    return reference


def held(backend: LendingBackend) -> tuple[list[str], int]:
    """Names of the threads, without those of Qt's pool, which wait for the next work, and how many clients nobody has
    closed."""
    names = (thread.name for thread in threading.enumerate())
    return sorted(name for name in names if not name.startswith("Dummy-")), len(backend.missed)


def descriptors() -> list[str]:
    return os.listdir("/proc/self/fd")  # noqa: PTH208


def programs() -> int:
    """How many OpenGL programs there are that the contexts of all windows share."""
    context, surface = QOpenGLContext(), QOffscreenSurface()
    context.setShareContext(QOpenGLContext.globalShareContext())
    surface.create()
    assert context.create() and context.makeCurrent(surface)
    found = sum(bool(GL.glIsProgram(name)) for name in range(1, NAMES))
    context.doneCurrent()
    return found


def memory_mb() -> float:
    """Of this process, without the files that it maps, and without what was freed and is kept for the next use."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("RssAnon"))
    return int(line.split()[1]) / 1024


@pytest.fixture(scope="module")
def lending(make_shared_bench, tmp_path_factory):
    """The main window on a backend that knows its clients, at rest: nothing is drawn or compiled beside the test."""
    bench = make_shared_bench(LendingBackend(tmp_path_factory.mktemp("rig") / "desk.json"))
    bench.track()
    bench.backend.engine.running = False
    bench.until(lambda: not bench.controller.running)
    bench.rest = held(bench.backend)
    return bench


def settle(bench: Any) -> int:
    """Wait until the window holds no more than it did alone; the number of its descriptors."""
    wait(lambda: held(bench.backend) == bench.rest, told=lambda: f"{bench.rest} became {held(bench.backend)}")
    gc.collect()
    return len(descriptors())


@pytest.mark.parametrize("opener", OPENERS, ids=lambda opener: opener.name)
def test_nothing_stays_of_what_was_closed(lending, opener):
    open_and_close(lending.window, opener, escape=False)
    before = settle(lending)
    for number in range(1, ROUNDS):
        gone = open_and_close(lending.window, opener, escape=number % 2 == 1)
    wait(lambda: settle(lending) <= before and gone() is None, told=lambda: f"{before} became {descriptors()}")


@pytest.mark.parametrize("name", ["mouse", "replay"])
def test_a_scene_leaves_no_program_to_the_driver(lending, name):
    """A software renderer keeps the compiled code of every program."""
    opener = next(one for one in OPENERS if one.name == name)
    counts = []
    for _ in range(ROUNDS):
        opener.open(lending.window)
        wait(lambda: opener.find(lending.window).findChild(QOpenGLWidget).isValid())
        opened = weakref.ref(opener.find(lending.window))
        opener.find(lending.window).close()
        wait(lambda opened=opened: gc.collect() >= 0 and opened() is None)
        counts.append(programs())
    assert counts[0] == counts[-1] > 0


def unknown(parts: list[QWidget]) -> list[str]:
    """Those whose end Qt's style sheets would not hear of, so that what is kept for them stays."""
    return [type(part).__name__ for part in parts if not part.testAttribute(Qt.WidgetAttribute.WA_StyleSheet)]


def test_the_style_of_parts_that_were_never_shown_is_forgotten(themed):
    window, box = QWidget(), QDoubleSpinBox()
    QVBoxLayout(window).addWidget(box)
    assert "QLineEdit" in unknown(window.findChildren(QWidget)), "the line in a box is never known by itself"
    release_style(window)
    assert unknown([window, *window.findChildren(QWidget)]) == []


def test_the_fields_of_a_plot_that_nobody_sees_are_known_to_the_style(themed):
    plot = plot_widget()
    fields = [part for part in vars(plot.getPlotItem().ctrl).values() if isinstance(part, QWidget)]
    assert fields and unknown([one for part in fields for one in (part, *part.findChildren(QWidget))]) == []


def test_what_is_closed_is_known_to_the_style(lending, monkeypatch):
    """A wizard has pages that nobody has opened."""
    opener, closed = next(one for one in OPENERS if one.name == "bones"), []
    monkeypatch.setattr(WizardWindow, "deleteLater", lambda window: closed.extend(
        unknown([window, *window.findChildren(QWidget)])) or QDialog.deleteLater(window))
    open_and_close(lending.window, opener, escape=False)
    assert closed == []


def test_a_dialog_that_is_waited_for_does_not_stay(lending, monkeypatch):
    made = []

    def make(scheme, parent):
        dialog = NodesDialog(scheme, parent, lambda progress: Search((), (), ()), lambda addresses: [])
        QTimer.singleShot(0, dialog.reject)
        made.append(weakref.ref(dialog))
        return dialog

    monkeypatch.setattr(dialogs, "NodesDialog", make)
    assert lending.window.dialogs.connect_nodes(DARK) is None
    wait(lambda: settle(lending) and made[0]() is None)


@pytest.mark.study("rhot_app/ui")
@pytest.mark.timeout(3600)
def test_a_hundred_rounds_through_all_windows_leave_nothing(lending):
    memory, before = [], 0
    for number in range(1, MANY + 1):
        for opener in OPENERS:
            open_and_close(lending.window, opener, escape=number % 2 == 1)
        if number % (MANY // 10) == 0:
            settled = settle(lending)
            before = before or settled
            memory.append(round(memory_mb()))
            print(f"{memory[-1]} MB after {number} rounds", flush=True)
    wait(lambda: settle(lending) == before, told=lambda: f"{before} became {descriptors()}")
    assert memory[-1] < (1.0 + MOST_GROWTH) * memory[0], memory
