"""The anatomy that no hand file holds, ``resources/anatomy/hand.json``: each table stands there beside its source."""

from __future__ import annotations

import msgspec

from rhot_app.errors import RigError
from rhot_node.files import read_document, resource_path

Degrees = tuple[float, float]


class Paint(msgspec.Struct, frozen=True):
    """The painted part of a fingertip."""

    lengths_mm: dict[str, float]
    nail_edge_mm: float
    nail_breadth: float
    nail_corners: float
    dot_corners: float


class Flesh(msgspec.Struct, frozen=True):
    """The capsules over palm and forearm."""

    neck: float
    joint_gap_m: float
    carpal_x_m: float
    carpal_spread: float
    carpal_z_m: float
    ulnar_taper: float
    knuckle_gap: float
    thenar_spread: float
    thenar_z_m: float
    thenar_thickness: float
    web_thickness: float
    forearm_length_m: float
    forearm_breadths: tuple[float, float]
    forearm_thickness: float


class Tables(msgspec.Struct, frozen=True):
    """`bones`: three of each finger, per hand length. `pose_prior`: of each sum of factor times angle the mean and the
    standard deviation, degrees."""

    bones: dict[str, tuple[float, float, float]]
    human_lengths_m: tuple[float, float]
    length_sd: float
    pose_prior: tuple[tuple[float, float, dict[str, float]], ...]
    neutral_deg: tuple[float, ...]
    thesis_limits_deg: dict[str, Degrees]
    inter_finger_lag_deg: float
    paint: Paint
    back: dict[str, tuple[str, float, float]]
    flesh: Flesh


TABLES = read_document(resource_path("anatomy", "hand.json"), Tables, format_name="rhot-hand-tables", version=1,
                       error=RigError)
