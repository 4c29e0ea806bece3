"""``rhot cameras``: the cameras of this computer, and what is wrong with those that cannot be used."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict

from rhot_app.sources.cameras.camera_set import NONE_FOUND
from rhot_node.capture.v4l2 import Device, list_devices
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot cameras``."""
    parser.add_argument("--json", action="store_true", help="print one JSON object: the cameras with all their modes")
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
