"""What a stereo calibration changes in a rig: lenses and places of its cameras, and nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.checks import check_cameras
from rhot_app.calibration.lens.certainty import WORKING_DISTANCE_M
from rhot_app.calibration.lens.start import LensStart
from rhot_app.calibration.stereo.report import StereoFigures, StereoReport
from rhot_app.calibration.stereo.world_frame import WorldFrame
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.errors import CalibrationError
from rhot_app.geometry.transforms import inverse, quaternion_from_rotation, rigid, rotation_from_quaternion
from rhot_app.project import CameraCalibration, CameraPose, Intrinsics, Rig, RigNode

Array = NDArray[np.float64]


ARRANGED = frozenset({"swapped", "swapped_or_mirrored", "mirrored"})
"""Findings that say why right stands on the left: the first of them is enough."""


def require_nodes(rig: Rig, cameras: Sequence[str]) -> None:
    """Raise CalibrationError unless the rig has a node of every camera's name."""
    known = [node.name for node in rig.nodes]
    missing = [name for name in cameras if name not in known]
    if missing:
        raise CalibrationError(f"the rig \"{rig.name}\" has no camera called {' or '.join(missing)}; it has "
                               f"{', '.join(known)}. Name the cameras as the rig does, with --camera NAME=PATTERN.")


def lens_of(node: RigNode) -> LensStart:
    """The lens that a rig states for a node."""
    lens = node.intrinsics
    return LensStart(np.array([lens.fx, lens.fy, lens.cx, lens.cy, *lens.distortion]), (lens.width, lens.height))


def calibrated_rig(rig: Rig, figures: StereoFigures, frame: WorldFrame | None = None) -> Rig:
    """`rig` with the lenses and places of the calibrated cameras, in the table's `frame` where one was placed.

    Cameras that were not calibrated keep their lens and their place relative to the first calibrated one. Raises
    CalibrationError when a camera is not in the rig.
    """
    names = [camera.name for camera in figures.cameras]
    require_nodes(rig, names)
    poses = figures.world_from_camera if frame is None else frame.world_from_camera
    old = next(node.pose for node in rig.nodes if node.name == names[0])
    new_from_old = poses[0] @ inverse(_matrix(old))
    nodes = []
    for node in rig.nodes:
        if node.name in names:
            camera = figures.cameras[names.index(node.name)]
            fx, fy, cx, cy, k1, k2, p1, p2, k3 = (float(value) for value in camera.lens)
            lens = Intrinsics(*camera.size, fx, fy, cx, cy, (k1, k2, p1, p2, k3))
            nodes.append(msgspec.structs.replace(node, intrinsics=lens, pose=_pose(poses[names.index(node.name)])))
        else:
            nodes.append(msgspec.structs.replace(node, pose=_pose(new_from_old @ _matrix(node.pose))))
    up: Literal["-y", "z"] = "-y" if frame is None else "z"
    error_m = figures.error_m[0]
    record = CameraCalibration("board", figures.lengths, error_m if np.isfinite(error_m) else None, WORKING_DISTANCE_M)
    return msgspec.structs.replace(rig, nodes=tuple(nodes), up=up, calibration=record,
                                   depth=msgspec.structs.replace(rig.depth, mode="stereo"))


def rig_findings(rig: Rig, cameras: Sequence[str]) -> list[Finding]:
    """What a rig with new cameras is blamed for by its own checks, and which cameras were not calibrated with them."""
    found = [finding for finding in check_cameras(rig) if finding.grade is not Grade.GOOD]
    left_out = [node.name for node in rig.nodes if node.name not in cameras]
    if left_out:
        found.append(Finding("not_calibrated", Grade.FAIR, f"{' and '.join(left_out)} of the rig took no part.",
                             "They keep their lenses, and stand to the first camera as they did before.",
                             "Calibrate all cameras together."))
    return found


def rig_verdict(report: StereoReport, rig: Rig, frame: WorldFrame | None = None) -> Verdict:
    """The verdict on writing `rig`: the calibration's, the rig's own checks, and the world frame's; each thing once."""
    found = list(report.verdict.findings)
    named = report.verdict.codes & ARRANGED
    found += [each for each in rig_findings(rig, report.cameras) if not (named and each.code in ARRANGED)]
    found += frame.verdict.findings if frame is not None else ()
    return judge(report.summary, list({finding.figure: finding for finding in found}.values()))


def _matrix(pose: CameraPose) -> Array:
    return rigid(rotation_from_quaternion(pose.rotation_wxyz), pose.translation_m)


def _pose(world_from_camera: Array) -> CameraPose:
    w, x, y, z = (float(value) for value in quaternion_from_rotation(world_from_camera[:3, :3]))
    tx, ty, tz = (float(value) for value in world_from_camera[:3, 3])
    return CameraPose((w, x, y, z), (tx, ty, tz))
