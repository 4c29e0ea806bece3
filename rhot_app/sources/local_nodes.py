"""``rhot-node`` daemons of this computer: started with their settings, keys and cameras, kept alive, ended by id."""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import json
import logging
import os
import select
import selectors
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import msgspec

from rhot_app.errors import RhotError, SourceError
from rhot_app.keys import load_master_keys
from rhot_node.config import NodeSettings, load_settings, save_settings
from rhot_node.errors import NodeError, SettingsError, system_sentence
from rhot_node.keys import keys_path, pair_beforehand
from rhot_node.terminal import cut_log, log_to_stderr
from rhot_node.threads import ANSWER_S

log = logging.getLogger(__name__)

READY_TIMEOUT_S = 300.0
"""The first start of all compiles the detector, minutes on a busy machine; later ones take about two seconds."""

_CLOSING_S = 0.5


@dataclass(frozen=True, slots=True)
class NodePorts:
    """The ports that a daemon said it listens on, its public key if it is paired with this master, and the (width,
    height) px of its pictures."""

    udp_port: int
    control_port: int
    preview_port: int
    pairing_port: int = 0
    public_key: str = ""
    size: tuple[int, int] = (0, 0)


class LocalNode:
    """One daemon process. Its settings, log and ready line are in `directory`; ports of 0 are taken as they come.

    The daemon ends with this process, whatever happens to it.
    """

    def __init__(self, directory: Path, settings: NodeSettings, camera: str, *, loop: bool = False) -> None:
        """Start the daemon, paired with this master unless it is open; `wait_ready` tells when it can be used. `loop`:
        a film begins again when it ends. Raises TrustError, OSError."""
        self.name = settings.name
        self._settings_path = settings_path(directory, settings.name)
        self.log_path = directory / f"{settings.name}.log"
        save_settings(self._settings_path, settings)
        self._public_key = "" if settings.trust == "open" else pair_beforehand(
            keys_path(self._settings_path), load_master_keys().me)
        with self.log_path.open("ab") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "rhot_node", "--settings", str(self._settings_path), "--camera", camera,
                 "--exit-with-parent", *(["--loop"] if loop else [])],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log)
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

        Raises SourceError with the daemon's last words when it ends or says nothing in time.
        """
        if self._ports is None:
            line = _read_line(self._process.stdout, deadline_s)
            if line is None:
                raise SourceError(self._why_not_ready())
            try:
                ready = json.loads(line)
                self._ports = NodePorts(ready["udp_port"], ready["control_port"], ready["preview_port"],
                                        ready["pairing_port"], self._public_key, (ready["width"], ready["height"]))
            except (ValueError, KeyError) as exc:
                raise SourceError(f"the node {self.name} said {line!r} instead of its ports.") from exc
        return self._ports

    def _why_not_ready(self) -> str:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_CLOSING_S)  # the pipe of one that ends closes a moment before
        if not self.alive:
            return f"the node {self.name} ended before it was ready: {self.last_words()}"
        return (f"the node {self.name} was not ready in time: compiling its detector takes minutes where "
                f"others need the processors as well. What is compiled is kept; start again (log: {self.log_path}).")

    def last_words(self) -> str:
        """The last line of its log, and where that is."""
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
                self._process.wait(ANSWER_S)
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
            chunk = os.read(handle, select.PIPE_BUF)
            if not chunk:
                return None
            line += chunk
    return line


# -- supervision -------------------------------------------------------------------------------------------------------

POLL_S = 0.05
_RESTART_PAUSE_S = 0.5
_LONGEST_PAUSE_S = 8.0
"""Between two starts of a daemon that ends before it is ready, as while its camera is unplugged; the pause doubles."""


class NodeSupervisor:
    """Keeps one daemon per camera alive, on the ports it had first."""

    def __init__(self, directory: Path, settings: Sequence[NodeSettings], cameras: Sequence[str], *,
                 loop: bool = False) -> None:
        """Start one daemon per settings and camera spec. Raises TrustError, OSError."""
        directory.mkdir(mode=stat.S_IRWXU, parents=True, exist_ok=True)
        self._directory, self._settings, self._cameras, self._loop = directory, list(settings), list(cameras), loop
        self._ports: list[NodePorts] = []
        self._due_s: dict[int, float] = {}  # of daemons that are to be started again
        self._pauses_s = [_RESTART_PAUSE_S] * len(self._settings)
        self.nodes: list[LocalNode] = []
        try:
            for one, camera in zip(self._settings, self._cameras, strict=True):
                self.nodes.append(LocalNode(directory, one, camera, loop=loop))
        except BaseException:
            self.close()
            raise

    def ports(self, deadline_s: float) -> list[NodePorts] | None:
        """The daemons' ports, once all have said them; None before. Raises SourceError when one cannot start."""
        while len(self._ports) < len(self.nodes):
            node = self.nodes[len(self._ports)]
            if not node.ready_waits and node.alive and time.monotonic() < deadline_s:
                return None
            self._ports.append(node.wait_ready(deadline_s))
        return self._ports

    def wait_ready(self, meanwhile: Callable[[], object] = lambda: time.sleep(POLL_S)) -> list[NodePorts]:
        """The daemons' ports, once all have said them; `meanwhile` is done again and again. Raises SourceError when one
        cannot start."""
        deadline_s = time.monotonic() + READY_TIMEOUT_S
        while (ports := self.ports(deadline_s)) is None:
            meanwhile()
        return ports

    def step(self) -> list[int]:
        """Start again what has died, a moment later; returns the numbers of the daemons that were."""
        started = []
        for index, node in enumerate(self.nodes):
            cut_log(node.log_path)
            if node.alive:
                if node.ready_waits:
                    self._pauses_s[index] = _RESTART_PAUSE_S
                continue
            now_s = time.monotonic()
            if index not in self._due_s:
                if self._pauses_s[index] == _RESTART_PAUSE_S:
                    log.warning("the node %s has ended and is started again until it stays: %s", node.name,
                                node.last_words())
                self._due_s[index] = now_s + self._pauses_s[index]
                self._pauses_s[index] = min(2.0 * self._pauses_s[index], _LONGEST_PAUSE_S)
            elif now_s >= self._due_s[index]:
                del self._due_s[index]
                self.start_again(index)
                started.append(index)
        return started

    def start_again(self, index: int) -> None:
        """End a daemon if it runs, and start it with what its settings file says by now, as a real node does."""
        self.nodes[index].close()
        settings, ports = self._settings[index], self._ports[index]
        with contextlib.suppress(SettingsError):
            settings = load_settings(settings_path(self._directory, settings.name))
        settings = msgspec.structs.replace(settings, udp_port=ports.udp_port, control_port=ports.control_port,
                                           preview_port=ports.preview_port, pairing_port=ports.pairing_port)
        self.nodes[index] = LocalNode(self._directory, settings, self._cameras[index], loop=self._loop)

    def close(self) -> None:
        """End every daemon. May be called twice."""
        for node in self.nodes:
            node.close()


# -- the program that serves them --------------------------------------------------------------------------------------

def add_serve_arguments(parser: argparse.ArgumentParser) -> None:
    """``--while-locked`` of a program that serves nodes."""
    parser.add_argument("--while-locked", type=Path, metavar="FILE",
                        help="end when the program that started this one has ended and for half a minute no engine has "
                             "locked FILE")


def serve(work: Callable[[Callable[[], bool]], None], while_locked: Path | None) -> int:
    """Do `work`, given what tells that nobody uses it any more, until it ends or a signal comes. Returns the program's
    exit code: 2 after an error."""
    log_to_stderr()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        work((lambda: False) if while_locked is None else Use(while_locked).over)
    except (RhotError, NodeError) as exc:
        print(f"rhot: {exc}", file=sys.stderr)
        return 2
    except OSError as exc:
        print(f"rhot: {system_sentence(exc)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        pass
    return 0


# -- whether somebody uses them ----------------------------------------------------------------------------------------

UNUSED_S = 30.0
"""As long as an engine without clients goes on; one that crashed has been started again by then."""

_LOOK_S = 1.0


class Use:
    """Whether the program that started this one still runs, or an engine that has locked `lock_file`."""

    def __init__(self, lock_file: Path, unused_s: float = UNUSED_S) -> None:
        self._lock_file, self._unused_s = lock_file, unused_s
        self._parent = os.getppid()
        self._used_s = self._looked_s = time.monotonic()

    def over(self) -> bool:
        """Whether neither has run for `unused_s`; looks once a second."""
        now_s = time.monotonic()
        if now_s - self._looked_s >= _LOOK_S:
            self._looked_s = now_s
            if os.getppid() == self._parent or self._is_locked():
                self._used_s = now_s
        return now_s - self._used_s > self._unused_s

    def _is_locked(self) -> bool:
        try:
            with self._lock_file.open("rb") as file:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:
            return False
        return False
