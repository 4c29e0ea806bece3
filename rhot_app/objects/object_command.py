"""``rhot object``: check an object file, and print the object's pose in one still image of each camera of a rig."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.options import add_json_argument, add_rig_argument
from rhot_node.compiled import announce_compilation
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.objects.object_file import ObjectModel
    from rhot_app.objects.observations import FiducialFrame
    from rhot_app.objects.pose import ObjectPose
    from rhot_app.project import Rig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot object``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a rhot-object file")
    parser.add_argument("--images", nargs="+", default=[], metavar="CAMERA=IMAGE",
                        help="one image of each camera, by the camera's name in the rig, taken at the same instant")
    add_rig_argument(parser, "the rig file, for lenses and poses of the cameras", exists=False)
    add_json_argument(parser)
    add_examples(parser, "rhot object cube.json",
                 "rhot object cube.json --rig desk.json --images left=left.png right=right.png")


def run(args: argparse.Namespace) -> int:
    """Check, detect, solve and print. Raises ObjectError or RigError for what cannot be."""
    from rhot_app.errors import ObjectError
    from rhot_app.objects.object_file import load_object
    from rhot_app.project import load_rig

    model = load_object(args.file)
    fields: dict[str, Any] = {"name": model.name, "fiducials": len(model.fiducials), "markers": len(model.markers)}
    if args.images:
        if args.rig is None:
            raise ObjectError("--images needs the cameras' lenses and poses; give the rig file with --rig.")
        if not model.fiducials:
            raise ObjectError(f"{args.file}: {model.name!r} has colour markers only, which are not looked for in still "
                              "images. Give an object with fiducials.")
        announce_compilation("some seconds")
        found, warnings = _solve(model, load_rig(args.rig), args.images)
        fields.update(_pose_fields(found), warnings=warnings)
    print(json.dumps(fields) if args.json else "\n".join(_lines(fields)))
    return 0


def _solve(model: ObjectModel, rig: Rig, images: Sequence[str]) -> tuple[ObjectPose, list[str]]:
    """The pose, and sentences about what is ambiguous in the images."""
    from rhot_app.errors import ObjectError
    from rhot_app.geometry.camera import CameraModel
    from rhot_app.objects.motion import CameraArrays
    from rhot_app.objects.observations import ObjectPoints
    from rhot_app.objects.pose import estimate_pose
    from rhot_app.objects.track import copies_sentence
    from rhot_node.detect.tags import TagDetector

    points = ObjectPoints(model)
    detector = TagDetector(sorted({tag.family for tag in model.fiducials}))
    frames = [_detect(rig, detector, image) for image in images]
    doubled = [frame.camera for frame in frames if sum(one.camera == frame.camera for one in frames) > 1]
    if doubled:
        raise ObjectError(f"--images names the camera {rig.nodes[doubled[0]].name!r} twice; give one image of each.")
    views = [view for frame in frames if (view := points.view(frame)) is not None]
    ambiguous = [copies_sentence(rig.nodes[frame.camera].name, frame.keys[copies[0]], model.name)
                 for frame in frames for copies in points.copies(frame)]
    if not views and ambiguous:
        raise ObjectError(f"{', '.join(images)}: no pose. {' '.join(ambiguous)}")
    if not views:
        raise ObjectError(f"no tag of {model.name!r} was found in {', '.join(images)}. Is it in sight, sharp and "
                          "at least 20 px large?")
    cameras = CameraArrays.of([CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes])
    found = estimate_pose(points, cameras, views)
    if found is None:
        raise ObjectError(f"the tags of {model.name!r} determine no pose; is their layout in the object file right?")
    return found, ambiguous


def _detect(rig: Rig, detector: Any, argument: str) -> FiducialFrame:
    """The tags in the image of ``CAMERA=IMAGE``."""
    from rhot_app.errors import ObjectError
    from rhot_app.objects.observations import fiducial_frame
    from rhot_node.pictures import read_picture
    from rhot_node.wire.messages import Fiducials

    name, equals, path = argument.partition("=")
    names = [node.name for node in rig.nodes]
    if not equals or name not in names:
        raise ObjectError(f"--images {argument}: there is no camera {name!r}. Write CAMERA=IMAGE with one of "
                          f"{', '.join(names)}.")
    luma = read_picture(Path(path), grey=True)
    camera, (height, width) = names.index(name), luma.shape
    lens = rig.nodes[camera].intrinsics
    if (width, height) != (lens.width, lens.height):
        raise ObjectError(f"{path}: the image has {width} x {height} px, camera {name!r} {lens.width} x {lens.height}. "
                          "Give an unscaled image of that camera.")
    found = detector.detect(luma)
    return fiducial_frame(Fiducials(1, 1, 0, 0, 0, 0, 0, 0, width, height, 0, found), camera, 0)


def _pose_fields(pose: ObjectPose) -> dict[str, Any]:
    import numpy as np

    from rhot_app.estimation.se3 import quaternion_from_rotation

    world = pose.world_from_object
    sd = np.sqrt(np.diag(pose.covariance))
    fields: dict[str, Any] = {
        "validity": pose.validity.value, "translation_m": world[:3, 3].tolist(),
        "rotation_wxyz": quaternion_from_rotation(world[:3, :3]).tolist(), "translation_sd_m": sd[:3].tolist(),
        "rotation_sd_rad": sd[3:].tolist(), "reprojection_rms_px": pose.rms_px, "points": pose.points,
        "second_probability": pose.second_probability}
    if pose.second is not None:
        fields["second"] = {"translation_m": pose.second[:3, 3].tolist(),
                            "rotation_wxyz": quaternion_from_rotation(pose.second[:3, :3]).tolist()}
    return fields


def _lines(fields: dict[str, Any]) -> list[str]:
    lines = [f"{fields['name']}: {fields['fiducials']} fiducials, {fields['markers']} markers"]
    if "validity" not in fields:
        return lines
    place, sd = (", ".join(f"{1e3 * value:.2f}" for value in fields[key])
                 for key in ("translation_m", "translation_sd_m"))
    turn = ", ".join(f"{value:.5f}" for value in fields["rotation_wxyz"])
    turn_sd = ", ".join(f"{57.29577951308232 * value:.3f}" for value in fields["rotation_sd_rad"])
    lines += [f"{fields['validity']}, {fields['points']} corners, reprojection error "
              f"{fields['reprojection_rms_px']:.3f} px rms", f"translation {place} mm (standard deviation {sd})",
              f"rotation wxyz {turn} (standard deviation {turn_sd} degrees)"]
    if fields["validity"] == "ambiguous":
        lines.append(f"a second pose has a probability of {100.0 * fields['second_probability']:.0f} %; show a second "
                     "tag, or the tag to a second camera.")
    return lines + fields["warnings"]
