"""No button of a wizard moves when the sentence changes, and every sentence fits into its place."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from fake_backend import InProcessSolver
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLineEdit,
    QMenu,
    QWidget,
)
from wizard_rig import FakeRigClient, FakeSettingsStore

from rhot_app.calibration.registry import InForce, calibration, calibrations
from rhot_app.project import load_rig
from rhot_app.ui import wizards
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.simulated_rig_menus import FIRST, THINGS
from rhot_app.ui.wizards import colours, framework
from rhot_app.ui.wizards.framework.definition import WizardContext
from rhot_app.ui.wizards.framework.frame import WizardFrame
from rhot_app.ui.wizards.framework.step import StepView
from rhot_app.ui.wizards.framework.work import Work
from rhot_app.ui.wizards.launcher import make_wizard
from rhot_node.files import resource_path

SIZES = ((1280, 800), (1024, 700))
LONG = "The board is seen by neither camera, because it is too dark, too far away or turned too much. " * 4
AIMS = (QAbstractButton, QComboBox, QLineEdit, QAbstractSpinBox)


class Silence:
    """A listener that hears nothing."""

    def poll(self):
        return []

    def close(self):
        pass


@pytest.fixture
def frame_of(themed):
    """A function that lays out a wizard by its module's name, without processes; gives window, frame and definition."""
    windows = []

    def lay_out(module, size):
        rig = load_rig(resource_path("rigs", "two_pis.json"))
        client = FakeRigClient(rig)
        client.answers = {name: {"known": False} for name in ("refined", "adapted", "measured")}
        context = WizardContext(calibration(module), InForce(rig, None, client.told), client.connect, DARK,
                                FakeSettingsStore(), Silence)
        definition, window = make_wizard(context), QWidget()
        cameras = tuple(node.name for node in rig.nodes)
        frame = WizardFrame(definition, cameras, Work(InProcessSolver(), window), DARK, window)
        window.resize(*size)
        window.show()
        windows.append((window, definition))
        return window, frame, definition

    yield lay_out
    for window, definition in windows:
        window.hide()
        if definition.put_back is not None:
            definition.put_back()
        window.deleteLater()


def places(window):
    """Where everything stands that a mouse may aim at."""
    for _ in range(3):  # a scrolling page is laid out once more when its bar has come or gone
        QApplication.processEvents()
    return {(kind.__name__, number): part.mapTo(window, part.rect().topLeft()).toTuple()
            for kind in AIMS for number, part in enumerate(window.findChildren(kind)) if part.isVisible()}


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
@pytest.mark.parametrize("module", [one.name for one in calibrations()])
def test_nothing_moves_when_the_sentences_change(module, size, frame_of):
    window, frame, definition = frame_of(module, size)
    frame.offer_twin(QMenu(window))
    for number, page in enumerate(definition.pages):
        frame.show_page(page, number)
        before = None
        for sentence, hint in (("Wait.", ""), (LONG, ""), (LONG, LONG), ("Wait.", LONG)):
            frame.show_view(StepView(sentence, hint=hint), page.step, number, [False] * len(definition.pages))
            now = places(window)
            assert before in (None, now), page.step.title
            before = now
        assert (window.width(), window.height()) == size


def known_sentences():
    """What the steps' views say in plain words: the first argument of StepView, and what methods called `_sentence`
    and `sentence` return."""
    for package in (wizards, colours, framework):
        for path in sorted(Path(package.__path__[0]).glob("*.py")):
            for node in ast.walk(ast.parse(path.read_text())):
                parts = []
                if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "StepView" and node.args:
                    parts = [node.args[0]]
                elif isinstance(node, ast.FunctionDef) and node.name in ("_sentence", "sentence"):
                    parts = [one.value for one in ast.walk(node) if isinstance(one, ast.Return) and one.value]
                for one in (found for part in parts for found in ast.walk(part)):
                    if isinstance(one, ast.Constant) and isinstance(one.value, str):
                        yield one.value


def test_every_sentence_is_seen_whole_in_a_small_window(frame_of):
    sentences = set(known_sentences())
    for one in calibrations():
        *_, definition = frame_of(one.name, SIZES[-1])
        sentences |= {page.step.view().sentence for page in definition.pages}
    assert len(sentences) > 60
    _, frame, definition = frame_of("lens", SIZES[-1])
    frame.show_page(definition.pages[0], 0)
    QApplication.processEvents()
    for sentence in sorted(sentences):
        frame.sentence.setText(sentence)
        assert frame.sentence.whole, sentence


def test_the_last_button_keeps_its_width_whatever_it_says(frame_of):
    _, frame, definition = frame_of("lens", SIZES[0])
    last = definition.pages[-1]
    frame.show_page(last, len(definition.pages) - 1)
    before = None
    for state in ("proposed", "used", "restored"):
        last.step.finish(state)
        frame.show_view(last.step.view(), last.step, len(definition.pages) - 1, [False] * len(definition.pages))
        QApplication.processEvents()
        now = frame.next_button.geometry(), frame.back_button.geometry()
        assert before in (None, now)
        before = now


def test_the_simulated_rig_says_what_a_person_would_measure(frame_of):
    """Sizes of board and ruler, and entries of the menu that there are."""
    entries = {*FIRST.values(), *(text for _, text, _ in THINGS), "Shows one marker at"}
    told = {}
    for one in calibrations():
        window, frame, definition = frame_of(one.name, SIZES[-1])
        for number, page in enumerate(definition.pages):
            frame.show_page(page, number)
            assert frame.twin_facts.text() == "", "a real rig has nobody to be told"
        frame.offer_twin(QMenu(window))
        for number, page in enumerate(definition.pages):
            frame.show_page(page, number)
            text = frame.twin_facts.text()
            assert not text or text.partition(":")[0].removesuffix(".") in entries, text
            QApplication.processEvents()
            assert frame.twin_facts.whole
            told[one.name] = told.get(one.name, "") + text
    assert all(told[module] for module in ("lens", "stereo", "depth", "time", "filters", "bones", "alignment"))
    assert all("25 mm" in told[module] for module in ("lens", "stereo")) and "200 mm" in told["stereo"]
