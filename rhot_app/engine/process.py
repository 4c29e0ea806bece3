"""Engine and node processes that an app starts: found again by a later app, and ended by their own ids only.

``session.json`` in the engine's directory lists every process with its start time, so that a number that the system
has given to another process since is never signalled.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import msgspec

from rhot_app.engine.client import EngineClient
from rhot_app.engine.directory import EngineDirectory, lock_holder, open_directory
from rhot_app.errors import EngineError
from rhot_node.files import decode_message, read_input, write_document
from rhot_node.terminal import before

START_TIMEOUT_S = 240.0
"""The first start of all compiles the tracker, on a slow or busy machine for minutes; later ones take seconds."""

_END_TIMEOUT_S = 3.0


class StartedProcess(msgspec.Struct, frozen=True):
    """One process that the app has started. `started_ticks` is its start time as the kernel counts it."""

    pid: int
    started_ticks: int
    role: str  # "engine", "node left", ...


class _Session(msgspec.Struct):
    processes: list[StartedProcess] = []


def start_ticks(pid: int) -> int | None:
    """When a process started, in the kernel's ticks since boot; None when there is none (a zombie is none)."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return None
    return None if fields[0] in (b"Z", b"X") else int(fields[19])


def started_processes(directory: EngineDirectory) -> list[StartedProcess]:
    """The processes that apps have started here and that still live."""
    try:
        session = decode_message(read_input(directory.session_file), _Session)
    except (OSError, msgspec.MsgspecError):
        return []
    return [process for process in session.processes if start_ticks(process.pid) == process.started_ticks]


def remember_process(directory: EngineDirectory, pid: int, role: str) -> StartedProcess:
    """Note a process just started, so that `end_started` of this or a later app ends it."""
    ticks = start_ticks(pid)
    if ticks is None:
        raise EngineError(f"{role}: process {pid} has ended already.")
    process = StartedProcess(pid, ticks, role)
    write_document(directory.session_file, _Session([*started_processes(directory), process]))
    return process


def end_started(directory: EngineDirectory, roles: Sequence[str] | None = None,
                timeout_s: float = _END_TIMEOUT_S) -> None:
    """End every process that apps have started here (or those of `roles`), asking first, and forget them."""
    processes = started_processes(directory)
    chosen = [process for process in processes if roles is None or process.role in roles]
    end_processes(chosen, timeout_s)
    kept = [process for process in processes if process not in chosen]
    if kept:
        write_document(directory.session_file, _Session(kept))
    else:
        directory.session_file.unlink(missing_ok=True)


def end_processes(processes: Sequence[StartedProcess], timeout_s: float = _END_TIMEOUT_S) -> None:
    """Ask the processes to end (SIGTERM), wait for them together, and kill those that do not."""
    handles: list[int] = []
    for process in processes:
        handle = _open_verified(process)
        if handle is not None:
            handles.append(handle)
            signal.pidfd_send_signal(handle, signal.SIGTERM)
    deadline = time.monotonic() + timeout_s
    for handle in handles:
        if not _ended(handle, max(0.0, deadline - time.monotonic())):
            with contextlib.suppress(ProcessLookupError):
                signal.pidfd_send_signal(handle, signal.SIGKILL)
            _ended(handle, timeout_s)
        os.close(handle)
    for process in processes:  # our own children leave a zombie until somebody asks for them
        with contextlib.suppress(ChildProcessError, OSError):
            os.waitpid(process.pid, os.WNOHANG)


def _open_verified(process: StartedProcess) -> int | None:
    """A handle on exactly this process: opened first, compared then, so that its number cannot change hands."""
    try:
        handle = os.pidfd_open(process.pid)
    except OSError:
        return None
    if start_ticks(process.pid) == process.started_ticks:
        return handle
    os.close(handle)
    return None


def _ended(handle: int, timeout_s: float) -> bool:
    poller = select.poll()
    poller.register(handle, select.POLLIN)
    return bool(poller.poll(round(1e3 * timeout_s)))


def running_engine(directory: Path | None = None) -> int | None:
    """Process id of the engine that runs in `directory`; None when none does."""
    return lock_holder(open_directory(directory))


def ensure_engine(rig_path: Path, directory: Path | None = None, *, start: bool = False, resume: bool = False,
                  timeout_s: float = START_TIMEOUT_S) -> int:
    """Find the engine in `directory`, or start one on `rig_path` in the background; returns its process id.

    An engine that runs already keeps its own rig. `start` has a new one tell the nodes to stream at once; with
    `resume` it continues what the one before did. It ends when nobody uses it. Raises EngineError with the engine's
    own words when it does not come up.
    """
    place = open_directory(directory)
    pid = lock_holder(place)
    if pid is None:
        pid = _spawn(rig_path, place, start, resume)
    deadline = time.monotonic() + timeout_s
    with EngineClient(place.path, states=False) as client:
        while time.monotonic() < deadline:
            with contextlib.suppress(EngineError):
                return int(client.command("hello", timeout_s=0.2)["pid"])
            if start_ticks(pid) is None:
                raise EngineError(f"the engine did not start: {_last_words(place)}")
    raise EngineError(f"the engine (pid {pid}) did not answer within {timeout_s:g} s; see {place.log_file}.")


def stop_engine(directory: Path | None = None) -> None:
    """End the engine in `directory`, started by whomever; returns when it has ended. Nothing happens without one."""
    place = open_directory(directory)
    pid = lock_holder(place)
    ticks = None if pid is None else start_ticks(pid)
    if pid is not None and ticks is not None:
        end_processes([StartedProcess(pid, ticks, "engine")])


def _spawn(rig_path: Path, place: EngineDirectory, start: bool, resume: bool) -> int:
    command = [sys.executable, "-m", "rhot_app", "engine", "--rig", str(rig_path.absolute()), "--unchecked",
               "--end-unused", "--directory", str(place.path), *(["--start"] if start else []),
               *(["--resume"] if resume else [])]
    with contextlib.suppress(OSError):
        place.log_file.replace(before(place.log_file))
    with place.log_file.open("ab") as log:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)
    with contextlib.suppress(EngineError):
        remember_process(place, process.pid, "engine")
    return process.pid


def _last_words(place: EngineDirectory) -> str:
    try:
        lines = place.log_file.read_text(errors="replace").strip().splitlines()
    except OSError:
        lines = []
    return lines[-1] if lines else f"it said nothing; see {place.log_file}."
