"""A short protocol on the simulated rig without pictures, and what is true of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from rhot_app.certificate.recordings import ProtocolFile
from rhot_app.certificate.simulated import Lengths, record_protocol
from rhot_app.project import Rig
from rhot_app.simulator.scene.scene import build_rig, make_scene, twin_defaults

SHORT = Lengths(static_s=4.0, distance_s=0.8, rod_s=10.0, flash_s=10.0, plumb_s=1.5,
                distances_m=(0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 1.0))
BRIEF = replace(SHORT, static_s=2.0, distance_s=0.4, rod_s=5.0, flash_s=6.0)


@dataclass(frozen=True)
class Recorded:
    """A folder of recordings, and the rig that a perfect calibration would give."""

    folder: Path
    protocol: ProtocolFile
    rig: Rig


def recorded(folder: Path, seed: int, lengths: Lengths = SHORT) -> Recorded:
    """Make it."""
    folder.mkdir()
    scene = make_scene(twin_defaults(), seed)
    return Recorded(folder, record_protocol(scene, folder, sketched=True, lengths=lengths), build_rig(scene))


def with_baseline(rig: Rig, factor: float) -> Rig:
    """The rig as if its squares had been stated too large or too small: every length by that factor."""
    nodes = tuple(msgspec.structs.replace(node, pose=msgspec.structs.replace(
        node.pose, translation_m=tuple(factor * x for x in node.pose.translation_m))) for node in rig.nodes)
    return msgspec.structs.replace(rig, nodes=nodes)


def with_focal_length(rig: Rig, factor: float) -> Rig:
    """Both lenses too long or too short."""
    nodes = tuple(msgspec.structs.replace(node, intrinsics=msgspec.structs.replace(
        node.intrinsics, fx=factor * node.intrinsics.fx, fy=factor * node.intrinsics.fy)) for node in rig.nodes)
    return msgspec.structs.replace(rig, nodes=nodes)
