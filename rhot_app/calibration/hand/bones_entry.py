"""Bone lengths entered by hand, and whether a hand can have them."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand.bones_report import (
    BoneLength,
    BonesReport,
    Known,
    bone_lengths,
    bone_name,
    finger_reaches,
)
from rhot_app.calibration.hand.shape import BONE_COUNT, HandUnknowns
from rhot_app.calibration.verdict import Finding, Grade, judge
from rhot_app.errors import CalibrationError
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.skeleton import FINGERS

Array = NDArray[np.float64]

RULER_SD_MM = 1.5
"""How well a bone is measured from joint to joint with a ruler."""

UNUSUAL, IMPOSSIBLE = 3.0, 6.0
"""Standard deviations from what is usual in a hand of the size that the other bones show."""

BONE_NAMES: tuple[str, ...] = tuple(bone_name(k // 3, k % 3) for k in range(BONE_COUNT))
_CENTIMETRES = (1.0, 12.0)  # a length in this range is likely to be one of centimetres


def enter_bones(base: HandAnatomy, lengths_mm: Mapping[str, float]) -> BonesReport:
    """The hand `base` with some of its bones, named as "index.proximal", replaced. Markers keep their part of the bone.

    Raises CalibrationError when there is no such bone, or a length is not a number of millimetres at all.
    """
    for name, value in lengths_mm.items():
        if name not in BONE_NAMES:
            raise CalibrationError(f"there is no bone {name!r}; they are {', '.join(BONE_NAMES)}.")
        if not 0.0 < value <= 400.0:
            raise CalibrationError(f"{name}: {value:g} mm cannot be the length of a bone.")
    hand = _with_lengths(base, lengths_mm)
    unknowns = HandUnknowns(base, ())
    entered = HandUnknowns(hand, ())
    covariance = _after_measuring(unknowns, lengths_mm)
    bones = tuple(
        bone if bone.name not in lengths_mm else
        BoneLength(bone.name, bone.length_mm, RULER_SD_MM, bone.usual_std_mm, Known.ENTERED)
        for bone in bone_lengths(entered, entered.prior.mean, covariance))
    reaches, _, _ = finger_reaches(entered, entered.prior.mean, covariance)
    _, size, size_std = finger_reaches(unknowns, entered.prior.mean, covariance)
    findings = [finding for name, value in lengths_mm.items()
                if (finding := _judge_length(unknowns, lengths_mm, name, value)) is not None]
    return BonesReport(
        hand=hand, method="entered", size=size, size_std=size_std, bones=bones, reaches=reaches, markers=(), rigid=(),
        residual_mm=None, noise_mm=0.0, error_mm=None, seconds=0.0, instants=0,
        verdict=judge(f"{len(lengths_mm)} of {BONE_COUNT} bones entered.", findings))


def _with_lengths(base: HandAnatomy, lengths_mm: Mapping[str, float]) -> HandAnatomy:
    fingers = dict(base.fingers)
    for finger, name in enumerate(FINGERS):
        old = base.fingers[name]
        bones = tuple(float(lengths_mm.get(bone_name(finger, k), length)) for k, length in enumerate(old.bones_mm))
        marker = old.marker_mm / old.bones_mm[2] * bones[2]
        fingers[name] = msgspec.structs.replace(old, bones_mm=(bones[0], bones[1], bones[2]),
                                                marker_mm=round(marker, 2))
    return msgspec.structs.replace(base, fingers=fingers)


def _after_measuring(unknowns: HandUnknowns, lengths_mm: Mapping[str, float]) -> Array:
    """Covariance of the unknowns once these bones were measured."""
    rows = [BONE_NAMES.index(name) for name in lengths_mm]
    covariance = unknowns.prior.covariance
    if not rows:
        return covariance
    noise = (1e-3 * RULER_SD_MM) ** 2 * np.eye(len(rows))
    gain = covariance[:, rows] @ np.linalg.inv(covariance[np.ix_(rows, rows)] + noise)
    return np.asarray(covariance - gain @ covariance[rows])


def _judge_length(unknowns: HandUnknowns, lengths_mm: Mapping[str, float], name: str, value: float) -> Finding | None:
    """What the other lengths that were entered say of this one."""
    prior, own = unknowns.prior, BONE_NAMES.index(name)
    others = [BONE_NAMES.index(other) for other in lengths_mm if other != name]
    mean, variance = prior.mean[own], prior.covariance[own, own]
    if others:
        seen = 1e-3 * np.array([lengths_mm[BONE_NAMES[k]] for k in others])
        noise = (1e-3 * RULER_SD_MM) ** 2 * np.eye(len(others))
        gain = prior.covariance[own, others] @ np.linalg.inv(prior.covariance[np.ix_(others, others)] + noise)
        mean, variance = mean + gain @ (seen - prior.mean[others]), variance - gain @ prior.covariance[others, own]
    usual, scatter = 1e3 * float(mean), 1e3 * float(np.sqrt(variance)) + RULER_SD_MM
    off = abs(value - usual) / scatter
    if off < UNUSUAL:
        return None
    centimetres = _CENTIMETRES[0] < value < _CENTIMETRES[1] and abs(10.0 * value - usual) < UNUSUAL * scatter
    return Finding(
        "implausible_bone", Grade.POOR if off > IMPOSSIBLE or centimetres else Grade.FAIR,
        f"{name} is entered as {value:g} mm; {usual:.0f} +- {scatter:.0f} mm is usual with the other lengths.",
        "It looks like centimetres." if centimetres else "Another bone was measured, or the hand is unusual.",
        f"Enter {10.0 * value:g}." if centimetres else "Measure again, from the middle of one joint to the next.")
