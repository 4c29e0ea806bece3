"""A recording as a file for other programs: what to write, a look at the first rows, progress, cancel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QDoubleSpinBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from rhot_app.export.export import Exported
from rhot_app.export.formats import all_formats
from rhot_app.export.gaps import LONGEST_S
from rhot_app.export.plan import ExportOptions, Units
from rhot_app.export.process import export_apart, first_states
from rhot_app.export.resample import MOST_HZ
from rhot_app.export.states import HandStates, columns
from rhot_app.hand.skeleton import FINGERS
from rhot_app.project import Rig
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.parts import ask_where_to_save, keep_width
from rhot_app.ui.common.record_table import Column, RecordTable
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.dialogs.recordings import newest_recording
from rhot_app.ui.language import tr, tr_noop

ROWS = 8
LOOK_MS = 300  # a choice is looked at when it has stood for a while

_SIZE = (860, 600)
_OWN_RATE, _NO_FILL = tr_noop("as recorded"), tr_noop("leave gaps")
_TRACKERS = ((tr_noop("as recorded"), None), (tr_noop("classic"), "classic"), (tr_noop("estimator"), "estimator"))
_FRAMES = ((tr_noop("rig"), "rig"), (tr_noop("wrist, along the palm's axes"), "wrist"))
_UNITS: tuple[tuple[str, Units], ...] = (("mm", "mm"), ("m", "m"))


class ExportDialog(QDialog):
    """`log` is the recording, the newest one in `folder` unless another is given; None while there is none."""

    def __init__(self, log: Path | None, folder: Path, parent: QWidget | None = None, *, rig: Rig | None = None,
                 smooth: bool = False, out_folder: Path | None = None) -> None:
        """`rig`: what `log` is tracked with; None: as it was recorded. `smooth`: begin with that. `out_folder`: where
        the file is offered to be written, None: beside the recording."""
        super().__init__(parent)
        self.setWindowTitle(tr("Export recording"))
        self.setProperty("guide", "recording")
        self.resize(*_SIZE)
        self.log = log
        self._rig = rig
        self._folder = folder
        self._out_folder = out_folder
        self._job: Job | None = None
        self._look: Job | None = None
        self.log_label = QLabel()
        self.log_button = QPushButton(tr("Choose …"))
        self.log_button.setToolTip(tr("Another recording (.rhotlog)."))
        self.format_box = _box(((one.title, name) for name, one in all_formats().items()),
                               tr("Which programs shall read it."))
        self.format_box.setCurrentIndex(self.format_box.findData("csv"))
        self.tracker_box = _box(_TRACKERS, tr("Which tracker makes a hand of the recorded datagrams."))
        self.frame_box = _box(_FRAMES,
                              tr("Where positions are told: in the rig frame, or relative to the wrist joint."))
        self.units_box = _box(_UNITS, tr("Unit of length, where the format leaves a choice."))
        self.smooth_box = QCheckBox(tr("Smooth"))
        self.smooth_box.setChecked(smooth)
        self.smooth_box.setToolTip(tr("Every state uses what came after it as well. Only the estimator can."))
        self.rate_box = QDoubleSpinBox()
        self.rate_box.setRange(0.0, MOST_HZ)
        self.rate_box.setDecimals(1)
        self.rate_box.setSuffix(" Hz")
        self.rate_box.setSpecialValueText(tr(_OWN_RATE))
        self.rate_box.setMinimumHeight(30)
        self.rate_box.setToolTip(tr("States at equal intervals. As recorded each keeps its own time, and formats that "
                                    "have a rate get the cameras'."))
        self.fill_box = QDoubleSpinBox()
        self.fill_box.setRange(0.0, LONGEST_S)
        self.fill_box.setDecimals(2)
        self.fill_box.setSingleStep(0.1)
        self.fill_box.setSuffix(" s")
        self.fill_box.setSpecialValueText(tr(_NO_FILL))
        self.fill_box.setMinimumHeight(30)
        self.fill_box.setToolTip(tr("Gaps up to this length are interpolated. What is filled in is marked: by its "
                                    "knowledge, or in a table beside the file where the format has none."))
        self.table: RecordTable[tuple[object, ...]] = RecordTable(())
        self.table.verticalHeader().show()
        self.table.setToolTip(tr("The first fingertips as they would be written; the file holds much more."))
        self.sentence = Sentence(3)
        self.bar = QProgressBar()
        self.bar.setRange(0, 1000)
        self.bar.hide()
        self.export_button = QPushButton(tr("Export …"))
        keep_width(self.export_button, tr("Export …"), tr("Cancel"))
        self.export_button.setToolTip(tr("Choose a file; it appears when it is whole."))
        self.export_button.setDefault(True)
        self.close_button = QPushButton(tr("Close"))
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(LOOK_MS)
        self._lay_out()
        self._connect()
        self._show_format()
        self.show_log(newest_recording(folder) if log is None else log)

    def _lay_out(self) -> None:
        source = QHBoxLayout()
        source.addWidget(self.log_label, 1)
        source.addWidget(self.log_button)
        form = QFormLayout()
        form.setSpacing(8)
        for words, part in ((tr("Recording"), source), (tr("Format"), self.format_box),
                            (tr("Tracker"), self.tracker_box),
                            ("", self.smooth_box), (tr("Rate"), self.rate_box), (tr("Fill gaps up to"), self.fill_box),
                            (tr("Positions in"), self.frame_box),
                            (tr("Lengths in"), self.units_box)):
            form.addRow(words, part)
        buttons = QHBoxLayout()
        buttons.addWidget(self.bar, 1)
        buttons.addStretch(1)
        buttons.addWidget(self.close_button)
        buttons.addWidget(self.export_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(16)
        layout.addLayout(form)
        layout.addWidget(self.table, 1)
        layout.addWidget(self.sentence)
        layout.addLayout(buttons)

    def _connect(self) -> None:
        self.log_button.clicked.connect(self._choose_log)
        self.format_box.currentIndexChanged.connect(self._show_format)
        for box in (self.format_box, self.tracker_box, self.frame_box, self.units_box):
            box.currentIndexChanged.connect(self._timer.start)
        for number in (self.rate_box, self.fill_box):
            number.valueChanged.connect(self._timer.start)
        self.smooth_box.toggled.connect(self._timer.start)
        self._timer.timeout.connect(self._preview)
        self.export_button.clicked.connect(self._export_or_cancel)
        self.close_button.clicked.connect(self.close)

    # -- what is asked for -----------------------------------------------------------------------------------------

    @property
    def format(self) -> str:
        """The chosen format."""
        return str(self.format_box.currentData())

    def options(self) -> ExportOptions:
        """The other choices."""
        rate = self.rate_box.value()
        units: Units | None = self.units_box.currentData() if all_formats()[self.format].units_free else None
        return ExportOptions(self.tracker_box.currentData(), rate or None, self.frame_box.currentData(), units,
                             smooth=self.smooth_box.isChecked(), fill_s=self.fill_box.value() or None)

    def show_log(self, log: Path | None) -> None:
        """Export another recording."""
        self.log = log
        tracked = "" if self._rig is None else tr(", tracked as shown")
        self.log_label.setText(tr("Choose a recording.") if log is None else f"{log}{tracked}")
        self.export_button.setEnabled(log is not None)
        self.rate_box.setSpecialValueText(tr(_OWN_RATE))
        if log is not None:
            self._preview()

    def _choose_log(self) -> None:
        start = self._folder if self.log is None else self.log
        name, _ = QFileDialog.getOpenFileName(self, tr("Choose a recording"), str(start),
                                              tr("Recordings (*.rhotlog *.log);;All files (*)"))
        if name:
            self._rig = None
            self.show_log(Path(name))

    def _show_format(self) -> None:
        """A new format's unit, and whether another can be chosen."""
        chosen = all_formats()[self.format]
        self.units_box.setCurrentIndex(self.units_box.findData(chosen.units))
        self.units_box.setEnabled(chosen.units_free)

    # -- the first rows --------------------------------------------------------------------------------------------

    def _preview(self) -> None:
        if self._look is not None:
            self._look.cancel()
        log, name, options, rig = self.log, self.format, self.options(), self._rig
        if log is None or self._job is not None:
            return
        units = options.units or all_formats()[name].units

        def look(progress: Any) -> HandStates:
            return first_states(log, name, options, ROWS, rig)

        self._look = Job(look, lambda states: self._show_rows(states, units), self._say, None, self).start()

    def _show_rows(self, states: HandStates, units: Units) -> None:
        """Times, conditions and fingertips."""
        tips = [f"fingertip_{finger}_{axis}_{units}" for finger in FINGERS for axis in "xyz"]
        wanted = ("time_s", "condition", *tips)
        table = dict(columns(states, 1000.0 if units == "mm" else 1.0, None))
        steps_s = np.diff(np.asarray(table["time_s"], dtype=np.float64))
        if self.rate_box.value() == 0.0 and len(steps_s) and np.median(steps_s) > 0.0:
            self.rate_box.setSpecialValueText(f"{tr(_OWN_RATE)}, {1.0 / np.median(steps_s):.0f} Hz")
        self.table.show_records(list(zip(*(table[name].tolist() for name in wanted), strict=True)),
                                [_column(number, name) for number, name in enumerate(wanted)])
        self.table.resizeColumnsToContents()
        self._say("")

    # -- writing ---------------------------------------------------------------------------------------------------

    def _export_or_cancel(self) -> None:
        if self._job is not None:
            self._job.cancel()
            self._end(tr("Cancelled; nothing was written."))
            return
        if self.log is None:
            return
        endings = all_formats()[self.format].endings
        beside = self.log.with_suffix(endings[0])
        start = beside if self._out_folder is None else self._out_folder / beside.name
        kinds = " ".join(f"*{ending}" for ending in endings)
        out = ask_where_to_save(self, tr("Export to"), start,
                                tr("{format} ({kinds});;All files (*)", format=self.format, kinds=kinds))
        if out is not None:
            self.export(out)

    def export(self, out: Path) -> None:
        """Write `out`; what stands there is written over, as the person was asked when choosing it."""
        log, name, options, rig = self.log, self.format, self.options(), self._rig
        if log is None:
            return
        self._job = Job(lambda progress: export_apart(log, out, name, options, progress.report,
                                                           rig), self._show_done,
                        self._end, self._show_progress, self).start()
        self.export_button.setText(tr("Cancel"))
        self.bar.setValue(0)
        self.bar.show()
        self._say(tr("Exporting to {out} …", out=out))

    def _show_progress(self, text: str, fraction: float) -> None:
        self.bar.setValue(round(1000 * fraction))

    def _show_done(self, done: Exported) -> None:
        said = [tr("Exported {states} states to {path}.", states=done.states, path=done.path),
                *(f"{note}." for note in done.notes)]
        said += [tr("Not all of the recording could be read: {loss}.", loss=loss.removesuffix("."))
                 for loss in done.losses]
        self._end("\n".join(said))

    def _end(self, sentence: str) -> None:
        self._job = None
        self.bar.hide()
        self.export_button.setText(tr("Export …"))
        self._say(sentence)

    def _say(self, sentence: str) -> None:
        self.sentence.setText(sentence)

    def done(self, result: int) -> None:
        """An export that is under way ends with the dialog, and leaves nothing."""
        for job in (self._job, self._look):
            if job is not None:
                job.cancel()
        super().done(result)


def _box(entries: Any, meaning: str) -> QComboBox:
    box = QComboBox()
    for words, value in entries:
        box.addItem(tr(words), value)
    box.setToolTip(meaning)
    return box


def _column(number: int, name: str) -> Column[tuple[object, ...]]:
    """A column of the preview, which is the value of that number in a row."""
    places = 2 if name.endswith("_mm") else 4

    def text(row: tuple[object, ...]) -> str:
        value = row[number]
        return value if isinstance(value, str) else "" if value != value else f"{value:.{places}f}"

    return Column(name.replace("fingertip_", ""), text)
