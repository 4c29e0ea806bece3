"""Zenoh: every state as a JSON message under one key. A bridge carries it on to ROS 2 (docs/outputs.md)."""

from __future__ import annotations

import contextlib
import json
from typing import Any, Final

from rhot_app.errors import OutputError
from rhot_app.outputs.joints import Sample, json_message
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
            # A subscriber that is slow misses states.
            self._publisher = self._session.declare_publisher(KEY, encoding=zenoh.Encoding.APPLICATION_JSON,
                                                              congestion_control=zenoh.CongestionControl.DROP)
        except zenoh.ZError as exc:
            where = "the network" if self._router is None else "the router at {}:{}".format(*self._router)
            raise OutputError(f"Zenoh cannot join {where} ({exc}); is it running and reachable?") from exc

    def write(self, sample: Sample) -> None:
        """Publish one state."""
        self._publisher.put(json_message(sample))

    def close(self) -> None:
        """Leave the network."""
        session, self._session, self._publisher = self._session, None, None
        if session is not None:
            with contextlib.suppress(Exception):  # the library's own errors have several roots
                session.close()
