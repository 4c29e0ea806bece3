"""Real ``rhot-node`` daemons as the twin's nodes: started with their own settings, clocks and cameras, ended by id."""

from __future__ import annotations

import contextlib
import json
import os
import select
import selectors
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO

from rhot_app.errors import SimulatorError
from rhot_app.keys import load_master_keys
from rhot_app.simulator.scene.scene import NodePorts
from rhot_node.config import NodeSettings, save_settings
from rhot_node.keys import keys_path, pair_beforehand

READY_TIMEOUT_S = 300.0
"""The first start of all compiles the detector, minutes on a busy machine; later ones take about two seconds."""

_END_TIMEOUT_S = 3.0
_CLOSING_S = 0.5


class TwinNode:
    """One daemon process. Its settings, log and ready line are in `directory`; ports of 0 are taken as they come.

    The daemon ends with this process, whatever happens to it.
    """

    def __init__(self, directory: Path, settings: NodeSettings, camera: str) -> None:
        """Start the daemon, paired with this master unless it is open; `wait_ready` tells when it can be used. Raises
        SimulatorError, TrustError, OSError."""
        self.name = settings.name
        self._settings_path = settings_path(directory, settings.name)
        self.log_path = directory / f"{settings.name}.log"
        save_settings(self._settings_path, settings)
        self._public_key = "" if settings.trust == "open" else pair_beforehand(
            keys_path(self._settings_path), load_master_keys().me)
        with self.log_path.open("ab") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "rhot_node", "--settings", str(self._settings_path), "--camera", camera,
                 "--exit-with-parent"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log)
        self._ports: NodePorts | None = None

    @property
    def pid(self) -> int:
        """Process id of the daemon."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the daemon still runs."""
        return self._process.poll() is None

    @property
    def ready_waits(self) -> bool:
        """Whether the ready line (or the end of the pipe) can be read without waiting."""
        return self._process.stdout is not None and bool(select.select([self._process.stdout], [], [], 0.0)[0])

    def wait_ready(self, deadline_s: float) -> NodePorts:
        """The daemon's ports once it says that it is ready; `deadline_s` is monotonic time.

        Raises SimulatorError with the daemon's last words when it ends or says nothing in time.
        """
        if self._ports is None:
            line = _read_line(self._process.stdout, deadline_s)
            if line is None:
                raise SimulatorError(self._why_not_ready())
            try:
                ready = json.loads(line)
                self._ports = NodePorts(ready["udp_port"], ready["control_port"], ready["preview_port"],
                                        ready["pairing_port"], self._public_key)
            except (ValueError, KeyError) as exc:
                raise SimulatorError(f"the simulated node {self.name} said {line!r} instead of its ports.") from exc
        return self._ports

    def _why_not_ready(self) -> str:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_CLOSING_S)  # the pipe of one that ends closes a moment before
        if not self.alive:
            return f"the simulated node {self.name} ended before it was ready: {self._last_words()}"
        return (f"the simulated node {self.name} was not ready in time: compiling its detector takes minutes where "
                f"others need the processors as well. What is compiled is kept; start again (log: {self.log_path}).")

    def _last_words(self) -> str:
        with contextlib.suppress(OSError):
            lines = self.log_path.read_text(errors="replace").strip().splitlines()
            if lines:
                return f"{lines[-1]} (whole log: {self.log_path})"
        return f"it wrote nothing to {self.log_path}."

    def close(self) -> None:
        """Ask the daemon to end, and insist after a few seconds. May be called twice."""
        if self.alive:
            self._process.terminate()
            try:
                self._process.wait(_END_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()


def settings_path(directory: Path, name: str) -> Path:
    """The settings file of the daemon of this name."""
    return directory / f"{name}.node.json"


def _read_line(stream: IO[bytes] | None, deadline_s: float) -> bytes | None:
    """One line of a pipe; None when it closes or nothing complete came before the deadline."""
    if stream is None:
        return None
    handle, line = stream.fileno(), b""
    with selectors.DefaultSelector() as selector:
        selector.register(handle, selectors.EVENT_READ)
        while not line.endswith(b"\n"):
            if not selector.select(max(0.0, deadline_s - time.monotonic())):
                return None
            chunk = os.read(handle, 4096)
            if not chunk:
                return None
            line += chunk
    return line


class TwinNodes:
    """All daemons of a twin, started together and ended together. A context manager."""

    def __init__(self, directory: Path, settings: Sequence[NodeSettings], cameras: Sequence[str]) -> None:
        """Start one daemon per settings and camera spec and wait until all are ready.

        Raises SimulatorError when one cannot; the others are then ended.
        """
        directory.mkdir(parents=True, exist_ok=True)
        self.nodes: list[TwinNode] = []
        try:
            self.nodes.extend(TwinNode(directory, one, camera) for one, camera in zip(settings, cameras, strict=True))
            deadline = time.monotonic() + READY_TIMEOUT_S
            self.ports = [node.wait_ready(deadline) for node in self.nodes]
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End every daemon. May be called twice."""
        for node in self.nodes:
            node.close()

    def __enter__(self) -> TwinNodes:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()
