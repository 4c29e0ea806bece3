"""What can be wrong with a calibration of bones, in sentences with figure, cause and remedy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand.bones_collector import RigidPair, find_slip, find_step
from rhot_app.calibration.hand.bones_result import BoneLength, Known, MarkerSpot
from rhot_app.calibration.hand.marker_places import PALM, MarkerPlace, MarkerTracks
from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.hand.skeleton import FINGERS, FLEXIONS

Array = NDArray[np.float64]

SHORT_S, TOO_SHORT_S = 20.0, 5.0
STILL_DEG = 40.0
"""Flexion of a finger's joints together; closing a fist takes 200 and more."""

STILL_PART = 0.12
"""Part of its reach by which a finger's tip comes nearer to the wrist; in a fist it is half."""

OTHER_SIDE = 0.7
"""The other hand fits so much better that this one must be the wrong one (ratio of costs)."""

STEP_M = 0.5e-3
"""A step of a marker about the fitted hand, which gives way to a slip and shows a quarter of it or less."""

LARGE_ERROR_MM, USELESS_ERROR_MM = 2.0, 5.0
MISPLACED_MM = 4.0
"""A marker this far off on average sits somewhere else: skin does not slide so far."""

_MISPLACED_TIMES = 2.5  # what is usual of the other markers
_NAMED = 4
_BEYOND_BONE, _FAR_BEYOND_BONE = 0.25, 0.5  # of its length
_BEYOND_ERROR = 5.0  # times what markers are off anyway, which also steps when a hand takes hold of something
_FAR_FROM_USUAL, _NO_HAND_HAS = 3.0, 6.0  # standard deviations


def length_findings(seconds: float) -> list[Finding]:
    """Whether the recording is long enough."""
    if seconds >= SHORT_S:
        return []
    return [Finding("too_short", Grade.POOR if seconds < TOO_SHORT_S else Grade.FAIR,
                    f"The recording is {seconds:.0f} s long.", "Few movements show the joints from few sides.",
                    "Move every finger freely for a minute.")]


def side_findings(side: str, other_side_cost: float) -> list[Finding]:
    """Whether the other hand would fit better."""
    other = "left" if side == "right" else "right"
    if other_side_cost > OTHER_SIDE:
        return []
    return [Finding("wrong_side", Grade.POOR, f"A {other} hand fits {1.0 / other_side_cost:.1f} times better than a "
                    f"{side} one.", "The fingers bend the other way.", f"Give --side {other}, or check the markers' "
                    "roles.")]


def stillness_findings(angles: Array) -> list[Finding]:
    """Fingers that hardly moved, from joint angles (F, 21) rad."""
    found = []
    for finger, name in enumerate(FINGERS):
        flexions = angles[:, list(FLEXIONS[finger])].sum(axis=1)
        bent = float(np.degrees(np.subtract(*np.percentile(flexions, [97.5, 2.5]))))
        if bent < STILL_DEG:
            found.append(_still(name, f"bent by {bent:.0f} degrees only, all joints together"))
    return found


def bending_findings(reach_m: Array, bending_m: Array) -> list[Finding]:
    """The same from reaches (5,) m and how much shorter each finger got."""
    return [_still(name, f"came {1e3 * bending_m[k]:.0f} mm nearer to the wrist only")
            for k, name in enumerate(FINGERS) if np.isfinite(reach_m[k]) and bending_m[k] < STILL_PART * reach_m[k]]


def _still(finger: str, how: str) -> Finding:
    return Finding("finger_still", Grade.FAIR, f"The {finger} finger {how}." if finger != "thumb" else
                   f"The thumb {how}.", "Its joints do not show where they are.",
                   "Record again, and bend it further than this time.")


def slip_findings(tracks: MarkerTracks) -> list[Finding]:
    """Markers of one body whose distance stepped."""
    found = []
    for first, second in same_body(tracks.places):
        slip = find_slip(tracks.times_s, tracks.positions, first, second)
        if slip is not None:
            found.append(_slipped(f"{tracks.places[first].name} and {tracks.places[second].name} were "
                                  f"{1e3 * slip.before_m:.1f} mm apart until {slip.at_s:.0f} s, then "
                                  f"{1e3 * slip.after_m:.1f} mm."))
    return found


def drift_findings(times_s: Array, local: Array, places: Sequence[MarkerPlace], error_m: float) -> list[Finding]:
    """Markers that step out of their place on the fitted hand, from residuals (F, M, 3) m in their own segments.

    `error_m`: how far markers are off in any case, whenever the movement changes. The other markers of the finger
    follow a step in part; the one that steps most is named.
    """
    smallest = max(STEP_M, _BEYOND_ERROR * error_m)
    steps: dict[int, tuple[float, float, int]] = {}
    for m, place in enumerate(places):
        for axis in range(3):
            step = find_step(times_s, local[:, m, axis], smallest)
            if step is not None:
                size = abs(step[2] - step[1])
                steps[place.finger] = max(steps.get(place.finger, (0.0, 0.0, 0)), (size, step[0], m))
    return [_slipped(f"{places[m].name} moved on its bone by {1e3 * size:.1f} mm or more at {at_s:.0f} s.")
            for size, at_s, m in steps.values()]


def _slipped(figure: str) -> Finding:
    return Finding("marker_slipped", Grade.POOR, figure, "It slipped, or was confused with another.",
                   "Fasten it and record again.")


def rigid_findings(pairs: Sequence[RigidPair], tracks: MarkerTracks) -> list[Finding]:
    """Markers that are said to sit on one bone but do not keep their distance."""
    places, positions = tracks.places, tracks.positions
    rigid = {(pair.first, pair.second) for pair in pairs}
    found = []
    for first, second in same_body(places):
        if (first, second) in rigid or places[first].painted != places[second].painted:
            continue
        distance = np.linalg.norm(positions[:, first] - positions[:, second], axis=1)
        if not np.isfinite(distance).any():
            continue
        low, high = np.nanpercentile(distance, [2.5, 97.5])
        if high - low > 8e-3:
            found.append(Finding(
                "not_rigid", Grade.FAIR, f"{places[first].name} and {places[second].name} are {1e3 * low:.0f} to "
                f"{1e3 * high:.0f} mm apart.", f"They are said to sit on one body, the {places[first].word}.",
                "Check their roles, or put them where the skin moves less."))
    return found


def same_body(places: Sequence[MarkerPlace]) -> list[tuple[int, int]]:
    """Pairs of markers that sit on the same bone, or both on the palm."""
    bodies = [(place.finger, place.segment) for place in places]
    return [(a, b) for a in range(len(bodies)) for b in range(a + 1, len(bodies)) if bodies[a] == bodies[b]]


def error_findings(error_mm: float) -> list[Finding]:
    """Whether the markers move as a hand's do."""
    if error_mm < LARGE_ERROR_MM:
        return []
    return [Finding("large_error", Grade.POOR if error_mm > USELESS_ERROR_MM else Grade.FAIR,
                    f"The markers are {error_mm:.1f} mm off the fitted hand.",
                    "Markers sit elsewhere than their roles say, or were confused with each other.",
                    "Check the roles, and that no two markers look alike.")]


def misplaced_findings(residuals: Array, places: Sequence[MarkerPlace]) -> list[Finding]:
    """Markers that follow the fitted hand much worse than the others, from residuals (F, M, 3) m."""
    counts = np.isfinite(residuals).sum(axis=(0, 2))
    off_mm = 1e3 * np.sqrt(np.nansum(np.square(residuals), axis=(0, 2)) / np.maximum(counts, 1))
    usual = float(np.median(off_mm))
    odd = [m for m in np.argsort(-off_mm) if off_mm[m] > max(MISPLACED_MM, _MISPLACED_TIMES * usual)]
    if not odd:
        return []
    names = " and ".join(f"{places[m].name} ({off_mm[m]:.0f} mm)" for m in odd[:_NAMED])
    return [Finding("misplaced", Grade.POOR, f"Far off the fitted hand: {names}; the others are {usual:.1f} mm off.",
                    "They sit elsewhere than their roles or names say, or were confused with each other.",
                    "Check their roles, above all whether two of these are swapped.")]


def order_findings(spots: Sequence[MarkerSpot], bones: Sequence[BoneLength]) -> list[Finding]:
    """Markers that came out far before or behind the bone on which they are said to sit."""
    lengths = {bone.name.replace(".", " "): bone.length_mm for bone in bones}
    found = []
    for spot in spots:
        length = lengths.get(spot.place, 0.0)
        beyond = max(-spot.along_mm, spot.along_mm - length)
        if length and beyond > _BEYOND_BONE * length:
            found.append(Finding(
                "beyond_bone", Grade.POOR if beyond > _FAR_BEYOND_BONE * length else Grade.FAIR,
                f"{spot.marker} came out {spot.along_mm:.0f} mm along the {spot.place} bone, which is {length:.0f} mm "
                "long.",
                "It sits on another bone than its role or name says, or was confused with its neighbour.",
                "Check its role, and whether it is swapped with the next one on the finger."))
    return found


def few_marker_findings(markers: int) -> list[Finding]:
    """What so few markers cannot show."""
    return [Finding("not_observed", Grade.GOOD, f"{markers} markers show the size of the hand and how far each finger "
                    "reaches, not single bones.", "Their lengths are what is usual in a hand of this size.",
                    "A marker on each bone and three on the back of the hand show single bones.")]


def bone_findings(bones: Sequence[BoneLength]) -> list[Finding]:
    """Bones that the recording does not show."""
    unseen = [bone.name for bone in bones if bone.known is Known.PRIOR]
    if not unseen:
        return []
    seen = [bone.name for bone in bones if bone.known is not Known.PRIOR]
    which = ("no bone by itself" if not seen else f"only {', '.join(seen)}" if len(seen) < len(unseen)
             else f"all but {', '.join(unseen)}")
    return [Finding("not_observed", Grade.GOOD if len(seen) > len(unseen) else Grade.FAIR,
                    f"The recording shows {which}; the lengths not shown are what is usual in a hand of this size.",
                    "No marker, or no movement, tells them from their neighbours.",
                    "Bend every joint by itself, or add markers.")]


def plausibility_findings(bones: Sequence[BoneLength], usual_mm: Array) -> list[Finding]:
    """Lengths far from what is usual in a hand of this size, `usual_mm` (15,)."""
    found = []
    for bone, usual in zip(bones, usual_mm, strict=True):
        off = abs(bone.length_mm - usual) / bone.usual_std_mm
        if bone.known is not Known.PRIOR and off > _FAR_FROM_USUAL:
            found.append(Finding(
                "unusual_bone", Grade.POOR if off > _NO_HAND_HAS else Grade.FAIR,
                f"{bone.name} is {bone.length_mm:.1f} mm; {usual:.1f} ± "
                f"{bone.usual_std_mm:.1f} mm is usual in a hand of this size.",
                "An unusual hand, or a marker on another bone than its role says.", "Measure it with a ruler."))
    return found


def palm_findings(places: Sequence[MarkerPlace]) -> list[Finding]:
    """Whether anything but the fingers shows the palm."""
    if any(place.finger == PALM for place in places):
        return []
    return [Finding("no_palm", Grade.FAIR, "No marker sits on the palm or the wrist.",
                    "The palm follows from the fingers alone.", "Put three markers on the back of the hand.")]
