"""A workbench for end-to-end tests: two nodes, an engine and its client on this machine, each in its own process."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
from patience import PATIENCE_S
from shipped_markers import RHOT6
from shipped_rig import RIGHT_HAND

from rhot_app.engine.client import EngineClient
from rhot_app.engine.status import NodeStatus, Published
from rhot_app.keys import load_master_keys
from rhot_app.project import Broadcast, CameraPose, Intrinsics, Rig, RigNode, save_rig
from rhot_app.state import HandState
from rhot_node.config import ClockSettings, NodeSettings, save_settings
from rhot_node.keys import keys_path, pair_beforehand

BASELINE_M = 0.075
WIDTH, HEIGHT, FPS = 640, 480, 40.0
FOCAL_PX = 530.0
CLOCKS = (ClockSettings(offset_s=1234.5, drift_ppm=40.0), ClockSettings(offset_s=-77.25, drift_ppm=-25.0))
START_S = 150.0  # seconds; after a change of the tracker its first start compiles it, beside other tests
TEST_S = 300.0  # of a whole test, when it comes to that


@dataclass
class Bench:
    """The folder of one test, its rig of paired nodes, and the processes that the test has started."""

    folder: Path
    processes: list[subprocess.Popen[bytes]] = field(default_factory=list)
    rig: Rig = field(init=False)

    def __post_init__(self) -> None:
        rig = make_rig(free_ports(11))
        keys = [pair_beforehand(keys_path(self.settings_path(node)), load_master_keys().me) for node in rig.nodes]
        self.rig = with_keys(rig, keys)
        self.save()

    @property
    def rig_path(self) -> Path:
        """The rig file."""
        return self.folder / "rig.json"

    @property
    def sockets(self) -> Path:
        """The engine's private directory."""
        return self.folder / "engine"

    def save(self) -> None:
        """Write the rig and each node's settings."""
        save_rig(self.rig_path, self.rig)
        for node, clock in zip(self.rig.nodes, CLOCKS, strict=True):
            save_settings(self.settings_path(node), NodeSettings(
                node_id=node.node_id, name=node.name, markers=self.rig.markers, bind_address="127.0.0.1",
                udp_port=node.udp_port, control_port=node.control_port, preview_port=node.preview_port,
                pairing_port=node.pairing_port, broadcast_port=None, clock=clock))

    def settings_path(self, node: RigNode) -> Path:
        """The settings file of a node."""
        return self.folder / f"{node.name}.json"

    def allow_text(self) -> None:
        """Let every node of the rig speak the thesis's text datagrams."""
        self.rig = msgspec.structs.replace(self.rig, nodes=tuple(
            msgspec.structs.replace(node, text_datagrams=True, public_key="") for node in self.rig.nodes))
        self.save()

    def start_node(self, index: int, camera: str) -> subprocess.Popen[bytes]:
        """A node in its own process; what it says goes to NAME.log."""
        node = self.rig.nodes[index]
        return self.start(["rhot_node", "--settings", str(self.settings_path(node)), "--camera", camera, "--loop"],
                          node.name)

    def start_engine(self, *arguments: str) -> subprocess.Popen[bytes]:
        """The engine in its own process; what it says goes to engine.log."""
        return self.start(["rhot_app", "engine", "--rig", str(self.rig_path), "--directory", str(self.sockets),
                           *arguments], "engine")

    def start(self, module_and_arguments: Sequence[str], name: str) -> subprocess.Popen[bytes]:
        """``python -m MODULE ARGUMENTS...``; its output is appended to NAME.log."""
        return self._spawn(["-m", *module_and_arguments], name)

    def start_code(self, code: str, *arguments: str, name: str) -> subprocess.Popen[bytes]:
        """``python -c CODE ARGUMENTS...``; its output is appended to NAME.log."""
        return self._spawn(["-c", code, *arguments], name)

    def log(self, name: str) -> str:
        """Everything that a process has said so far."""
        return (self.folder / f"{name}.log").read_text(errors="replace")

    def clear(self) -> None:
        """End all processes: politely first. Fails the test when one had to be killed or ends with another code."""
        running = [process for process in self.processes if process.poll() is None]
        for process in running:
            process.terminate()
        for process in running:
            if not ends(process, PATIENCE_S):
                process.kill()
                process.wait()
        codes = {str(process.args[2:4]): process.returncode for process in running}
        assert not any(codes.values()), f"did not end well when asked: {codes}"

    def _spawn(self, arguments: Sequence[str], name: str) -> subprocess.Popen[bytes]:
        with (self.folder / f"{name}.log").open("ab") as log:
            process = subprocess.Popen([sys.executable, *arguments], stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self.processes.append(process)
        return process


def ends(process: subprocess.Popen[bytes], timeout_s: float) -> bool:
    """Whether the process ends within this time."""
    try:
        process.wait(timeout_s)
    except subprocess.TimeoutExpired:
        return False
    return True


def make_rig(ports: Sequence[int]) -> Rig:
    """Two cameras 75 mm apart on this machine; the rig frame is the left one. `ports`: eleven free ones."""
    nodes = tuple(RigNode(
        node_id=index + 1, name=name, intrinsics=Intrinsics(WIDTH, HEIGHT, FOCAL_PX, FOCAL_PX, 319.5, 239.5),
        pose=CameraPose(translation_m=(BASELINE_M * index, 0.0, 0.0)), udp_port=ports[4 * index],
        control_port=ports[4 * index + 1], preview_port=ports[4 * index + 2], data_port=ports[4 * index + 3],
        pairing_port=ports[9 + index])
        for index, name in enumerate(("left", "right")))
    return Rig(name="bench", nodes=nodes, markers=RHOT6, hand=RIGHT_HAND,
               broadcast=Broadcast("127.255.255.255", ports[8]))


def with_keys(rig: Rig, keys: Sequence[str]) -> Rig:
    """The rig with a public key for each node."""
    return msgspec.structs.replace(rig, nodes=tuple(
        msgspec.structs.replace(node, public_key=key) for node, key in zip(rig.nodes, keys, strict=True)))


def free_ports(count: int) -> list[int]:
    """Different ports that are free for TCP and UDP at this moment."""
    with contextlib.ExitStack() as stack:
        ports: list[int] = []
        while len(ports) < count:
            tcp = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_STREAM))
            udp = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            tcp.bind(("127.0.0.1", 0))
            with contextlib.suppress(OSError):
                udp.bind(("127.0.0.1", tcp.getsockname()[1]))
                ports.append(tcp.getsockname()[1])
        return ports


def wait_until(client: EngineClient, condition: Callable[[], bool], timeout_s: float, what: str) -> float:
    """Poll the client until `condition` holds; returns the seconds that took."""
    begun = time.monotonic()
    while not condition():
        passed = time.monotonic() - begun
        assert passed < timeout_s, f"{what}: not within {timeout_s:g} s; status {client.status}"
        client.poll(0.01)
    return time.monotonic() - begun


def node_status(client: EngineClient, name: str) -> NodeStatus | None:
    """The engine's newest word on a node."""
    if client.status is None:
        return None
    return next((node for node in client.status.nodes if node.name == name), None)


def streams(client: EngineClient, name: str) -> bool:
    """Whether the engine says that a node streams."""
    status = node_status(client, name)
    return status is not None and status.state == "streaming" and status.rate_hz > 0.0


def tracks(client: EngineClient) -> bool:
    """Whether both nodes stream and a state describes the last moment."""
    return (streams(client, "left") and streams(client, "right") and client.state is not None
            and time.monotonic_ns() - client.state.t_master_ns < 300_000_000)


def messages_of(client: EngineClient, seconds: float) -> list[Published]:
    """Everything that arrives within this time."""
    messages: list[Published] = []
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        messages += client.poll(min(left, 0.05))
    return messages


def states_of(client: EngineClient, seconds: float) -> list[HandState]:
    """All hand states that arrive within this time."""
    return [message for message in messages_of(client, seconds) if isinstance(message, HandState)]


def kill_hard(process: subprocess.Popen[bytes]) -> None:
    """kill -9, by its own id."""
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
