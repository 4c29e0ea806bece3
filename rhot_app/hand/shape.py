"""The hand's volume as capsules, for the digital twin's images and the 3-D scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.kinematics import HandPoints
from rhot_app.hand.model import HandModel
from rhot_app.hand.skeleton import FINGERS, HandPose
from rhot_app.hand.tables import TABLES

Array = NDArray[np.float64]

FLESH = TABLES.flesh


@dataclass(frozen=True, slots=True)
class Capsules:
    """N capsules: all points within `radius` of the segment `start`-`end`. World frame, m.

    `names`: "<finger>_proximal", "_medial", "_neck", "_distal" (thumb: "_metacarpal", "_proximal", "_neck", "_distal"),
    "palm_...", "forearm_..." and "wrist_band". A fingertip marker is the whole distal capsule, painted: it reaches
    from near the last joint to the tip and its middle is the marker's centre. The wrist marker is the wrist band,
    whose middle is the wrist joint.
    """

    names: tuple[str, ...]
    start: Array  # (N, 3)
    end: Array  # (N, 3)
    radius: Array  # (N,)


def segments(model: HandModel, pose: HandPose, points: HandPoints) -> Capsules:
    """The capsules of the whole hand. `points` must be `forward(model, pose)`."""
    parts: list[tuple[str, Array, Array, float]] = []
    for finger in range(5):
        parts += _finger(model, finger, points)
    rotation, origin = pose.world_from_palm[:3, :3], pose.world_from_palm[:3, 3]
    mirror = np.array([1.0, model.mirror, 1.0])
    for name, start, end, radius in _palm(model):
        parts.append((name, origin + rotation @ (mirror * start), origin + rotation @ (mirror * end), radius))
    return Capsules(tuple(part[0] for part in parts), np.array([part[1] for part in parts]),
                    np.array([part[2] for part in parts]), np.array([part[3] for part in parts]))


def _finger(model: HandModel, finger: int, points: HandPoints) -> list[tuple[str, Array, Array, float]]:
    name = FINGERS[finger]
    words = ("metacarpal", "proximal") if name == "thumb" else ("proximal", "medial")
    base, second, last, tip = points.joints[1 + 4 * finger:5 + 4 * finger]
    first_radius, second_radius, tip_radius = (float(radius) for radius in model.radii[finger])
    medial, distal = (last - second) / model.bones[finger, 1], (tip - last) / model.bones[finger, 2]
    centre = points.marker_centres[finger]
    half = max(float(model.bones[finger, 2] - model.marker[finger]) - tip_radius, 0.0)
    return [
        (f"{name}_{words[0]}", base, second, first_radius),
        # Ends before the last joint, so that skin does not hide one side of the painted distal segment.
        (f"{name}_{words[1]}", second, last - ((1.0 - FLESH.neck) * second_radius + FLESH.joint_gap_m) * medial,
         second_radius),
        (f"{name}_neck", second, last, FLESH.neck * tip_radius),
        (f"{name}_distal", centre - half * distal, centre + half * distal, tip_radius),
    ]


def _palm(model: HandModel) -> list[tuple[str, Array, Array, float]]:
    """Palm, thenar, forearm and band of a right hand in its palm frame."""
    anatomy = model.anatomy
    thick = 0.5e-3 * anatomy.palm_thickness_mm
    knuckles = model.base[1:]
    parts = []
    for k, name in enumerate(FINGERS[1:]):
        radius = thick * (1.0 - (1.0 - FLESH.ulnar_taper) * k / (len(knuckles) - 1))
        carpal = np.array([FLESH.carpal_x_m, FLESH.carpal_spread * knuckles[k, 1], FLESH.carpal_z_m])
        # The knuckle's own finger is thinner than the palm: keep the palm's round end behind the joint.
        way = knuckles[k] - carpal
        end = carpal + way * (1.0 - FLESH.knuckle_gap * radius / float(np.linalg.norm(way)))
        parts.append((f"palm_{name}", carpal, end, radius))
    thumb = model.base[0]
    heel = np.array([FLESH.carpal_x_m, FLESH.thenar_spread * thumb[1], FLESH.thenar_z_m])
    parts.append(("palm_thenar", heel, thumb, FLESH.thenar_thickness * thick))
    parts.append(("palm_web", thumb, 0.5 * (parts[0][1] + knuckles[0]), FLESH.web_thickness * thick))
    wide, flat = 0.5e-3 * anatomy.wrist_breadth_mm, 0.5e-3 * anatomy.wrist_thickness_mm
    side = max(wide - flat, 0.0)
    for name, y in (("radial", side), ("ulnar", -side)):
        near, far = FLESH.forearm_breadths
        parts.append((f"forearm_{name}", np.array([0.0, near * y, 0.0]),
                      np.array([-FLESH.forearm_length_m, far * y, 0.0]), FLESH.forearm_thickness * flat))
    parts.append(("wrist_band", np.array([0.0, -side, 0.0]), np.array([0.0, side, 0.0]), flat))
    return parts


