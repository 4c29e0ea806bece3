"""Pictures of every page for the guide. They are written when RHOT_UPDATE_SCREENSHOTS=1; otherwise the pages must show
something, and the pictures must be there."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from fake_engine import FakeEngine
from PySide6.QtCore import QSize
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication

from rhot_app.engine.status import Advice
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.nodes_dialog import NodesDialog
from rhot_app.ui.rig_dialog import RigDialog

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "screenshots"
UPDATE = os.environ.get("RHOT_UPDATE_SCREENSHOTS") == "1"
SIZE = QSize(1280, 800)
WRIST = "Right camera saw no wrist marker for 12 s: it is behind the forearm. Turn the hand or add rhot8."


def picture_of(window) -> QImage:
    """What is on the screen where the window stands, OpenGL included."""
    QApplication.processEvents()
    return window.screen().grabWindow(window.winId()).toImage()


def colours_in(image: QImage) -> int:
    """How many different colours the picture has, in coarse steps."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), rgb.bytesPerLine())[:, :3 * rgb.width()]
    coarse = (rows.reshape(-1, 3) >> 4).astype(np.intp) @ np.array([256, 16, 1])
    return int(np.count_nonzero(np.bincount(coarse)))


def check(name: str, image: QImage, least_colours: int) -> None:
    """Write the picture, or see that it is neither blank nor missing in the docs."""
    assert colours_in(image) >= least_colours, f"the page {name} is nearly blank"
    path = FOLDER / f"{name}.png"
    if UPDATE:
        FOLDER.mkdir(parents=True, exist_ok=True)
        assert image.save(str(path))
    assert path.exists(), f"{path} is missing; run this test with RHOT_UPDATE_SCREENSHOTS=1"


@pytest.fixture
def shown(tracking):
    """The shared window at the size of the pictures, in the dark scheme."""
    tracking.window.resize(SIZE)
    tracking.window.move(0, 0)
    if tracking.window.settings.scheme != "dark":
        tracking.window.appearance.set_scheme("dark")
    tracking.window.screen_parts.scene.reset_view()
    tracking.window.docks.arrange()
    tracking.backend.engine.session += 1
    tracking.run(0.4)
    return tracking


def scene_colours(bench) -> int:
    """Colours inside the scene alone: a scene without OpenGL has one."""
    scene = bench.window.screen_parts.scene
    image = picture_of(bench.window)
    corner = scene.mapTo(bench.window, scene.rect().topLeft())
    return colours_in(image.copy(corner.x(), corner.y(), scene.width(), scene.height()))


def test_first_page(bench):
    bench.window.resize(SIZE)
    bench.run(0.5)
    check("welcome", picture_of(bench.window), 20)


def test_progress_page(bench):
    bench.window.resize(SIZE)
    bench.backend.gate.clear()
    bench.window.welcome.twin_button.click()
    bench.until(lambda: bench.window.welcome.progress_bar.value() == 40)
    check("starting", picture_of(bench.window), 12)


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_tracking(shown, scheme):
    if scheme != "dark":
        shown.window.appearance.set_scheme(scheme)
    shown.run(20.0 if UPDATE else 0.5)
    assert scene_colours(shown) > 40
    check("tracking" if scheme == "dark" else "tracking-light", picture_of(shown.window), 80)


def test_something_is_hidden(shown):
    shown.backend.engine.hidden = {"wrist": "right", "ring": "both"}
    shown.backend.engine.advice = (Advice("warning", WRIST),)
    shown.until(lambda: shown.window.advice.texts == [WRIST])
    shown.window.screen_parts.scene.frame_hand()
    shown.run(0.7)
    check("partial", picture_of(shown.window), 80)


def test_the_engine_is_gone(shown):
    shown.backend.gate.clear()
    shown.backend.engine.dead = True
    shown.until(lambda: shown.window.toolbar.badge.word == "NO ENGINE")
    shown.run(0.8)
    check("no-engine", picture_of(shown.window), 40)


def test_scene_alone(shown):
    shown.window.actions_.alone.trigger()
    shown.window.screen_parts.scene.frame_hand()
    shown.run(0.7)
    check("scene", picture_of(shown.window), 60)


def test_dialogs(qtbot, bench):
    for name, dialog in (("connect-nodes", NodesDialog(DARK)), ("rig-cameras", RigDialog(FakeEngine().rig, "cameras")),
                         ("rig-markers", RigDialog(FakeEngine().rig, "markers"))):
        qtbot.addWidget(dialog)
        dialog.show()
        qtbot.waitExposed(dialog)
        bench.run(0.2)
        check(name, dialog.grab().toImage(), 10)
    bench.window.open_guide("window")
    bench.run(0.3)
    check("guide", bench.window.dialogs.guide.grab().toImage(), 12)
