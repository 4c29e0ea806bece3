"""Pictures of windows for the guide: taken, looked at, written when they are to be renewed."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from PySide6.QtCore import QSize
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "screenshots"
UPDATE = os.environ.get("RHOT_UPDATE_SCREENSHOTS") == "1"
SIZE = QSize(1280, 800)


def picture_of(window) -> QImage:
    """What is on the screen where the window stands, OpenGL included."""
    QApplication.processEvents()
    return window.screen().grabWindow(window.winId()).toImage()


def colours_in(image: QImage) -> int:
    """How many different colours the picture has, in coarse steps."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), rgb.bytesPerLine())[:, :3 * rgb.width()]
    coarse = (rows.reshape(-1, 3) >> 4).astype(np.intp) @ np.array([256, 16, 1])
    return int(np.count_nonzero(np.bincount(coarse)))


def check(name: str, image: QImage, least_colours: int) -> None:
    """Write the picture, or see that it is neither blank nor missing in the docs."""
    assert colours_in(image) >= least_colours, f"the page {name} is nearly blank"
    path = FOLDER / f"{name}.png"
    if UPDATE:
        FOLDER.mkdir(parents=True, exist_ok=True)
        assert image.save(str(path))
    assert path.exists(), f"{path} is missing; run this test with RHOT_UPDATE_SCREENSHOTS=1"
