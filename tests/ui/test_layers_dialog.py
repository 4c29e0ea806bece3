"""The layers of the tracked hand in their window: masks, visibility order, pause, and what is said without a hand."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import Qt

from rhot_app.articulated.bodies import hand_bodies
from rhot_app.barehand.surface import surface_of
from rhot_app.hand.model import build_model
from rhot_app.ui.models.layers import LayerPictures


@pytest.fixture
def layers(tracking):
    """The dialog of a window that tracks, and a drawing in it; nothing is drawn between the tests."""
    bench = tracking
    bench.window.actions_.layers.trigger()
    dialog = bench.window.dialogs.layers
    dialog.pause_button.setChecked(False)
    dialog.over_check.setChecked(True)
    dialog.camera_box.setCurrentIndex(0)
    bench.until(lambda: dialog.shown_of is not None and dialog.shown_of[0] == "left")
    yield bench, dialog
    if bench.window.dialogs.layers is not None:
        dialog.pause_button.setChecked(True)


def test_every_layer_is_listed_from_the_front_on(layers):
    bench, dialog = layers
    _, names = hand_bodies(surface_of(build_model(bench.controller.rig.hand)))
    rows = [dialog.list.item(row).text() for row in range(dialog.list.count())]
    assert len(rows) == len(names)
    assert sorted(row.split("  ", 1)[1] for row in rows) == sorted(name.replace("_", " ") for name in names)
    assert [int(row.split()[0].strip("()")) for row in rows] == list(range(1, len(names) + 1))
    coloured = {line.rgb for line in dialog.shown.lines}
    assert len(coloured) == len(names), "each layer has a colour of its own"


def test_the_masks_follow_the_hand_until_they_are_paused(layers):
    bench, dialog = layers
    first = dialog.shown
    bench.until(lambda: dialog.shown is not first and not np.array_equal(dialog.shown.image, first.image))
    bench.press(Qt.Key.Key_Space, dialog)
    assert dialog.pause_button.isChecked()
    bench.until(lambda: not dialog.drawing)
    held = dialog.shown
    bench.run(0.2)
    assert dialog.shown is held
    bench.press(Qt.Key.Key_F1, dialog)
    assert dialog.tools.guide.page == "scene"


def test_each_camera_has_its_own_picture(layers):
    bench, dialog = layers
    assert [dialog.camera_box.itemText(k) for k in range(2)] == ["left", "right"]
    dialog.over_check.setChecked(False)
    bench.until(lambda: (dialog.shown.image[0, 0] == 60).all())
    dialog.camera_box.setCurrentIndex(1)
    bench.until(lambda: dialog.shown_of[0] == "right")
    left = LayerPictures(bench.controller.rig).draw("left", dialog.shown_of[1], None)  # the hand moves
    columns = [np.flatnonzero((one.image != 60).any(axis=(0, 2))).mean() for one in (left, dialog.shown)]
    assert columns[0] - columns[1] > 20.0, "the right camera sees the hand farther left"


def test_without_a_hand_it_says_so_and_closing_forgets_it(layers):
    bench, dialog = layers
    bench.controller.start_or_stop()
    bench.until(lambda: "No hand" in dialog.sentence.text())
    assert dialog.list.count() == 0 and dialog.shown is None
    dialog.close()
    bench.until(lambda: bench.window.dialogs.layers is None)


def test_picture(layers):
    bench, dialog = layers
    dialog.move(0, 0)
    bench.keep("layers", 60, lambda: dialog.grab().toImage())
