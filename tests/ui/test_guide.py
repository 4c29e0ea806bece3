"""The guide: every page is there, F1 opens the one that fits, links between pages work."""

from __future__ import annotations

import re

import pytest
from PySide6.QtCore import QPoint, Qt, QUrl

from rhot_app.ui.common.guide import GUIDE, PAGES, anchor_of, page_of, page_path


@pytest.mark.parametrize("name", [name for name, _ in PAGES])
def test_every_page_is_written(name):
    text = page_path(name).read_text()
    assert text.startswith("# ") and len(text) > 300


def test_no_page_is_left_out():
    """`start.de.md` is the page `start` in German."""
    assert {path.name.partition(".")[0] for path in GUIDE.glob("*.md")} - {"README"} == {name for name, _ in PAGES}


def test_the_key_table_matches_the_window(bench):
    text = page_path("keys").read_text()
    keys = set(re.findall(r"^\| `([^`]+)`", text, re.MULTILINE))
    window = bench.window
    actions = [*window.actions_.all(), *window.docks.actions]
    assert {action.shortcut().toString() for action in actions if not action.shortcut().isEmpty()} <= keys


def test_f1_opens_the_page_of_the_panel_in_use(bench):
    bench.click(bench.window.welcome.twin_button)
    bench.until(lambda: bench.controller.rig is not None)
    parts = bench.window.screen_parts
    for widget, page in ((parts.jitter.pause_button, "plots"), (parts.scene, "scene"),
                         (parts.cameras.views["left"], "cameras"), (bench.window.welcome.twin_button, "start"),
                         (bench.window, "window")):
        assert page_of(widget) == page
    parts.scene.setFocus()
    bench.until(parts.scene.hasFocus)
    bench.press(Qt.Key.Key_F1)
    assert bench.window.guide_page == "scene"
    bench.window.dialogs.guide.browser.anchorClicked.emit(QUrl("troubles.md"))
    assert bench.window.guide_page == "troubles"
    assert "wrong" in bench.window.dialogs.guide.browser.toPlainText()


def test_a_link_to_a_section_leads_there(bench):
    bench.window.open_guide("window")
    guide = bench.window.dialogs.guide
    bench.until(lambda: guide.browser.verticalScrollBar().maximum() > 0)
    assert guide.list.horizontalScrollBar().maximum() == 0, "every title fits"
    guide.browser.anchorClicked.emit(QUrl("tracker.md#when-a-camera-sees-nothing"))
    bench.until(lambda: guide.browser.verticalScrollBar().value() > 0)
    bench.until(lambda: "When a camera sees nothing" in guide.browser.cursorForPosition(QPoint(40, 2)).block().text())


def test_links_between_pages_name_sections_that_are_there():
    for name, _ in PAGES:
        for page, section in re.findall(r"\]\((\w+)?(?:\.md)?#([\w-]+)\)", page_path(name).read_text()):
            headings = re.findall(r"^#+ (.+)$", page_path(page or name).read_text(), re.MULTILINE)
            assert section in [anchor_of(heading) for heading in headings], f"{name}: {page}#{section}"
