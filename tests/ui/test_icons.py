"""The drawings of the icons: all there are, in the colours of the scheme, and sharp on every screen."""

from __future__ import annotations

import re

import numpy as np
import pytest
from PySide6.QtCore import QSize
from PySide6.QtGui import QColor, QImage
from PySide6.QtWidgets import QToolBar, QToolButton

from rhot_app.ui.common.shapes import ShapeMark, shape_icon, shape_pixmap, show_overflow
from rhot_app.ui.models.palette import DARK, LIGHT
from rhot_node.files import resource_path

FOLDER = resource_path("icons")
OF_SHEETS = {"checked"}  # named by the style sheet, which gives no colours
NAMES = sorted(path.stem for path in FOLDER.glob("*.svg") if path.stem not in OF_SHEETS)


def pixels(image: QImage) -> np.ndarray:
    """(H, W, 4) uint8, red first."""
    image = image.convertToFormat(QImage.Format.Format_RGBA8888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    return rows[:, :4 * image.width()].reshape(image.height(), image.width(), 4).copy()


@pytest.mark.parametrize("name", NAMES)
def test_an_icon_is_drawn_in_the_one_colour_asked_for(themed, name):
    for colour in (DARK.text, LIGHT.accent):
        drawn = pixels(shape_pixmap(name, colour, 32).toImage())
        solid = drawn[drawn[..., 3] > 250][:, :3].astype(int)
        assert len(solid) > 20, "there is something to see"
        assert np.abs(solid - QColor(colour).getRgb()[:3]).max() <= 2
        assert drawn[[0, -1]][..., 3].max() == 0 and drawn[:, [0, -1]][..., 3].max() == 0, "nothing is cut off"


@pytest.mark.parametrize("name", NAMES)
def test_lines_have_one_width_and_every_colour_is_the_schemes(name):
    text = (FOLDER / f"{name}.svg").read_text(encoding="utf-8")
    assert set(re.findall(r'(?:fill|stroke)="([^"]+)"', text)) <= {"currentColor", "none"}
    assert set(re.findall(r'stroke-width="([^"]+)"', text)) <= ({"2", "1"} if name == "hatch" else {"2"})


@pytest.mark.parametrize("name", ["octagon", "play", "hatch"])
def test_an_icon_is_sharp_at_twice_the_pixels(themed, name):
    """It is drawn anew, not enlarged: its edges stay one device pixel wide."""
    icon = shape_icon(name, DARK.text)
    once, twice = (pixels(icon.pixmap(QSize(18, 18), ratio).toImage()) for ratio in (1.0, 2.0))
    assert (once.shape[:2], twice.shape[:2]) == ((18, 18), (36, 36))
    enlarged = once.repeat(2, axis=0).repeat(2, axis=1)
    soft = [int(np.count_nonzero((each[..., 3] > 8) & (each[..., 3] < 247))) for each in (twice, enlarged)]
    assert soft[0] < 0.75 * soft[1]


def test_the_marks_follow_the_scheme(tracking):
    """Toolbar and marks have the colours of the scheme that was chosen last."""
    def colour(scheme):
        tracking.window.appearance.set_scheme(scheme)
        drawn = pixels(tracking.window.actions_.start.icon().pixmap(QSize(24, 18), 2.0).toImage())
        return np.median(drawn[drawn[..., 3] == 255], axis=0)[:3].tolist()

    for name, scheme in (("dark", DARK), ("light", LIGHT)):
        assert colour(name) == pytest.approx(QColor(scheme.accent).getRgb()[:3], abs=1)
    tracking.window.appearance.set_scheme("dark")


def test_a_mark_draws_the_shape_it_was_given(qtbot):
    mark = ShapeMark(16)
    qtbot.addWidget(mark)
    mark.set_shape("disc", "#ff0000")
    filled = pixels(mark.grab().toImage())
    mark.set_shape("ring", "#ff0000")
    hollow = pixels(mark.grab().toImage())
    assert tuple(filled[8, 8, :3]) == (255, 0, 0) and tuple(hollow[8, 8, :3]) != (255, 0, 0)


def test_the_arrow_of_a_narrow_bar_can_be_seen(qtbot):
    bar = QToolBar()
    qtbot.addWidget(bar)
    for number in range(20):
        bar.addAction(f"Entry {number}")
    show_overflow(bar, "#ffffff")
    bar.resize(200, 40)
    bar.show()
    qtbot.waitExposed(bar)
    arrow = bar.findChild(QToolButton, "qt_toolbar_ext_button")
    assert arrow.isVisible() and not arrow.icon().isNull()
