"""Films of a hand that somebody has already: which camera took which, the rig, when they began; then they are tracked
and replayed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QDoubleSpinBox,
    QFileDialog,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QProgressBar,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from rhot_app.errors import RhotError
from rhot_app.export.film_log import ChosenFilm, describe_film, log_films
from rhot_app.project import Rig, load_rig
from rhot_app.sources.film_offset import FilmOffset, offsets_of
from rhot_app.ui.backend.solver import Solver, StoppedError
from rhot_app.ui.common.job import CancelledError, Job, Progress
from rhot_app.ui.common.parts import ask_where_to_save
from rhot_app.ui.common.record_table import Column, RecordTable
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.dialogs.recordings import LOG_FILTER
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.replay.run_dialog import FileChoice

ENDINGS = (".avi", ".m4v", ".mkv", ".mov", ".mp4", ".mpg", ".mts", ".webm")
"""What a folder's films are known by; a file that is chosen by itself may have another."""

_SIZE, _LINES, _TABLE_PX = (820, 560), 5, 170
_LATEST_S = 3600.0
_MEANING = tr_noop("Films of a bare hand by one camera, or by several at the same time. The hand networks find its "
                   "landmarks; the tracked hand is then shown beside the pictures. Several films need the rig file "
                   "that says where their cameras stand; one film is tracked without, at a distance that is a guess.")


@dataclass(eq=False)
class FilmRow:
    """A film on the list: what was found of it, which is `wrong` when it is none, and what the person chose."""

    path: Path
    camera: str = ""
    later_s: float = 0.0
    about: str = "…"
    wrong: bool = False


_CAMERA, _LATER = 0, 3  # columns of fields


class FilmsDialog(QDialog):
    """`tracked` gives the log that was written. `make_solver`: what the work is done in."""

    tracked = Signal(object)

    def __init__(self, make_solver: Callable[[], Solver] = Solver, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("Track films"))
        self.setProperty("guide", "recording")
        self.resize(*_SIZE)
        self._solver = make_solver()
        self._rig: Rig | None = None
        self._looks: list[Job] = []
        self._job: Job | None = None
        self.problem = ""  # of the rig file
        self._state = ""
        meaning = QLabel(tr(_MEANING))
        meaning.setWordWrap(True)
        meaning.setProperty("muted", True)
        self.rig_choice = FileChoice(tr("The rig of the films' cameras"), tr("none: one film, its lens assumed"),
                                     tr("No rig"))
        tip = Qt.ItemDataRole.ToolTipRole
        self.table: RecordTable[FilmRow] = RecordTable((
            Column(tr("Camera"), lambda row: ""),
            Column(tr("Film"), lambda row: row.path.name, roles=lambda row: {tip: str(row.path)}),
            Column("", lambda row: tr("no film") if row.wrong else row.about, roles=lambda row: {tip: row.about}),
            Column(tr("Begins later by"), lambda row: "")))
        self.table.horizontalHeader().setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        self.table.setSelectionMode(RecordTable.SelectionMode.ExtendedSelection)
        self.table.setMinimumHeight(_TABLE_PX)
        self.add_button, self.folder_button = QPushButton(tr("Add films …")), QPushButton(tr("Add a folder …"))
        self.folder_button.setToolTip(tr("All films in a folder, in the order of their names."))
        self.remove_button = QPushButton(tr("Remove"))
        self.remove_button.setToolTip(tr("Take the chosen film off the list (Delete); the file stays."))
        self.sound_button, self.flash_button = QPushButton(tr("Align by sound")), QPushButton(tr("Align by a flash"))
        self.sound_button.setToolTip(tr("Find by how much later each film began: what all of them heard, such as a "
                                        "clap."))
        self.flash_button.setToolTip(tr("Find by how much later each film began: a lamp that goes on in all of them."))
        self.sentence = Sentence(_LINES)
        self.bar = QProgressBar()
        self.bar.setRange(0, 1000)
        self.bar.setTextVisible(False)
        self.track_button, self.close_button = QPushButton(tr("Track …")), QPushButton(tr("Close"))
        self.track_button.setDefault(True)
        self.track_button.setToolTip(tr("Choose where the recording is written; it opens when it is whole."))
        self._lay_out(meaning)
        self.add_button.clicked.connect(self._choose_films)
        self.folder_button.clicked.connect(self._choose_folder)
        self.remove_button.clicked.connect(self.remove)
        self.sound_button.clicked.connect(lambda: self.align("sound"))
        self.flash_button.clicked.connect(lambda: self.align("flash"))
        self.table.chosen_changed.connect(self._show_state)
        self.rig_choice.changed.connect(self._take_rig)
        self.track_button.clicked.connect(self._track_or_cancel)
        self.close_button.clicked.connect(self.reject)
        self._show_state()

    def _lay_out(self, meaning: QLabel) -> None:
        rig, films, buttons = QHBoxLayout(), QHBoxLayout(), QHBoxLayout()
        rig.addWidget(QLabel(tr("Rig")))
        rig.addWidget(self.rig_choice, 1)
        for button in (self.add_button, self.folder_button, self.remove_button):
            button.setAutoDefault(False)
            films.addWidget(button)
        films.addStretch(1)
        for button in (self.sound_button, self.flash_button):
            button.setAutoDefault(False)
            films.addWidget(button)
        buttons.addWidget(self.bar, 1)
        buttons.addWidget(self.close_button)
        buttons.addWidget(self.track_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(12)
        layout.addWidget(meaning)
        layout.addLayout(rig)
        layout.addWidget(self.table, 1)
        layout.addLayout(films)
        layout.addWidget(self.sentence)
        layout.addLayout(buttons)

    # -- what is asked for -----------------------------------------------------------------------------------------

    @property
    def films(self) -> list[ChosenFilm]:
        """The films on the list."""
        return [ChosenFilm(row.camera, row.path, row.later_s) for row in self.table.records]

    def add(self, paths: list[Path]) -> None:
        """Put films on the list; each takes the next camera of the rig."""
        known = {row.path for row in self.table.records}
        new = [path for path in dict.fromkeys(paths) if path not in known]
        self._show_rows([*self.table.records, *map(FilmRow, new)])
        for path in new:
            self._looks.append(Job(partial(_describe, path), partial(self._show_what, path, wrong=False),
                                   partial(self._show_what, path, wrong=True), None, self).start())

    def remove(self) -> None:
        """Take the chosen films off the list."""
        chosen = self.table.chosen_rows
        self._show_rows([row for k, row in enumerate(self.table.records) if k not in chosen])

    def _show_rows(self, rows: list[FilmRow]) -> None:
        self.table.show_records(rows)
        for k, row in enumerate(rows):
            later = QDoubleSpinBox()
            later.setRange(-_LATEST_S, _LATEST_S)
            later.setDecimals(4)
            later.setSuffix(" s")
            later.setToolTip(tr("By how much this film began after the others."))
            later.setValue(row.later_s)
            later.valueChanged.connect(partial(setattr, row, "later_s"))
            camera = QComboBox()
            camera.currentTextChanged.connect(partial(self._choose_camera, row))
            for column, field in ((_CAMERA, camera), (_LATER, later)):
                self.table.setIndexWidget(self.table.records_model.index(k, column), field)
        self._name_cameras()
        self._fit_columns()
        self._show_state()

    def _fit_columns(self) -> None:
        for column in (_CAMERA, 2, _LATER):
            self.table.resizeColumnToContents(column)

    def field(self, row: int, column: int) -> QComboBox | QDoubleSpinBox:
        """The field in a cell."""
        found = self.table.indexWidget(self.table.records_model.index(row, column))
        assert isinstance(found, QComboBox | QDoubleSpinBox)
        return found

    def _choose_films(self) -> None:
        names, _ = QFileDialog.getOpenFileNames(
            self, tr("Films"), str(self._folder()),
            tr("Films ({names});;All files (*)", names=" ".join(f"*{one}" for one in ENDINGS)))
        self.add([Path(name) for name in names])

    def _choose_folder(self) -> None:
        name = QFileDialog.getExistingDirectory(self, tr("A folder of films"), str(self._folder()))
        if name:
            found = sorted(path for path in Path(name).iterdir() if path.suffix.lower() in ENDINGS)
            self.add(found)
            if not found:
                self.sentence.setText(tr("{name} holds no films ({names}).", name=name, names=", ".join(ENDINGS)))

    def _folder(self) -> Path:
        return self.films[-1].path.parent if self.films else Path.home()

    def _take_rig(self) -> None:
        self._rig, self.problem = None, ""
        if self.rig_choice.path is not None:
            try:
                self._rig = load_rig(self.rig_choice.path)
            except RhotError as exc:
                self.problem = str(exc)
        self._name_cameras()
        self._show_state()

    def _name_cameras(self) -> None:
        """Offer the rig's cameras; a film whose name begins with a camera's gets that one."""
        names = [node.name for node in self._rig.nodes] if self._rig is not None else ["camera"]
        for k, row in enumerate(self.table.records):
            box = self.field(k, _CAMERA)
            assert isinstance(box, QComboBox)
            if [box.itemText(n) for n in range(box.count())] != names:
                alike = [name for name in names if row.path.stem.lower().startswith(name.lower())]
                if row.camera not in names:
                    row.camera = alike[0] if alike else names[min(k, len(names) - 1)]
                with QSignalBlocker(box):
                    box.clear()
                    box.addItems(names)
                    box.setCurrentText(row.camera)

    def _choose_camera(self, row: FilmRow, name: str) -> None:
        row.camera = name
        self._show_state()

    def _show_what(self, path: Path, text: str, *, wrong: bool) -> None:
        for row in self.table.records:
            if row.path == path:
                row.about, row.wrong = text, wrong
        self.table.records_model.refresh()
        self._fit_columns()
        self._show_state()

    def _wanting(self) -> str:
        """What is missing before the films can be tracked, "" for nothing."""
        films = self.films
        if self.problem:
            return self.problem
        if not films:
            return tr("Add the film of a hand, or those of several cameras.")
        for row in self.table.records:
            if row.wrong:
                return row.about
        if self._rig is None and len(films) > 1:
            return tr("Several films need the rig of their cameras: choose its file, or remove all films but one.")
        cameras = [film.camera for film in films]
        twice = next((name for name in cameras if cameras.count(name) > 1), None)
        return tr("Camera {twice} has two films: choose another camera for one of them.", twice=twice) if twice else ""

    def _show_state(self) -> None:
        busy, wanting = self._job is not None, self._wanting()
        for part in (self.add_button, self.folder_button, self.rig_choice, self.table):
            part.setEnabled(not busy)
        self.remove_button.setEnabled(not busy and bool(self.table.chosen_rows))
        for button in (self.sound_button, self.flash_button):
            button.setEnabled(not busy and len(self.films) > 1)
        self.track_button.setText(tr("Cancel") if busy else tr("Track …"))
        self.track_button.setEnabled(busy or not wanting)
        state = wanting or tr("Ready. Looking for hands takes about as long as the films.")
        if not busy and state != self._state:  # what came of the last work stays until something else is missing
            self._state = state
            self.sentence.setText(state)

    # -- tracking --------------------------------------------------------------------------------------------------

    def _track_or_cancel(self) -> None:
        if self._job is not None:
            self.cancel()
            return
        first = self.films[0].path
        log = ask_where_to_save(self, tr("Write the recording to"), first.with_name(f"{first.stem}-hand.rhotlog"),
                                tr(LOG_FILTER))
        if log is not None:
            self.track(log)

    def track(self, log: Path) -> None:
        """Track the films in another process; `tracked` follows when the log is whole."""
        self._start(log_films, (self.rig_choice.path, self.films, log), partial(self._finish, log))

    def align(self, by: Literal["sound", "flash"]) -> None:
        """Find by how much later each film began, and write it into the list."""
        self._start(offsets_of, ({str(film.path): film.path for film in self.films}, by), self._show_offsets)

    def _start(self, function: Callable[..., Any], arguments: tuple[Any, ...], done: Callable[[Any], None]) -> None:
        """Have the other process do one thing."""
        def work(progress: Progress) -> Any:
            try:
                return self._solver.run(function, arguments, progress.report)
            except StoppedError as exc:
                raise CancelledError(tr("Cancelled.")) from exc

        self._job = Job(work, done, self._fail, self._report, self).start()
        self._show_state()
        self.sentence.setText("…")

    def cancel(self) -> None:
        """Give the tracking up; nothing of it is left."""
        job, self._job = self._job, None
        if job is not None:
            job.cancel()
            self._solver.stop()
            self.bar.setValue(0)
            self._show_state()
            self.sentence.setText(tr("Cancelled; nothing was written."))

    def _report(self, text: str, fraction: float) -> None:
        self.sentence.setText(f"{text} …")
        self.bar.setValue(round(1000 * fraction))

    def _show_offsets(self, offsets: dict[str, FilmOffset]) -> None:
        self._job = None
        self.bar.setValue(1000)
        for k, row in enumerate(self.table.records):
            later = self.field(k, _LATER)
            assert isinstance(later, QDoubleSpinBox)
            later.setValue(offsets[str(row.path)].seconds)
        self._show_state()
        found = ", ".join(f"{Path(path).name} {one.seconds:+.3f} ± {one.std_s:.3f} s" for path, one in offsets.items())
        self.sentence.setText(tr("Aligned: {offsets}.", offsets=found))

    def _finish(self, log: Path, said: list[str]) -> None:
        self._job = None
        self.bar.setValue(1000)
        self._show_state()
        self.sentence.setText("\n".join(said))
        self.tracked.emit(log)

    def _fail(self, sentence: str) -> None:
        self._job = None
        self.bar.setValue(0)
        self._show_state()
        self.sentence.setText(sentence)

    def done(self, result: int) -> None:
        """What goes on is given up."""
        self.cancel()
        self._solver.stop()
        for job in self._looks:
            job.cancel()
        super().done(result)


def _describe(path: Path, progress: Progress) -> str:
    return describe_film(path)
