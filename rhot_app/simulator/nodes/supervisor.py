"""Keeps the live twin's node daemons alive, on the ports that they had first."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

import msgspec

from rhot_app.simulator.nodes.nodes import NodePorts, TwinNode, settings_path
from rhot_app.simulator.scene.scene import Scene, node_settings
from rhot_node.config import load_settings
from rhot_node.errors import SettingsError

_RESTART_PAUSE_S = 0.5


class Supervisor:
    """Keeps one daemon per camera alive, on the ports it had first."""

    def __init__(self, scene: Scene, directory: Path) -> None:
        self._scene, self._directory = scene, directory
        self._nodes = [self._start(index, None) for index in range(len(scene.names))]
        self._ports: list[NodePorts] = []
        self._died_s: dict[int, float] = {}

    def _start(self, index: int, ports: NodePorts | None) -> TwinNode:
        """A daemon; one that starts again keeps what its settings file says by now, as a real node does."""
        name = self._scene.names[index]
        settings = node_settings(self._scene, index, ports=ports)
        if ports is not None:
            with contextlib.suppress(SettingsError):
                kept = load_settings(settings_path(self._directory, name))
                settings = msgspec.structs.replace(kept, udp_port=ports.udp_port, control_port=ports.control_port,
                                                   preview_port=ports.preview_port,
                                                   pairing_port=ports.pairing_port)
        return TwinNode(self._directory, settings, f"stream:{socket_path(self._directory, name)}")

    def ports(self, deadline_s: float) -> list[NodePorts] | None:
        """The daemons' ports, once all have said them; None before. Raises SimulatorError when one cannot start."""
        while len(self._ports) < len(self._nodes):
            node = self._nodes[len(self._ports)]
            if not node.ready_waits and node.alive and time.monotonic() < deadline_s:
                return None
            self._ports.append(node.wait_ready(deadline_s))
        return self._ports

    def step(self) -> None:
        """Start again what has died, a moment later."""
        for index, node in enumerate(self._nodes):
            if node.alive:
                continue
            died = self._died_s.setdefault(index, time.monotonic())
            if time.monotonic() - died >= _RESTART_PAUSE_S:
                node.close()
                self._nodes[index] = self._start(index, self._ports[index])
                del self._died_s[index]

    def close(self) -> None:
        """End every daemon."""
        for node in self._nodes:
            node.close()


def socket_path(directory: Path, name: str) -> Path:
    """Where the frames of the camera `name` are offered."""
    return directory / f"{name}.frames"
