"""The window's line to the engine: one client, and commands that wait in workers so that the window does not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from PySide6.QtCore import QObject

from rhot_app.ui.backend.live import Client
from rhot_app.ui.job import Job


class ClosableClient(Client, Protocol):
    """The engine's client, which can be closed."""

    def close(self) -> None:
        """Disconnect."""
        ...


class EngineLink(QObject):
    """`client` is None while no engine is wanted. `failed` hears of every command that fails, as a sentence."""

    def __init__(self, connect: Callable[[], ClosableClient], failed: Callable[[str], None],
                 parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._connect = connect
        self._failed = failed
        self._jobs: list[Job] = []
        self.client: ClosableClient | None = None

    def open(self) -> None:
        """A fresh client in place of the last one."""
        self.close()
        self.client = self._connect()

    def close(self) -> None:
        """Disconnect, if connected."""
        if self.client is not None:
            self.client.close()
            self.client = None

    def command(self, name: str, **args: Any) -> None:
        """Give a command; only its failure is heard of."""
        self.work(lambda client: client.command(name, **args), lambda answer: None)

    def work(self, op: Callable[[ClosableClient], Any], done: Callable[[Any], None],
             failed: Callable[[str], None] | None = None) -> None:
        """Run something short with the client in a worker; nothing happens without a client.

        `done(result)` or `failed(sentence)` follow in the window's thread; `failed` is the link's own by default.
        """
        client = self.client
        if client is None:
            return
        self._jobs = [job for job in self._jobs if job.running]
        self._jobs.append(Job(lambda progress: op(client), done, failed or self._failed, None, self))
        self._jobs[-1].start()

    def wait(self, timeout_s: float) -> None:
        """Let what is under way come to its end, each at most `timeout_s`."""
        for job in self._jobs:
            job.wait(timeout_s)
