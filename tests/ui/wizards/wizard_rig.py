"""A rig without processes for the wizards' tests: a client that gives pictures and keeps rig and settings."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from fake_backend import FakeBackend

from rhot_app.errors import EngineError
from rhot_app.project import Rig, parse_rig, save_rig
from rhot_app.ui.backend.contract import Opened
from rhot_node.config import NodeSettings, changed_settings

Draw = Callable[[int, float], np.ndarray]


def grey_picture(node_id: int, t_s: float) -> np.ndarray:
    """A picture in which something moves."""
    picture = np.full((240, 320, 3), 60 + 20 * node_id, np.uint8)
    cv2.circle(picture, (round(160 + 100 * np.sin(t_s)), 120), 20, (60, 160, 220), -1)
    return picture


class FakeSettingsStore(dict[str, str]):
    """Remembers until the test is over."""

    def remembered(self, name: str) -> str:
        return self.get(name, "")

    def remember(self, name: str, text: str) -> None:
        self[name] = text


class FakeRigClient:
    """What the engine's client answers to `still`, `rig`, `set_rig` and `node`; `draw` makes the pictures."""

    def __init__(self, rig: Rig, draw: Draw = grey_picture) -> None:
        self.rig = rig
        self.draw = draw
        self.refuse = ""
        self.commands: list[str] = []
        self.settings = {node.node_id: NodeSettings(node.node_id, node.name, rig.markers) for node in rig.nodes}
        self.path = ""
        self.answers: dict[str, dict[str, Any]] = {}  # to other commands
        self.saved: list[int] = []
        self.connected = self.closed = 0
        self.number = 0
        self._sent: dict[int, tuple[np.ndarray, bytes]] = {}  # the last picture of each node and its JPEG
        self._lock = threading.Lock()

    @property
    def told(self) -> dict[int, dict[str, Any]]:
        """The nodes' settings by node id, as they give them."""
        return {node_id: msgspec.to_builtins(one) for node_id, one in self.settings.items()}

    def connect(self) -> FakeRigClient:
        """One client for everybody."""
        self.connected += 1
        return self

    def close(self) -> None:
        self.closed += 1

    def command(self, name: str, *, timeout_s: float = 3.0, **arguments: Any) -> dict[str, Any]:
        """As the engine would answer."""
        if self.refuse:
            raise EngineError(self.refuse)
        with self._lock:
            self.commands.append(name)
            self.number += 1
            number = self.number
        if name == "still":
            return self._still(arguments["node_id"], number)
        if name == "set_rig":
            self.rig = parse_rig(msgspec.json.encode(arguments["document"]), "the new rig")
        if name == "rig":
            return {"document": msgspec.to_builtins(self.rig), "path": self.path}
        if name == "node":
            return {"answer": self._node(arguments["node_id"], arguments["request"])}
        return self.answers.get(name, {})

    def _still(self, node_id: int, number: int) -> dict[str, Any]:
        now_s = time.monotonic()
        picture = self.draw(node_id, now_s)
        before, jpeg = self._sent.get(node_id, (None, b""))
        if picture is not before:
            jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 98])[1].tobytes()
            self._sent[node_id] = picture, jpeg
        return {"jpeg": jpeg, "answer": {"number": number, "t_node_ns": round(1e9 * now_s)}}

    def _node(self, node_id: int, request: dict[str, Any]) -> dict[str, Any]:
        if request["request"] == "set_settings":
            self.settings[node_id] = changed_settings(self.settings[node_id], request["settings"])
            if request.get("save", True):
                self.saved.append(node_id)
            return {"restart": []}
        return {"settings": self.told[node_id]}


class RigBackend(FakeBackend):
    """A fake engine whose rig has a file, and which answers the wizards' questions."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path
        self.rig_client = FakeRigClient(self.engine.rig)
        self.rig_client.path = str(path)
        self.engine.rig_path = str(path)
        save_rig(path, self.engine.rig)

    def command_client(self):
        return self.rig_client

    def _opened(self, path, *, simulated):
        return Opened(self.engine.rig, str(self.path), self.engine.running, self.ours, simulated)
