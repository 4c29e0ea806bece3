"""Starts RHOT's programs at once, as forks of a server process that has imported them and loaded compiled code.

In a room whose conftest imports `forked_programs`, this is how subprocess starts ``python -m rhot_app ...`` and
``python -m rhot_node ...``. A test that uses `fresh_programs` starts them as users do.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import gc
import importlib
import json
import multiprocessing
import os
import pkgutil
import runpy
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import pytest

PRELOADED = {"rhot_app": ("rhot_app.engine", "rhot_app.outputs", "rhot_app.sources", "rhot_app.tracking"),
             "rhot_node": ("rhot_node",)}
"""Packages that a server imports with all their modules, by the package of its programs."""

WORKERS = ("rhot_app.export.batch", "rhot_app.export.process", "rhot_app.simulator.film.film")
"""Modules that the fork server of multiprocessing imports."""

Popen = subprocess.Popen
get_context = multiprocessing.get_context
SERVER_ENVIRONMENT = dict(os.environ)
PR_SET_CHILD_SUBREAPER = 36  # linux/prctl.h
MESSAGE_BYTES = 1 << 17
ADOPTED = b"adopted"


@pytest.fixture(scope="module", autouse=True)
def forked_programs() -> Iterator[None]:
    """subprocess forks RHOT's programs, and multiprocessing forks its processes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(subprocess, "Popen", ForkingPopen)
        patch.setattr(multiprocessing, "get_context", forking_context)
        yield


@pytest.fixture
def fresh_programs(monkeypatch: pytest.MonkeyPatch) -> None:
    """subprocess starts all programs in new interpreters, as it does outside of tests."""
    monkeypatch.setattr(subprocess, "Popen", Popen)


def forking_context(method: str | None = None) -> Any:
    """multiprocessing.get_context with a fork server that has imported `WORKERS` in place of "spawn"."""
    context: Any = get_context("forkserver" if method == "spawn" else method)
    if method == "spawn":
        context.set_forkserver_preload(list(WORKERS))
    return context


class ForkingPopen(Popen):
    """subprocess.Popen that has a server fork ``python -m MODULE ...`` of RHOT; the fork becomes a child of this one.

    The server's modules read the environment when they were imported. So a program with another cache of compiled code
    starts in a new interpreter.
    """

    def _execute_child(self, args: Any, executable: Any, preexec_fn: Any, close_fds: bool,
                       pass_fds: Sequence[int], cwd: Any, env: Any, startupinfo: Any, creationflags: int, shell: bool,
                       p2cread: int, p2cwrite: int, c2pread: int, c2pwrite: int, errread: int, errwrite: int,
                       *more: Any) -> None:
        pipes = p2cread, p2cwrite, c2pread, c2pwrite, errread, errwrite
        words = [args] if isinstance(args, str | bytes | os.PathLike) else [os.fspath(arg) for arg in args]
        package = words[2].partition(".")[0] if words[:2] == [sys.executable, "-m"] else ""
        environment = dict(os.environ if env is None else env)
        has_own_cache = environment.get("NUMBA_CACHE_DIR") != SERVER_ENVIRONMENT.get("NUMBA_CACHE_DIR")
        if package not in PRELOADED or preexec_fn is not None or pass_fds or has_own_cache:
            super()._execute_child(args, executable, preexec_fn, close_fds, pass_fds, cwd, env, startupinfo,
                                   creationflags, shell, *pipes, *more)
            return
        request = {"module": words[2], "arguments": words[3:], "folder": str(Path(cwd or ".").resolve()),
                   "environment": environment, "new_session": more[5]}
        streams = [number if stream == -1 else stream for number, stream in enumerate((p2cread, c2pwrite, errwrite))]
        try:
            self.pid = start(_server(package)[0], json.dumps(request).encode(), streams)
        finally:
            self._close_pipe_fds(*pipes)
        self._child_created = True


@cache
def _server(package: str) -> tuple[socket.socket, subprocess.Popen[bytes]]:
    """The socket and the process of a package's server, which ends when the socket is closed."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        process = Popen([sys.executable, __file__, package, str(theirs.fileno())], stdin=subprocess.DEVNULL,
                        stdout=subprocess.DEVNULL, env=SERVER_ENVIRONMENT, pass_fds=[theirs.fileno()])
    return ours, process


def start(server: socket.socket, request: bytes, streams: Sequence[int]) -> int:
    """Start a program with these standard streams; returns its process id.

    The server forks twice. When the intermediate process ends, this process, a subreaper, adopts the program.
    """
    prctl = ctypes.CDLL(None).prctl
    prctl(PR_SET_CHILD_SUBREAPER, 1)
    try:
        socket.send_fds(server, [request], streams)
        pid = int(server.recv(MESSAGE_BYTES))
        server.recv(MESSAGE_BYTES)  # ADOPTED
    finally:
        prctl(PR_SET_CHILD_SUBREAPER, 0)
    return pid


def serve(tests: socket.socket) -> dict[str, Any]:
    """Fork for each request; returns the request in the fork. Ends when `tests` is closed."""
    while True:
        request, streams, _, _ = socket.recv_fds(tests, MESSAGE_BYTES, 3)
        if not request:
            os._exit(0)
        ready, adopted = os.pipe()  # the program waits for the end of file, which comes once it is adopted
        intermediate = os.fork()
        if intermediate == 0:
            pid = os.fork()
            if pid != 0:
                tests.send(str(pid).encode())
                os._exit(0)
            tests.close()
            os.close(adopted)
            os.read(ready, 1)
            os.close(ready)
            for number, stream in enumerate(streams):
                os.dup2(stream, number)
                os.close(stream)
            return dict(json.loads(request))
        os.waitpid(intermediate, 0)
        tests.send(ADOPTED)
        for descriptor in (*streams, ready, adopted):
            os.close(descriptor)


def preload(package: str) -> None:
    """Import the modules of a package's programs, and load compiled code."""
    if package == "rhot_node":
        sys.modules["scipy"] = None  # as the program itself does first
    for name in PRELOADED[package]:
        for module in pkgutil.walk_packages(importlib.import_module(name).__path__, f"{name}."):
            importlib.import_module(module.name)
    if package == "rhot_node":
        from rhot_node.config import load_settings
        from rhot_node.detectors import make_detector
        from rhot_node.files import resource_path
        make_detector(load_settings(resource_path("nodes", "left.json")))
    else:
        from rhot_app.engine.pipeline import warm_up
        from rhot_app.project import load_rig
        from rhot_app.tracking.scene import make_tracker
        from rhot_node.files import resource_path
        rig = load_rig(resource_path("rigs", "two_pis.json"))
        warm_up(make_tracker(rig), rig)


def main() -> None:
    """Serve a package; in each fork run a program."""
    code: Any = 1

    def leave() -> None:  # the last exit handler: clearing the modules would take long
        with contextlib.suppress(OSError):
            sys.stdout.flush()
        os._exit(code)

    atexit.register(leave)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.path[0] = str(Path(__file__).parents[1])
    package, descriptor = sys.argv[1:]
    preload(package)
    gc.collect()
    gc.freeze()
    request = serve(socket.socket(fileno=int(descriptor)))
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if request["new_session"]:
        os.setsid()
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    module = request["module"]
    sys.argv = ["", *request["arguments"]]
    sys.path[:1] = [request["folder"], *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]
    for name in (module, f"{module}.__main__"):
        sys.modules.pop(name, None)  # else runpy warns of a module that is imported already
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
        code = 0
    except SystemExit as exit:
        code = exit.code if isinstance(exit.code, int) else int(exit.code is not None)
        raise  # the interpreter prints a sentence in place of a code


if __name__ == "__main__":
    main()
