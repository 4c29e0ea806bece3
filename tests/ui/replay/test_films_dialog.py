"""Films that somebody has already: chosen, tracked and replayed by clicks; what is missing is said before anything."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from drawn_films import RATE, StandIn, seen_by, use_networks, video
from fake_backend import InProcessSolver
from landmark_detector import landmark_rig, moving_hand
from person import Person
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog
from test_replay_window import Desk

from rhot_app.export.film_log import ChosenFilm, log_films
from rhot_app.project import save_rig
from rhot_app.recording.raw_log import LogReader
from rhot_app.sources.frame_sets import recorded_films
from rhot_app.ui.replay.films_dialog import FilmsDialog
from rhot_node.landmarks import networks

RIG = landmark_rig()


@pytest.fixture
def films(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the films of two cameras, in the wrong order of names, their rig, and a file that is no film."""
    hand = moving_hand(RIG, "grasp", 1.5, RATE, 1, 0.05)
    folder = tmp_path / "films"
    folder.mkdir()
    for node in RIG.nodes:
        video(folder / f"{node.name}-take1.avi", node.intrinsics, len(hand.times_s))
    save_rig(tmp_path / "rig.json", RIG)
    (tmp_path / "notes.mp4").write_text("no film")
    use_networks(monkeypatch, [StandIn(pixels[None], 0.95) for pixels in seen_by(RIG, hand.joints())])
    return folder


@pytest.fixture
def person(themed: Any) -> Iterator[Person]:
    person = Person(FilmsDialog(InProcessSolver))
    yield person
    person.window.close()
    person.window.deleteLater()


def answer(monkeypatch: pytest.MonkeyPatch, method: str, value: Any) -> None:
    """What the person chooses in the next file dialog."""
    monkeypatch.setattr(QFileDialog, method, lambda *arguments: value if method == "getExistingDirectory"
                        else (value, ""))


def said(person: Person, *words: str) -> Callable[[], bool]:
    return lambda: all(word in person.window.sentence.text() for word in words)


def test_two_films_of_a_folder_are_tracked_and_open(person: Person, films: Path, tmp_path: Path,
                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    dialog, opened = person.window, list[Path]()
    dialog.tracked.connect(opened.append)
    answer(monkeypatch, "getExistingDirectory", str(films))
    person.click(dialog.folder_button)
    person.until(said(person, "Several films need the rig"))
    assert not dialog.track_button.isEnabled()
    answer(monkeypatch, "getOpenFileName", str(tmp_path / "rig.json"))
    person.click(dialog.rig_choice.choose_button)
    person.until(dialog.track_button.isEnabled)
    assert [(film.camera, film.path.name) for film in dialog.films] == [
        (node.name, f"{node.name}-take1.avi") for node in sorted(RIG.nodes, key=lambda node: node.name)]
    person.until(lambda: "images/s" in dialog.table.text(0, 2))
    log = tmp_path / "hand.rhotlog"
    answer(monkeypatch, "getSaveFileName", str(log))
    person.click(dialog.track_button)
    person.until(lambda: opened == [log])
    assert said(person, "Bones", "A hand in")()
    reader = LogReader(log)
    reader.close()
    assert len(recorded_films(log, reader.rig)) == 2


def test_a_replay_of_landmarks_fits_a_small_screen(themed: Any, films: Path, tmp_path: Path) -> None:
    log_films(tmp_path / "rig.json", [ChosenFilm(node.name, films / f"{node.name}-take1.avi") for node in RIG.nodes],
              tmp_path / "hand.rhotlog")
    desk = Desk(tmp_path)
    desk.open(tmp_path / "hand.rhotlog")
    desk.window.resize(1024, 700)
    desk.until(lambda: desk.window.parts.films.isVisible())
    least = desk.window.minimumSizeHint()
    assert least.width() <= 1024 and least.height() <= 700 and desk.window.parts.transport.play_button.isVisible()
    desk.window.close()
    desk.window.deleteLater()


def test_what_is_missing_is_said(person: Person, films: Path, tmp_path: Path,
                                 monkeypatch: pytest.MonkeyPatch) -> None:
    dialog = person.window
    assert said(person, "Add the film")() and not dialog.track_button.isEnabled()
    dialog.add([tmp_path / "notes.mp4"])
    person.until(said(person, "notes.mp4"))
    assert not dialog.track_button.isEnabled() and dialog.table.text(0, 2) == "no film"
    dialog.table.selectRow(0)
    person.click(dialog.remove_button)
    dialog.add(sorted(films.iterdir()))
    dialog.rig_choice.show_path(tmp_path / "rig.json")
    dialog.field(1, 0).setCurrentIndex(dialog.field(0, 0).currentIndex())
    person.until(said(person, "two films"))
    dialog.rig_choice.show_path(tmp_path / "notes.mp4")
    person.until(said(person, "notes.mp4"))
    answer(monkeypatch, "getExistingDirectory", str(tmp_path))
    (tmp_path / "notes.mp4").unlink()
    person.click(dialog.folder_button)
    person.until(said(person, "holds no films"))


def test_what_was_chosen_for_a_film_stays_when_another_goes(person: Person, films: Path, tmp_path: Path) -> None:
    dialog = person.window
    dialog.rig_choice.show_path(tmp_path / "rig.json")
    dialog.add([tmp_path / "notes.mp4", *sorted(films.iterdir())])
    person.until(lambda: dialog.table.text(0, 2) == "no film")
    dialog.field(2, 3).setValue(0.25)
    dialog.field(2, 0).setCurrentIndex(0)
    chosen = dialog.films[2]
    person.click(dialog.table.viewport(), dialog.table.visualRect(dialog.table.records_model.index(0, 1)).center())
    person.click(dialog.remove_button)
    assert dialog.films[1] == chosen and chosen.offset_s == 0.25 and len(dialog.films) == 2
    assert (dialog.field(1, 3).value(), dialog.field(1, 0).currentText()) == (0.25, chosen.camera)


def flashing(path: Path, at: int) -> Path:
    """A film of 25 images/s in which a lamp goes on at a frame."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 25.0, (64, 48))
    for number in range(60):
        writer.write(np.full((48, 64, 3), 150 if number >= at else 40 + number % 2, np.uint8))
    writer.release()
    return path


def test_films_are_aligned_by_a_flash_and_silence_is_no_sound(person: Person, tmp_path: Path) -> None:
    dialog = person.window
    dialog.add([flashing(tmp_path / "left.avi", 30), flashing(tmp_path / "right.avi", 20)])
    person.until(dialog.flash_button.isEnabled)
    person.click(dialog.flash_button)
    person.until(said(person, "Aligned", "right.avi"))
    assert [film.offset_s for film in dialog.films] == [0.0, pytest.approx(0.4, abs=0.02)]
    person.click(dialog.sound_button)
    person.until(said(person, "sound"))
    assert [film.offset_s for film in dialog.films] == [0.0, pytest.approx(0.4, abs=0.02)], "a refusal changes nothing"


def test_one_film_needs_no_rig_and_without_networks_nothing_is_begun(person: Person, films: Path, tmp_path: Path,
                                                                     monkeypatch: pytest.MonkeyPatch) -> None:
    from rhot_node.errors import KeypointError

    def missing() -> None:
        raise KeypointError("the hand networks are not installed. Run `rhot landmarks install`.")

    monkeypatch.setattr(networks, "open_hand_networks", missing)
    dialog = person.window
    dialog.add([next(films.iterdir())])
    person.until(dialog.track_button.isEnabled)
    answer(monkeypatch, "getSaveFileName", str(tmp_path / "hand.rhotlog"))
    person.click(dialog.track_button)
    person.until(said(person, "landmarks install"))
    assert not (tmp_path / "hand.rhotlog").exists() and dialog.track_button.isEnabled()


def test_cancel_leaves_nothing(person: Person, films: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Slow:
        def find(self, picture: Any) -> tuple[()]:
            np.linalg.inv(np.eye(200))
            return ()

    use_networks(monkeypatch, iter(Slow, None))
    dialog = person.window
    dialog.add([next(films.iterdir())])
    person.until(dialog.track_button.isEnabled)
    dialog.track(tmp_path / "hand.rhotlog")
    assert dialog.track_button.text() == "Cancel"
    dialog.cancel()
    person.until(said(person, "nothing was written"))
    assert not (tmp_path / "hand.rhotlog").exists() and dialog.track_button.isEnabled()
    person.press(Qt.Key.Key_Escape)
    person.until(lambda: not dialog.isVisible())
