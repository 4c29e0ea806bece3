"""Zenoh: every state as a JSON message under one key, and as messages of ROS 2, which a bridge carries on
(docs/outputs.md)."""

from __future__ import annotations

import contextlib
import json
from typing import Any, Final

from rhot_app.errors import OutputError
from rhot_app.outputs.joints import Sample, json_message
from rhot_app.outputs.ros2 import ros2_messages
from rhot_app.outputs.spec import host_and_port
from rhot_app.project import OutputSettings

KEY: Final = "rhot/state"


class ZenohSink:
    """A publisher, as a peer of whoever is found on the network, or as a client of a router."""

    def __init__(self, settings: OutputSettings) -> None:
        """Raises OutputError when the target is neither empty nor HOST:PORT. Nothing is opened yet."""
        self._router = host_and_port(settings) if settings.target else None
        self._session: Any = None
        self._publisher: Any = None
        self._topics: dict[str, Any] = {}

    def open(self) -> None:
        """Join the network; raises OutputError when Zenoh is not installed or the router does not answer."""
        try:
            import zenoh
        except ImportError as exc:
            raise OutputError("Zenoh needs the package eclipse-zenoh, RHOT's extra zenoh: "
                              "`.venv/bin/python -m pip install eclipse-zenoh`.") from exc
        config = zenoh.Config()
        if self._router is not None:
            host, port = self._router
            config.insert_json5("mode", '"client"')
            place = f"tcp/{f'[{host}]' if ':' in host else host}:{port}"
            config.insert_json5("connect/endpoints", json.dumps([place]))
        try:
            self._session = zenoh.open(config)
            self._cdr, self._drop = zenoh.Encoding.APPLICATION_CDR, zenoh.CongestionControl.DROP
            self._publisher = self._declare(KEY, zenoh.Encoding.APPLICATION_JSON)
        except zenoh.ZError as exc:
            where = "the network" if self._router is None else "the router at {}:{}".format(*self._router)
            raise OutputError(f"Zenoh cannot join {where} ({exc}); is it running and reachable?") from exc

    def write(self, sample: Sample) -> None:
        """Publish one state."""
        self._publisher.put(json_message(sample))
        for topic, data in ros2_messages(sample):
            publisher = self._topics.get(topic)
            if publisher is None:
                publisher = self._topics[topic] = self._declare(topic, self._cdr)
            publisher.put(data)

    def _declare(self, key: str, encoding: Any) -> Any:
        """A publisher; a subscriber that is slow misses states."""
        return self._session.declare_publisher(key, encoding=encoding, congestion_control=self._drop)

    def close(self) -> None:
        """Leave the network."""
        session, self._session, self._publisher, self._topics = self._session, None, None, {}
        if session is not None:
            with contextlib.suppress(Exception):  # the library's own errors have several roots
                session.close()
