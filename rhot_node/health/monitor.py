"""What the daemon tells the master of its machine: only what is wrong now, or became wrong a moment ago."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from rhot_node.health.check import Check
from rhot_node.health.checks import NOW, check_heat, check_memory, check_power
from rhot_node.health.machine import Machine, Throttled

LOOK_S = 2.0  # between looks at the machine, however often it is asked
RECENT_S = 60.0  # a brown-out between two looks is told for so long


class HealthMonitor:
    """Looks at the machine when asked, which is in the control channel's thread: the frame loop pays nothing."""

    def __init__(self, machine: Machine, now_s: Callable[[], float] = time.monotonic) -> None:
        self._machine = machine
        self._now_s = now_s
        self._lock = threading.Lock()
        self._known = machine.throttled(ask_commands=False) or Throttled(0)  # what had been before the node started
        self._noticed: dict[Throttled, float] = {}
        self._troubles: list[Check] = []
        self._looked_s = -LOOK_S

    def troubles(self) -> list[Check]:
        """Everything that is not as it should be; empty on a well machine."""
        with self._lock:
            now_s = self._now_s()
            if now_s - self._looked_s >= LOOK_S:
                self._looked_s = now_s
                self._troubles = self._look(now_s)
            return self._troubles

    def _look(self, now_s: float) -> list[Check]:
        flags = self._machine.throttled(ask_commands=False)
        if flags is not None:
            for flag in flags & ~self._known & ~NOW:
                self._noticed[flag] = now_s
            self._known |= flags
            recent = [flag for flag, noticed_s in self._noticed.items() if now_s - noticed_s < RECENT_S]
            flags &= NOW
            for flag in recent:
                flags |= flag
        checks = (check_power(flags), check_heat(self._machine.temperature_c(), flags),
                  check_memory(self._machine.available_bytes()))
        return [check for check in checks if check.level != "ok"]
