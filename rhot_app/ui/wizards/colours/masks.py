"""What the detectors of all cameras take for which marker, as masks over their pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QComboBox

from rhot_app.calibration.colour.cause import Cause, Explainer
from rhot_app.calibration.colour.illuminant import DriftResult, IlluminantDrift, drift_findings
from rhot_app.calibration.verdict import Finding
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.rows import marker_name
from rhot_app.ui.wizards.framework.drawing import Callout, Dots, Layer, Overlay
from rhot_app.ui.wizards.framework.step import AnnotatedPicture, Pictures
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage, from_bgr
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerObservation

_DIMMED = 150  # alpha of the black over everything that is taken for no marker
_FAINT = 70  # alpha of a marker's colour where it was not asked for

Show = Literal["all", "chosen", "none"]
"""Whose mask lies over the pictures."""


@dataclass(frozen=True, slots=True, eq=False)
class MaskedPicture:
    """One camera's `picture` as its detector sees it: `labels` (H/2, W/2) 1 + index of the marker, 0 for none; `drift`:
    how the light of the last pictures stands to the one that the marker set was learnt in; `causes`: by index, why the
    markers that were asked for are not found, or found in doubt."""

    picture: Picture
    image: YuvImage
    labels: NDArray[np.uint8]
    seen: tuple[MarkerObservation, ...]
    drift: DriftResult
    causes: Mapping[int, Cause]

    def why(self, index: int) -> str:
        """In words, why a marker is not found or in doubt; empty for one in plain view."""
        cause = self.causes.get(index)
        if cause is None:
            return ""
        how = tr("doubtful") if self.seen[index].found else tr("not found")
        return f"{how}. {cause.sentence}"


MaskedPictures = dict[str, MaskedPicture]


class MaskMaker:
    """Detectors of all cameras for one marker set after the other. One thread only."""

    def __init__(self) -> None:
        self._markers: MarkerSet | None = None
        self._detectors: dict[str, FastDetector] = {}
        self._drifts: dict[str, IlluminantDrift] = {}
        self._explainer: Explainer | None = None

    def look(self, pictures: Pictures, markers: MarkerSet, asked: Sequence[str] = ()) -> MaskedPictures:
        """What every camera's detector finds with `markers`, and why it does not find those that are `asked` for."""
        if markers is not self._markers:
            self._markers, self._detectors, self._drifts, self._explainer = markers, {}, {}, None
        masked = {}
        for name, picture in pictures.items():
            detector = self._detectors.setdefault(name, FastDetector(markers))
            image = from_bgr(picture.bgr)
            seen = detector.detect(image)
            drift = self._drifts.setdefault(name, IlluminantDrift(markers, detector))
            drift.update(image, seen)
            causes = self._causes(detector, image, seen, [marker for marker in asked if marker in markers.ids])
            masked[name] = MaskedPicture(picture, image, detector.labels(image), seen, drift.report(), causes)
        return masked

    def _causes(self, detector: FastDetector, image: YuvImage, seen: tuple[MarkerObservation, ...],
                asked: Sequence[str]) -> dict[int, Cause]:
        """Why those of the markers `asked` for that are not in plain view are not, by index."""
        assert self._markers is not None
        causes: dict[int, Cause] = {}
        for index in map(self._markers.ids.index, asked):
            if seen[index].found:
                cause = Explainer.doubt(seen, index)
            else:
                self._explainer = self._explainer or Explainer(self._markers)
                cause = self._explainer.why_lost(detector, image, seen, index)
            if cause is not None:
                causes[index] = cause
        return causes


def drift_of(masked: MaskedPictures) -> tuple[Finding, ...]:
    """What is to be said of the light."""
    return drift_findings({name: picture.drift for name, picture in masked.items()})


def annotated_by_masks(masked: MaskedPictures, markers: MarkerSet, chosen: int | None,
                       show: Show) -> dict[str, AnnotatedPicture]:
    """The pictures with the masks that `show` asks for."""
    return {name: AnnotatedPicture(one.picture, () if show == "none" else mask_overlay(one, markers, chosen))
            for name, one in masked.items()}


def mask_overlay(picture: MaskedPicture, markers: MarkerSet, chosen: int | None) -> Overlay:
    """The mask over a dimmed picture, every marker in its own colour, those found with a ring and their name.

    `chosen`: the only marker that is shown in full; None shows all so.
    """
    palette = np.zeros((len(markers.markers) + 1, 4), np.uint8)
    palette[0, 3] = _DIMMED
    for index, marker in enumerate(markers.markers):
        palette[index + 1] = (*marker.display_rgb, 255 if chosen in (None, index) else _FAINT)
    marks: list[Layer | Dots | Callout] = [Layer(palette[picture.labels])]
    for number, mark in enumerate(picture.seen):
        if mark.found and chosen in (None, mark.index):
            marks.append(Dots(np.array([[mark.x, mark.y]]), "text", radius=3.0))
            further = "" if number < len(markers.markers) else "?"  # something else of the marker's colour
            marks.append(Callout(mark.x, mark.y, marker_name(markers.ids[mark.index]) + further))
    return tuple(marks)


_SHOWN = (("all", tr_noop("Mask of all markers")), ("chosen", tr_noop("Mask of the chosen marker")),
          ("none", tr_noop("Picture without mask")))


class MaskChoice(QComboBox):
    """Whose mask lies over the pictures."""

    def __init__(self) -> None:
        super().__init__()
        for value, text in _SHOWN:
            self.addItem(tr(text), value)
        self.setToolTip(tr("The mask is what the detector really takes for each marker, pixel by pixel, in this "
                           "light."))
