"""Node settings tried out while a person turns a knob: sent by a worker, the last word wins, put back after."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Signal

from rhot_app.errors import RhotError
from rhot_app.ui.backend.contract import Asker
from rhot_app.ui.job import Job

Settings = dict[str, Any]


class Tryout(QObject):
    """`want` as often as you like; at most one request is under way. `told` with "" or with what went wrong."""

    told = Signal(str)

    def __init__(self, connect: Callable[[], Asker], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._connect = connect
        self._wanted: dict[int, Settings] = {}
        self._job: Job | None = None
        self._tried: set[int] = set()
        self._lock = threading.Lock()  # between the worker that sends and the one that puts back

    @property
    def under_way(self) -> bool:
        """Whether the nodes have not been told everything yet."""
        return self._job is not None

    def want(self, node_id: int, settings: Settings) -> None:
        """Have the node go by `settings` without saving them."""
        self._wanted[node_id] = settings
        self._tried.add(node_id)
        self._begin()

    def _begin(self) -> None:
        if self._job is None and self._wanted:
            wanted, self._wanted = self._wanted, {}
            self._job = Job(lambda progress: self._send(wanted), self._sent, self._failed, None, self).start()

    def _send(self, wanted: dict[int, Settings]) -> None:
        with self._lock:
            asker = self._connect()
            try:
                for node_id, settings in wanted.items():
                    try_settings(asker, node_id, settings)
            finally:
                asker.close()

    def _sent(self, _: None) -> None:
        self._job = None
        self.told.emit("")
        self._begin()

    def _failed(self, sentence: str) -> None:
        self._job = None
        self.told.emit(sentence)
        self._begin()

    def put_back(self, before: dict[int, Settings]) -> None:
        """Have every node that was told anything go by `before` again; waits, so call it in a worker. A node that does
        not answer is left: what was tried out ends with its process."""
        self._wanted = {}
        with self._lock:
            asker = self._connect()
            try:
                for node_id in sorted(self._tried):
                    try:
                        try_settings(asker, node_id, before[node_id])
                    except RhotError:
                        continue
            finally:
                asker.close()


def try_settings(asker: Asker, node_id: int, settings: Settings) -> None:
    """Settings that are in force but not saved; raises EngineError with the node's sentence."""
    asker.command("node", node_id=node_id, request={"request": "set_settings", "settings": settings, "save": False})
