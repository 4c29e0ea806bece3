"""The judgement on learnt colours: what will go wrong, why, and what helps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from rhot_app.calibration.colour.identity import Identity
from rhot_app.calibration.colour.illuminant import SAME, Lamp
from rhot_app.calibration.colour.model import COVERAGE
from rhot_app.calibration.colour.names import name_of_hue
from rhot_app.calibration.colour.rehearsal import FOUND, Rehearsal
from rhot_app.calibration.colour.samples import PaintSamples
from rhot_app.calibration.colour.separability import SKIN, Separability
from rhot_app.calibration.colour.surroundings import SurroundingsReport
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_node.detect.illuminant import RGB_FROM_YCC
from rhot_node.detect.illuminant_guess import MARKERS_LEAST
from rhot_node.markers import ChromaModel

OVERLAP = 0.1  # of a colour taken for a marker, over all lamps: less are specks, which the detector leaves out
SAME_COLOUR = 0.35  # of one marker taken for another: only chance tells them apart
SKIN_COLOUR = 0.75  # of skin taken for a marker: also where that is not in shade
LOST = 0.1  # of the pictures, over all lamps: more is not only by lamps at the end of the range
NEVER_FOUND = 0.9  # of the pictures in which a marker is lost, while something else has its colour: it is that
RIVAL = 0.7  # of the marker's own merit: a thing that is about as good a marker
PALE = 28.0  # grey levels of chroma: less drowns in noise when a hand is in shade
BURNT, BURNT_SHARE = 253.0, 0.1  # a channel that is cut off falsifies the hue
DARK, DIM = 25.0, 60.0  # grey levels of luma: too dark; so dark that light helps
_KEEP_LAMPS = "Or keep the lamps as they are, and learn again when they change."
_UNKNOWN_LAMP = (f"Less than {MARKERS_LEAST} markers do not tell a camera which lamp there is, unless it changes "
                 "slowly.", f"Wear {MARKERS_LEAST} markers or more, or keep the lamps as they are.")
FAIR, GOOD, POOR = Grade.FAIR, Grade.GOOD, Grade.POOR


def judge_report(samples: Sequence[PaintSamples], models: Sequence[ChromaModel], separability: Separability,
                 room: SurroundingsReport, rehearsal: Rehearsal, free: Sequence[str], runs_on: set[str],
                 identity: Identity) -> Verdict:
    """All findings on a calibration, worst first, and a sentence that sums up."""
    other_paint = f"Use another paint for one of them: {_or(free[:3])} would be free here." if free else \
        "Use fewer markers, or a plainer background: no hue is left free here."
    joined = {one.name for one, lost in zip(samples, rehearsal.lost, strict=True) if lost >= LOST} & runs_on
    findings = [
        *_skin(separability, free, joined, identity), *_pairs(separability, other_paint, identity),
        *_exchanged(identity), *_rivals(samples, room, free), *_lamps(samples, rehearsal, separability, room),
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


def _rivals(samples: Sequence[PaintSamples], room: SurroundingsReport, free: Sequence[str]) -> Iterator[Finding]:
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
           room: SurroundingsReport) -> Iterator[Finding]:
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
