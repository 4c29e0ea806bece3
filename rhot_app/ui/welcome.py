"""The first page: the ways to begin, and progress while one of them is under way."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from rhot_app.simulator.scene.shipped_motions import shipped_motions
from rhot_app.ui.backend.contract import TwinChoice
from rhot_app.ui.common.theme import app_font
from rhot_app.ui.language import tr

_TITLE_PT = 20.0
_CARD_WIDTH_PX = 300


class WelcomePage(QWidget):
    """Simulated rig, cameras of this computer, a rig file, nodes; the last rig too when there is one."""

    twin_asked = Signal(object)
    file_asked = Signal()
    last_asked = Signal()
    nodes_asked = Signal()
    cameras_asked = Signal()
    cancel_asked = Signal()

    def __init__(self, motion: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("welcome")
        self.setProperty("guide", "start")
        self._pages = QStackedWidget()
        self._pages.addWidget(self._choice_page(motion))
        self._pages.addWidget(self._progress_page())
        middle = QWidget()
        column = QVBoxLayout(middle)
        column.addStretch(1)
        column.addWidget(self._pages)
        column.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setWidget(middle)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(scroll)

    def _choice_page(self, motion: str) -> QWidget:
        title = QLabel(tr("How do you want to begin?"))
        title.setFont(app_font(_TITLE_PT, bold=True))
        title.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        line = QLabel(tr("RHOT tracks a hand with cheap cameras: a bare hand with one, a hand that wears six colour "
                         "markers with two. No camera at hand? The simulated rig shows everything."))
        line.setWordWrap(True)
        line.setProperty("muted", True)
        line.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        self.motion_box = QComboBox()
        for info in shipped_motions():
            self.motion_box.addItem(tr(info.name), info.name)
            self.motion_box.setItemData(self.motion_box.count() - 1, tr(info.description),
                                        Qt.ItemDataRole.ToolTipRole)
        self.motion_box.setCurrentIndex(max(0, self.motion_box.findData(motion)))
        self.motion_box.setToolTip(tr("What the simulated hand does."))
        self.motion_box.setAccessibleName(tr("Motion of the simulated hand"))
        self.twin_button = QPushButton(tr("Start the simulated rig"))
        self.twin_button.setProperty("primary", True)
        self.twin_button.clicked.connect(lambda: self.twin_asked.emit(TwinChoice(motion=self.motion)))
        self.file_button = QPushButton(tr("Open a rig file …"))
        self.file_button.clicked.connect(self.file_asked)
        self.last_button = QPushButton()
        self.last_button.clicked.connect(self.last_asked)
        self.nodes_button = QPushButton(tr("Connect nodes …"))
        self.nodes_button.clicked.connect(self.nodes_asked)
        self.cameras_button = QPushButton(tr("Choose cameras …"))
        self.cameras_button.clicked.connect(self.cameras_asked)
        self.show_last("")
        cards = QGridLayout()
        cards.setSpacing(16)
        cards.addWidget(_card(tr("Simulated rig"), tr("Two simulated cameras look at a simulated hand, through real "
                                                      "node programs and the real network path."), self.motion_box,
                              self.twin_button), 0, 0)
        cards.addWidget(_card(tr("Cameras of this computer"),
                              tr("A webcam or two, films, or a network camera such as a phone. One is enough to begin "
                                 "with a bare hand."), self.cameras_button), 0, 1)
        cards.addWidget(_card(tr("Two nodes"), tr("Enter the addresses of two Raspberry Pis that run rhot-node, see "
                                                  "whether they answer, and write a first rig file."),
                              self.nodes_button), 1, 0)
        cards.addWidget(_card(tr("Rig file"),
                              tr("A rig that was set up before: its cameras, lenses, marker set and hand."),
                              self.last_button, self.file_button), 1, 1)
        page = QWidget()
        layout = QVBoxLayout(page)
        layout.setSpacing(16)
        layout.addWidget(title)
        layout.addWidget(line)
        layout.addLayout(_centred(cards))
        return page

    def _progress_page(self) -> QWidget:
        self.progress_label = QLabel()
        self.progress_label.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        self.progress_label.setFont(app_font(14.0, bold=True))
        self.progress_bar = QProgressBar()
        self.progress_bar.setRange(0, 100)
        self.progress_bar.setTextVisible(False)
        self.progress_bar.setFixedWidth(420)
        self.cancel_button = QPushButton(tr("Cancel"))
        self.cancel_button.clicked.connect(self.cancel_asked)
        page = QWidget()
        layout = QVBoxLayout(page)
        layout.setSpacing(16)
        layout.addStretch(1)
        for widget in (self.progress_label, self.progress_bar, self.cancel_button):
            layout.addWidget(widget, alignment=Qt.AlignmentFlag.AlignHCenter)
        layout.addStretch(1)
        return page

    @property
    def motion(self) -> str:
        """The motion chosen."""
        return str(self.motion_box.currentData() or TwinChoice().motion)

    def show_last(self, name: str) -> None:
        """Offer the rig opened last; "" offers none."""
        self.last_button.setVisible(bool(name))
        self.last_button.setText(tr("Open {name}", name=name))
        self.last_button.setToolTip(tr("The rig opened last: {name}", name=name))

    def show_busy(self, busy: tuple[str, float] | None) -> None:
        """Progress of what is under way; None shows the choices."""
        self._pages.setCurrentIndex(0 if busy is None else 1)
        if busy is not None:
            self.progress_label.setText(busy[0])
            self.progress_bar.setValue(round(100 * busy[1]))


def _card(title: str, sentence: str, *actions: QWidget) -> QFrame:
    frame = QFrame()
    frame.setProperty("card", True)
    frame.setFixedWidth(_CARD_WIDTH_PX)
    heading = QLabel(title)
    heading.setFont(app_font(13.0, bold=True))
    text = QLabel(sentence)
    text.setWordWrap(True)
    text.setProperty("muted", True)
    text.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Expanding)
    text.setAlignment(Qt.AlignmentFlag.AlignTop)
    layout = QVBoxLayout(frame)
    layout.setContentsMargins(16, 16, 16, 16)
    layout.setSpacing(8)
    layout.addWidget(heading)
    layout.addWidget(text, 1)
    for action in actions:
        layout.addWidget(action)
    return frame


def _centred(inner: QGridLayout) -> QHBoxLayout:
    row = QHBoxLayout()
    row.addStretch(1)
    row.addLayout(inner)
    row.addStretch(1)
    return row
