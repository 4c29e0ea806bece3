"""Fixtures of the tests of the window: one OpenGL platform, documents in a temporary folder, a fake engine."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from fake_backend import FakeBackend, InProcessSolver

from rhot_app.ui.app import cap_heap, cap_software_gl, choose_gl_platform

choose_gl_platform()
cap_software_gl()
cap_heap()

from person import Person  # after the OpenGL platform was chosen  # noqa: E402
from PySide6.QtCore import QCoreApplication, Qt  # noqa: E402
from PySide6.QtGui import QAction, QPalette  # noqa: E402
from PySide6.QtWidgets import QApplication, QMenu  # noqa: E402

QCoreApplication.setAttribute(Qt.ApplicationAttribute.AA_ShareOpenGLContexts)

from rhot_app.ui.backend import session  # noqa: E402
from rhot_app.ui.backend.solver import Solver  # noqa: E402
from rhot_app.ui.common.controller import Controller  # noqa: E402
from rhot_app.ui.common.settings import Settings  # noqa: E402
from rhot_app.ui.common.theme import apply_theme, scheme_named  # noqa: E402
from rhot_app.ui.main_window import MainWindow  # noqa: E402
from rhot_app.ui.models import proposal  # noqa: E402
from rhot_app.ui.models.pacing import FramePacer  # noqa: E402
from rhot_app.ui.scene.surface import choose_format  # noqa: E402


class Bench(Person):
    """A user of the main window on a fake engine."""

    def __init__(self, folder: Path, backend: FakeBackend | None = None, scheme: str = "dark",
                 make_solver: Callable[[], Solver] = InProcessSolver, settings: Settings | None = None) -> None:
        self.backend = backend or FakeBackend()
        settings = settings or Settings(folder / "app.ini")
        settings.scheme = scheme
        self._passed_s = 0.0
        self.backend.engine.clock = self.clock
        self.controller = Controller(self.backend, clock=self.clock)
        self.window = MainWindow(self.controller, settings, make_solver)
        if QApplication.palette().color(QPalette.ColorRole.Window).name() != scheme_named(scheme).window:
            self.window.appearance.set_scheme(scheme)
        self.window.screen_parts.pacer = FramePacer(most_hz=4.0)  # software OpenGL is slow
        super().__init__(self.window)

    def clock(self) -> float:
        """The time of the window and its engine, s."""
        return time.monotonic() + self._passed_s

    def let_pass(self, seconds: float) -> None:
        """Advance the clock."""
        self._passed_s += seconds

    def told(self) -> Any:
        return self.window.toolbar.badge.word, self.window.advice.texts

    def choose(self, menu: QMenu, entry: QAction) -> None:
        """Click a menu in the menu bar, then an entry of it."""
        bar = self.window.menus
        self.click(bar, bar.actionGeometry(menu.menuAction()).center())
        self.until(menu.isVisible)
        self.click(menu, menu.actionGeometry(entry).center())

    def close_rig(self) -> None:
        """Go back to the first page."""
        self.window.actions_.close_rig.trigger()
        self.until(lambda: self.window.welcome.twin_button.isVisible() and not self.controller.working)

    def see_newer_states(self) -> None:
        """Wait until two new states are drawn and two new statuses of the engine have arrived."""
        scene, live = self.window.screen_parts.scene, self.controller.live
        for _ in range(2):
            shown, status = scene.state, live.status
            self.until(lambda shown=shown, status=status: scene.state is not shown and live.status is not status)

    def said(self, *words: str) -> bool:
        """Whether one of the sentences at the bottom contains all these words."""
        return any(all(word in text for word in words) for text in self.window.advice.texts)

    @property
    def calm(self) -> bool:
        """Whether the window says that nothing is wrong."""
        return self.said("in order")

    def track(self) -> None:
        """From any state of the window, track the simulated rig with nothing wrong."""
        self.backend.calm()
        self.window.passing.clear()
        if self.controller.rig is None:
            self.until(lambda: self.window.welcome.twin_button.isVisible())
            self.click(self.window.welcome.twin_button)
        self.until(lambda: self.window.toolbar.badge.word == "TRACKING" and self.calm)
        self.backend.calls.clear()
        self.backend.engine.commands.clear()

    def close(self) -> None:
        """Close the window and end what it started."""
        self.backend.gate.set()
        self.window.close()
        self.controller.shut_down()
        self.window.deleteLater()


@pytest.fixture(scope="session")
def themed(qapp: Any) -> Any:
    """The application with its theme."""
    choose_format()
    apply_theme(qapp, scheme_named("dark"))
    return qapp


@pytest.fixture(autouse=True)
def own_documents(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Recordings of the tests are written to a temporary folder."""
    monkeypatch.setenv("XDG_DOCUMENTS_DIR", str(tmp_path))


@pytest.fixture(scope="session", autouse=True)
def nothing_compiled() -> Iterator[None]:
    """No tracker is compiled before an engine starts: fake engines need none, and real ones compile themselves."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (proposal, session):
            patch.setattr(module, "compile_part", lambda *args: None)
        yield


def benches(folder: Path) -> Iterator[Callable[..., Bench]]:
    """Yields a function that makes windows with one settings file; all are closed at the end."""
    opened: list[Bench] = []

    def make(backend: FakeBackend | None = None, scheme: str = "dark", **options: Any) -> Bench:
        opened.append(Bench(folder, backend, scheme, **options))
        return opened[-1]

    yield make
    for bench in opened:
        bench.close()


@pytest.fixture
def make_bench(themed: Any, tmp_path: Path) -> Iterator[Callable[..., Bench]]:
    """Makes windows of one test."""
    yield from benches(tmp_path)


@pytest.fixture
def bench(make_bench: Callable[..., Bench]) -> Bench:
    """One window on its first page."""
    return make_bench()


@pytest.fixture(scope="module")
def make_shared_bench(themed: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Bench]]:
    """Makes windows that all tests of a module share."""
    yield from benches(tmp_path_factory.mktemp("window"))


@pytest.fixture(scope="module")
def shared_bench(make_shared_bench: Callable[..., Bench]) -> Bench:
    """One window for all tests of a module; with software OpenGL, making one takes a second."""
    return make_shared_bench()


@pytest.fixture
def tracking(shared_bench: Bench) -> Bench:
    """The simulated rig, tracking, nothing wrong, all panels shown."""
    shared_bench.track()
    if shared_bench.window.actions_.alone.isChecked():
        shared_bench.window.actions_.alone.trigger()
    for dock in shared_bench.window.docks.docks:
        dock.show()
    parts = shared_bench.window.screen_parts
    for plot in (parts.jitter, parts.latency, parts.rate):
        plot.pause_button.setChecked(False)
    shared_bench.window.setFocus()
    return shared_bench
