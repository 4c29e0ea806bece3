"""Fingertips that other fingers hide: how much less of its paint a camera sees than there is.

What is left of a half-hidden fingertip has its middle elsewhere, by up to its radius, much alike in all pictures and
for as long as it is hidden. A node notices when an area changes from one frame to the next, not when one finger slides
behind another, and two cameras that see equally little of it agree. The master knows how far away the fingertip is, how
it points and how large it was in plain view, hence how much of it is missing. Its middle is then believed to lie off
its place by as much as that may have moved it: a bias of the marker, the same for all cameras. Of a fingertip that
shows all of its paint a node's caution, who has seen its area change, is not needed.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.lean import lean, room
from rhot_app.tracking.kalman.combine import dot, fill
from rhot_app.tracking.kalman.covering import LEARNT, set_bias_variance
from rhot_app.tracking.kalman.estimate import LOOK_AGE, LOOK_HIDDEN, Estimate
from rhot_app.tracking.kalman.markers import Cameras, Frame, Places, Worn
from rhot_app.tracking.kalman.sighted import FRESH_S, count_seen, line_of_sight

Array = NDArray[np.float64]

VARIES, VARIES_PER_M_S, FASTEST_M_S = 0.07, 0.08, 3.0
"""Areas of fingertips in plain view are less than they should be by up to this part, and by so much more per speed,
because motion smears their edges."""

SHIFT = 1.6
"""A part h of its area that is hidden moves the middle of a fingertip by SHIFT h^1.5 of its radius, one standard
deviation per axis. (Measured of crossing and pinching fingers: 1.25, which is `MOVED`; but it lasts.)"""
MOVED = 1.25

PLAIN_PX = 0.1
"""A fingertip in plain view is seen to this, one standard deviation per axis, if its node does not even claim more:
what has just come out from behind another, or hurries, is stated with up to 1 px. (Measured: 0.06 to 0.08.)"""

PLACED_BY = 3
"""A hand of which another camera sees so many markers is where it is taken to be."""

SHRINKS = 0.01
"""Of what a fingertip in plain view is smaller than it was known to be, a sight teaches this part: slower than of what
it is larger (`covering.LEARNT`), because what is smaller may be hidden."""

VARIED, VARIES_LEARNT = 0.02, 0.02
"""One standard deviation of a width's logarithm before anything is known of it, and which part of its variance a sight
teaches."""

LIKE = 0.1
"""A part of its area that a fingertip in plain view may be smaller."""


@lean
def judge_fingertips(worn: Worn, cameras: Cameras, frame: Frame, estimate: Estimate, places: Places,
                     made: Array) -> None:
    """Set the biases' variances of fingertips that are hidden in part, and back, and `frame.own` of those in plain
    view; learn their sizes (`estimate.width`) and how the hand is bent (`estimate.placed_angles`).

    To be called after `doubt_partial`. `places` as `place_markers` has them; `made` (M,) m^2: variance of the markers'
    places by their making.
    """
    camera, seen = frame.camera[0], 0
    if not is_placed(estimate, camera):
        return
    for sight in range(frame.seen.shape[0]):
        seen += frame.seen[sight]
    if seen >= PLACED_BY:
        fill(estimate.placed_angles, estimate.angles)
    for sight in range(worn.part.shape[0]):
        m = frame.label[sight]
        if not frame.sizes[sight] > 0.0 or worn.slender[m] < 0.0:
            continue
        width = frame.sizes[sight]
        part = part_shown(worn, places, cameras.pose[camera], m)
        hidden = _hidden(estimate, m, width / math.sqrt(part), frame.plain[sight])
        estimate.looks[camera, m, LOOK_HIDDEN] = hidden
        varies = VARIES + VARIES_PER_M_S * min(speed_of(places.jacobian[m], estimate.velocity), FASTEST_M_S)
        most = max(hidden, _most_hidden(estimate, m))
        shift = SHIFT * 0.5 * width * math.sqrt(max(most**3 - varies**3, 0.0))
        set_bias_variance(estimate, m, made[m] + shift * shift)
        if frame.plain[sight] and -varies < hidden and most < varies:
            stated = 0.5 * (frame.covariances[sight, 0, 0] + frame.covariances[sight, 1, 1])
            frame.own[sight] = min(frame.own[sight], PLAIN_PX**2 / max(stated, PLAIN_PX**2))


@lean
def slightly_moved(estimate: Estimate, m: int) -> float:
    """How far the middle of fingertip `m` is moved, m^2 per axis, by what hides no more of it than may be missing in
    plain view anyway. The filter does not count that (it would doubt every sight); `judge_fingertips` counts the rest.
    """
    return (MOVED * 0.5 * estimate.width[m]) ** 2 * min(_most_hidden(estimate, m), VARIES) ** 3


@lean
def part_shown(worn: Worn, places: Places, camera: Array, m: int) -> float:
    """The part of a fingertip's largest area that a camera (3, 4) sees of it when nothing hides it; 1 for others.

    A painted fingertip is a capsule: from its end it shows a disc, from its side also what is between its ends.
    """
    if not worn.slender[m] > 0.0:
        return 1.0
    sight, bone = room((3,)), places.frames[worn.dh.point_row[m]]
    line_of_sight(camera, places.points[m], sight)
    along = bone[0, 0] * sight[0] + bone[1, 0] * sight[1] + bone[2, 0] * sight[2]
    return shown_part(worn.slender[m], math.sqrt(max(1.0 - along * along, 0.0)))


@lean
def shown_part(slender: float, side: float) -> float:
    """The part of its largest area that a fingertip shows, `Worn.slender`, of which `side` is the sine of the angle
    between it and the line of sight."""
    return (1.0 + slender * side) / (1.0 + slender)


@lean
def is_placed(estimate: Estimate, camera: int) -> bool:
    """Whether it is known how far away the hand is: cameras other than this one see it too."""
    for other in range(estimate.unseen.shape[0]):
        if other != camera and count_seen(estimate.unseen, other) >= PLACED_BY:
            return True
    return False


@lean
def _hidden(estimate: Estimate, m: int, size: float, plain: bool) -> float:
    """The part of fingertip `m` that is missing in a sight of `size`, m: the diameter of a disc as large as it is, seen
    from its side. Learns from sights in plain view."""
    known = estimate.width[m]
    if known == 0.0:
        estimate.width[m], estimate.width_varies[m] = size, VARIED**2
        return 0.0
    hidden = 1.0 - (size / known) ** 2
    if plain and hidden < LIKE:
        off = math.log(size / known)
        estimate.width_varies[m] += VARIES_LEARNT * (off * off - estimate.width_varies[m])
        estimate.width[m] += (LEARNT if size > known else SHRINKS) * (size - known)
    return hidden


@lean
def _most_hidden(estimate: Estimate, m: int) -> float:
    """The largest part of a fingertip that is hidden from a camera that saw it just now."""
    most = 0.0
    for camera in range(estimate.looks.shape[0]):
        if estimate.looks[camera, m, LOOK_AGE] < FRESH_S:
            most = max(most, estimate.looks[camera, m, LOOK_HIDDEN])
    return most


@lean
def speed_of(jacobian: Array, velocity: Array) -> float:
    """m/s, of what has `jacobian` (3, 27)."""
    x, y, z = dot(jacobian[0], velocity), dot(jacobian[1], velocity), dot(jacobian[2], velocity)
    return math.sqrt(x * x + y * y + z * z)
