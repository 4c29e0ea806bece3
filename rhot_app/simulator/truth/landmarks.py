"""Recordings of real hands as landmarks: points on the hand over time, from the files that recorders write.

Read here: Qualisys TSV exports (optical markers on fingertips and finger middles, a triad on the back of the hand)
and Leap Motion CSV exports (joint positions). Millimetres in the files, metres from here on.
"""

from __future__ import annotations

import csv
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import RecordingError, SimulatorError
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import FINGERS, JOINTS
from rhot_app.recording.qualisys import read_qualisys
from rhot_node.files import read_input

Array = NDArray[np.float64]

TRIAD = ("hand_top", "hand_left", "hand_right")
"""Markers on the back of the hand; where on it, nobody measured."""

_TIP_FRACTION = 0.75  # of the distal bone: a tip marker is glued to the nail
_LEAP_FINGERS = ("thumb", "index", "middle", "ring", "pinky")
_LEAP_JOINTS = ("mcp", "pip", "dip", "tip")
"""Four per finger, as here; Leap gives the thumb a metacarpal of no length, so that its "mcp" is the root."""


@dataclass(frozen=True, slots=True)
class Landmarks:
    """N frames of L landmarks on a hand and R rigid points on its back, world of the recorder, m; NaN = missing.

    Landmark l lies between joints `ends[l]` at `fraction[l]` of the way. Where the rigid points sit on the palm is
    unknown. `times_s` (N,), `points` (N, L, 3), `rigid` (N, R, 3), `ends` (L, 2), `fraction` (L,).
    """

    times_s: Array
    points: Array
    rigid: Array
    ends: NDArray[np.int64]
    fraction: Array


def read_landmarks(path: Path, model: HandModel) -> Landmarks:
    """Landmarks of a recording; `model` tells where along a finger a marker must sit. Raises SimulatorError."""
    try:
        landmarks = _qualisys(path, model) if path.suffix.lower() == ".tsv" else _leap(read_input(path).decode())
    except (OSError, UnicodeDecodeError, RecordingError) as exc:
        raise SimulatorError(f"{path}: cannot be read as a recording ({exc}).") from exc
    except (ValueError, IndexError, KeyError, csv.Error) as exc:
        raise SimulatorError(f"{path}: not a recording this program knows ({exc}). It reads Qualisys .tsv exports with "
                             "finger and hand markers, and Leap Motion .csv exports with joint positions.") from exc
    if len(landmarks.times_s) < 2 or not (np.isfinite(landmarks.points).all(axis=2).sum(axis=1) >= 4).any():
        raise SimulatorError(f"{path}: no frame of the recording has four finger landmarks; there is no hand to fit.")
    return landmarks


def _qualisys(path: Path, model: HandModel) -> Landmarks:
    tracks = read_qualisys(path)

    def of(name: str) -> Array:
        if name not in tracks.names:
            raise ValueError(f"it has no marker {name!r}")
        return np.asarray(tracks.positions[:, tracks.names.index(name)])

    chosen, ends, fractions = [], [], []
    for finger, name in enumerate(FINGERS):
        tip, middle = of(f"{name}_tip"), of(f"{name}_middle")
        reach = np.nanpercentile(np.linalg.norm(tip - middle, axis=1), 90.0)
        # The middle marker sits on the bone before the last one or two: the thumb has one bone less.
        bone = 1 if name == "thumb" else 0
        between = model.bones[finger, bone + 1:2].sum() + _TIP_FRACTION * model.bones[finger, 2]
        base = 1 + 4 * finger
        chosen += [tip, middle]
        ends += [(base + 2, base + 3), (base + bone, base + bone + 1)]
        # Stretched out, tip to middle spans what is left of the marker's own bone and all that follows.
        fractions += [_TIP_FRACTION, float(np.clip(1.0 - (reach - between) / model.bones[finger, bone], 0.05, 1.0))]
    rigid = np.stack([of(name) for name in TRIAD], axis=1)
    return Landmarks(tracks.times_s, np.stack(chosen, axis=1), rigid, np.array(ends), np.array(fractions))


def _leap(text: str) -> Landmarks:
    rows = list(csv.DictReader(text.splitlines()))
    hands = Counter(row["hand_id"] for row in rows)
    rows = [row for row in rows if row["hand_id"] == hands.most_common(1)[0][0]]
    times = np.array([float(row["t"]) for row in rows])
    points = np.array([[[float(row[f"{finger}_{joint}_{axis}"] or "nan") for axis in "xyz"]
                        for finger in _LEAP_FINGERS for joint in _LEAP_JOINTS] for row in rows])
    later = np.concatenate([[True], times[1:] > np.maximum.accumulate(times)[:-1]])
    joints = np.arange(1, len(JOINTS))
    return Landmarks(times[later] - times[0], 1e-3 * points[later], np.empty((int(later.sum()), 0, 3)),
                     np.stack([joints, joints], axis=1), np.zeros(len(joints)))
