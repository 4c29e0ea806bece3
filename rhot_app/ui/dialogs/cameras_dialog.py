"""Choose cameras of this computer: webcams, films, folders of pictures and network cameras; look at them, name them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from PySide6.QtCore import QRegularExpression, Qt, QTimer
from PySide6.QtGui import QRegularExpressionValidator
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QFileDialog,
    QHBoxLayout,
    QInputDialog,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from rhot_app.errors import SourceError
from rhot_app.sources.cameras.camera_set import NONE_FOUND, CameraSource, Prepared, Side, names_of, prepare
from rhot_app.sources.cameras.camera_source import CameraPreview, check_source, source_of
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.framework.picture_view import PictureView
from rhot_node.capture.v4l2 import Device, Mode, list_devices

TICK_MS = 66
_SIZE_PX = 980, 640
_LIST_PX = 344
_NAME_CHARACTERS = 40

Prepare = Callable[..., Prepared]
_Result = TypeVar("_Result")


@dataclass(frozen=True, slots=True)
class Choice:
    """One entry of the list: a `source` that can be chosen, or a `device` whose problem is told. `name`: as it was
    typed, "" for the usual one."""

    source: CameraSource | None
    device: Device | None = None
    name: str = ""

    @property
    def title(self) -> str:
        """Two lines: what it is, and in which mode or why not."""
        if self.source is None:
            assert self.device is not None
            return tr("{name} ({device})\ncannot be used now", name=self.device.name,
                      device=Path(self.device.path).name)
        one = self.source
        what = f"{one.width} × {one.height} px, {one.fps:.4g}/s" + ("" if one.seconds is None else
                                                                     f", {one.seconds:.1f} s")
        where = f" ({Path(self.device.path).name})" if self.device is not None else ""
        return f"{self.name or one.title}{where}\n{what}"


class CamerasDialog(QDialog):
    """`prepared` is what was written when the dialog was accepted. What it works with is passed in by tests."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None, *,
                 devices: Callable[[], tuple[Device, ...]] = list_devices,
                 check: Callable[[str], CameraSource] = check_source,
                 preview: Callable[[CameraSource, CameraPreview | None], CameraPreview] = CameraPreview,
                 write: Prepare = prepare) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("Cameras of this computer"))
        self.setProperty("guide", "start")
        self._devices, self._check, self._make_preview, self._write = devices, check, preview, write
        self.prepared: Prepared | None = None
        self.choices: list[Choice] = []
        self._preview: CameraPreview | None = None
        self._ended: CameraPreview | None = None  # the last one; it has waited for those before
        self._shown: tuple[object, str] = (None, "")
        self._number = 0
        self._job: Job | None = None
        self._make_list()
        self._make_view(scheme)
        self._make_questions()
        self._lay_out()
        self.resize(*_SIZE_PX)
        self._timer = QTimer(self, interval=TICK_MS)
        self._timer.timeout.connect(self.tick)
        self._timer.start()
        self.finished.connect(lambda code: self._end())
        self._look(-1)
        self._show_whether_ready()
        self.search()

    def _make_list(self) -> None:
        """What can be chosen, and how more is added."""
        self.list = QListWidget()
        self.list.setFixedWidth(_LIST_PX)
        self.list.setSpacing(4)
        self.list.setWordWrap(True)
        self.list.setAccessibleName(tr("Cameras"))
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.currentRowChanged.connect(self._look)
        self.list.itemChanged.connect(lambda item: self._show_whether_ready())
        self.film_button = plain_button(tr("Films …"), tr("Add films of one camera each, recorded at the same time."),
                                        self.choose_films)
        self.folder_button = plain_button(tr("Folder …"), tr("Add a folder of pictures, or of raw frames."),
                                          self.choose_folder)
        self.address_button = plain_button(tr("Network …"), tr("Add a camera or a phone that sends its pictures by "
                                                               "HTTP (motion JPEG) or RTSP."), self.choose_address)
        self.again_button = plain_button(tr("Search again"), tr("Look for webcams that were plugged in meanwhile."),
                                         self.search)

    def _make_view(self, scheme: Scheme) -> None:
        """The picture of the camera that is looked at, its name and mode."""
        self.picture = PictureView("", scheme)
        self.name_field = QLineEdit()
        self.name_field.setMaxLength(_NAME_CHARACTERS)
        self.name_field.setValidator(QRegularExpressionValidator(QRegularExpression(r"\w[\w .-]*")))
        self.name_field.setAccessibleName(tr("Name of the camera"))
        self.name_field.setToolTip(tr("How the camera is called in the rig, such as left."))
        self.name_field.textEdited.connect(self._rename)
        self.mode_box = QComboBox()
        self.mode_box.setMinimumContentsLength(len("1920 × 1080, 30/s"))
        self.mode_box.setAccessibleName(tr("Picture size and rate"))
        self.mode_box.setToolTip(tr("Larger pictures show a hand farther away, and take longer to search."))
        self.mode_box.activated.connect(self._change_mode)
        self.turned_box, self.mirrored_box = QCheckBox(tr("upside down")), QCheckBox(tr("mirrored"))
        self.turned_box.setToolTip(tr("Turn the picture by 180 degrees: the camera hangs upside down."))
        self.mirrored_box.setToolTip(tr("Exchange left and right, where a phone's program has mirrored the picture. In "
                                        "a mirrored picture a right hand looks like a left one."))
        for box in (self.turned_box, self.mirrored_box):
            box.clicked.connect(self._orient)
        self.rate = Sentence(2)

    def _make_questions(self) -> None:
        """Which hand, and whether to open."""
        self.hand_box = QComboBox()
        self.hand_box.addItem(tr("the right hand"), "right")
        self.hand_box.addItem(tr("the left hand"), "left")
        self.hand_box.setAccessibleName(tr("Hand"))
        self.hand_box.setToolTip(tr("Which hand is tracked."))
        self.verdict = Sentence(2)
        self.cancel_button = QPushButton(tr("Cancel"))
        self.cancel_button.clicked.connect(self.reject)
        self.open_button = QPushButton(tr("Open"))
        self.open_button.setProperty("primary", True)
        self.open_button.setDefault(True)
        self.open_button.setToolTip(tr("Possible once a camera is ticked."))
        self.open_button.clicked.connect(self.open_cameras)

    def _lay_out(self) -> None:
        intro = QLabel(tr("Tick one camera or more, and look at each. The first one tracks alone until the others are "
                          "put together with it."))
        intro.setWordWrap(True)
        left, right = QVBoxLayout(), QVBoxLayout()
        add, row, turn, bottom = QHBoxLayout(), QHBoxLayout(), QHBoxLayout(), QHBoxLayout()
        left.addWidget(self.list, 1)
        for button in (self.film_button, self.folder_button, self.address_button):
            add.addWidget(button)
        left.addLayout(add)
        left.addWidget(self.again_button)
        right.addWidget(self.picture, 1)
        for widget in (QLabel(tr("name")), self.name_field, self.mode_box):
            row.addWidget(widget)
        for box in (self.turned_box, self.mirrored_box):
            turn.addWidget(box)
        turn.addWidget(self.rate, 1)
        right.addLayout(row)
        right.addLayout(turn)
        middle = QHBoxLayout()
        middle.setSpacing(16)
        middle.addLayout(left)
        middle.addLayout(right, 1)
        for question in (QLabel(tr("track")), self.hand_box):
            bottom.addWidget(question)
        bottom.addWidget(self.verdict, 1)
        for end in (self.cancel_button, self.open_button):
            bottom.addWidget(end)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(16)
        layout.addWidget(intro)
        layout.addLayout(middle, 1)
        layout.addLayout(bottom)

    # -- the list ------------------------------------------------------------------------------------------------------

    def search(self) -> None:
        """List the webcams anew, in a worker; what was added stays."""
        self._work(lambda: self._devices(), self._list_devices)

    def _list_devices(self, devices: tuple[Device, ...]) -> None:
        known = {one.device.path for one in self.choices if one.device is not None}
        for device in devices:
            if device.path not in known:
                self._add(Choice(None if device.problem else source_of(device), device))
        present = {device.path: device for device in devices}
        for row in reversed(range(len(self.choices))):
            known_device = self.choices[row].device
            if known_device is not None and known_device.path not in present:
                self._remove(row)
        self.verdict.setText("" if self.choices else NONE_FOUND)
        if self.choices and self.list.currentRow() < 0:
            self.list.setCurrentRow(0)

    def choose_films(self) -> None:
        """Ask for films and add them."""
        names, _ = QFileDialog.getOpenFileNames(self, tr("Films of one camera each"), str(Path.home()),
                                                tr("Films and pictures (*.mp4 *.avi *.mov *.mkv *.webm *.png *.jpg "
                                                   "*.jpeg);;All files (*)"))
        self.add(names)

    def choose_folder(self) -> None:
        """Ask for a folder and add it."""
        name = QFileDialog.getExistingDirectory(self, tr("A folder of pictures"), str(Path.home()))
        self.add([name] if name else [])

    def choose_address(self) -> None:
        """Ask for an address and add it."""
        text, entered = QInputDialog.getText(self, tr("Network camera"),
                                             tr("Address of the pictures, such as\nhttp://192.168.1.20:8080/video or "
                                                "rtsp://192.168.1.21/live"))
        self.add([text.strip()] if entered and text.strip() else [])

    def add(self, texts: list[str]) -> None:
        """Check in a worker what was named, and add and tick it; what cannot be opened is told."""
        if not texts:
            return
        self.verdict.setText(tr("looking …"))

        def check() -> tuple[list[CameraSource], str]:
            found: list[CameraSource] = []
            for text in texts:
                try:
                    found.append(self._check(text))
                except SourceError as exc:
                    return found, str(exc)
            return found, ""
        self._work(check, self._add_checked)

    def _add_checked(self, checked: tuple[list[CameraSource], str]) -> None:
        sources, refused = checked
        specs = [one.source.spec for one in self.choices if one.source is not None]
        for source in sources:
            if source.spec in specs:
                refused = refused or tr("{title} is in the list already.", title=source.title)
            else:
                self._add(Choice(source), ticked=True)
        self.verdict.setText(refused)

    def _add(self, choice: Choice, *, ticked: bool = False) -> None:
        self.choices.append(choice)
        item = QListWidgetItem(choice.title)
        if choice.source is None:
            item.setToolTip(choice.device.problem if choice.device is not None else "")
        else:
            item.setFlags(item.flags() | Qt.ItemFlag.ItemIsUserCheckable)
            item.setCheckState(Qt.CheckState.Checked if ticked else Qt.CheckState.Unchecked)
        self.list.addItem(item)
        if ticked:
            self.list.setCurrentItem(item)
        self._show_whether_ready()

    def _remove(self, row: int) -> None:
        del self.choices[row]
        self.list.takeItem(row)
        self._look(self.list.currentRow())
        self._show_whether_ready()

    def ticked(self) -> list[Choice]:
        """What is to be opened, in the order of the list."""
        return [choice for row, choice in enumerate(self.choices)
                if choice.source is not None and self.list.item(row) is not None
                and self.list.item(row).checkState() is Qt.CheckState.Checked]

    def _show_whether_ready(self) -> None:
        count = len(self.ticked())
        self.open_button.setText(tr("Open {n} camera", "Open {n} cameras", count) if count else tr("Open"))
        self.open_button.setEnabled(count > 0 and self._job is None)

    # -- the one that is looked at -------------------------------------------------------------------------------------

    def _look(self, row: int) -> None:
        """Show another camera large."""
        self._end_preview()
        choice = self.choices[row] if 0 <= row < len(self.choices) else None
        source = choice.source if choice is not None else None
        for box, on in ((self.turned_box, source is not None and source.turned),
                        (self.mirrored_box, source is not None and source.mirrored)):
            box.setEnabled(source is not None)
            box.setChecked(on)
        self.name_field.setEnabled(source is not None)
        self.name_field.setText("" if choice is None or source is None else choice.name)
        self.name_field.setPlaceholderText("" if source is None else names_of([source])[0])
        modes = choice.device.modes if choice is not None and source is not None and choice.device is not None else ()
        self.mode_box.clear()
        for mode in modes:
            self.mode_box.addItem(f"{mode.width} × {mode.height}, {mode.fps:g}/s", mode)
        self.mode_box.setEnabled(len(modes) > 1)
        if source is not None:
            if modes and choice is not None and choice.device is not None:
                self.mode_box.setCurrentIndex(next(
                    (k for k, mode in enumerate(modes) if _in_mode(source, choice.device, mode) == source), -1))
            self._preview = self._make_preview(source, self._ended)
        self._shown = (None, "")
        self.picture.name = "" if source is None or choice is None else choice.name or source.title
        self.picture.show_picture(None, _words_without_picture(choice))
        self.rate.setText("")

    def tick(self) -> None:
        """Show the newest picture, and what is known of the camera."""
        preview = self._preview
        if preview is None:
            return
        picture, problem = preview.picture, preview.problem
        if picture is not self._shown[0] or problem != self._shown[1]:
            self._shown = picture, problem
            self._number += 1
            shown = None if picture is None else Picture("", picture, self._number, 0, 0)
            self.picture.show_picture(shown, problem)
        rate_hz = preview.rate_hz
        rate = "" if rate_hz is None or problem else tr("{rate:.0f} frames/s come.", rate=rate_hz)
        self.rate.setText(preview.remark or rate)

    def _rename(self, text: str) -> None:
        row = self.list.currentRow()
        self.choices[row] = replace(self.choices[row], name=text.strip())
        self.list.item(row).setText(self.choices[row].title)

    def _change_mode(self, number: int) -> None:
        row = self.list.currentRow()
        device, source = self.choices[row].device, self.choices[row].source
        if device is not None and source is not None:
            self._take(row, _in_mode(source, device, device.modes[number]))

    def _orient(self) -> None:
        row = self.list.currentRow()
        source = self.choices[row].source
        if source is not None:
            self._take(row, replace(source, turned=self.turned_box.isChecked(),
                                    mirrored=self.mirrored_box.isChecked()))

    def _take(self, row: int, source: CameraSource) -> None:
        """Look at a camera that is opened otherwise from now on."""
        self.choices[row] = replace(self.choices[row], source=source)
        self.list.item(row).setText(self.choices[row].title)
        self._look(row)

    def _end_preview(self) -> None:
        if self._preview is not None:
            self._preview.stop()
            self._ended, self._preview = self._preview, None

    # -- the end -------------------------------------------------------------------------------------------------------

    def open_cameras(self) -> None:
        """Let go of the cameras and write their rig, in a worker; then accept."""
        chosen = self.ticked()
        sources = [one.source for one in chosen if one.source is not None]
        names = [one.name or usual for one, usual in zip(chosen, names_of(sources), strict=True)]
        doubled = next((name for name in names if names.count(name) > 1), "")
        if doubled:
            self.verdict.setText(tr("Two cameras are called {doubled}. Give each a name of its own.", doubled=doubled))
            return
        side: Side = "left" if self.hand_box.currentData() == "left" else "right"
        self._end_preview()
        ended = self._ended

        def write() -> Prepared:
            if ended is not None:
                ended.wait()  # a node cannot open what is open here
            return self._write(sources, names, side=side)
        self._work(write, self._accept)

    def _accept(self, prepared: Prepared) -> None:
        self.prepared = prepared
        self.accept()

    def _work(self, op: Callable[[], _Result], done: Callable[[_Result], None]) -> None:
        """Do something that takes a moment in a worker; the buttons wait."""
        if self._job is not None:
            return
        self._set_busy(True)

        def end(result: _Result) -> None:
            self._job = None
            self._set_busy(False)
            done(result)
            self._show_whether_ready()

        def fail(sentence: str) -> None:
            self._job = None
            self._set_busy(False)
            self.verdict.setText(sentence)
            self._show_whether_ready()
            if self._preview is None:
                self._look(self.list.currentRow())
        self._job = Job(lambda progress: op(), end, fail, None, self).start()
        self._show_whether_ready()

    def _set_busy(self, busy: bool) -> None:
        for button in (self.film_button, self.folder_button, self.address_button, self.again_button):
            button.setEnabled(not busy)

    def _end(self) -> None:
        self._timer.stop()
        self._end_preview()
        if self._job is not None:
            self._job.cancel()


def _in_mode(source: CameraSource, device: Device, mode: Mode) -> CameraSource:
    """The camera in another mode, turned as it is."""
    return replace(source_of(device, mode), turned=source.turned, mirrored=source.mirrored)


def _words_without_picture(choice: Choice | None) -> str:
    if choice is None:
        return tr("Choose a camera, or add a film.")
    if choice.source is None:
        return choice.device.problem if choice.device is not None else ""
    return ""
