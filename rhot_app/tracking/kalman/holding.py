"""What a hand's markers do not show of it is held to its course, lest one part of it be taken for another.

One camera does not see distance, one marker on the palm does not show how it is turned, and fingertips alone do not say
where the palm is: a finger that bends, a palm that turns and one that withdraws look alike. A filter that linearises
anew with every frame soon believes to tell them apart. So the palm of a hand that moves slowly goes on as it went in
the directions that its own markers leave open - its place only while no fingertip is placed either -, and the fingers
are taken to do what is seen; what is truly not known goes into the covariance (`withholding.py`), and habit brings the
whole hand to what is natural (`forgetting.py`). A palm that hurries carries its fingers along: then they are held.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_app.tracking.kalman.estimate import (
    ACCELERATION,
    ANGLES,
    FINGERS,
    FINGERS_HELD,
    FIRST_FINGER,
    FREE,
    GROUP_OF,
    LINEAR,
    PALM_HELD,
    PLACED,
    POSE,
    ROTATION,
    SCALE,
    TURN,
    TURN_HELD,
    VELOCITY,
    Estimate,
)
from rhot_app.tracking.kalman.motion import speeds
from rhot_app.tracking.kalman.rows import PALM_PART, Rows
from rhot_app.tracking.kalman.sighted import eyes_on, line_of_sight, unseen_now
from rhot_app.tracking.kalman.withholding import Held

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

ENOUGH = 3
"""This many markers on a palm, seen by two cameras, show how it is turned."""

HURRIES_M_S, HURRIES_RAD_S = 0.15, 1.5
"""A palm that moves or turns faster carries its fingers along."""

TURNS_RAD_S = 0.5
"""A palm that turns faster, while two cameras see all markers, is known by its fingertips to do so. Paint on its inner
side may be covered."""

TURN_ALONE = 9
"""Directions that are held when nothing but the palm's turn is: three angles, their velocities and accelerations."""

REST_S = 0.1
"""A turn that is held comes to rest with this time constant."""


@njit(cache=True)
def hold(estimate: Estimate, rows: Rows, part: Indices, palmar: Mask, cameras: Array, stiff: Array,
         held: Held) -> None:
    """Decide how the hand is to be held, `estimate.held`, and fill `held.directions`.

    `rows` of this update; `part` and `palmar` (M,) as in `Worn`; `cameras` (C, 3, 4) camera_from_world m; `stiff`
    (R, 27) as in `Habits`.
    """
    unseen = unseen_now(estimate, rows)
    on_palm, placed, most, eye, all_placed = 0, 0, 0, -1, True
    eyes_of = np.zeros(FINGERS, np.int64)
    for m in range(part.shape[0]):
        eyes, last = eyes_on(unseen, m)
        all_placed &= eyes > 1 or palmar[m]
        if part[m] != PALM_PART:
            eyes_of[part[m]] = max(eyes_of[part[m]], eyes)
        else:
            on_palm += 1
            placed += eyes > 1
            if eyes > most:
                most, eye = eyes, last
    moving = speeds(estimate)
    hurries = moving[LINEAR] > HURRIES_M_S or moving[TURN] > HURRIES_RAD_S
    held.directions[:held.used[0]] = 0.0
    held.used[0] = 0
    before, estimate.held[0] = estimate.held[0], FREE
    if on_palm == 0:
        return
    if most > 1:
        if all_placed and (hurries or estimate.turning[0] > TURNS_RAD_S):
            return
        _hold_stiff(stiff, eyes_of, held)
        if placed < ENOUGH:
            estimate.held[0] = TURN_HELD
            hold_turn(held)
    elif hurries and before not in (PLACED, PALM_HELD):
        estimate.held[0] = FINGERS_HELD
        for i in range(ANGLES, POSE):
            _hold_number(i, held)
    else:
        estimate.held[0] = PLACED if eyes_of.max() > 1 else PALM_HELD
        if estimate.held[0] == PALM_HELD:
            _hold_place(estimate, most, cameras[eye], held)
        hold_turn(held)


@njit(cache=True)
def hold_turn(held: Held) -> None:
    """Hold how the palm is turned and turns."""
    for i in range(ROTATION):
        _hold_number(ROTATION + i, held)


@njit(cache=True)
def hold_size(covariance: Array, held: Held) -> None:
    """Hold how large the hand is, where that is not certain: no single frame tells (`hand_size.py`)."""
    if covariance[SCALE, SCALE] > 0.0:
        held.directions[held.used[0], SCALE] = 1.0
        held.used[0] += 1


@njit(cache=True)
def _hold_number(number: int, held: Held) -> None:
    """Hold one number of the pose, its velocity and its acceleration."""
    for base in (0, VELOCITY, ACCELERATION):
        held.directions[held.used[0], base + number] = 1.0
        held.used[0] += 1


@njit(cache=True)
def _hold_place(estimate: Estimate, eyes: int, camera: Array, held: Held) -> None:
    """Hold what is not seen of the palm's place: all of it without `eyes` on it, with one, `camera` (3, 4), how far
    away it is."""
    if eyes == 0:
        for i in range(ROTATION):
            _hold_number(i, held)
        return
    sight = np.empty(3)
    line_of_sight(camera, estimate.world[:3, 3], sight)
    for base in (0, VELOCITY, ACCELERATION):
        held.directions[held.used[0], base:base + 3] = sight
        held.used[0] += 1


@njit(cache=True)
def _hold_stiff(stiff: Array, eyes_of: Indices, held: Held) -> None:
    """A finger that one camera sees is believed to stir as little as may be, and to bend in all its joints at once."""
    for row in range(stiff.shape[0]):
        finger = -1
        for i in range(ANGLES, POSE):
            if stiff[row, i] != 0.0:
                finger = GROUP_OF[i] - FIRST_FINGER
        if eyes_of[finger] == 1:
            for base in (0, VELOCITY, ACCELERATION):
                held.directions[held.used[0], base:base + POSE] = stiff[row]
                held.used[0] += 1


@njit(cache=True)
def rest(estimate: Estimate, dt: float) -> None:
    """What is held of the palm is not shaken, and its turn comes to rest."""
    if estimate.held[0] not in (TURN_HELD, PLACED, PALM_HELD):
        return
    share, covariance = math.exp(-dt / REST_S), estimate.covariance
    for i in range(ROTATION, ANGLES):
        estimate.velocity[i] *= share
        estimate.acceleration[i] *= share
        for base in (VELOCITY, ACCELERATION):
            covariance[base + i] *= share
            covariance[:, base + i] *= share
    estimate.agitation[TURN] = 0.0
    if estimate.held[0] == PALM_HELD:
        estimate.agitation[LINEAR] = 0.0
