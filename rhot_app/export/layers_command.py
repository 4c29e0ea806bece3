"""``rhot layers``: which link hides which, drawn for a pose of a hand or of any articulated object, or for a film."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.errors import RigError, input_file, refuse_existing
from rhot_app.options import add_force_argument, add_json_argument, add_out_argument
from rhot_node.compiled import announce_compilation
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rhot_app.articulated.bodies import Bodies, Placed
    from rhot_app.geometry.camera import CameraModel

    Array = NDArray[np.float64]

SIZE_PX = 640, 480
FILM_FRAMES, FILM_HZ = 60, 15.0
"""A film is one turn about the vertical: six degrees from frame to frame, four seconds."""

FILL = 0.42
"""Part of the picture's height from its middle to the farthest part of the object."""

BACKGROUND = 60  # grey level, so that white and black lines both show


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot layers``."""
    parser.add_argument("file", type=input_file, nargs="?", metavar="FILE",
                        help="a rhot-hand or rhot-articulated file; without it, the shipped right hand")
    parser.add_argument("--angle", action="append", default=[], metavar="NAME=DEG",
                        help="set an angle; the others rest. Give it once for every angle")
    parser.add_argument("--from", dest="eye", default="60,50", metavar="AZIMUTH,ELEVATION",
                        help="where the camera stands, degrees about the vertical and above the object (60,50)")
    add_out_argument(parser, "the picture (.png, .jpg), or a film of one turn about the object (.avi, .mp4)",
                     required=True)
    add_force_argument(parser)
    add_json_argument(parser)
    add_examples(parser, "rhot layers --out layers.png", "rhot layers mine.json --from 0,20 --out turn.mp4")


def run(args: argparse.Namespace) -> int:
    """Draw; raises RigError or ExportError for what cannot be, before anything is written."""
    import numpy as np

    from rhot_app.articulated.bodies import place
    from rhot_app.articulated.visibility import visibility
    from rhot_app.export.pictures import whole_pictures

    bodies, names, angles = _posed(args.file, args.angle)
    azimuth, elevation = _eye(args.eye)
    film = _is_film(args.out, force=args.force)
    announce_compilation("some seconds")
    placed = place(bodies, np.eye(4), angles)
    cameras = [_camera(bodies, placed, azimuth + turn, elevation) for turn in
               (np.arange(FILM_FRAMES) * 360.0 / FILM_FRAMES if film else [0.0])]
    pictures = _pictures(bodies, placed, cameras, names)
    if film:
        with whole_pictures(args.out, FILM_HZ) as writer:
            for one in pictures:
                writer.add(one)
    else:
        _picture(args.out, next(pictures))
    seen = visibility(bodies, placed, cameras[0].record)
    order = [names[layer] for layer in seen.order]
    cut = [names[layer] for layer in np.flatnonzero(seen.cut)]
    if args.json:
        print(json.dumps({"order": order, "cut": cut, "written": str(args.out)}))
        return 0
    print("\n".join(f"{place_ + 1:3d}  {name}{'  (a cycle is cut here)' if name in cut else ''}"
                    for place_, name in enumerate(order)))
    print(f"Written: {args.out}")
    return 0


def _posed(path: Path | None, wanted: list[str]) -> tuple[Bodies, tuple[str, ...], Array]:
    """Bodies, the layers' names, and angles (A,) rad of the file's object."""
    import numpy as np

    from rhot_app.articulated.bodies import bodies_of, hand_bodies
    from rhot_app.barehand.surface import surface_of
    from rhot_app.hand.anatomy import load_hand
    from rhot_app.hand.articulated import FORMAT, load_articulated
    from rhot_app.hand.articulated_model import STATE_ROOT, build_articulated
    from rhot_app.hand.limits import pose_prior
    from rhot_app.hand.model import build_model
    from rhot_app.hand.skeleton import ANGLES
    from rhot_node.files import read_json, resource_path

    path = resource_path("hands", "right.json") if path is None else path
    document: Any = read_json(path, RigError)
    if isinstance(document, dict) and document.get("format") == FORMAT:
        model = build_articulated(load_articulated(path))
        bodies, layers = bodies_of(model)
        if not layers:
            raise RigError(f"{path}: no frame has a shape, so nothing can hide anything. Give its frames shapes.")
        names, angles, limits = model.angle_names, model.rest[STATE_ROOT:].copy(), model.limits
    else:
        hand = build_model(load_hand(path))
        bodies, layers = hand_bodies(surface_of(hand))
        names, angles, limits = ANGLES, pose_prior().mean.copy(), hand.limits
    for one in wanted:
        name, equals, value = one.partition("=")
        if not equals:
            raise RigError(f"--angle {one}: give a name and its degrees, as in --angle {names[0]}=30.")
        if name not in names:
            raise RigError(f"--angle {one}: {path.name} has no angle {name!r}; it has {', '.join(names)}.")
        angles[names.index(name)] = np.radians(_number(f"--angle {one}", value))
        low, high = np.degrees(limits[names.index(name)])
        if not low - 1e-9 <= float(value) <= high + 1e-9:
            raise RigError(f"--angle {one}: the limits of {name} are {low:g} and {high:g} degrees.")
    return bodies, layers, angles


def _number(where: str, text: str) -> float:
    import math

    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise RigError(f"{where}: {text!r} is no number of degrees.")
    return value


def _eye(text: str) -> tuple[float, float]:
    parts = text.split(",")
    if len(parts) != 2:
        raise RigError(f"--from {text}: give two numbers, azimuth and elevation, such as 60,50.")
    azimuth, elevation = (_number(f"--from {text}", part) for part in parts)
    if not -85.0 <= elevation <= 85.0:
        raise RigError(f"--from {text}: the elevation is between -85 and 85 degrees.")
    return azimuth, elevation


def _is_film(path: Path, *, force: bool) -> bool:
    if path.suffix not in (".png", ".jpg", ".avi", ".mp4"):
        raise RigError(f"--out {path}: a picture ends in .png or .jpg, a film in .avi or .mp4.")
    if not path.parent.is_dir():
        raise RigError(f"{path}: there is no folder {path.parent}. Make it first, or name another place.")
    refuse_existing(path, RigError, force=force)
    return path.suffix in (".avi", ".mp4")


def _camera(bodies: Bodies, placed: Placed, azimuth_deg: float, elevation_deg: float) -> CameraModel:
    """A camera that looks at the whole object, z up."""
    import numpy as np

    from rhot_app.articulated.bodies import BOX
    from rhot_app.geometry.camera import CameraModel, intrinsics_row
    from rhot_app.geometry.transforms import inverse, rigid

    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, 8)
    boxes = [pose[:, 3] + (pose[:, :3] @ (corners * half[:, None])).T
             for kind, pose, half in zip(bodies.kind, placed.box, bodies.half, strict=True) if kind == BOX]
    points = np.concatenate([placed.root[None, :3, 3], placed.frames[:, :, 3], *boxes])  # of a hand: no forearm
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    extent = float(np.max(np.linalg.norm(points - centre, axis=1))) + 0.02
    a, e = np.radians([azimuth_deg, elevation_deg])
    away = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    distance = 4.0 * extent
    world = rigid(np.column_stack([right, np.cross(-away, right), -away]), centre + distance * away)
    width, height = SIZE_PX
    focal = FILL * height * distance / extent
    return CameraModel(width, height, intrinsics_row([focal, focal, 0.5 * width - 0.5, 0.5 * height - 0.5]),
                       world, inverse(world))


def _pictures(bodies: Bodies, placed: Placed, cameras: list[CameraModel],
              names: tuple[str, ...]) -> Iterator[Any]:
    import numpy as np

    from rhot_app.articulated.bodies import camera_rays
    from rhot_app.export.layers_picture import draw_layers

    width, height = SIZE_PX
    rays = camera_rays(cameras[0])
    for camera in cameras:
        empty = np.full((height, width, 3), BACKGROUND, np.uint8)
        yield draw_layers(empty, bodies, placed, camera, rays, names)


def _picture(path: Path, image: Any) -> None:
    import cv2

    from rhot_node.files import write_atomically

    try:
        write_atomically(path, bytes(cv2.imencode(path.suffix, image[:, :, ::-1])[1]))
    except OSError as exc:
        raise RigError(f"{path}: cannot be written ({exc.strerror}).") from exc
