"""``rhot-node doctor``: looks at everything that a node needs, and says what to do."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from rhot_node.capture.camera import Camera
from rhot_node.capture.open import open_camera
from rhot_node.capture.pi_camera import CameraStack, load_stack
from rhot_node.capture.sensors import PRESETS
from rhot_node.capture.v4l2 import Device, list_devices
from rhot_node.clock import NodeClock
from rhot_node.compiled import is_compiled_in
from rhot_node.config import CameraSettings, NodeSettings, load_settings, network_model
from rhot_node.errors import CameraError, KeypointError, NodeError, TrustError
from rhot_node.health.camera import watch_camera
from rhot_node.health.checks import (
    Check,
    Level,
    Machine,
    check_clock,
    check_heat,
    check_memory,
    check_memory_limit,
    check_network,
    check_power,
    check_speed,
    worst,
)
from rhot_node.keys import NodeTrust, keys_path
from rhot_node.landmark_search import OpenNetworks, open_networks
from rhot_node.service import NAME, STATE_FOLDER
from rhot_node.terminal import add_examples

EXIT_CODES: dict[Level, int] = {"ok": 0, "unknown": 0, "warning": 1, "error": 2}
SERVICE_CACHE = Path("var/cache") / STATE_FOLDER.name

LoadStack = Callable[[], CameraStack]
OpenCamera = Callable[[str, CameraSettings, NodeClock], Camera]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    parser.add_argument("--settings", type=Path, metavar="FILE",
                        help=f"settings of the node (default: the service's, {STATE_FOLDER}/node.json, if there)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    add_examples(parser, "rhot-node doctor", "rhot-node doctor --settings left.json --json")


def run(options: argparse.Namespace) -> int:
    """Print all checks; returns the exit code."""
    from platformdirs import user_cache_path
    checks = examine(Machine(), options.settings, user_cache_path())
    level = worst(checks)
    if options.json:
        print(json.dumps({"verdict": level, "checks": [asdict(check) for check in checks]}, indent=1))
    else:
        for check in checks:
            print(f"{check.level:<8} {check.code:<15} {check.sentence}")
    return EXIT_CODES[level]


def examine(machine: Machine, settings: Path | None, user_cache: Path, load: LoadStack = load_stack) -> list[Check]:
    """All checks, in the order in which a node needs the things. `settings` None: the service's, if it has any."""
    flags = machine.throttled()
    model = machine.model()
    is_pi = model is not None and model.startswith("Raspberry")
    return [
        Check("machine", "ok", f"{model or 'Not a Raspberry Pi'}."),
        check_power(flags), check_heat(machine.temperature_c(), flags), check_memory(machine.available_bytes()),
        check_speed(machine.governor()), check_clock(machine.ntp_synchronised(), machine.clock_source()),
        *check_network(machine), check_camera(machine, is_pi, load),
        *(() if is_pi else check_webcams(list_devices(machine.root / "dev"))),
        check_compiled([user_cache, machine.root / SERVICE_CACHE]), *check_settings(machine, settings),
        *check_service(machine)]


def check_camera(machine: Machine, is_pi: bool, load: LoadStack) -> Check:
    """Cameras that a node could open. A Pi has video devices even without a camera, so picamera2 decides there."""
    try:
        found = load().picamera2.Picamera2.global_camera_info()
    except CameraError as exc:
        devices = machine.video_devices()
        if devices and not is_pi:
            return Check("camera", "ok", f"Webcams: {', '.join(devices)}.")
        if is_pi:
            return Check("camera", "error", "No Pi camera can be used:", f"{exc}")
        return Check("camera", "error", "There is no camera.", "Plug one in.")
    if not found:
        return Check("camera", "error", "picamera2 finds no camera.", "Switch the Pi off and seat the ribbon cable "
                     "anew, contacts the right way round; `rpicam-hello --list-cameras` must then show it.")
    names = []
    for info in found:
        presets = ", ".join(preset.name for preset in PRESETS if str(info["Model"]).startswith(preset.sensor))
        names.append(f"{info['Model']} ({f'presets {presets}' if presets else 'no presets'})")
    return Check("camera", "ok", f"Pi cameras: {', '.join(names)}.")


def check_webcams(devices: Sequence[Device], open_with: OpenCamera = open_camera) -> list[Check]:
    """Two seconds of each webcam in its usual mode, as the app opens it: its light, its rate, its automatic modes."""
    found = []
    for device in devices:
        if device.problem:
            found.append(Check("webcam", "unknown", f"{device.path}: {device.problem}"))
            continue
        mode = device.mode
        settings = CameraSettings(width=mode.width, height=mode.height, fps=mode.fps, exposure_us=0.5 * 1e6 / mode.fps)
        try:
            camera = open_with(device.path, settings, NodeClock())
            try:
                troubles = watch_camera(camera, mode.fps)
            finally:
                camera.close()
        except CameraError as exc:
            found.append(Check("webcam", "error", f"{exc}"))
            continue
        well = Check("webcam", "ok", f"bright enough for {mode.fps:g} frames/s.")
        found += [replace(check, text=f"{device.path}: {check.text}") for check in troubles or [well]]
    return found


def check_compiled(caches: list[Path]) -> Check:
    """Whether the next start has to compile."""
    if any(is_compiled_in(cache) for cache in caches):
        return Check("compiled", "ok", "The numerical code is compiled: the node starts within seconds.")
    return Check("compiled", "warning", "The numerical code is not compiled yet: the next start takes minutes, once.",
                 "Start the node and wait until it is ready; `rhot-node install` does so.")


def check_settings(machine: Machine, path: Path | None) -> list[Check]:
    """The settings file, and whom the node trusts."""
    if path is None:
        path = machine.root / (STATE_FOLDER / "node.json").relative_to("/")
        if not path.exists():
            return []
    try:
        settings = load_settings(path)
    except NodeError as exc:
        return [Check("settings", "error", f"{exc}")]
    return [Check("settings", "ok", f"{path}: node {settings.node_id}, {settings.name}."),
            _check_trust(path, settings), *check_landmarks(settings)]


def check_landmarks(settings: NodeSettings, open_with: OpenNetworks | None = None) -> list[Check]:
    """The hand networks, where the settings ask for them: whether they can be used, and the rate to expect."""
    model = network_model(settings.detector)
    if model is None:
        return []
    import numpy as np

    from rhot_node.landmarks.networks import SEARCH_EVERY
    from rhot_node.landmarks.runtime import LITERT, best_runtime
    camera = settings.camera
    try:
        networks = (open_networks if open_with is None else open_with)(model)
        search_s, hand_s = networks.cost_s(np.zeros((camera.height, camera.width, 3), np.uint8))
    except KeypointError as exc:
        return [Check("landmarks", "error", f"{exc}")]
    runtime = best_runtime()
    hz = 1.0 / (hand_s + search_s / SEARCH_EVERY)
    text = (f"Hand networks ({model}, {'LiteRT' if runtime == LITERT else 'OpenCV'}): {1e3 * hand_s:.0f} ms an image "
            f"with one hand, {2e3 * hand_s:.0f} ms with two, and {1e3 * search_s:.0f} ms to search for one. Expect "
            f"landmarks of a hand in up to {min(hz, camera.fps):.0f} of {camera.fps:.0f} images a second.")
    if hz >= camera.fps:
        return [Check("landmarks", "ok", text)]
    faster = [] if runtime == LITERT else ["install LiteRT (pip install 'rhot[landmarks]')"]
    faster += [] if model == "lite" else ['set "detector" to "landmarks:lite"']
    remedy = " or ".join(faster) or "lower camera.fps to save the other images' work"
    return [Check("landmarks", "warning", text, f"{remedy[:1].upper()}{remedy[1:]}.")]


def check_service(machine: Machine) -> list[Check]:
    """The system service, where systemd knows of one."""
    shown = machine.run(["systemctl", "show", NAME, "--property=LoadState,ActiveState,NRestarts"]) or ""
    state = dict(line.split("=", 1) for line in shown.splitlines() if "=" in line)
    if state.get("LoadState") != "loaded":
        return []
    active, restarts = state.get("ActiveState", "unknown"), state.get("NRestarts", "0")
    look = f"`journalctl -u {NAME} -n 50` has its words."
    if active != "active":
        service = Check("service", "error", f"The service is {active}, restarted {restarts} times.", look)
    elif restarts != "0":
        service = Check("service", "warning", f"The service runs, but had to be restarted {restarts} times.", look)
    else:
        service = Check("service", "ok", "The service runs.")
    return [service, check_memory_limit(machine.limits_memory())]


def _check_trust(path: Path, settings: NodeSettings) -> Check:
    pair = f"`rhot-node pair --settings {path}` shows a code; enter it in the app."
    if settings.trust == "open":
        return Check("pairing", "warning", "The node is open: whoever reaches it may see its pictures and steer it.",
                     'Set "trust" to "paired", restart the node, and pair it.')
    if not keys_path(path).exists():
        return Check("pairing", "warning", "The node is not paired with a master yet.", pair)
    try:
        masters = NodeTrust(keys_path(path)).masters
    except TrustError as exc:
        return Check("pairing", "warning", f"{exc}", "A service's keys are its own: "
                     "`sudo -u rhot-node /opt/rhot/bin/rhot-node doctor`.")
    if not masters:
        return Check("pairing", "warning", "The node is not paired with a master yet.", pair)
    return Check("pairing", "ok", f"Paired with {', '.join(master.name for master in masters)}.")
