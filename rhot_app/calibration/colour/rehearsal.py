"""Rehearse tracking by other lamps: the calibration's own pictures, relit, shown to the real detector.

The detector reports several candidates of a marker, and the master chooses among them by place. A marker is therefore
found when any of its candidates is where it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rhot_app.calibration.colour.cause import JOINED, Cause, Explainer
from rhot_app.calibration.colour.illuminant import LAMPS, SAME, Lamp, chances, relit_image
from rhot_app.calibration.colour.paint_region import PaintRegion
from rhot_app.calibration.colour.samples import View
from rhot_app.progress import Progress, silent
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage
from rhot_node.markers import MarkerSet
from rhot_node.wire.messages import MarkerFlag, MarkerObservation

VIEWS_MOST = 4
LAMPS_TRIED = (SAME, *(lamp for lamp in LAMPS if lamp.brightness != 1.0))
CHANCES = chances(LAMPS_TRIED)
SHRUNK = 0.3  # of the marker's sample: most of it is gone

Outcome = Literal["lost", "elsewhere", "joined", "second", "doubtful"]
FOUND = ("second", "doubtful")


@dataclass(frozen=True, slots=True)
class Failure:
    """A marker that the detector did not find where it is: lost, found elsewhere, or joined by its surroundings.

    "second": it was found where it is, after something else of its colour; "doubtful": it was found alone, with a flag
    of doubt. `tracked`: whether that happened in its tracking window, a frame after it had been found. `cause`: the
    test of the detector that says so.
    """

    marker: str
    picture: int
    lamp: Lamp
    outcome: Outcome
    tracked: bool
    cause: Cause


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """`failures`: everything that failed. `lost`, per marker: in what share of all pictures it is not found where it
    is, by the lamps that may come, each as often as it may; of searching and tracking the worse one. What is FOUND
    does not count."""

    failures: tuple[Failure, ...]
    lost: tuple[float, ...]


def rehearse(markers: MarkerSet, names: Sequence[str], views: Sequence[View],
             progress: Progress = silent) -> Rehearsal:
    """Show the pictures by all lamps as unrelated stills and once again as the next frame; tell what fails.

    Only markers that are known in a picture are judged there. `names`: of the markers, in the order of the set.
    """
    detector, explainer = FastDetector(markers), Explainer(markers)
    failures = []
    chosen = list(enumerate(views))[:VIEWS_MOST]
    for number, (picture, view) in enumerate(chosen):
        for step, lamp in enumerate(LAMPS_TRIED):
            progress("trying other lamps", (number + step / len(LAMPS_TRIED)) / len(chosen))
            image = view.image if lamp == SAME else relit_image(view.image, lamp)
            detector.reset()
            for tracked in (False, True):
                seen = detector.detect(image)
                for index, name in enumerate(names):
                    if name in view.paint:
                        outcome = _outcome([mark for mark in seen if mark.index == index], view.paint[name])
                        if outcome is not None:
                            cause = _cause(outcome, explainer, detector, image, seen, index, view)
                            failures.append(Failure(name, picture, lamp, _as_said(outcome, cause), tracked, cause))
    shown = [sum(name in view.paint for _, view in chosen) for name in names]
    return Rehearsal(tuple(failures), tuple(_lost(name, count, failures)
                                            for name, count in zip(names, shown, strict=True)))


def _lost(name: str, shown: int, failures: Sequence[Failure]) -> float:
    """The share of a marker's `shown` pictures, over all lamps, in which it failed."""
    worse = 0.0
    for tracked in (False, True):
        own = [LAMPS_TRIED.index(one.lamp) for one in failures if one.marker == name and one.tracked == tracked
               and one.outcome not in FOUND]
        worse = max(worse, float(CHANCES[own].sum()) / max(shown, 1))
    return worse


def _outcome(candidates: Sequence[MarkerObservation], region: PaintRegion) -> Outcome | None:
    """What became of a marker; `candidates`: what was found of it, the best first."""
    each = [_outcome_of(mark, region) for mark in candidates]
    if None in each:
        cut = len(each) == 1 and candidates[0].flags & MarkerFlag.EDGE
        return "second" if each[0] is not None else "doubtful" if cut else None
    return next((outcome for outcome in each if outcome == "joined"), each[0])


def _cause(outcome: Outcome, explainer: Explainer, detector: FastDetector, image: YuvImage,
           seen: Sequence[MarkerObservation], index: int, view: View) -> Cause:
    doubt = explainer.doubt(seen, index) if outcome == "doubtful" else None
    if doubt is not None:
        return doubt
    return explainer.why_second(seen, index) if outcome == "second" else \
        explainer.why_lost(detector, image, seen, index, view.paint)


def _as_said(outcome: Outcome, cause: Cause) -> Outcome:
    """The outcome by its cause: a large thing elsewhere may be the marker with its surroundings, or not."""
    if cause.code == "joined":
        return "joined"
    return "elsewhere" if outcome == "joined" else outcome


def _outcome_of(seen: MarkerObservation, region: PaintRegion) -> Outcome | None:
    if not seen.found:
        return "lost"
    height, width = region.whole.shape
    column, row = min(max(int(seen.x) // 2, 0), width - 1), min(max(int(seen.y) // 2, 0), height - 1)
    area = math.pi * (0.25 * seen.diameter) ** 2
    if not region.whole[row, column]:
        return "joined" if area > JOINED * region.area else "elsewhere"
    if area > JOINED * region.area:
        return "joined"
    return "lost" if area < SHRUNK * np.count_nonzero(region.sample) else None
