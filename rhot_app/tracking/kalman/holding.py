"""What a hand's markers do not show of it is held to its course, lest one part of it be taken for another.

One camera does not see distance, one marker on the palm does not show how it is turned, and fingertips alone do not say
where the palm is: a finger that bends, a palm that turns and one that withdraws look alike. A filter that linearises
anew with every frame soon believes to tell them apart. So the palm of a hand that moves slowly goes on as it went in
the directions that its own markers leave open - its place only while no fingertip is placed either -, and the fingers
are taken to do what is seen; what is truly not known goes into the covariance (`withholding.py`), and habit brings the
whole hand to what is natural (`forgetting.py`). A palm that hurries or turns is not held, nor one whose fingers would
have to be bent as no hand bends them: it has turned meanwhile.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room, slots
from rhot_app.tracking.kalman.combine import dot, fill, scale
from rhot_app.tracking.kalman.estimate import (
    ACCELERATION,
    ANGLES,
    FINGERS,
    FIRST_FINGER,
    FREE,
    GOES_ON,
    GROUP_OF,
    GROUPS,
    HAND_ANGLES,
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
from rhot_app.tracking.kalman.habits import Habits
from rhot_app.tracking.kalman.motion import speeds
from rhot_app.tracking.kalman.rows import PALM_PART, Rows
from rhot_app.tracking.kalman.sighted import eyes_now, line_of_sight
from rhot_app.tracking.kalman.withholding import Held

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

ENOUGH = 3
"""This many markers on a palm, seen by two cameras, show how it is turned."""

HURRIES_M_S, HURRIES_RAD_S = 0.15, 1.5
"""A palm that moves or turns faster goes on turning as its fingertips show it."""

TURNS_RAD_S, TURNED_RAD_S = 0.5, 0.7
"""So does one that turned faster of late, while two cameras see all markers, and while they do not. Paint on its inner
side may be covered."""

STRANGE = 30.0
"""`strangeness` of fingers that are bent as they are because something is held that is not so: hands that grasp, pinch,
point and spread their fingers have up to 28, those whose palm has turned by 20 degrees unseen twice as much. A hand
that crosses its fingers may have more, and is then held less."""

TURN_ALONE = 9
"""Directions that are held when nothing but the palm's turn is: three angles, their velocities and accelerations."""

REST_S = 0.1
"""A turn that is held comes to rest with this time constant."""

ARRIVE_S = 0.2
"""So does the way of a palm to or from a camera that has seen it alone for as long, when it is not in a hurry: slow
ways are short."""


@lean
def hold(estimate: Estimate, rows: Rows, part: Indices, palmar: Mask, cameras: Array, habits: Habits,
         held: Held) -> None:
    """Decide how the hand is to be held, `estimate.held`, and fill `held.directions`.

    `rows` of this update; `part` and `palmar` (M,) as in `Worn`; `cameras` (C, 3, 4) camera_from_world m.
    """
    on_palm, placed, most, eye, all_placed = 0, 0, 0, -1, True
    eyes_of = slots((FINGERS,))
    eyes_of[:] = 0
    for m in range(part.shape[0]):
        eyes, last = eyes_now(estimate.unseen, m, rows)
        all_placed &= eyes > 1 or palmar[m]
        if part[m] != PALM_PART:
            eyes_of[part[m]] = max(eyes_of[part[m]], eyes)
        else:
            on_palm += 1
            placed += eyes > 1
            if eyes > most:
                most, eye = eyes, last
    moving, most_on_finger = room((GROUPS,)), 0
    speeds(estimate, moving)
    for finger in range(FINGERS):
        most_on_finger = max(most_on_finger, eyes_of[finger])
    goes_on = (moving[LINEAR] > HURRIES_M_S or moving[TURN] > HURRIES_RAD_S
               or estimate.turning[0] > (TURNS_RAD_S if all_placed else TURNED_RAD_S))
    strange = strangeness(estimate.angles, habits) > STRANGE
    let_go(held)
    before, estimate.held[0] = estimate.held[0], FREE
    if on_palm == 0 or (strange and (most > 1 or most_on_finger > 1)):
        return
    if most > 1:
        _hold_stiff(habits.stiff, eyes_of, held)
        if not goes_on and placed < ENOUGH:
            estimate.held[0] = TURN_HELD
            hold_turn(held)
    elif goes_on and not strange and before not in (PLACED, PALM_HELD):
        _hold_stiff(habits.stiff, eyes_of, held)
        if most_on_finger < 2:
            estimate.held[0] = GOES_ON
            _hold_place(estimate, most, cameras[eye], held)
    else:
        estimate.held[0] = PLACED if most_on_finger > 1 else PALM_HELD
        if estimate.held[0] == PALM_HELD:
            _hold_place(estimate, most, cameras[eye], held)
        hold_turn(held)


@lean
def strangeness(angles: Array, habits: Habits) -> float:
    """How far from habit `angles` (21,) rad are: the square of the distance, in standard deviations."""
    away, total = room((HAND_ANGLES,)), 0.0
    for i in range(HAND_ANGLES):
        away[i] = angles[i] - habits.mean[i]
    for i in range(HAND_ANGLES):
        total += away[i] * dot(habits.information[i], away)
    return total


@lean
def let_go(held: Held) -> None:
    """Hold nothing any more."""
    for k in range(held.used[0]):
        held.directions[k] = 0.0
    held.used[0] = 0
    held.sight[:] = 0.0


@lean
def hold_turn(held: Held) -> None:
    """Hold how the palm is turned and turns."""
    for i in range(ROTATION):
        _hold_number(ROTATION + i, held)


@lean
def hold_size(covariance: Array, held: Held) -> None:
    """Hold how large the hand is, where that is not certain: no single frame tells (`hand_size.py`)."""
    if covariance[SCALE, SCALE] > 0.0:
        held.directions[held.used[0], SCALE] = 1.0
        held.used[0] += 1


@lean
def _hold_number(number: int, held: Held) -> None:
    """Hold one number of the pose, its velocity and its acceleration."""
    for base in (0, VELOCITY, ACCELERATION):
        held.directions[held.used[0], base + number] = 1.0
        held.used[0] += 1


@lean
def _hold_place(estimate: Estimate, eyes: int, camera: Array, held: Held) -> None:
    """Hold what is not seen of the palm's place: all of it without `eyes` on it, with one, `camera` (3, 4), how far
    away it is."""
    if eyes == 0:
        for i in range(ROTATION):
            _hold_number(i, held)
        return
    sight = room((3,))
    line_of_sight(camera, estimate.world[:3, 3], sight)
    for base in (0, VELOCITY, ACCELERATION):
        fill(held.directions[held.used[0], base:base + 3], sight)
        held.used[0] += 1
    if _alone(estimate.unseen):
        fill(held.sight, sight)


@lean
def _alone(unseen: Array) -> bool:
    """Whether all cameras but one have seen nothing of the hand for a while; `unseen` (C, M) as in `Estimate`."""
    seeing = 0
    for camera in range(unseen.shape[0]):
        newest = unseen[camera, 0]
        for m in range(unseen.shape[1]):
            newest = min(newest, unseen[camera, m])
        seeing += newest < ARRIVE_S
    return seeing < 2


@lean
def _hold_stiff(stiff: Array, eyes_of: Indices, held: Held) -> None:
    """A finger that one camera sees is believed to stir as little as may be, and to bend in all its joints at once."""
    for row in range(stiff.shape[0]):
        finger = -1
        for i in range(ANGLES, POSE):
            if stiff[row, i] != 0.0:
                finger = GROUP_OF[i] - FIRST_FINGER
        if eyes_of[finger] == 1:
            for base in (0, VELOCITY, ACCELERATION):
                fill(held.directions[held.used[0], base:base + POSE], stiff[row])
                held.used[0] += 1


@lean
def rest(estimate: Estimate, sight: Array, dt: float) -> None:
    """What is held of the palm is not shaken, and comes to rest. `sight` (3,) as in `Held`."""
    _arrive(estimate, sight, dt)
    if estimate.held[0] not in (TURN_HELD, PLACED, PALM_HELD):
        return
    share, covariance = math.exp(-dt / REST_S), estimate.covariance
    for i in range(ROTATION, ANGLES):
        estimate.velocity[i] *= share
        estimate.acceleration[i] *= share
        for base in (VELOCITY, ACCELERATION):
            scale(covariance[base + i], share)
            for j in range(covariance.shape[0]):
                covariance[j, base + i] *= share
    estimate.agitation[TURN] = 0.0
    if estimate.held[0] == PALM_HELD:
        estimate.agitation[LINEAR] = 0.0


@lean
def _arrive(estimate: Estimate, sight: Array, dt: float) -> None:
    """A way along `sight` (3,) that is not hurried ends. How fast it is is known no better for that: the covariance
    stays."""
    speed = dot(sight, estimate.velocity[:ROTATION])
    pull = dot(sight, estimate.acceleration[:ROTATION])
    if abs(speed) > HURRIES_M_S:
        return
    lost = 1.0 - math.exp(-dt / ARRIVE_S)
    for i in range(ROTATION):
        estimate.velocity[i] -= lost * speed * sight[i]
        estimate.acceleration[i] -= lost * pull * sight[i]
