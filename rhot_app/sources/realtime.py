"""Precedence for the threads between a datagram and its state: of the system's scheduler, and of the interpreter."""

from __future__ import annotations

import contextlib
import os
import sys

_PRIORITY = 1  # the lowest of the real-time ones: above every ordinary program, below all of the system's own


PATIENCE_S = 2e-5
"""How long a thread that wakes up leaves the interpreter to another one (Python's default is 5 ms)."""

_WORK_S = 5e-3  # no state takes longer


def claim_interpreter() -> None:
    """Keep the interpreter until this thread waits for something: a state is not interrupted for a status report."""
    sys.setswitchinterval(_WORK_S)


def share_interpreter() -> None:
    """From now on the next thread that wakes up gets the interpreter within `PATIENCE_S`."""
    sys.setswitchinterval(PATIENCE_S)


def hurry_this_thread() -> None:
    """Let the calling thread run as soon as it wakes up, whatever else the machine does. Linux, where permitted.

    Permission is root's or what ``ulimit -r`` grants; without it nothing changes. The kernel leaves a twentieth of
    the time to others whatever such a thread does, and programs started from it run as usual.
    """
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(_PRIORITY))
