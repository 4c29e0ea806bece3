"""Contact of fingertips with an object: signed distances, and contact flags with hysteresis.

A fingertip pad is the capsule of the last segment (`rhot_app.hand.shape`), as three spheres on its axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.quantiles import normal_isf
from rhot_app.hand.dh import DhArrays, riding_points
from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.hand.model import HandModel
from rhot_app.hand.places import segment_axis
from rhot_app.hand.skeleton import FINGERS, JOINTS
from rhot_app.objects.shape import Shape

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

SWITCHING = 1e-3
"""Probability with which noise alone changes the flag of a finger that hovers midway between the two thresholds, where
it is largest. It is that of one sample."""

BEGIN_SD, END_SD = 0.0, 2.0 * normal_isf(SWITCHING)
"""Standard deviations of the distance: contact begins when the pad is within the surface with a probability of one
half, and ends beyond a distance that noise exceeds by SWITCHING from midway."""

_SPHERES = 3  # of a pad: the ends of its axis and its middle


@dataclass(frozen=True, slots=True)
class FingertipPads:
    """Three sphere centres per finger as points of a kinematic table, in the order of FINGERS; `radii` (5,) m."""

    dh: DhArrays
    radii: Array


@dataclass(frozen=True, slots=True)
class PadDistances:
    """Of each of five fingers: `distance` (5,) m from the pad to the surface, negative within it; `sphere` (5,), the
    point of the table that is nearest; `normal` (5, 3) outward, and `place` (5, 3) m of the nearest surface point, both
    in the world frame."""

    distance: Array
    sphere: NDArray[np.int64]
    normal: Array
    place: Array


def fingertip_pads(model: HandModel) -> FingertipPads:
    """The pads of a hand."""
    points = []
    for finger in range(len(FINGERS)):
        middle, half = segment_axis(model, finger)
        row = int(model.dh.point_row[len(JOINTS) + finger])
        points += [(row, (middle + shift * half, 0.0, 0.0)) for shift in (-1.0, 0.0, 1.0)]
    return FingertipPads(riding_points(model.dh, points), model.radii[:, 2].copy())


def pad_distances(pads: FingertipPads, points: Array, shape: Shape, world_from_object: Array) -> PadDistances:
    """Distances of the pads whose sphere centres are `points` (15, 3) m, world frame, from an object's surface."""
    rotation, origin = world_from_object[:3, :3], world_from_object[:3, 3]
    distance, normal = shape.signed_distance((points - origin) @ rotation)
    nearest = np.argmin(distance.reshape(-1, _SPHERES), axis=1)
    sphere = nearest + _SPHERES * np.arange(len(nearest))
    outward = normal[sphere] @ rotation.T
    place = points[sphere] - distance[sphere, None] * outward
    return PadDistances(distance[sphere] - pads.radii, sphere, outward, place)


def pad_points(pads: FingertipPads, world_from_palm: Array, angles: Array) -> Array:
    """(15, 3) m sphere centres of a hand at `world_from_palm` (4, 4) with `angles` (21,) rad, world frame."""
    points = np.empty((len(pads.dh.point_row), 3))
    forward_arrays(pads.dh, world_from_palm, angles, empty_frames(pads.dh), points)
    return points


def distance_sd(normal: Array, fingertip_covariances: Array, object_covariance: Array) -> Array:
    """(5,) m standard deviations of distances along `normal` (5, 3), from covariances (5, 3, 3) of the fingertips and
    (3, 3) or (5, 3, 3) of the object's surface, m^2."""
    return np.asarray(np.sqrt(np.einsum("fi,fij,fj->f", normal, fingertip_covariances + object_covariance, normal)))


class ContactTrigger:
    """Contact flags of five fingers with hysteresis (Schmitt 1938)."""

    def __init__(self) -> None:
        self.touching: Flags = np.zeros(len(FINGERS), dtype=bool)

    def update(self, distance: Array, sd: Array) -> Flags:
        """The flags (5,) after distances (5,) m of standard deviations `sd` (5,) m; an unknown distance is none."""
        begins, stays = distance <= BEGIN_SD * sd, distance < END_SD * sd
        self.touching = begins | (self.touching & stays)
        return self.touching.copy()


class ContactMonitor:
    """Contacts of one hand with one object, from the tracker's states and the object's poses. They move no hand: a
    wrong shape or pose of the object would do so as well."""

    def __init__(self, model: HandModel, shape: Shape) -> None:
        self.pads, self.shape = fingertip_pads(model), shape
        self.trigger = ContactTrigger()

    def update(self, world_from_palm: Array, angles: Array, fingertip_covariances: Array, world_from_object: Array,
               object_covariance: Array, pads: FingertipPads | None = None) -> tuple[PadDistances, Array, Flags]:
        """Distances, their standard deviations (5,) m and the contact flags (5,) of one instant.

        `object_covariance` (6, 6): of the object's pose, as of `ObjectState`. Fingertips without covariances switch
        their flags at the surface, without hysteresis. `pads`: of a hand of another size than the model's.
        """
        pads = self.pads if pads is None else pads
        points = pad_points(pads, world_from_palm, angles)
        found = pad_distances(pads, points, self.shape, world_from_object)
        arms = found.place - world_from_object[:3, 3]
        by_pose = np.concatenate([found.normal, np.cross(arms, found.normal)], axis=1)  # of the distance
        surface = np.einsum("fi,ij,fj->f", by_pose, object_covariance, by_pose)
        sd = np.sqrt(surface + distance_sd(found.normal, fingertip_covariances, np.zeros((3, 3))) ** 2)
        return found, sd, self.trigger.update(found.distance, np.nan_to_num(sd))
