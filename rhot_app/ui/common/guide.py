"""The operator's guide inside the app: pages of docs/guide, opened by F1 at the page of the panel in use."""

from __future__ import annotations

import re
from pathlib import Path

from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QImage, QKeySequence, QShortcut, QTextDocument
from PySide6.QtWidgets import QDialog, QHBoxLayout, QListWidget, QListWidgetItem, QTextBrowser, QVBoxLayout, QWidget

from rhot_app.ui.language import language, tr, tr_noop

GUIDE = Path(__file__).resolve().parents[3] / "docs" / "guide"

PAGES: tuple[tuple[str, str], ...] = (
    ("start", tr_noop("Getting started")), ("window", tr_noop("The window")), ("nodes", tr_noop("Nodes")),
    ("markers", tr_noop("Markers")), ("cameras", tr_noop("Cameras")), ("hand", tr_noop("The hand")),
    ("scene", tr_noop("The scene")),
    ("plots", tr_noop("The plots")),
    ("calibration", tr_noop("Calibration")), ("fitting", tr_noop("Fitting the hand to pictures")),
    ("tracker", tr_noop("The tracker")), ("outputs", tr_noop("Streams to other programs")),
    ("mouse", tr_noop("The 3-D mouse")),
    ("recording", tr_noop("Recording and replay")), ("settings", tr_noop("Settings")),
    ("troubles", tr_noop("When something is wrong")), ("keys", tr_noop("Keys")),
)
"""Name of each page's file and its title, in reading order."""


_MARGIN_PX = 16
_SCROLL_BAR_PX = 24
_SPACING_PX = 3


def page_path(name: str) -> Path:
    """Where a page's text stands: in the window's language if there is one."""
    translated = GUIDE / f"{name}.{language()}.md"
    return translated if translated.is_file() else GUIDE / f"{name}.md"


def page_of(widget: QWidget | None) -> str:
    """The page that explains a widget: that of the nearest parent which names one, else the window's."""
    while widget is not None:
        name = widget.property("guide")
        if isinstance(name, str) and name:
            return name
        widget = widget.parentWidget()
    return "window"


def anchor_of(heading: str) -> str:
    """What links call a heading: "Two hands" is two-hands."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


class PageBrowser(QTextBrowser):
    """Shows pictures no wider than the page."""

    def loadResource(self, kind: int, url: QUrl | str) -> object:  # noqa: N802
        """A picture beside the guide's pages, made as narrow as the page; everything else as Qt does."""
        address = QUrl(url)
        if kind == QTextDocument.ResourceType.ImageResource.value and address.isRelative():
            picture = QImage(str(GUIDE / address.path()))
            width = round((self.width() - 2 * _MARGIN_PX - _SCROLL_BAR_PX) * self.devicePixelRatioF())
            if picture.width() > width > 0:
                picture = picture.scaledToWidth(width, Qt.TransformationMode.SmoothTransformation)
            picture.setDevicePixelRatio(self.devicePixelRatioF())
            return picture
        return super().loadResource(kind, address)


class GuideViewer(QDialog):
    """A list of pages on the left, the page on the right. Stays open beside the window."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("RHOT guide"))
        self.resize(960, 680)
        self.list = QListWidget()
        for name, title in PAGES:
            item = QListWidgetItem(tr(title))
            item.setData(Qt.ItemDataRole.UserRole, name)
            self.list.addItem(item)
        self.list.setSpacing(_SPACING_PX)
        self.list.setFixedWidth(self.list.sizeHintForColumn(0) + 2 * (_SPACING_PX + self.list.frameWidth())
                                + self.list.verticalScrollBar().sizeHint().width())
        self.browser = PageBrowser()
        self.browser.setOpenLinks(False)
        self.browser.document().setDocumentMargin(_MARGIN_PX)
        self.browser.anchorClicked.connect(self._follow)
        self.list.currentItemChanged.connect(self._show_current)
        layout = QHBoxLayout()
        layout.addWidget(self.list)
        layout.addWidget(self.browser, 1)
        outer = QVBoxLayout(self)
        outer.addLayout(layout)
        QShortcut(QKeySequence("F1"), self, self.close)

    def open_page(self, name: str, section: str = "") -> None:
        """Show a page, from the heading `section` (its words, or its anchor) on if there is one, and bring the
        viewer to the front."""
        names = [page for page, _ in PAGES]
        self.list.setCurrentRow(names.index(name) if name in names else 0)
        self.show()
        self.raise_()
        self.activateWindow()
        self._scroll_to(section)

    def _scroll_to(self, section: str) -> None:
        document = self.browser.document()
        block = document.begin()
        while block.isValid():
            if block.blockFormat().headingLevel() and section in (block.text(), anchor_of(block.text())):
                self.browser.verticalScrollBar().setValue(round(document.documentLayout().blockBoundingRect(block).top()))
                return
            block = block.next()

    @property
    def page(self) -> str:
        """Name of the page shown."""
        item = self.list.currentItem()
        return str(item.data(Qt.ItemDataRole.UserRole)) if item is not None else ""

    def _show_current(self) -> None:
        path = page_path(self.page)
        try:
            text = path.read_text(encoding="utf-8")
        except OSError:
            text = tr("The guide's pages are not installed here ({path}). They are in the project's docs/guide folder.",
                      path=path)
        self.browser.setMarkdown(text)

    def _follow(self, url: QUrl) -> None:
        """Links between pages stay in the viewer; others are left to the reader's own browser."""
        target = Path(url.path())
        if url.isRelative() and target.suffix == ".md":
            self.open_page(target.name.partition(".")[0], url.fragment())
