"""About RHOT: versions as a text for reports of faults, and the licences of what it is made of."""

from __future__ import annotations

import platform
import re
import sys
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, distribution, version
from typing import Final

from PySide6.QtCore import Qt, qVersion
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from rhot_app.engine.offline.report import package_versions
from rhot_app.ui.common.record_table import Column, RecordTable
from rhot_app.ui.language import tr

_SIZE: Final = (680, 560)
_ROW_PX: Final = 28
_CLASSIFIER: Final = "License :: OSI Approved :: "
_NAME: Final = re.compile(r"[\w.-]+")
_LONGEST: Final = 60  # what is longer is a licence's whole text
_STATED: Final = {"ezc3d": "MIT"}  # by the licence that it carries; its metadata say nothing


@dataclass(frozen=True)
class Part:
    """Something of others that RHOT uses."""

    name: str
    version: str
    licence: str


SHIPPED: Final = (Part("three.js (web view)", "0.185.0", "MIT"),)
"""Files of others that ship with RHOT; THIRD_PARTY.md lists them."""


def versions_text() -> str:
    """What a report of a fault must say: versions and the system."""
    lines = [f"RHOT {version('rhot')}", f"Python {sys.version.split()[0]}", f"Qt {qVersion()}",
             *(f"{name} {found}" for name, found in package_versions().items() if name != "rhot"),
             f"System {platform.platform()}", f"Screen {QGuiApplication.platformName()}"]
    return "\n".join(lines)


def parts() -> list[Part]:
    """What ships with RHOT, and every installed package that it needs, directly or through others."""
    return [*SHIPPED, *(Part(one.name, one.version, licence_of(one)) for one in _needed("rhot"))]


def _needed(root: str) -> Iterable[Distribution]:
    """Installed packages that `root` needs, those of its extras for users too, by name."""
    found: dict[str, Distribution] = {}
    waiting = deque(_requirements(root))
    while waiting:
        name = waiting.popleft()
        if name in found or name == root:
            continue
        try:
            found[name] = distribution(name)
        except PackageNotFoundError:  # of an extra, or for another system
            continue
        waiting.extend(_requirements(name, extras=False))
    return [found[name] for name in sorted(found)]


def _requirements(name: str, *, extras: bool = True) -> list[str]:
    """Normalised names of what a package needs."""
    names = []
    for text in distribution(name).requires or []:
        match = _NAME.match(text)
        optional = "extra ==" in text
        if match is not None and (not optional or (extras and 'extra == "dev"' not in text)):
            names.append(re.sub(r"[-_.]+", "-", match.group()).lower())
    return names


def licence_of(package: Distribution) -> str:
    """What a package's metadata say of its licence, in few words."""
    about = package.metadata
    stated = (about.get_all("License-Expression") or about.get_all("License") or [""])[0]
    classified = [text.removeprefix(_CLASSIFIER) for text in about.get_all("Classifier") or []
                  if text.startswith(_CLASSIFIER)]
    if stated and len(stated) <= _LONGEST and stated.upper() != "UNKNOWN":
        return stated
    return ", ".join(classified) or _STATED.get(package.name, tr("see the package's own files"))


class AboutDialog(QDialog):
    """Two tabs: versions to copy, licences to read."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("About RHOT"))
        self.setProperty("guide", "troubles")
        self.resize(*_SIZE)
        title = QLabel(f"RHOT {version('rhot')}")
        title.setProperty("title", True)
        meaning = QLabel(tr("Low-cost hand and object tracking with cheap cameras. RHOT itself has the MIT licence."))
        meaning.setWordWrap(True)
        self.versions = QPlainTextEdit(versions_text())
        self.versions.setReadOnly(True)
        self.versions.setToolTip(tr("Put this into a report of a fault. `rhot report` collects more."))
        self.table: RecordTable[Part] = RecordTable((
            Column(tr("Package"), lambda part: part.name), Column(tr("Version"), lambda part: part.version),
            Column(tr("Licence"), lambda part: part.licence,
                   roles=lambda part: {Qt.ItemDataRole.ToolTipRole: part.licence})))
        self.table.setShowGrid(False)
        self.table.setAccessibleName(tr("Packages and licences"))
        self.table.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.table.show_records(parts())
        self.table.fit_columns()
        self.table.horizontalHeader().setStretchLastSection(False)  # some licences are longer than the window is wide
        self.tabs = QTabWidget()
        self.tabs.addTab(self.versions, tr("Versions"))
        self.tabs.addTab(self.table, tr("Licences"))
        self.copy_button = QPushButton(tr("Copy"))
        self.copy_button.setToolTip(tr("Copy the versions, for a report of a fault."))
        self.copy_button.clicked.connect(self._copy)
        self.close_button = QPushButton(tr("Close"))
        self.close_button.clicked.connect(self.close)
        buttons = QHBoxLayout()
        buttons.addWidget(self.copy_button)
        buttons.addStretch(1)
        buttons.addWidget(self.close_button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(12)
        for part in (title, meaning):
            layout.addWidget(part)
        layout.addWidget(self.tabs, 1)
        layout.addLayout(buttons)

    def _copy(self) -> None:
        QGuiApplication.clipboard().setText(self.versions.toPlainText())
