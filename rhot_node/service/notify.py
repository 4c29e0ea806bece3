"""What a daemon tells systemd, by datagrams to the socket that the environment names (sd_notify(3))."""

from __future__ import annotations

import contextlib
import os
import socket
import time
from collections.abc import Callable, Mapping


class ServiceManager:
    """Says that the node is ready and, often enough, that it is alive. Silent where nobody asked for it."""

    def __init__(self, environment: Mapping[str, str] = os.environ,
                 now_s: Callable[[], float] = time.monotonic) -> None:
        """Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID."""
        address = environment.get("NOTIFY_SOCKET", "")
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        watched = environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        microseconds = environment.get("WATCHDOG_USEC", "")
        # A third of what the manager waits for: one sign may be late.
        self._period_s = int(microseconds) / 3e6 if watched and microseconds.isdigit() else None
        self._now_s = now_s
        self._due_s = 0.0
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) if address else None

    def ready(self, status: str) -> None:
        """The node can be used from now on."""
        self._say(f"READY=1\nSTATUS={status}")

    def alive(self) -> None:
        """The node's loop goes round; called at every turn, says so only when it is due."""
        if self._period_s is not None and self._now_s() >= self._due_s:
            self._due_s = self._now_s() + self._period_s
            self._say("WATCHDOG=1")

    def stopping(self) -> None:
        """The node ends. Nothing is said after this."""
        self._say("STOPPING=1")
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _say(self, text: str) -> None:
        if self._socket is not None:
            with contextlib.suppress(OSError):  # a manager that went away or is busy must not hold the node up
                self._socket.sendto(text.encode(), socket.MSG_DONTWAIT, self._address)
