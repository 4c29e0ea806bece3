"""Bone lengths from landmarks that two cameras see: each is the median distance of its two joints, and the palm is the
mean of all palms.

Landmarks err by millimetres, but about joints, so that nothing has to be fitted. On a recorded hand the medians are as
good as a bundle adjustment.
"""

from __future__ import annotations

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand import bones_judgement
from rhot_app.calibration.hand.bones_result import BoneLength, BonesResult, Known, Reach, bone_name
from rhot_app.calibration.hand.marker_places import SIZE_SD, MarkerTracks
from rhot_app.calibration.hand.shape import BONE_COUNT, HandUnknowns
from rhot_app.calibration.verdict import Finding, Grade, judge
from rhot_app.errors import CalibrationError
from rhot_app.geometry.transforms import best_rotation
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.landmarks import ANATOMY_SD_M, LASTING_S
from rhot_app.hand.skeleton import FINGERS, JOINTS

Array = NDArray[np.float64]

LEAST_INSTANTS = 30
"""Instants in which a bone's two joints are located: fewer give no median that may be used."""

LONG_S = 2.0
"""s: correlation times of landmarks enough for a median to settle."""

LARGE_SPREAD, USELESS_SPREAD = 0.12, 0.18
"""Median spread of the bones as a part of their lengths. A recorded hand's is 0.05 to 0.08; that of the same landmarks
with one camera a third of a second late 0.19, with the cameras in the wrong order 0.7."""

WRONG_SIZE = 4.0
"""Standard deviations of the size of adult hands (SIZE_SD): one in 16 000 is beyond."""

_DECILES = 2.563  # standard deviations of a Gaussian from its tenth to its ninetieth part; two hands in turn show, too


def are_landmarks(tracks: MarkerTracks) -> bool:
    """Whether the tracks are the landmarks of all joints."""
    return {place.joint for place in tracks.places} >= set(range(len(JOINTS)))


def measure_bones(tracks: MarkerTracks, base: HandAnatomy) -> BonesResult:
    """The hand whose landmarks these are; `base` gives what landmarks do not show: side, directions, radii, limits.

    A bone's stated deviation is the spread of its length, not that of the median. Raises CalibrationError when a bone,
    or the whole palm, was located in fewer than LEAST_INSTANTS instants.
    """
    column = {place.joint: k for k, place in enumerate(tracks.places)}
    joints = tracks.positions[:, [column[joint] for joint in range(len(JOINTS))]]
    lengths, spreads, instants = np.empty((5, 4)), np.empty((5, 4)), len(joints)
    for finger, name in enumerate(FINGERS):
        chain = [0, *range(4 * finger + 1, 4 * finger + 5)]
        for bone in range(4):
            seen = np.linalg.norm(joints[:, chain[bone + 1]] - joints[:, chain[bone]], axis=1)
            seen = seen[np.isfinite(seen)]
            if len(seen) < LEAST_INSTANTS:
                raise CalibrationError(f"{JOINTS[chain[bone]]} and {JOINTS[chain[bone + 1]]} of the {name} finger are "
                                       f"located together in {len(seen)} of the instants; a bone needs "
                                       f"{LEAST_INSTANTS}. Hold the hand so that two cameras see all of it.")
            instants = min(instants, len(seen))
            lengths[finger, bone] = np.median(seen)
            spreads[finger, bone] = np.subtract(*np.percentile(seen, [90.0, 10.0])) / _DECILES
    hand = _with_lengths(base, 1e3 * _roots(joints, base), 1e3 * lengths[:, 1:], 1e3 * spreads)
    prior = HandUnknowns(base, tracks.places).prior
    usual_mm = 1e3 * np.sqrt(np.diag(prior.fixed_size)[:BONE_COUNT] + 2.0 * ANATOMY_SD_M**2)  # a landmark is no joint
    bones = tuple(BoneLength(bone_name(k // 3, k % 3), float(1e3 * lengths[k // 3, 1 + k % 3]),
                             float(1e3 * spreads[k // 3, 1 + k % 3]), float(usual_mm[k]), Known.OBSERVED)
                  for k in range(BONE_COUNT))
    reaches = tuple(Reach(name, float(1e3 * lengths[k].sum()), float(1e3 * np.linalg.norm(spreads[k])))
                    for k, name in enumerate(FINGERS))
    usual_reaches = np.array([float(np.linalg.norm(one.base_mm)) + sum(one.bones_mm)
                              for one in (base.fingers[name] for name in FINGERS)])
    ratios = 1e3 * lengths.sum(axis=1) / usual_reaches
    size, spread = float(np.mean(ratios[1:])), float(np.median(spreads / lengths))
    findings = [*_length_findings(tracks.duration_s), *_spread_findings(spread), *_size_findings(size),
                *bones_judgement.plausibility_findings(bones, size * 1e3 * prior.mean[:BONE_COUNT])]
    return BonesResult(
        hand=hand, method="landmarks", size=size,
        size_std=float(1e3 * np.linalg.norm(spreads[1:]) / usual_reaches[1:].sum()), bones=bones,
        reaches=reaches, markers=(), rigid=(), residual_mm=None, noise_mm=float(1e3 * np.median(spreads)),
        error_mm=None, seconds=tracks.duration_s, instants=instants,
        verdict=judge(f"All bones are medians of {instants} instants or more, whose lengths spread by "
                      f"{100 * spread:.0f} %; the hand is {100 * size:.1f} % of the base hand.", findings))


def spreads_apart(result: BonesResult, hand: HandAnatomy) -> float:
    """How far the measured bones are from those of a hand: rms over them, each by the spread of its length."""
    others = np.array([hand.fingers[name].bones_mm for name in FINGERS]).ravel()
    return float(np.sqrt(np.mean([((one.length_mm - other) / max(one.std_mm, 0.01)) ** 2
                                  for one, other in zip(result.bones, others, strict=True)])))


def _roots(joints: Array, base: HandAnatomy) -> Array:
    """(5, 3) m: mean places of the fingers' roots in the palm's frame of a right hand, from `joints` (T, 21, 3) m. The
    palms of all instants are laid on each other (generalised Procrustes analysis, Gower 1975), at first on `base`."""
    palms = joints[:, [0, *(1 + 4 * finger for finger in range(5))]]
    palms = palms[np.isfinite(palms).all(axis=(1, 2))] * (1.0 if base.side == "right" else np.array([-1.0, 1.0, 1.0]))
    if len(palms) < LEAST_INSTANTS:
        raise CalibrationError(f"the whole palm is located in {len(palms)} instants; its width needs {LEAST_INSTANTS}. "
                               "Hold the hand so that two cameras see all of it.")
    mean = np.vstack([np.zeros(3), 1e-3 * np.array([base.fingers[name].base_mm for name in FINGERS])])
    rigid = [0, 2, 3, 4, 5]  # the root of the thumb moves
    for _ in range(2):
        turns = [best_rotation((mean[rigid] - mean[rigid].mean(axis=0)).T @ (palm[rigid] - palm[rigid].mean(axis=0)))
                 for palm in palms]
        mean = np.mean([(palm - palm[0]) @ turn.T for palm, turn in zip(palms, turns, strict=True)], axis=0)
    return np.asarray(mean[1:])


def _with_lengths(base: HandAnatomy, roots_mm: Array, lengths_mm: Array, spreads_mm: Array) -> HandAnatomy:
    """`roots_mm` (5, 3): of the fingers, in the palm's frame; `lengths_mm` (5, 3): of their bones; `spreads_mm` (5, 4):
    of the distance from wrist to root, then of the bones."""
    fingers = {}
    for k, name in enumerate(FINGERS):
        one = base.fingers[name]
        x, y, z = (round(float(value), 2) for value in roots_mm[k])
        first, second, last = (round(float(value), 2) for value in lengths_mm[k])
        deviations = tuple(round(max(float(value), 0.01), 2) for value in spreads_mm[k, 1:])
        fingers[name] = msgspec.structs.replace(
            one, base_mm=(x, y, z), bones_mm=(first, second, last), marker_mm=min(one.marker_mm, last),
            bones_sd_mm=(deviations[0], deviations[1], deviations[2]))
    return msgspec.structs.replace(base, fingers=fingers)


def _length_findings(seconds: float) -> list[Finding]:
    if seconds >= LONG_S:
        return []
    return [Finding("too_short", Grade.POOR if seconds < 2.0 * LASTING_S else Grade.FAIR,
                    f"The recording is {seconds:.1f} s long.", "Landmarks keep their errors for tenths of a second.",
                    f"Show the open hand to both cameras for {LONG_S:.0f} s, and turn it.")]


def _spread_findings(spread: float) -> list[Finding]:
    if spread < LARGE_SPREAD:
        return []
    return [Finding("large_spread", Grade.POOR if spread > USELESS_SPREAD else Grade.FAIR,
                    f"The bones' lengths spread by {100 * spread:.0f} %.",
                    "Landmarks of the two cameras are of different moments or hands, or the rig is not theirs.",
                    "Check the cameras' order and times, and that one hand is in sight.")]


def _size_findings(size: float) -> list[Finding]:
    if abs(np.log(size)) < WRONG_SIZE * SIZE_SD:
        return []
    return [Finding("unusual_size", Grade.POOR,
                    f"The hand is {100 * size:.0f} % of the base hand.",
                    "The cameras' distance is in another unit or wrong, or it is a child's hand.",
                    "Check the stereo calibration. For a child begin from a hand of its length (rhot hand --length).")]
