"""The segment of the hand on which a marker sits, by its name or by what the user says; the prior of bone lengths.

A segment is the palm, or one of a finger's three bones. Known words: ``index_proximal``, ``index_medial``,
``index_distal`` (``index_tip`` is the same bone; the thumb's are metacarpal, proximal and distal), ``index_middle`` for
a marker on one of the two inner bones, whichever fits; anything that begins with ``hand_``, ``palm_`` or
``back_of_hand`` for the palm; ``wrist`` for a band round the wrist; and ``landmark_<joint>`` for a joint itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import CalibrationError
from rhot_app.hand.places import LANDMARK_ROLES
from rhot_app.hand.skeleton import BONES, FINGERS, WRIST_ROLE

# -- prior of bone lengths ---------------------------------------------------------------------------------------------
# Means and standard deviations: Buryanov and Kotiuk 2010, Int. J. Morphol. 28(3):755-758, table I (X-rays of 66 adults;
# the last bone is the distal phalanx and the soft tip). A part of the scatter is size: big hands have all bones longer.
# Hand length is 194 ± 10 mm for men and 181 ± 10 mm for women (Gordon et al. 1989, ANSUR), 6.3 % over both. What is
# left of each bone's scatter is its proportion.

Array = NDArray[np.float64]

SIZE_SD = 0.063
"""Standard deviation of the size of adult hands, as a part of it."""

BONES_M = 1e-3 * np.array([[46.22, 31.57, 27.34], [39.78, 22.38, 19.66], [44.63, 26.33, 21.35], [41.37, 25.65, 21.25],
                           [32.74, 18.11, 19.69]])
"""(5, 3) m, mean bones as in `skeleton.BONES`."""

_BONE_SD_M = 1e-3 * np.array([[3.94, 3.13, 1.71], [4.94, 2.51, 2.34], [3.81, 3.00, 1.95], [3.87, 3.29, 2.25],
                              [2.77, 2.54, 2.53]])  # distal and soft tip added as independent
_METACARPAL_SD = np.array([0.0852, 0.0920, 0.0833, 0.0872, 0.0812])  # as a part of the mean, same table
_LEAST_PROPORTION_SD = 0.03

BASE_SD_M = 3e-3
"""Of a finger root's place in the palm across the hand and up, and of the carpus behind the metacarpals; nobody
published it, the layout of the shipped hands is ours."""

BASE_TURN_SD = np.radians([[12.0, 12.0, 12.0], *[[8.0, 6.0, 6.0]] * 4])
"""(5, 3) rad, of each finger's neutral frame about the palm's x (roll), y (flexion) and z (abduction): ours."""

TIP_PART = (0.75, 0.12)
PAINT_PART = (0.5, 0.01)
"""Where a tip's marker sits along the last bone and its scatter, as parts of it: a dot on the nail, paint all over."""


def proportion_sd() -> Array:
    """(5, 3) standard deviation of each bone as a part of its length, in hands of the same size."""
    return _without_size(_BONE_SD_M / BONES_M)


def root_proportion_sd() -> Array:
    """(5,) the same for the distance of each finger's root from the wrist."""
    return _without_size(_METACARPAL_SD)


def _without_size(whole: Array) -> Array:
    return np.maximum(np.sqrt(np.maximum(whole ** 2 - SIZE_SD ** 2, 0.0)), _LEAST_PROPORTION_SD)


@dataclass(frozen=True, slots=True)
class Prior:
    """Gaussian over a parameter vector: `mean` (G,), `covariance` (G, G), and `fixed_size` (G, G), the covariance among
    hands of one size: what is known of each bone once the size of the hand is."""

    mean: Array
    covariance: Array
    fixed_size: Array


# -- segment of a marker -----------------------------------------------------------------------------------------------

PALM = -1
DISTAL = 2
_PALM_WORDS = ("hand_", "palm_", "back_of_hand")


@dataclass(frozen=True, slots=True)
class MarkerPlace:
    """One marker of a hand. `finger` indexes `FINGERS` and `segment` its bones; both PALM on the palm.

    `painted`: the marker is the paint on the whole last bone, or a band round the wrist, so that its centre lies
    inside the limb at a known part of it; else it is a dot somewhere on the skin. `joint`: a landmark's index in
    `skeleton.JOINTS`, -1 for a marker; its segment is the bone that ends there, or the palm.
    """

    name: str
    finger: int
    segment: int
    painted: bool = False
    joint: int = -1

    @property
    def on_palm(self) -> bool:
        """Whether it moves with the palm."""
        return self.finger == PALM

    @property
    def word(self) -> str:
        """The segment in words: "index medial", "palm"."""
        return "palm" if self.on_palm else f"{FINGERS[self.finger]} {BONES[self.finger][self.segment]}"


@dataclass(frozen=True, slots=True)
class MarkerTracks:
    """Identified markers over time: `times_s` (T,), `positions` (T, M, 3) m in any one frame, NaN = missing."""

    times_s: Array
    positions: Array
    places: tuple[MarkerPlace, ...]

    @property
    def duration_s(self) -> float:
        """From the first instant to the last, s."""
        return float(self.times_s[-1] - self.times_s[0]) if len(self.times_s) else 0.0

    def within(self, start_s: float, end_s: float) -> MarkerTracks:
        """The part of the recording between two of its own times."""
        inside = (self.times_s >= start_s) & (self.times_s < end_s)
        return MarkerTracks(self.times_s[inside], self.positions[inside], self.places)


def tracks_of(times_s: Array, positions: Array, names: Sequence[str], roles: Mapping[str, str] | None = None, *,
              painted: frozenset[str] = frozenset()) -> MarkerTracks:
    """The markers among `names` that sit on a hand, by `roles` (name -> role) or else by their own names.

    `painted` names markers that are paint or bands. Raises CalibrationError when a role is no place on the hand, names
    no marker, or no marker is on the hand.
    """
    roles = roles or {}
    unknown = sorted(set(roles) - set(names))
    if unknown:
        raise CalibrationError(f"there is no marker {unknown[0]!r}; the recording has {', '.join(names)}.")
    words = [roles.get(name, name) for name in names]
    positions = np.asarray(positions, dtype=np.float64)
    places, columns = [], []
    for column, (name, word) in enumerate(zip(names, words, strict=True)):
        spot = _spot(word, positions[:, column], {other: positions[:, k] for k, other in enumerate(words)})
        if spot is None and name in roles:
            raise CalibrationError(f"{word!r} is no place on the hand; say for example index_tip, index_medial, palm_1 "
                                   "or wrist.")
        if spot is not None:
            joint = LANDMARK_ROLES.index(word) if word in LANDMARK_ROLES else -1
            places.append(MarkerPlace(name, *spot, name in painted or word == WRIST_ROLE or joint >= 0, joint))
            columns.append(column)
    if not places:
        raise CalibrationError(f"none of the markers {', '.join(names)} names a place on the hand; give --roles "
                               "NAME=ROLE, for example m1=index_tip.")
    return MarkerTracks(np.asarray(times_s, dtype=np.float64), positions[:, columns], tuple(places))


def _spot(word: str, track: Array, tracks: Mapping[str, Array]) -> tuple[int, int] | None:
    """(finger, segment) of a role; None when it is no place on the hand."""
    if word == WRIST_ROLE or word.startswith(_PALM_WORDS):
        return PALM, PALM
    if word in LANDMARK_ROLES:
        finger, along = divmod(LANDMARK_ROLES.index(word) - 1, 4)
        return (PALM, PALM) if finger < 0 or along == 0 else (finger, along - 1)
    name, _, segment = word.partition("_")
    if name not in FINGERS:
        return None
    finger = FINGERS.index(name)
    if segment == "tip":
        return finger, DISTAL
    if segment == "middle":
        return finger, _inner_segment(finger, track, tracks.get(f"{name}_tip", tracks.get(f"{name}_distal")))
    return (finger, BONES[finger].index(segment)) if segment in BONES[finger] else None


def _inner_segment(finger: int, track: Array, tip: Array | None) -> int:
    """Which of the two inner bones a marker sits on, by how far it is from the tip of the stretched finger."""
    if tip is None:
        return 1
    inner, medial, distal = BONES_M[finger]
    reach = float(np.nanpercentile(np.linalg.norm(track - tip, axis=1), 90.0))
    on_medial = 0.75 * distal + 0.5 * medial
    return 1 if reach < on_medial + 0.5 * (0.5 * medial + 0.5 * inner) else 0
