"""Real-time scheduling for the threads between a datagram and its state."""

from __future__ import annotations

import contextlib
import os

_PRIORITY = 1  # the lowest of the real-time ones: above every ordinary program, below all of the system's own


def hurry_this_thread() -> None:
    """Let the calling thread run as soon as it wakes up, whatever else the machine does. Linux, where permitted.

    Permission is root's or what ``ulimit -r`` grants; without it nothing changes. The kernel leaves a twentieth of
    the time to others whatever such a thread does, and programs started from it run as usual.
    """
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(_PRIORITY))
