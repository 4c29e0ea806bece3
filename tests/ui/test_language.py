"""The window in another language: what is translated, what falls back to English, and that German fits the window."""

from __future__ import annotations

import subprocess
import sys
from datetime import datetime

import pytest
from fake_engine import synthetic_rig
from PySide6.QtCore import Qt, QUrl
from PySide6.QtWidgets import QDialogButtonBox, QDoubleSpinBox, QLabel
from screen_pictures import SIZE, cut_texts
from test_nodes_dialog import found
from test_settings_dialog import select

from resources.translations.update import release
from rhot_app.engine.status import Advice, advise, words
from rhot_app.state import Condition
from rhot_app.ui import language
from rhot_app.ui.backend.contract import Opened
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.dialogs.found_nodes import FoundNodes
from rhot_app.ui.dialogs.outputs_dialog import OutputsDialog
from rhot_app.ui.language import date_text, tr, use_language
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.models.rows import marker_name
from rhot_app.ui.models.words import CONDITIONS, tip

MESSAGE = """<message{numerus}><source>{source}</source><comment>{comment}</comment>
<translation>{translation}</translation></message>"""


@pytest.fixture(autouse=True)
def english_again():
    yield
    use_language("en")


@pytest.fixture
def german(themed):
    use_language("de")


@pytest.fixture
def klingon(tmp_path, monkeypatch):
    """A function that writes a translation file and uses it: (text, comment, forms) for each message."""
    def use(*messages: tuple[str, str, tuple[str, ...]]) -> None:
        (tmp_path / "translations").mkdir(exist_ok=True)
        path = tmp_path / "translations" / "rhot_de.ts"
        body = "".join(MESSAGE.format(
            numerus=' numerus="yes"' if len(forms) > 1 else "", source=source, comment=comment,
            translation="".join(f"<numerusform>{form}</numerusform>" for form in forms) if len(forms) > 1 else forms[0])
            for source, comment, forms in messages)
        path.write_text(f'<?xml version="1.0" encoding="utf-8"?><!DOCTYPE TS><TS version="2.1" language="de"><context>'
                        f"<name></name>{body}</context></TS>")
        release(path, path.with_suffix(".qm"))
        monkeypatch.setattr(language, "resource_path", lambda *parts: tmp_path.joinpath(*parts))
        use_language("de")

    return use


def test_a_sentence_takes_its_values_and_its_plural(klingon):
    klingon(("Saved {path}.", "", ("{path} gespeichert.",)), ("{n} file of {name}", "{n} files of {name}",
                                                              ("{n} Datei von {name}", "{n} Dateien von {name}")))
    assert tr("Saved {path}.", path="a.json") == "a.json gespeichert."
    assert [tr("{n} file of {name}", "{n} files of {name}", n, name="x") for n in (0, 1, 2)] == [
        "0 Dateien von x", "1 Datei von x", "2 Dateien von x"]
    use_language("en")
    assert [tr("{n} file of {name}", "{n} files of {name}", n, name="x") for n in (0, 1, 2)] == [
        "0 files of x", "1 file of x", "2 files of x"]


def test_a_comment_tells_two_meanings_apart(klingon):
    klingon(("Open", "a button", ("Öffnen",)), ("Open", "a state", ("Offen",)))
    assert (tr("Open", "a button"), tr("Open", "a state"), tr("Open")) == ("Öffnen", "Offen", "Open")


@pytest.mark.parametrize("wrong", ["{weg} gespeichert.", "Gespeichert.", "{path gespeichert.", "{path:d} gespeichert.",
                                   "{path.__class__} gespeichert.", ""])
def test_a_translation_that_does_not_fit_is_english(klingon, wrong):
    klingon(("Saved {path}.", "", (wrong,)))
    assert tr("Saved {path}.", path="a.json") == "Saved a.json."


def test_what_has_no_translation_is_english(german):
    assert tr("No such sentence {here}.", here=1) == "No such sentence 1."
    assert tr("") == ""


def test_words_that_are_made_at_the_import_follow_the_language():
    assert tr(CONDITIONS[Condition.TRACKING.value].word) == "TRACKING" and tip("rig").startswith("The rig file")
    use_language("de")
    assert tr(CONDITIONS[Condition.TRACKING.value].word) == "VERFOLGT" and tip("rig").startswith("Die Rig-Datei")


@pytest.mark.parametrize(("desktop", "found"), [("de_AT.UTF-8", "de"), ("eo.UTF-8", "en"), ("C", "en"),
                                                ("en_GB.UTF-8", "en")])
def test_the_desktop_decides_until_a_language_is_chosen(desktop, found):
    """In a process of its own: Qt reads the variables once."""
    code = "from rhot_app.ui.language import language_of as of; print(of('system'), of('en'), of('de'), of('xx'))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True,
                          env={"PATH": "", "LC_ALL": desktop, "LANG": desktop, "LANGUAGE": desktop.partition(".")[0]})
    assert done.stdout.split() == [found, "en", "de", found]


def test_the_settings_choose_the_language_of_the_next_start(bench, tmp_path):
    bench.choose(bench.window.menus.rig, bench.window.actions_.settings)
    bench.until(lambda: bench.window.dialogs.settings is not None and bench.window.dialogs.settings.isVisible())
    page = bench.window.dialogs.settings.general
    assert page.language_box.currentText() == "As the desktop" and page.language_note.isHidden()
    select(bench, page.language_box, 2)
    assert page.language_box.currentText() == "Deutsch" and page.language_note.isVisible()
    bench.click(bench.window.dialogs.settings.close_button)
    assert Settings(bench.window.settings.path).language == "de"
    assert tr("Help") == "Help", "this window stays as it is"
    select(bench, page.language_box, 1)
    assert page.language_note.isHidden()


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_the_german_window_is_german_and_nothing_is_cut(german, make_bench, scheme):
    bench = make_bench(scheme=scheme)
    window = bench.window
    window.resize(SIZE)
    assert window.toolbar.badge.word == "KEIN RIG" and window.welcome.twin_button.text() == "Simuliertes Rig starten"
    assert not cut_texts(window)
    if scheme == "dark":
        bench.keep("welcome.de", 20)
    bench.click(window.welcome.twin_button)
    bench.until(lambda: window.toolbar.badge.word == "VERFOLGT" and bench.said("Alles ist in Ordnung"))
    assert [dock.windowTitle() for dock in window.docks.docks] == ["Knoten", "Marker", "Kameras", "Hand", "Diagramme"]
    assert not [text for text in cut_texts(window) if not text.endswith("°")], "an angle has room for a longer one"
    shown = {label.text() for label in window.findChildren(QLabel) if label.isVisible()}
    assert {"Zeigefinger", "gemessen", "Handfläche", "Jitter je Marker"} <= shown
    assert not shown & {"thumb", "index", "measured", "palm", "ok "}
    assert window.actions_.record.text() == "Aufnehmen" and window.actions_.record.toolTip().endswith("(R).")
    assert window.actions_.start.toolTip().endswith("(Leertaste).")


@pytest.mark.parametrize("key, name", [(Qt.Key.Key_R, "rig"), (Qt.Key.Key_K, "calibrate"), (Qt.Key.Key_A, "view"),
                                       (Qt.Key.Key_H, "help")])
def test_german_menus_are_opened_by_german_letters(german, make_bench, key, name):
    bench = make_bench()
    bench.press(key, modifier=Qt.KeyboardModifier.AltModifier)
    menu = getattr(bench.window.menus, name)
    bench.until(menu.isVisible)
    assert any("&" in entry.text() for entry in menu.actions())
    bench.press(Qt.Key.Key_Escape, menu)


def test_the_engines_advice_is_said_in_the_language_of_the_window(german, make_bench):
    """Its words as well; what comes without a pattern stays as it is."""
    bench = make_bench()
    bench.click(bench.window.welcome.twin_button)
    bench.until(lambda: bench.window.toolbar.badge.word == "VERFOLGT")
    bench.backend.engine.advice = (
        advise("Node {name}: {message}", level="error", subject="tracking", name="left",
               message=words("it reports a fault; look at its log.")),
        Advice("warning", "The cameras' rays miss each other."))
    bench.until(lambda: bench.said("Knoten left: er meldet einen Fehler; in sein Protokoll sehen."))
    assert bench.backend.engine.advice[0].text == "Node left: it reports a fault; look at its log."
    bench.until(lambda: bench.said("The cameras' rays miss each other."))


def test_a_number_in_the_words_of_an_advice_is_said_in_german(german, make_bench):
    bench = make_bench()
    bench.click(bench.window.welcome.twin_button)
    bench.until(lambda: bench.window.toolbar.badge.word == "VERFOLGT")
    bench.backend.engine.advice = (advise(
        "{by} alone tracks the hand.{guess}", level="error", by="left", degrees=60,
        guess=words(" The distance is a guess, by the hand's size and an assumed lens ({degrees} degrees).")),)
    assert bench.backend.engine.advice[0].text.endswith("an assumed lens (60 degrees).")
    bench.until(lambda: bench.said("einem angenommenen Objektiv (60 Grad)."))


def test_a_marker_of_ones_own_keeps_its_name(german):
    assert tr("Open") != "Open" and marker_name("Open") == "Open"
    assert marker_name("thumb_tip") == tr("thumb tip") != "thumb tip"


def test_joint_sets_and_states_of_found_nodes_are_german(german, qtbot):
    dialog = OutputsDialog(Opened(synthetic_rig(), "", False, False, False), pytest.fail, lambda: None, lambda: DARK)
    qtbot.addWidget(dialog)
    box = dialog.joints_box
    assert [box.itemText(k) for k in range(box.count())] == [
        "own: 21 Gelenke", "openxr: 26 Gelenke", "mediapipe: 21 Gelenke"]
    table = FoundNodes(pytest.fail, ())
    qtbot.addWidget(table)
    table.table.show_records(found(("left", 11)).nodes)
    assert table.table.text(0, 4) == "bereit" and table.table.heads()[4] == "Zustand"


def test_copied_figures_keep_the_decimal_point(german, make_bench):
    bench = make_bench()
    bench.click(bench.window.welcome.twin_button)
    plot = bench.window.screen_parts.rate
    bench.until(lambda: len(plot.seconds) > 0)
    head, row = plot.csv().splitlines()[:2]
    assert head.startswith("time [s]") and "," in row and all(part == "" or float(part) == float(part)
                                                            for part in row.split(","))


def test_numbers_keep_the_point_and_dates_have_the_months_of_the_language(german):
    assert QDoubleSpinBox().textFromValue(1234.5) == "1234.50"
    assert date_text(datetime(2026, 5, 1, 9, 5)) == "01. Mai 2026, 09:05"
    use_language("en")
    assert date_text(datetime(2026, 5, 1, 9, 5)) == "01 May 2026, 09:05"


def test_german_questions_have_german_buttons(german):
    box = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
    assert box.button(QDialogButtonBox.StandardButton.Cancel).text().replace("&", "") == "Abbrechen"


def test_the_guide_opens_the_german_page_where_there_is_one(german, make_bench):
    bench = make_bench()
    bench.window.open_guide("start")
    guide = bench.window.dialogs.guide
    assert guide.browser.toPlainText().startswith("Erste Schritte")
    guide.browser.anchorClicked.emit(QUrl("start.md"))
    assert guide.page == "start"
    bench.window.open_guide("nodes")
    assert guide.browser.toPlainText().startswith("Nodes")
