"""The lengths of one hand and the places of its markers as one vector of unknowns, with what is known beforehand.

All hands are right hands here: a left one is the mirror image (`mirrored`). The vector holds, in this order: the bones
(5, 3) m; the finger roots (5, 3) m in the palm frame; how far each finger's neutral frame is turned from the base
hand's, rotation vectors (5, 3) rad in the palm frame; the markers (M, 3) m; and how far each dot on an inner bone
slides along it, m, per sine of the flexion at the bone's beginning and at its end. A marker's place is told from the
joint at which its segment begins: along the bone, towards the thumb's side, and out of the back. On the palm: in the
palm frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.calibration.hand.marker_places import (
    BASE_SD_M,
    BASE_TURN_SD,
    DISTAL,
    PAINT_PART,
    SIZE_SD,
    TIP_PART,
    MarkerPlace,
    Prior,
    proportion_sd,
    root_proportion_sd,
)
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.landmarks import ANATOMY_SD_M
from rhot_app.hand.model import HandModel, build_model
from rhot_app.hand.skeleton import FINGERS, JOINTS, WRIST_ROLE

Array = NDArray[np.float64]

BONE_COUNT = 15
ROOTS, TURNS, MARKERS = 15, 30, 45
"""Where each part of the vector begins; the bones begin at 0."""

SLIDE_SD_M = 0.5e-3
"""How far skin slides over a phalanx when a joint at its end bends fully. Unknown for each marker, and hardly to be
told from a longer bone: without it, places on small circles would be believed much too exactly."""

_ACROSS_SD_M, _PAINT_SD_M, _WRIST_SD_M = 3e-3, 0.7e-3, 2e-3
_PALM_SD_M = (30e-3, 30e-3, 10e-3)
_EXACT = 12  # digits of mm
_INNER_PART = (0.5, 0.25)  # of the bone: where a dot on an inner segment sits, and its scatter


@dataclass(frozen=True, slots=True)
class HandShape:
    """`bones` (5, 3) m, `roots` (5, 3) m, `turns` (5, 3, 3) palm_from_finger, `markers` (M, 3) m; see the module."""

    bones: Array
    roots: Array
    turns: Array
    markers: Array

    @property
    def reaches(self) -> Array:
        """(5,) m from the wrist over each finger's root to its stretched tip."""
        return np.asarray(np.linalg.norm(self.roots, axis=1) + self.bones.sum(axis=1))


class HandUnknowns:
    """Turns the vector into a hand and back, for one base hand and one set of markers."""

    def __init__(self, base: HandAnatomy, places: tuple[MarkerPlace, ...]) -> None:
        self.places = places
        self.slides = MARKERS + 3 * len(places)  # where this part of the vector begins
        self.sliding = tuple(k for k, place in enumerate(places)
                             if not place.on_palm and place.segment != DISTAL and not place.painted)
        self.size = self.slides + 2 * len(self.sliding)
        self._base = base
        self._kept: tuple[Array, HandModel] | None = None
        self._model = build_model(msgspec.structs.replace(base, side="right"))
        self.bone_rows = self._model.dh.point_row[1:len(JOINTS)].reshape(5, 4)[:, 1:]  # (5, 3) rows that end each bone
        self.prior = self._make_prior()

    def shape(self, vector: Array) -> HandShape:
        """The hand that `vector` (G,) describes."""
        turns = Rotation.from_rotvec(vector[TURNS:MARKERS].reshape(5, 3)).as_matrix() @ self._model.base_rotation
        return HandShape(vector[:ROOTS].reshape(5, 3), vector[ROOTS:TURNS].reshape(5, 3), turns,
                         vector[MARKERS:self.slides].reshape(-1, 3))

    @property
    def limits(self) -> Array:
        """(21, 2) rad, the base hand's joint limits."""
        return self._model.limits

    def model(self, vector: Array) -> HandModel:
        """The right hand that `vector` describes, to the last digit; the last one asked for is kept."""
        if self._kept is None or not np.array_equal(self._kept[0], vector):
            hand = msgspec.structs.replace(self.anatomy(vector, _EXACT), side="right")
            self._kept = vector.copy(), build_model(hand)
        return self._kept[1]

    def anatomy(self, vector: Array, digits: int = 2) -> HandAnatomy:
        """The hand file of `vector`, to so many `digits` of mm and degrees: name, side and limits of the base hand,
        thicknesses scaled with the bones."""
        shape = self.shape(vector)
        degrees = np.degrees(Rotation.from_matrix(shape.turns).as_euler("ZYX"))
        thicker = shape.bones / self._model.bones
        along = self._tip_markers(shape)
        fingers = {}
        for k, finger in enumerate(FINGERS):
            old = self._base.fingers[finger]
            bones = _numbers(1e3 * shape.bones[k], digits)
            fingers[finger] = msgspec.structs.replace(
                old, base_mm=_numbers(1e3 * shape.roots[k], digits), bones_mm=bones,
                radii_mm=_numbers(np.array(old.radii_mm) * thicker[k], digits),
                base_rotation_deg=_numbers(degrees[k], digits), bones_sd_mm=None, radii_sd_mm=None,
                marker_mm=float(np.clip(round(1e3 * along[k], digits), 0.1, bones[2])))
        return msgspec.structs.replace(self._base, fingers=fingers)

    def _tip_markers(self, shape: HandShape) -> Array:
        """(5,) m from the last joint along the distal bone: measured, or the same part of the bone as before."""
        along = self._model.marker / self._model.bones[:, DISTAL] * shape.bones[:, DISTAL]
        for place, marker in zip(self.places, shape.markers, strict=True):
            if place.segment == DISTAL and place.joint < 0:
                along[place.finger] = marker[0]
        return along

    def _make_prior(self) -> Prior:
        """Independent causes, one column each, added up: the size of the hand, then whatever is left of each length."""
        model, count = self._model, self.size
        mean = np.zeros(count)
        mean[:ROOTS], mean[ROOTS:TURNS] = model.bones.ravel(), model.base.ravel()
        causes = np.zeros((count, count + 5))
        causes[np.arange(BONE_COUNT), np.arange(BONE_COUNT)] = mean[:ROOTS] * proportion_sd().ravel()
        causes[np.arange(ROOTS, TURNS), np.arange(ROOTS, TURNS)] = BASE_SD_M
        causes[np.arange(TURNS, MARKERS), np.arange(TURNS, MARKERS)] = BASE_TURN_SD.ravel()
        for finger in range(5):  # a longer metacarpal moves the root along its own direction
            rows = slice(ROOTS + 3 * finger, ROOTS + 3 * finger + 3)
            causes[rows, count + finger] = mean[rows] * root_proportion_sd()[finger]
        for k, place in enumerate(self.places):
            rows = slice(MARKERS + 3 * k, MARKERS + 3 * k + 3)
            mean[rows], scatter, bone_part = self._marker_prior(place)
            causes[rows, rows] = np.diag(scatter)
            if not place.on_palm:
                causes[rows.start] += bone_part * causes[3 * place.finger + place.segment]
            elif place.joint > 0:  # the landmark of a finger's root moves with it
                root = ROOTS + 3 * ((place.joint - 1) // 4)
                causes[rows] += causes[root:root + 3]
        slides = np.arange(self.slides, count)
        causes[slides, slides] = SLIDE_SD_M
        size = mean.copy()
        size[TURNS:MARKERS] = 0.0
        fixed_size = causes @ causes.T
        return Prior(mean, fixed_size + SIZE_SD ** 2 * np.outer(size, size), fixed_size)

    def _marker_prior(self, place: MarkerPlace) -> tuple[Array, Array, float]:
        """Mean (3,) and scatter (3,) m of a marker's place, and at which part of its bone it sits."""
        model = self._model
        if place.joint >= 0:
            along = model.base[(place.joint - 1) // 4] if place.on_palm and place.joint else np.zeros(3)
            if not place.on_palm:
                along = np.array([model.bones[place.finger, place.segment], 0.0, 0.0])
            return along, np.full(3, ANATOMY_SD_M), float(not place.on_palm)
        if place.name == WRIST_ROLE or (place.on_palm and place.painted):
            return np.zeros(3), np.full(3, _WRIST_SD_M), 0.0
        if place.on_palm:
            middle = np.array([0.5 * model.base[2, 0], 0.0, 0.5e-3 * self._base.palm_thickness_mm])
            return middle, np.array(_PALM_SD_M), 0.0
        bone, radius = model.bones[place.finger, place.segment], model.radii[place.finger, place.segment]
        if place.painted:
            part, scatter = model.marker[place.finger] / bone, PAINT_PART[1]
            return np.array([part * bone, 0.0, 0.0]), np.array([scatter * bone, _PAINT_SD_M, _PAINT_SD_M]), float(part)
        part, scatter = TIP_PART if place.segment == DISTAL else _INNER_PART
        return (np.array([part * bone, 0.0, radius]), np.array([scatter * bone, _ACROSS_SD_M, _ACROSS_SD_M]),
                float(part))


def _numbers(values: Array, digits: int) -> tuple[float, float, float]:
    a, b, c = (round(float(value), digits) for value in values)
    return a, b, c
