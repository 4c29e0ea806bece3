"""The cameras of this computer that were opened together, and their rig: files of the app's own folder.

Only a rig of this folder starts cameras when it is opened. A rig file from elsewhere opens none.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import stat
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta
from platformdirs import user_data_path

from rhot_app.errors import RigError, SourceError
from rhot_app.hand.anatomy import load_hand
from rhot_app.options import add_json_argument
from rhot_app.project import Intrinsics, Rig, RigNode, TrackerSettings, load_rig
from rhot_app.rig_history import accept
from rhot_app.sources.local_nodes import NodePorts
from rhot_node.capture.v4l2 import Device, list_devices
from rhot_node.config import FPS, CameraSettings, NodeSettings
from rhot_node.files import PRINTABLE, read_document, resource_path, write_document
from rhot_node.landmarks.install import installed_folder
from rhot_node.markers import load_markers
from rhot_node.terminal import add_examples

FORMAT: Final = "rhot-cameras"
VERSION: Final = 1

NONE_FOUND: Final = ("This computer has no camera. Plug one in, or name a film, a folder of pictures or the address of "
                     "a network camera.")

Side = Literal["right", "left"]


@dataclass(frozen=True, slots=True)
class CameraSource:
    """A source that can be opened. `spec`: as ``rhot-node --camera`` takes it. `title`: what it is, for people.
    `width`, `height` px, even. `fps`: its rate. `seconds`: how long it plays, None for what is live. `turned`,
    `mirrored`: how its pictures are to be turned (`CameraSettings`)."""

    spec: str
    title: str
    width: int
    height: int
    fps: float
    seconds: float | None = None
    turned: bool = False
    mirrored: bool = False


class LocalCamera(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A camera of a set: its name in the rig, and how its node opens it. `film`: whether it plays what was recorded."""

    name: Annotated[str, Meta(min_length=1, max_length=64, pattern=PRINTABLE)]
    spec: Annotated[str, Meta(min_length=1, max_length=4096)]
    width: Annotated[int, Meta(ge=16, le=16384, multiple_of=2)]
    height: Annotated[int, Meta(ge=16, le=16384, multiple_of=2)]
    fps: Annotated[float, Meta(ge=FPS[0], le=FPS[1])]
    film: bool = False
    turned: bool = False
    mirrored: bool = False


class CameraSet(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The content of a set's file, in the order of the rig's nodes."""

    cameras: Annotated[tuple[LocalCamera, ...], Meta(min_length=1, max_length=16)]
    format: Literal["rhot-cameras"] = FORMAT
    version: Literal[1] = VERSION


@dataclass(frozen=True, slots=True)
class Prepared:
    """The rig file of a set, and what is to be known of it that the engine does not say: sentences."""

    rig_path: Path
    remarks: tuple[str, ...]


def cameras_folder() -> Path:
    """Where the sets of this user lie."""
    return user_data_path("rhot") / "cameras"


def nodes_folder(rig_path: Path) -> Path:
    """Where the nodes of a set keep settings, keys and logs."""
    return rig_path.with_suffix(".nodes")


def camera_set_of(rig_path: Path) -> CameraSet | None:
    """The cameras that belong to a rig file; None for a rig of nodes that somebody else starts. Raises RigError."""
    path = _set_path(rig_path)
    if rig_path.absolute().parent != cameras_folder().absolute() or not path.exists():
        return None
    return read_document(path, CameraSet, format_name=FORMAT, version=VERSION, error=RigError)


def prepare(sources: Sequence[CameraSource], names: Sequence[str] = (), base: Rig | None = None,
            side: Side | None = None) -> Prepared:
    """Write the set of these cameras and its rig: the one that they had before, or the calibration of `base`, or a
    first one. `side`: of the hand, where it is to be another one. Raises SourceError when `base` does not fit,
    RigError, OSError."""
    names = list(names) or names_of(sources)
    if base is not None:
        nodes = _nodes_of(base, sources, names)
        names = [node.name for node in nodes]
    cameras = tuple(LocalCamera(name, one.spec, one.width, one.height, one.fps, one.seconds is not None, one.turned,
                                one.mirrored) for name, one in zip(names, sources, strict=True))
    path = cameras_folder() / f"{_file_name(cameras)}.json"
    bare = installed_folder() is not None
    if base is not None:
        rig, reason = msgspec.structs.replace(base, nodes=nodes), "the calibration of another rig"
    else:
        rig, reason = _kept_rig(path, cameras, bare) or first_rig(cameras, bare=bare), "opening cameras"
    if side is not None and side != rig.hand.side:
        rig = msgspec.structs.replace(rig, hand=load_hand(resource_path("hands", f"{side}.json")), other_hand=None)
    path.parent.mkdir(mode=stat.S_IRWXU, parents=True, exist_ok=True)
    accept(path, rig, reason)
    write_document(_set_path(path), CameraSet(cameras))
    return Prepared(path, (*film_remarks(sources), *_rig_remarks(rig, bare)))


def change_observed(rig_path: Path, *, bare: bool) -> None:
    """Have a set's rig track a bare hand by landmarks, or painted markers; what stood there is kept. Takes effect when
    the rig is opened. Raises RigError, SourceError for a rig of other nodes."""
    cameras, rig = camera_set_of(rig_path), load_rig(rig_path)
    if cameras is None:
        raise SourceError(f"{rig_path}: is no rig of this computer's cameras; change its markers and its nodes' files.")
    new = first_rig(cameras.cameras, bare=bare)
    accept(rig_path, msgspec.structs.replace(rig, markers=new.markers, tracker=new.tracker, filters=new.filters,
                                             other_hand=None), "tracking something else")


def first_rig(cameras: Sequence[LocalCamera], *, bare: bool) -> Rig:
    """A rig of which nothing is calibrated: lenses are assumed, and only the first camera's place is known. `bare`: a
    bare hand is tracked by its landmarks; else painted markers are."""
    nodes = tuple(RigNode(number + 1, camera.name, Intrinsics.assumed(camera.width, camera.height),
                          pose_known=number == 0) for number, camera in enumerate(cameras))
    name = " and ".join(camera.name for camera in cameras)[:64]
    if bare:
        return Rig(name, nodes)
    return Rig(name, nodes, load_markers(resource_path("markers", "rhot6.json")),
               tracker=TrackerSettings(kind="estimator"))


def node_settings(camera: LocalCamera, node: RigNode, rig: Rig, kept: NodeSettings | None) -> NodeSettings:
    """What the node of a camera is told: loopback only, any free ports. `kept`: its settings of the last time, whose
    camera controls stay."""
    controls = camera_controls(camera) if kept is None else kept.camera
    landmarks = any(marker.shape == "landmark" for marker in rig.markers.markers)
    return NodeSettings(
        node_id=node.node_id, name=node.name, markers=rig.markers, bind_address="127.0.0.1", udp_port=0,
        control_port=0, preview_port=0, pairing_port=0, broadcast_port=None, announce=False,
        detector="landmarks" if landmarks else "fast",
        camera=msgspec.structs.replace(controls, width=camera.width, height=camera.height, fps=camera.fps,
                                       turned=camera.turned, mirrored=camera.mirrored))


def camera_controls(camera: LocalCamera | CameraSource) -> CameraSettings:
    """What a camera is told that nobody has set yet: its mode, and an exposure of half a frame."""
    return CameraSettings(width=camera.width, height=camera.height, fps=camera.fps, exposure_us=0.5 * 1e6 / camera.fps,
                          turned=camera.turned, mirrored=camera.mirrored)


def with_ports(rig: Rig, ports: Sequence[NodePorts]) -> Rig:
    """The rig with its nodes where they run now. A lens that is assumed is one of the pictures that really come."""
    nodes = []
    for node, port in zip(rig.nodes, ports, strict=True):
        lens = node.intrinsics
        if lens.nominal and (lens.width, lens.height) != port.size:
            lens = Intrinsics.assumed(*port.size)
        nodes.append(msgspec.structs.replace(
            node, intrinsics=lens, udp_port=port.udp_port, control_port=port.control_port,
            preview_port=port.preview_port, pairing_port=port.pairing_port, public_key=port.public_key))
    return msgspec.structs.replace(rig, nodes=tuple(nodes))


def _nodes_of(base: Rig, sources: Sequence[CameraSource], names: Sequence[str]) -> tuple[RigNode, ...]:
    """The nodes of a rig for these cameras: by their names where the rig has them, else in its order. Raises
    SourceError."""
    by_name = {node.name: node for node in base.nodes}
    if all(name in by_name for name in names):
        chosen = [by_name[name] for name in names]
    elif len(sources) == len(base.nodes):
        chosen = list(base.nodes)
    else:
        raise SourceError(f"The rig {base.name!r} has {len(base.nodes)} cameras ({', '.join(by_name)}), and "
                          f"{len(sources)} are named. Name as many, in the rig's order.")
    for node, source in zip(chosen, sources, strict=True):
        size = node.intrinsics.width, node.intrinsics.height
        if size != (source.width, source.height):
            raise SourceError(f"{source.title} gives pictures of {source.width} x {source.height} px, and the rig's "
                              f"lens {node.name} was calibrated for {size[0]} x {size[1]} px. Use the camera's other "
                              "mode, or calibrate it for this one.")
    return tuple(msgspec.structs.replace(node, address="127.0.0.1", text_datagrams=False, public_key="", data_port=0)
                 for node in chosen)


def _kept_rig(path: Path, cameras: Sequence[LocalCamera], bare: bool) -> Rig | None:
    """The rig that this set had. None for one in which nothing was measured or chosen, and which tracks what can be
    improved upon now. Raises RigError."""
    if not path.exists():
        return None
    kept = load_rig(path)
    measured = any(node.pose_known for node in kept.nodes[1:]) or not all(node.intrinsics.nominal
                                                                          for node in kept.nodes)
    other = msgspec.structs.replace(first_rig(cameras, bare=not bare), nodes=kept.nodes)
    return None if kept == other and not measured else kept


def _rig_remarks(rig: Rig, bare: bool) -> list[str]:
    """What the engine does not say of the rig."""
    if bare or not rig.painted:
        return []
    return ["The hand networks are not installed, so painted markers are looked for. For a bare hand run "
            "`rhot landmarks install` (Calibrate, Hand networks), then open the cameras again."]


def _set_path(rig_path: Path) -> Path:
    return rig_path.with_suffix(".cameras")


def _file_name(cameras: Sequence[LocalCamera]) -> str:
    """Names for people, and a number that another set does not have."""
    specs = [camera.spec + " turned" * camera.turned + " mirrored" * camera.mirrored for camera in cameras]
    number = hashlib.sha256("\n".join(specs).encode("utf-8", "surrogateescape")).hexdigest()
    return f"{re.sub(r'[^A-Za-z0-9]+', '-', '+'.join(camera.name for camera in cameras))[:48].strip('-')}-{number[:8]}"


def film_remarks(sources: Sequence[CameraSource]) -> list[str]:
    """What two films do not have in common and what follows from it; sizes and rates may differ."""
    films = [one for one in sources if one.seconds is not None]
    if films and len(films) < len(sources):
        return ["Films and cameras are mixed: they do not show the same moment, so nothing is measured between them."]
    if len(films) < 2:
        return []
    shortest, longest = (choose(films, key=lambda one: one.seconds or 0.0) for choose in (min, max))
    assert shortest.seconds is not None and longest.seconds is not None
    if longest.seconds - shortest.seconds <= 0.5 / min(one.fps for one in films):
        return []
    return [f"{shortest.title} lasts {shortest.seconds:.2f} s, {longest.title} {longest.seconds:.2f} s: from their "
            "second round on they show different moments. Cut them to the same length."]


def names_of(sources: Sequence[CameraSource]) -> list[str]:
    """A name for each camera, all different: the film's, else camera and a number."""
    names: list[str] = []
    for number, source in enumerate(sources, start=1):
        stem = Path(source.title).stem if source.seconds is not None else ""
        name = re.sub(r"[^\w .-]+", "_", stem)[:40].strip(" .") or f"camera {number}"
        names.append(name if name not in names else f"{name} {number}")
    return names


# -- the command ``rhot cameras`` --------------------------------------------------------------------------------------

def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot cameras``."""
    add_json_argument(parser, "print one JSON object: the cameras with all their modes")
    add_examples(parser, "rhot cameras", "rhot cameras --json")


def run(args: argparse.Namespace) -> int:
    """Print them; exit code 1 when there is none."""
    devices = list_devices()
    if args.json:
        print(json.dumps({"cameras": [asdict(device) for device in devices]}))
    else:
        print("\n".join(map(device_line, devices)) or NONE_FOUND)
    return 0 if devices else 1


def device_line(device: Device) -> str:
    """A camera in one line: its number, name, and modes or fault."""
    number = device.path.removeprefix("/dev/video")
    said = device.problem or f"{device.mode}" + (f", {len(device.modes)} picture sizes" if device.modes else "")
    return f"{number}  {device.name}  {said}"
