"""In a small window nothing is cut, in every language: each window, dialog, tab, and page of a wizard."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from functools import cache
from typing import Any

import pytest
from person import wait
from PySide6.QtCore import QSize
from PySide6.QtWidgets import QAbstractButton, QHeaderView, QLabel, QTabWidget, QVBoxLayout, QWidget
from screen_pictures import cut_texts
from test_cameras_dialog import HELD, WEBCAM, StillPreview
from test_open_and_close import OPENERS, LendingBackend, Opener
from test_screenshots import connecting

from rhot_app.sources.pairing import NodeAddress
from rhot_app.state import Condition
from rhot_app.ui.common.menu import without_letter
from rhot_app.ui.common.record_table import RecordTable
from rhot_app.ui.dialogs.cameras_dialog import CamerasDialog
from rhot_app.ui.dialogs.nodes_dialog import PairDialog
from rhot_app.ui.language import LANGUAGES, tr, use_language
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.models.words import CONDITIONS
from rhot_app.ui.wizards.colours.paint_list import PaintList, PaintRow
from rhot_app.ui.wizards.framework.page import RowTable
from rhot_app.ui.wizards.framework.window import WizardWindow
from rhot_node.files import resource_path

SMALL = QSize(1024, 640)
MORE = {
    "connect nodes": connecting,
    "pair a node": lambda: PairDialog("left", NodeAddress("192.168.1.11"), lambda address, code: "left"),
    "cameras": lambda: CamerasDialog(DARK, devices=lambda: (WEBCAM, HELD),
                                     preview=lambda source, before: StillPreview(source))}
"""Dialogs that the main window waits for."""
CAMERAS = {"left", "right"}
"""Names in the rig file, which stay as they are."""


@pytest.fixture(scope="module", params=LANGUAGES)
def small(request, make_shared_bench, tmp_path_factory):
    """The main window in each language, tracking."""
    use_language(request.param)
    bench = make_shared_bench(LendingBackend(tmp_path_factory.mktemp("rig") / "desk.json"))
    bench.window.resize(SMALL)
    bench.until(bench.window.welcome.twin_button.isVisible)
    yield bench
    use_language("en")


@pytest.fixture
def at_work(small):
    """The same with the simulated rig."""
    if small.controller.rig is None:
        small.backend.calm()
        small.click(small.window.welcome.twin_button)
        tracking = tr(CONDITIONS[Condition.TRACKING.value].word)
        small.until(lambda: small.window.toolbar.badge.word == tracking)
    return small


def faces(opened: Any) -> Iterator[str]:
    """Shows each page of a wizard and each tab of a dialog in turn; its title."""
    tabs = opened.findChild(QTabWidget)
    if isinstance(opened, WizardWindow):
        opened.tools.timer.stop()
        pages = opened.definition.pages
        for number, page in enumerate(pages):
            view = page.step.view()
            opened.frame.show_page(page, number)
            page.show_view(view)
            opened.frame.show_view(view, page.step, number, [False] * len(pages))
            yield page.step.title
    elif tabs is not None:
        for number in range(tabs.count()):
            tabs.setCurrentIndex(number)
            yield tabs.tabText(number)
    else:
        yield opened.windowTitle()


@cache
def translated() -> frozenset[str]:
    """English sentences that no other language has as they are."""
    found = set()
    for path in resource_path("translations", "rhot_de.ts").parent.glob("rhot_*.ts"):
        for message in ElementTree.parse(path).iter("message"):
            found.add((message.findtext("source") or "", message.findtext("translation") or ""))
    return frozenset(source for source, _ in found) - {translation for _, translation in found}


def english(window: QWidget) -> list[str]:
    """What is shown in English although it has been translated."""
    parts = [part for kind in (QLabel, QAbstractButton) for part in window.findChildren(kind) if part.isVisible()]
    return [part.text() for part in parts if without_letter(part.text()) in translated() - CAMERAS]


def cut_names(window: QWidget) -> list[str]:
    """Tables in sight without a row so far whose first column, which says what a row is about, will be as narrow as the
    others: it shares the width with them. A `RowTable` wraps its texts. Those with rows are read by `cut_texts`."""
    found = []
    for table in window.findChildren(RecordTable):
        header = table.horizontalHeader()
        if table.isVisible() and header.count() > 1 and not table.records and not isinstance(table, RowTable):
            shares = all(header.sectionResizeMode(k) == QHeaderView.ResizeMode.Stretch for k in range(2))
            found += [type(table).__name__] if shares else []
    return found


def assert_whole(window: QWidget, title: str) -> None:
    least = window.minimumSizeHint()
    assert least.width() <= SMALL.width() and least.height() <= SMALL.height(), (title, least)
    figures = re.compile(r"-?\d+°|–")  # have room for longer ones
    assert [text for text in cut_texts(window) if not figures.fullmatch(text)] == [], title
    assert cut_names(window) == [], title
    assert tr("Close") == "Close" or english(window) == [], title


def test_the_first_page_and_the_rig_at_work_are_whole(small):
    assert_whole(small.window, "first page")


@pytest.mark.parametrize("opener", OPENERS, ids=lambda opener: opener.name)
def test_what_the_menus_open_is_whole(at_work, opener: Opener):
    opener.open(at_work.window)
    wait(lambda: (shown := opener.find(at_work.window)) is not None and shown.isVisible(), told=lambda: opener.name)
    opened = opener.find(at_work.window)
    opened.resize(opened.size().boundedTo(SMALL))
    try:
        for title in faces(opened):
            assert_whole(opened, title)
    finally:
        opened.close()
        wait(lambda: opener.find(at_work.window) is None)


@pytest.mark.parametrize("name", MORE)
def test_a_dialog_that_is_waited_for_is_whole(small, qtbot, name):
    dialog = MORE[name]()
    qtbot.addWidget(dialog)
    dialog.show()
    qtbot.waitExposed(dialog)
    dialog.resize(dialog.size().boundedTo(SMALL))
    assert_whole(dialog, name)
    dialog.reject()


def test_names_beside_their_colours_are_read_as_they_stand(small, qtbot):
    """`cut_texts` itself: whole as the list lays them out, cut in a column that is a little narrower."""
    paints = PaintList(DARK, ("marker", "hue"))
    paints.show_rows(tuple(PaintRow(name, (200, 30, 30), "tick", "± 9°") for name in ("thumb", "middle")), "thumb")
    frame = QWidget()
    qtbot.addWidget(frame)
    QVBoxLayout(frame).addWidget(paints)
    frame.show()
    assert cut_texts(frame) == []
    header = paints.horizontalHeader()
    header.setSectionResizeMode(1, QHeaderView.ResizeMode.Fixed)
    header.resizeSection(1, header.sectionSize(1) - 8)
    assert paints.text(1, 1) in cut_texts(frame)
