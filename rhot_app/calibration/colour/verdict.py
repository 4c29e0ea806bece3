"""The verdict on learnt colours, and how well the detector finds the markers under other illuminants."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rhot_app.calibration.colour.cause import JOINED, Cause, Explainer
from rhot_app.calibration.colour.identity import Identity, hues_apart_deg, name_of_hue
from rhot_app.calibration.colour.illuminant import LAMPS, SAME, Lamp, chances, relit_image
from rhot_app.calibration.colour.model import COVERAGE
from rhot_app.calibration.colour.paint_region import HUE_REACH_DEG, PaintRegion
from rhot_app.calibration.colour.samples import MarkedPicture, PaintSamples
from rhot_app.calibration.colour.separability import SKIN, Separability
from rhot_app.calibration.colour.surroundings import SurroundingsResult
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.progress import Progress, silent
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.illuminant import MARKERS_LEAST, RGB_FROM_YCC
from rhot_node.detect.image import YuvImage
from rhot_node.markers import ChromaModel, MarkerSet
from rhot_node.wire.messages import MarkerFlag, MarkerObservation

# -- detection under other illuminants ---------------------------------------------------------------------------------
# The calibration's own pictures, relit, are shown to the real detector.
# The detector reports several candidates of a marker, and the master chooses among them by place. A marker is therefore
# found when any of its candidates is where it is.

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


def rehearse(markers: MarkerSet, names: Sequence[str], views: Sequence[MarkedPicture],
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
           seen: Sequence[MarkerObservation], index: int, view: MarkedPicture) -> Cause:
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


# -- verdict on learnt colours -----------------------------------------------------------------------------------------

OVERLAP = 0.1  # of a colour taken for a marker, over all lamps: less are specks, which the detector leaves out
SAME_COLOUR = 0.35  # of one marker taken for another: only chance tells them apart
SKIN_COLOUR = 0.75  # of skin taken for a marker: also where that is not in shade
LOST = 0.1  # of the pictures, over all lamps: more is not only by lamps at the end of the range
NEVER_FOUND = 0.9  # of the pictures in which a marker is lost, while something else has its colour: it is that
RIVAL = 0.7  # of the marker's own merit: a thing that is about as good a marker
_ROUNDED_DEG = 0.2  # two hue tolerances of one decimal
PALE = 28.0  # grey levels of chroma: less drowns in noise when a hand is in shade
BURNT, BURNT_SHARE = 253.0, 0.1  # a channel that is cut off falsifies the hue
DARK, DIM = 25.0, 60.0  # grey levels of luma: too dark; so dark that light helps
_KEEP_LAMPS = "Or keep the lamps as they are, and learn again when they change."
_UNKNOWN_LAMP = (f"Less than {MARKERS_LEAST} markers do not tell a camera which lamp there is, unless it changes "
                 "slowly.", f"Wear {MARKERS_LEAST} markers or more, or keep the lamps as they are.")
FAIR, GOOD, POOR = Grade.FAIR, Grade.GOOD, Grade.POOR


def judge_report(samples: Sequence[PaintSamples], markers: MarkerSet, separability: Separability,
                 room: SurroundingsResult, rehearsal: Rehearsal, free: Sequence[str], runs_on: set[str],
                 identity: Identity) -> Verdict:
    """All findings on a calibration, worst first, and a sentence that sums up. `markers`: all of the set."""
    bounds = {marker.id: marker.chroma for marker in markers.markers}
    models = [bounds[one.name] for one in samples]
    other_paint = f"Use another paint for one of them: {_or(free[:3])} would be free here." if free else \
        "Use fewer markers, or a plainer background: no hue is left free here."
    joined = {one.name for one, lost in zip(samples, rehearsal.lost, strict=True) if lost >= LOST} & runs_on
    findings = [
        *_skin(separability, free, joined, identity), *_pairs(separability, other_paint, identity),
        *_swallowed(samples, bounds, identity), *_exchanged(identity), *_rivals(samples, room, free),
        *_lamps(samples, rehearsal, separability, room),
        *_paints(samples, models),
    ]
    worst = separability.sentences[0] if separability.sentences else "no two colours overlap"
    names = ", ".join(_with_paint(one.name, model) for one, model in zip(samples, models, strict=True))
    return judge(f"{len(samples)} {'colour' if len(samples) == 1 else 'colours'} ({names}); {worst}.", findings)


def _pairs(separability: Separability, remedy: str, identity: Identity) -> Iterator[Finding]:
    same = {(first, second): apart for first, second, apart in identity.same}
    sampled = [(first, second) for k, first in enumerate(separability.names) for second in separability.names[k + 1:]]
    for first, second in dict.fromkeys([*same, *sampled]):
        share = separability.pair(first, second)
        overlap = f"{first} and {second} overlap by {100 * share:.0f} %"
        if (first, second) in same:
            how = overlap if share >= 0.005 else f"{first} and {second} have one colour"
            kept = [name for name in (first, second) if name not in separability.names]
            yield Finding("same-colour", POOR, f"{how}: their hues are {same[first, second]:.0f}° apart.",
                          "For the camera they have the same colour.",
                          f"Pick {kept[0]} too if it has new paint. {remedy}" if kept else remedy)
        elif share >= SAME_COLOUR:
            yield Finding("same-colour", POOR, f"{overlap}.", "For the camera they have the same colour.", remedy)
        elif share >= OVERLAP:
            yield Finding("overlap", FAIR, f"{overlap}.", "Their hues are too near each other; where they pass, one "
                          "may take the other's name.", remedy)


def _swallowed(samples: Sequence[PaintSamples], bounds: Mapping[str, ChromaModel],
               identity: Identity) -> Iterator[Finding]:
    """Markers whose hues reach into another's, or over its middle: where that one's paint is pale or dark, the first
    one takes it."""
    sampled, same = {one.name for one in samples}, {frozenset(pair[:2]) for pair in identity.same}
    for name, model in bounds.items():
        for other, theirs in bounds.items():
            if other == name or frozenset((name, other)) in same or not sampled & {name, other}:
                continue
            apart, reach = hues_apart_deg(model, theirs), model.hue_tolerance_deg
            into = sampled >= {name, other} and reach >= theirs.hue_tolerance_deg \
                and reach + theirs.hue_tolerance_deg > apart + _ROUNDED_DEG
            if apart > reach and not into:
                continue
            yield Finding("swallowed", POOR if apart <= reach and name in sampled else FAIR,
                          f"The hue of {name} reaches {reach:.0f}° either way, and {other} is only {apart:.0f}° away.",
                          f"Shaded paint of {other} is taken for {name}.",
                          f"Narrow {name} to less than {max(apart - theirs.hue_tolerance_deg, 0.5 * apart):.0f}°."
                          if name in sampled else f"Pick {name} too.")


def _skin(separability: Separability, free: Sequence[str], joined: set[str], identity: Identity) -> Iterator[Finding]:
    border = "Put a grey border of some 3 mm round the marker, so that no skin adjoins it"
    paint = f"use another paint: {_or(free[:3])} would be free here." if free else "use another paint."
    for name in separability.names:
        share = separability.pair(name, SKIN)
        overlap = f"{name} and skin overlap by {100 * share:.0f} %"
        shown = "; ".join(part for part in (overlap if share >= SKIN_COLOUR else "", identity.skin.get(name, ""))
                          if part)
        if shown:
            yield Finding("skin", POOR, f"{name} has the colour of skin: {shown}.",
                          "The hand itself would be taken for the marker.",
                          f"Pick the paint of {name} again if the click missed it; else {paint}")
        elif share >= OVERLAP:
            yield Finding("skin", FAIR, f"{overlap}.", "In some light or shade skin has this colour: the marker's "
                          "place will jump onto the hand.", f"{border}, or {paint}")
        elif name in joined:
            yield Finding("runs-on", FAIR, f"The colour of {name} goes on beyond what a marker can be.",
                          "What surrounds the marker has nearly its colour.", f"{border}, or {paint}")


def _exchanged(identity: Identity) -> Iterator[Finding]:
    if identity.exchanged:
        yield Finding("exchanged", FAIR, identity.exchanged,
                      "The paints were exchanged, or clicked in another order than they are on the hand.",
                      "If the hand does not wear them so, pick these markers again.")


def _rivals(samples: Sequence[PaintSamples], room: SurroundingsResult, free: Sequence[str]) -> Iterator[Finding]:
    for one, rival in zip(samples, room.rivals, strict=True):
        if rival is None or rival.merit < RIVAL:
            continue
        where = f"at {rival.x:.0f}, {rival.y:.0f} in picture {rival.picture + 1}"
        figure = f"Something {where} has the colour of {one.name}: {rival.area_px:.0f} px², the marker has " \
                 f"{4.0 * one.area:.0f} px²."
        cause = "The detector finds that first, and the marker after it." if rival.merit >= 1.0 else \
            "When the marker is turned or half hidden, the detector finds that first."
        paint = f", or use another paint: {_or(free[:3])} would be free here" if free else ""
        yield Finding("room", FAIR, figure, cause, f"Take it away or cover it, choose a plainer background{paint}.")


def _lamps(samples: Sequence[PaintSamples], rehearsal: Rehearsal, separability: Separability,
           room: SurroundingsResult) -> Iterator[Finding]:
    for one, lost, coverage, rival in zip(samples, rehearsal.lost, separability.coverage, room.rivals, strict=True):
        own = [failure for failure in rehearsal.failures if failure.marker == one.name]
        now = [failure for failure in own if failure.lamp == SAME]
        failed = [failure for failure in now if failure.outcome not in FOUND]
        second = [failure for failure in now if failure.outcome == "second"]
        if failed:
            what = {"lost": "not found", "elsewhere": "found in another place", "joined": "found together with what "
                    "surrounds it"}[failed[0].outcome]
            grade = POOR if lost >= NEVER_FOUND and rival is not None and rival.merit >= 1.0 else FAIR
            yield Finding("fails", grade, f"{one.name} is {what} in picture {failed[0].picture + 1} itself.",
                          failed[0].cause.sentence, failed[0].cause.remedy)
        elif lost >= LOST:
            usual = min((failure for failure in own if failure.outcome not in FOUND),
                        key=lambda failure: abs(failure.lamp.temperature_shift))
            untold = len(samples) < MARKERS_LEAST and usual.cause.code in ("hue", "other")
            cause, remedy = _UNKNOWN_LAMP if untold else ("", f"{usual.cause.remedy} {_KEEP_LAMPS}")
            yield Finding("lamp", FAIR, f"{one.name} would be lost or misplaced in {100 * lost:.0f} % of the pictures "
                          f"when lamps change, such as by {_in_words(usual.lamp)}.",
                          f"{usual.cause.sentence} {cause}".strip(), remedy)
        elif second and (rival is None or rival.merit < RIVAL):
            yield Finding("doubtful", FAIR, f"{one.name} is found in picture {second[0].picture + 1}, but another "
                          "thing of its colour is found first.", second[0].cause.sentence, second[0].cause.remedy)
        elif now and not second:
            yield Finding("doubtful", GOOD, f"{one.name} is found in doubt in picture {now[0].picture + 1}.",
                          now[0].cause.sentence, now[0].cause.remedy)
        elif coverage < COVERAGE:
            yield Finding("coverage", GOOD, f"{100 * coverage:.1f} % of the paint of {one.name} passes by every lamp.",
                          "Its model had to stay narrow because of what has a similar colour.")


def _paints(samples: Sequence[PaintSamples], models: Sequence[ChromaModel]) -> Iterator[Finding]:
    for one, model in zip(samples, models, strict=True):
        rgb = one.colours @ RGB_FROM_YCC.T
        burnt = float(np.mean(rgb.max(axis=1) >= BURNT))
        if burnt >= BURNT_SHARE:
            yield Finding("burnt", FAIR, f"{100 * burnt:.0f} % of {one.name}'s paint is too bright for the camera.",
                          "A colour channel is cut off there, which falsifies the hue.",
                          "Shorten the exposure or lower the gain, then learn again.")
        if one.spread_deg > HUE_REACH_DEG:
            yield Finding("uneven", FAIR if one.spread_deg <= 2.0 * HUE_REACH_DEG else POOR,
                          f"What was marked as {one.name} differs in hue by {one.spread_deg:.0f}°.",
                          "Light of another colour falls on a part of it, the cameras' white balances differ, or one "
                          "mark is on something else.", "It is learnt that wide; light the markers evenly, or mark "
                          "them again.")
        luma = float(np.median(one.colours[:, 0]))
        if model.magnitude < PALE or luma < DARK:
            figure = f"The colour of {one.name} is weak (chroma {model.magnitude:.0f}, luma {luma:.0f})."
            yield Finding("pale", FAIR, figure, "It is hard to tell from grey in shade.",
                          "Give more light, a longer exposure or more gain." if luma < DIM else
                          "Use a more saturated paint, or raise the camera's saturation.")


def _with_paint(name: str, model: ChromaModel) -> str:
    paint = name_of_hue(float(np.degrees(model.hue_rad)))
    return name if name.lower() == paint else f"{name} {paint}"


def _in_words(lamp: Lamp) -> str:
    colour = "much " if abs(lamp.temperature_shift) > 0.4 else ""
    colour += "warmer " if lamp.temperature_shift > 0.0 else "colder " if lamp.temperature_shift < 0.0 else ""
    change = 100.0 * (lamp.brightness - 1.0)
    bright = "" if not change else f" that is {abs(change):.0f} % {'brighter' if change > 0.0 else 'darker'}"
    return f"a {colour}lamp{bright}"


def _or(words: Sequence[str]) -> str:
    return " or ".join([", ".join(words[:-1]), words[-1]]) if len(words) > 1 else "".join(words)
