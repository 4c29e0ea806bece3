"""The tracked objects in words: how each is tracked, how well, and how far the fingertips are from it."""

from __future__ import annotations

import math

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from rhot_app.hand.skeleton import FINGERS
from rhot_app.objects.state import ObjectState, Validity
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme

WORDS = {Validity.SEARCHING: tr_noop("SEARCHING"), Validity.TRACKED: tr_noop("TRACKING"),
         Validity.AMBIGUOUS: tr_noop("AMBIGUOUS"), Validity.PREDICTED: tr_noop("PREDICTED"),
         Validity.LOST: tr_noop("LOST")}
MEANINGS = {
    Validity.SEARCHING: tr_noop("No camera has seen it yet. Are its tags in sight, sharp and at least 20 px large?"),
    Validity.TRACKED: tr_noop("Seen within the last tenth of a second."),
    Validity.AMBIGUOUS: tr_noop("Two poses explain its tags. Show a second tag, or the tag to a second camera."),
    Validity.PREDICTED: tr_noop("Not seen for a tenth of a second; it is where it would be if it went on moving."),
    Validity.LOST: tr_noop("Not seen for half a second.")}


class ObjectsPanel(QWidget):
    """Two lines for each object of the rig; hidden without objects."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("panel", True)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setProperty("guide", "objects")
        self.labels: list[QLabel] = []
        self._layout = QVBoxLayout(self)
        self._layout.setContentsMargins(8, 4, 8, 8)
        self.set_scheme(scheme)
        self.hide()

    def set_scheme(self, scheme: Scheme) -> None:
        """Change colours."""
        self._scheme = scheme

    def show_rig(self, rig: Rig | None) -> None:
        """The objects of another rig."""
        for label in self.labels:
            label.deleteLater()
        self.labels = []
        for model in () if rig is None else rig.models:
            label = QLabel(tr("{name}: no state yet", name=model.name))
            label.setWordWrap(True)
            label.setTextFormat(Qt.TextFormat.PlainText)
            self._layout.addWidget(label)
            self.labels.append(label)
        self.setVisible(bool(self.labels))

    def show_state(self, state: HandState | None) -> None:
        """The objects of a state; None: of nothing that is of now."""
        if state is None:
            return
        for label, one in zip(self.labels, state.objects, strict=False):
            text = "\n".join(object_lines(one))
            if text != label.text():
                label.setText(text)
                label.setToolTip(tr(MEANINGS[one.validity]))


def object_lines(one: ObjectState) -> list[str]:
    """What is said of an object: its state and standard deviations, then its fingertips."""
    if not one.tracked:
        return [f"{one.name}: {tr(WORDS[one.validity])}"]
    lines = [f"{one.name}: {tr(WORDS[one.validity])}, ±{1e3 * one.translation_sd:.1f} mm, "
             f"±{math.degrees(one.rotation_sd):.1f}°"]
    known = [(finger, distance, touching) for finger, distance, touching
             in zip(FINGERS, one.distances.tolist(), one.contacts.tolist(), strict=True) if math.isfinite(distance)]
    if known:
        lines.append(", ".join(tr("{finger} touches", finger=tr(finger)) if touching
                               else f"{tr(finger)} {1e3 * distance:.0f} mm" for finger, distance, touching in known))
    return lines
