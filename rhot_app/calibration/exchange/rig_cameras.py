"""Cameras of other programs in a rig, and a rig's cameras for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.camera_calibration import with_lens
from rhot_app.calibration.check.checks import all_pairs, lens_figures, lens_findings, pair_findings
from rhot_app.calibration.exchange.records import ForeignCamera
from rhot_app.calibration.verdict import Finding
from rhot_app.errors import CalibrationError
from rhot_app.estimation.se3 import quaternion_from_rotation, rotation_from_quaternion
from rhot_app.geometry.transforms import inverse, rigid
from rhot_app.project import CameraPose, Rig, RigNode

Array = NDArray[np.float64]

_PORTS = {field.name: int(field.default) for field in msgspec.structs.fields(RigNode)
          if field.name in ("udp_port", "control_port", "preview_port", "pairing_port")}
_DISTANCE = ("coincident", "narrow", "apart")  # findings of `pair_findings` on how far cameras are apart
_NEXT = 10  # as in resources/nodes: nodes on one machine, until they have addresses


def new_rig(name: str, cameras: Mapping[str, ForeignCamera]) -> Rig:
    """A rig of a bare hand with these cameras, by name, still without their poses. Raises CalibrationError."""
    nodes = [{"node_id": k, "name": node, "intrinsics": camera.lens,
              **{port: first + _NEXT * (k - 1) for port, first in _PORTS.items()}}
             for k, (node, camera) in enumerate(cameras.items(), 1)]
    try:
        return msgspec.convert(msgspec.to_builtins({"name": name, "nodes": nodes}), Rig)
    except msgspec.ValidationError as exc:
        raise CalibrationError(f"these cameras are no rig: {str(exc).replace('`', '')}.") from exc


def with_cameras(rig: Rig, cameras: Mapping[str, ForeignCamera], *, keep_world: bool = False,
                 unit_hint: str = "") -> Rig:
    """`rig` with other lenses of its nodes, and where the cameras have poses, with these.

    The rig frame is then the first camera's; with `keep_world` it is the file's world, whose z axis points up. Nodes
    that are not among `cameras` stay where they were beside the first one. No record says how the cameras were
    calibrated. Raises CalibrationError: only some cameras have a pose, or one that no rig holds; `unit_hint` then says
    which unit would fit.
    """
    unposed = [name for name, camera in cameras.items() if camera.camera_from_world is None]
    if unposed and len(unposed) < len(cameras):
        raise CalibrationError(f"{' and '.join(unposed)} has no pose in the file, others have; choose those with "
                               "--camera NAME=THEIRS.")
    if unposed:
        for name, camera in cameras.items():
            rig = with_lens(rig, name, camera.lens)
        return rig
    poses = {name: inverse(camera.camera_from_world) for name, camera in cameras.items()
             if camera.camera_from_world is not None}
    first = next(node.name for node in rig.nodes if node.name in cameras)
    origin = np.eye(4) if keep_world else inverse(poses[first])
    old = next(node.pose for node in rig.nodes if node.name == first)
    new_from_old = origin @ poses[first] @ inverse(_matrix(old))
    nodes = tuple(_moved(node, cameras.get(node.name), origin @ poses[node.name] if node.name in cameras
                         else new_from_old @ _matrix(node.pose), unit_hint) for node in rig.nodes)
    return msgspec.structs.replace(rig, nodes=nodes, up="z" if keep_world else "-y", calibration=None,
                                   depth=msgspec.structs.replace(rig.depth, mode="stereo"))


def baselines_m(cameras: Mapping[str, ForeignCamera]) -> list[float]:
    """The distances between all pairs of cameras with poses."""
    centres = [inverse(camera.camera_from_world)[:3, 3] for camera in cameras.values()
               if camera.camera_from_world is not None]
    return [float(np.linalg.norm(a - b)) for a, b in combinations(centres, 2)]


def camera_findings(rig: Rig, cameras: Mapping[str, ForeignCamera], unit_hint: str = "") -> list[Finding]:
    """Whether these can be lenses and places; `unit_hint`: which unit would make plausible distances. Where the hand
    will be is not known, so what cameras see together is not looked at; ``rhot check`` does."""
    nodes = [node for node in rig.nodes if node.name in cameras]
    found = [finding for node in nodes for finding in lens_findings(node, lens_figures(node))]
    if all(camera.camera_from_world is not None for camera in cameras.values()):
        pairs = [pair for pair in all_pairs(rig) if {pair.first, pair.second} <= cameras.keys()]
        found += [replace(finding, remedy=unit_hint) if unit_hint and finding.code in _DISTANCE else finding
                  for finding in pair_findings(rig, pairs) if finding.code != "overlap"]
    return found


def cameras_of(rig: Rig) -> list[ForeignCamera]:
    """The cameras of a rig; their world is the rig frame."""
    return [ForeignCamera(node.name, node.intrinsics, inverse(_matrix(node.pose))) for node in rig.nodes]


def _moved(node: RigNode, camera: ForeignCamera | None, world_from_camera: Array, unit_hint: str) -> RigNode:
    w, x, y, z = (float(value) for value in quaternion_from_rotation(world_from_camera[:3, :3]))
    tx, ty, tz = (float(value) for value in world_from_camera[:3, 3])
    try:
        pose = msgspec.convert({"rotation_wxyz": (w, x, y, z), "translation_m": (tx, ty, tz)}, CameraPose)
    except msgspec.ValidationError as exc:
        raise CalibrationError(f"{node.name} stands at ({tx:g}, {ty:g}, {tz:g}) m, farther than rigs reach. "
                               + (unit_hint or "Is the unit right (--unit)?")) from exc
    return msgspec.structs.replace(node, pose=pose, intrinsics=node.intrinsics if camera is None else camera.lens)


def _matrix(pose: CameraPose) -> Array:
    return rigid(rotation_from_quaternion(pose.rotation_wxyz), pose.translation_m)
