"""Compiles the numerical code in processes of its own: what a rig needs before its engine starts, and the rest while
the window is open, with the time that nobody else wants. No Qt."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence

from rhot_app.errors import EngineError
from rhot_app.project import Rig
from rhot_node.compiled import ALL, VARIABLE, WINDOW, is_complete

Report = Callable[[str, float], None]

COMMAND = (sys.executable, "-m", "rhot_app.warm")
TITLE = "Compiling the numerical code, once; this takes a minute"


def part_of(rig: Rig) -> str:
    """Which part of `rhot_app.warm.PARTS` the tracker of a rig is."""
    if rig.tracker.kind == "classic":
        return WINDOW if rig.tracker.ik == "fabrik" else "other solvers"
    return "contours" if rig.tracker.contours else "estimator"


def compile_part(part: str, report: Report, started: Callable[[int], object] = lambda pid: None,
                 command: Sequence[str] = COMMAND) -> None:
    """Compile a part unless that has been done, and report how far it is; `started` is told the process.

    Raises EngineError when it fails, or when the process is ended.
    """
    if not _has_to_do(part):
        return
    report(TITLE, 0.0)
    with _start([*command, part]) as process:
        try:
            started(process.pid)
            reason = _follow(process, lambda done, steps: report(TITLE, done / max(1, steps)))
        except BaseException:
            process.terminate()
            raise
    if process.returncode:
        raise EngineError(f"The numerical code could not be compiled: {reason}")


def _has_to_do(part: str) -> bool:
    """Whether a part is not compiled, and what would be compiled can be kept."""
    return VARIABLE in os.environ and not is_complete(part)


def _start(command: Sequence[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                            text=True)


def _follow(process: subprocess.Popen[str], step: Callable[[int, int], object]) -> str:
    """Tell `step` the steps done and to do, until the process ends; returns what it said last besides."""
    assert process.stdout is not None
    said = "the process was ended."
    for line in process.stdout:
        if match := re.match(r"(\d+) of (\d+) compiled", line):
            step(int(match[1]), int(match[2]))
        elif line.strip():
            said = line.strip()
    return said


class BackgroundCompilation:
    """Compiles everything that is not compiled yet."""

    def __init__(self, command: Sequence[str] = COMMAND) -> None:
        self.sentence = ""
        """How far it is, or why it failed; empty when there is nothing to say. Any thread may read it."""
        self._command = command
        self._process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        """Begin, unless it has begun or there is nothing to do."""
        if self._process is None and _has_to_do(ALL):
            self._process = _start([*self._command, ALL, "--background"])
            threading.Thread(target=self._watch, args=(self._process,), name="compilation", daemon=True).start()

    def close(self) -> None:
        """End it; what has been compiled stays, and the next start goes on."""
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()
            self._process.wait()

    def _watch(self, process: subprocess.Popen[str]) -> None:
        with process:
            reason = _follow(process, self._say)
        self.sentence = ""
        if process.returncode > 0:
            self.sentence = (f"The numerical code of other trackers and of calibrations could not be compiled, so that "
                             f"they begin slowly: {reason}")

    def _say(self, done: int, steps: int) -> None:
        self.sentence = ("The numerical code of other trackers and of calibrations is being compiled, once: "
                         f"{done} of {steps} steps.")
