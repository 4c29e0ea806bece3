"""Long work in a process of its own, so that it neither holds the window's interpreter nor outlives a cancel.

A thread would share the interpreter with the window: whatever a solver computes between two calls of numpy delays the
next turn of the window's timer. And a process can be ended, however deep in a library it is.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from typing import Any

from rhot_app.errors import CalibrationError
from rhot_app.progress import Progress
from rhot_app.ui.backend.solver_process import NICENESS
from rhot_app.ui.language import language, tr

_COMMAND = (sys.executable, "-m", "rhot_app.ui.backend.solver_process")
_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""More threads of a numerical library would take the cores that the engine and the nodes need."""

_END_S = 2.0


class StoppedError(CalibrationError):
    """The work was stopped on purpose."""


class Solver:
    """Runs one piece of work at a time. `run` waits, so call it in a worker; `stop` may be called from any thread."""

    def __init__(self, niceness: int = NICENESS) -> None:
        """`niceness` of the process; by default the window and the engine come first."""
        self._command = (*_COMMAND, str(niceness))
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None

    def prepare(self, module: str) -> None:
        """Start the process and have it import `module`, so that the work itself begins at once."""
        process = self._started()
        with contextlib.suppress(OSError, ValueError):
            _write(process, module)

    def run(self, function: Callable[..., Any], arguments: tuple[Any, ...], progress: Progress,
            options: Mapping[str, Any] | None = None) -> Any:
        """``function(*arguments, progress=..., **options)``, computed over there; its progress is passed on.

        Raises CalibrationError with the sentence of whatever error the work ended in, StoppedError after `stop`.
        """
        process = self._started()
        try:
            _write(process, (function, arguments, dict(options or {})))
            while True:
                assert process.stdout is not None
                kind, *rest = pickle.load(process.stdout)
                if kind == "progress":
                    progress(*rest)
                elif kind == "done":
                    return rest[0]
                else:
                    raise CalibrationError(str(rest[0]))
        except (EOFError, OSError, ValueError, pickle.UnpicklingError) as exc:
            with self._lock:
                stopped = self._process is not process
            self._end(process)
            if stopped:
                raise StoppedError("Stopped.") from exc
            raise CalibrationError(tr("The process that computes ended unexpectedly; try again. If it happens again, "
                                      "it may have run out of memory: use fewer pictures or a shorter "
                                      "recording.")) from exc
        except BaseException:  # whoever watches the progress wants no more of it
            self._end(process)
            raise

    def stop(self) -> None:
        """End the work under way, if any, and the process with it; the next `run` starts another."""
        with self._lock:
            process, self._process = self._process, None
        if process is not None:
            _terminate(process)

    def _started(self) -> subprocess.Popen[bytes]:
        with self._lock:
            if self._process is None or self._process.poll() is not None:
                command = (*self._command, language())
                self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                                 env={**os.environ, **_ONE_THREAD})
            return self._process

    def _end(self, process: subprocess.Popen[bytes]) -> None:
        with self._lock:
            if self._process is process:
                self._process = None
        _terminate(process)


def _write(process: subprocess.Popen[bytes], message: Any) -> None:
    assert process.stdin is not None
    process.stdin.write(pickle.dumps(message, pickle.HIGHEST_PROTOCOL))
    process.stdin.flush()


def _terminate(process: subprocess.Popen[bytes]) -> None:
    """End a process and wait for it, so that none is left behind."""
    process.terminate()
    try:
        process.wait(_END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
