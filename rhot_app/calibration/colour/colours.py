"""Calibrate the markers' colours: samples and pictures in, a marker set with a judgement out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.colour.identity import free_paints, identify
from rhot_app.calibration.colour.model import Obstacles, range_of_samples, solve_models
from rhot_app.calibration.colour.samples import MarkedPicture, PaintSamples
from rhot_app.calibration.colour.separability import Separability, judge_colours
from rhot_app.calibration.colour.surroundings import SurroundingsResult, surrounding_colours, survey_surroundings
from rhot_app.calibration.colour.verdict import Rehearsal, judge_report, rehearse
from rhot_app.calibration.verdict import Verdict
from rhot_app.errors import CalibrationError
from rhot_app.hand.skeleton import TIP_ROLES, WRIST_ROLE
from rhot_app.progress import Progress, silent
from rhot_node.detect.colour import Colours
from rhot_node.markers import ChromaModel, Marker, MarkerSet, Shape

NO_COLOURS: NDArray[np.float32] = np.zeros((0, 3), np.float32)

ROLES = {**{role.removesuffix("_tip"): role for role in TIP_ROLES}, "pinky": "little_tip", "wrist": WRIST_ROLE}


@dataclass(frozen=True, slots=True)
class ColourResult:
    """What a calibration of colours found.

    `markers`: the set to be used, base markers without samples left as they were. `names`: the markers with samples, in
    the set's order, which `samples`, `separability` and `room` follow. `rehearsal`: what the detector loses in
    the pictures, also relit. `free`: paints that the markers and the room leave free.
    """

    markers: MarkerSet
    names: tuple[str, ...]
    samples: tuple[PaintSamples, ...]
    separability: Separability
    room: SurroundingsResult
    rehearsal: Rehearsal
    free: tuple[str, ...]
    verdict: Verdict


def solve_colours(samples: Sequence[PaintSamples], views: Sequence[MarkedPicture], *, skin: Colours = NO_COLOURS,
                  base: MarkerSet | None = None, given: Mapping[str, ChromaModel] | None = None,
                  before: Mapping[str, Sequence[ChromaModel]] | None = None,
                  progress: Progress = silent) -> ColourResult:
    """Colour models for all sampled markers, and how well they can be told apart from each other, skin and the room.

    `views`: pictures in which the markers that they show are marked, as `ColourSamples` keeps them. `skin` (N, 3): Y,
    Cb, Cr of bare skin. `base`: the set whose markers are learnt anew; without it their roles are guessed from their
    names. `given`: models that a person has set, by marker; they are judged as the learnt ones are. `before`: what a
    person had named each marker's colour earlier, and then replaced. Raises CalibrationError when there are no samples,
    or names that `base` has not.
    """
    if not samples:
        raise CalibrationError("there are no samples; draw a box over at least one marker.")
    ordered = _in_order(samples, base)
    names = tuple(one.name for one in ordered)
    progress("learning the colours", 0.0)
    rooms = tuple(surrounding_colours(views, name) for name in names)
    own = given or {}
    models = tuple(own.get(one.name, model)
                   for one, model in zip(ordered, solve_models(ordered, Obstacles(skin, rooms)), strict=True))
    learnt = {one.name: _marker(one, model, base) for one, model in zip(ordered, models, strict=True)}
    sampled = MarkerSet(markers=tuple(learnt.values()))
    progress("comparing the colours", 0.1)
    separability = judge_colours(sampled, ordered, skin, [room.colours for room in rooms])
    room = survey_surroundings(sampled, names, views)
    rehearsal = rehearse(sampled, names, views, lambda text, share: progress(text, 0.3 + 0.7 * share))
    free = free_paints([np.degrees(model.hue_rad) for model in models], room.hue_px)
    runs_on = {name for view in views for name, region in view.paint.items() if region.runs_on}
    markers = sampled if base is None else MarkerSet(
        markers=tuple(learnt.get(marker.id, marker) for marker in base.markers), name=base.name)
    rig = {} if base is None else {marker.id: (marker.chroma,) for marker in base.markers}
    identity = identify(ordered, views, {marker.id: marker.chroma for marker in markers.markers}, (before or {}, rig))
    verdict = judge_report(ordered, markers, separability, room, rehearsal, free, runs_on, identity)
    return ColourResult(markers, names, tuple(ordered), separability, room, rehearsal, free, verdict)


def _in_order(samples: Sequence[PaintSamples], base: MarkerSet | None) -> list[PaintSamples]:
    """As in the base set; without one as given."""
    if base is None:
        return list(samples)
    unknown = [one.name for one in samples if one.name not in base.ids]
    if unknown:
        raise CalibrationError(f"the marker set has no marker {unknown[0]!r}; it has {', '.join(base.ids)}.")
    return sorted(samples, key=lambda one: base.ids.index(one.name))


def _marker(samples: PaintSamples, model: ChromaModel, base: MarkerSet | None) -> Marker:
    """The marker with its new colour; what else it is comes from the base set or from its name."""
    bounds = range_of_samples(samples)
    if base is not None:
        return msgspec.structs.replace(base.markers[base.ids.index(samples.name)], chroma=model,
                                       display_rgb=samples.rgb, range=bounds)
    role = ROLES.get(samples.name.lower())
    shape: Shape = "blob" if role is None else "band" if role == WRIST_ROLE else "capsule"
    return Marker(id=samples.name, chroma=model, display_rgb=samples.rgb, role=role, shape=shape, range=bounds)
