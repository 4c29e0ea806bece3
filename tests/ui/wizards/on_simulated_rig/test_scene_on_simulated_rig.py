"""The scene of a running simulated rig is saved and opened again, by clicks in Qt's own file dialogs."""

from __future__ import annotations

import pytest
from person import Person
from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialogButtonBox, QFileDialog, QLineEdit, QMessageBox

from rhot_app.simulator.scene.scene_description import HandShow
from rhot_app.simulator.scene.scene_file import read_scene
from rhot_app.ui.backend.contract import TwinChoice
from rhot_app.ui.backend.session import Session
from rhot_app.ui.common.controller import Controller
from rhot_app.ui.common.settings import Settings
from rhot_app.ui.main_window import MainWindow

START_S = 400.0


class Director(Person):
    """A person who tracks the simulated rig, and who types names into file dialogs."""

    def told(self):
        return self.window.toolbar.badge.word, self.window.advice.texts

    def track(self):
        self.until(lambda: self.window.toolbar.badge.word == "TRACKING", START_S)

    def choose(self, action, name, *, replace=None):
        """Trigger an action, type a name and press Enter, None: Escape; answer whether a file is to be replaced."""
        asked = []

        def confirm():
            box = QApplication.activeModalWidget()
            if isinstance(box, QMessageBox):
                asked.append(box.text())
                box.button(box.StandardButton.Yes if replace else box.StandardButton.No).click()
                dialog = QApplication.activeModalWidget()
                if isinstance(dialog, QFileDialog):  # it goes on asking after a No
                    dialog.reject()

        def answer():
            dialog = QApplication.activeModalWidget()
            assert isinstance(dialog, QFileDialog)
            if name is None:
                QTest.keyClick(dialog, Qt.Key.Key_Escape)
                return
            dialog.findChild(QLineEdit, "fileNameEdit").setText(str(name))
            QTimer.singleShot(300, confirm)
            dialog.findChild(QDialogButtonBox).buttons()[0].click()

        QTimer.singleShot(300, answer)
        action.trigger()
        return asked


@pytest.fixture
def director(themed, tmp_path):
    session = Session(tmp_path / "engine")
    controller = Controller(session)
    window = MainWindow(controller, Settings(tmp_path / "app.ini"))
    window.controller = controller
    yield Director(window)
    window.close()
    controller.shut_down()
    window.deleteLater()


@pytest.mark.timeout(900)
@pytest.mark.study("rhot_app/ui", "rhot_app/simulator/scene")
def test_a_scene_is_saved_while_it_runs_and_opened_again(director, tmp_path):
    actions, path = director.window.actions_, tmp_path / "lamp.json"
    director.window.open_twin(TwinChoice(motion="still"))
    director.track()
    director.window.controller.backend.show_in_twin("hand:wave")
    for name, answer in ((None, ""), (tmp_path / "nowhere" / "lamp.json", "nowhere"), ("/sys/lamp.json", "/sys")):
        director.choose(actions.save_scene, name)
        if answer:
            director.until(lambda answer=answer: any(
                answer in text and "nothing was saved" in text for text in director.window.advice.texts))
        director.window.passing.clear()
    assert not list(tmp_path.glob("*.json"))
    assert director.choose(actions.save_scene, path.with_suffix("")) == []
    director.until(path.exists)
    assert read_scene(path).shown() == HandShow("wave")
    before = path.read_bytes()
    director.window.controller.backend.show_in_twin("hand:still")
    for replace in (False, True):
        asked = director.choose(actions.save_scene, path.with_suffix(""), replace=replace)
        assert len(asked) == 1 and "lamp.json" in asked[0]
        director.run(0.5)
        assert (path.read_bytes() != before) is replace
    director.window.controller.backend.show_in_twin("hand:wave")
    director.choose(actions.open_scene, path)
    director.until(lambda: director.window.toolbar.badge.word != "TRACKING")
    director.track()
    assert director.window.controller.backend.shown_in_twin() == "hand:still"
