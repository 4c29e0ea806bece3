"""Work for the solver's process: module functions, because they are pickled by name."""

from __future__ import annotations

import os
import time
from collections.abc import Callable

from rhot_app.errors import CalibrationError
from rhot_app.ui.language import tr


def count(steps: int, pause_s: float, *, progress: Callable[[str, float], None]) -> int:
    """Count, slowly."""
    for k in range(steps):
        progress("counting", (k + 1) / steps)
        time.sleep(pause_s)
    return steps


def hold_the_interpreter(seconds: float, *, progress: Callable[[str, float], None]) -> str:
    """Compute in pure Python, as solvers do between calls of numpy."""
    progress("holding", 0.0)
    end, total = time.monotonic() + seconds, 0
    while time.monotonic() < end:
        total += sum(k * k for k in range(2000))
    return "held"


def who(*, progress: Callable[[str, float], None]) -> tuple[int, int, str]:
    """Process id, niceness, threads of numerical libraries."""
    return os.getpid(), os.nice(0), os.environ["OPENBLAS_NUM_THREADS"]


def say_what_is_done(*, progress: Callable[[str, float], None]) -> str:
    """Report in the language of the window."""
    progress(tr("Preparing the tracker …"), 1.0)
    return tr("Everything else is shown.")


def refuse(*, progress: Callable[[str, float], None]) -> None:
    """Fail on purpose."""
    raise CalibrationError("There are too few pictures; take at least five.")


def die(*, progress: Callable[[str, float], None]) -> None:
    """End without a word."""
    os._exit(3)
