"""Compiles the numerical code in processes of its own: what a rig needs before its engine starts, and the rest in idle
time while the window is open. No Qt."""

from __future__ import annotations

import functools
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Sequence

from rhot_app.engine.status import Advice, advise
from rhot_app.errors import EngineError
from rhot_app.project import Rig
from rhot_node.compiled import ALL, VARIABLE, WINDOW, is_complete
from rhot_node.threads import OneShotThread

Report = Callable[[str, float], None]

COMMAND = (sys.executable, "-m", "rhot_app.warm")
TITLE = "Compiling the numerical code, once; usually a minute or two"


def part_of(rig: Rig) -> str:
    """The part of `rhot_app.warm.PARTS` that the tracker of a rig needs."""
    if rig.tracker.kind == "classic":
        return WINDOW if rig.tracker.ik == "fabrik" else "other solvers"
    return "contours" if rig.tracker.contours else "estimator"


def compile_part(part: str, report: Report, started: Callable[[int], object] = lambda pid: None,
                 command: Sequence[str] = COMMAND) -> None:
    """Compile a part unless it is compiled, and report the progress; `started` gets the id of the process.

    Raises EngineError when it fails, or when the process is ended.
    """
    if not is_missing(part):
        return
    begun_s = time.monotonic()

    def tell(done: int, steps: int) -> None:
        report(f"{TITLE}: {time.monotonic() - begun_s:.0f} s so far", done / max(1, steps))

    report(TITLE, 0.0)
    with _start([*command, part]) as process:
        try:
            started(process.pid)
            reason = _follow(process, tell)
        except BaseException:
            process.terminate()
            raise
    if process.returncode:
        raise EngineError(f"The numerical code could not be compiled: {reason}")


def is_missing(part: str) -> bool:
    """Whether a part is not compiled yet; False where compiled code cannot be kept."""
    return VARIABLE in os.environ and not is_complete(part)


def _start(command: Sequence[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                            text=True)


def _follow(process: subprocess.Popen[str], progress: Callable[[int, int], object]) -> str:
    """Call `progress` with the steps done and their number until the process ends; returns its last other line."""
    assert process.stdout is not None
    last = "the process was ended."
    for line in process.stdout:
        if match := re.match(r"(\d+) of (\d+) steps compiled", line):
            progress(int(match[1]), int(match[2]))
        elif line.strip():
            last = line.strip()
    return last


class BackgroundCompilation:
    """Compiles everything that is not compiled yet."""

    def __init__(self, command: Sequence[str] = COMMAND) -> None:
        self.advice: Advice | None = None
        """Its progress, or why it failed; None before and after it. Any thread may read it."""
        self._command = command
        self._process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        """Start, unless it has started or everything is compiled."""
        if self._process is None and is_missing(ALL):
            self._process = _start([*self._command, ALL, "--background"])
            self._task = OneShotThread("follows the compilation", functools.partial(self._watch, self._process))

    def close(self) -> None:
        """End it. The next start goes on where it ended."""
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()
            self._process.wait()

    def _watch(self, process: subprocess.Popen[str]) -> None:
        with process:
            reason = _follow(process, self._report)
        self.advice = None if process.returncode <= 0 else advise(
            "The numerical code of other trackers and of calibrations could not be compiled, so that they begin "
            "slowly: {reason}", level="info", reason=reason)

    def _report(self, done: int, steps: int) -> None:
        self.advice = advise("The code of other trackers and of calibrations is being compiled in the background, "
                             "once: {done} of {steps} steps. It yields to the tracking, and takes minutes.",
                             level="info", done=done, steps=steps)
