"""A real ``rhot-node`` process, its master's sockets, and a twin that sends it frames."""

from __future__ import annotations

import contextlib
import json
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import zmq
from node_fakes import OF_ANY_PORT, saved_settings
from patience import PATIENCE_S, eventually
from shipped_markers import RHOT6

from rhot_node.capture.stream import StreamHeader, pack_header
from rhot_node.config import CameraSettings, ClockSettings
from rhot_node.detectors import warm_up_image
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import (
    ClockReply,
    ClockRequest,
    Message,
    NodeState,
    Observations,
    Start,
    StartEntry,
)

SIZE = (320, 240)
PERIOD_NS = 25_000_000
OFFSET_S = 5000.0
READY_S = 400.0  # a first start compiles the detector, beside whatever else there is to do


def i420() -> np.ndarray:
    image = warm_up_image(RHOT6, SIZE)
    return np.concatenate([image.y.ravel(), image.u.ravel(), image.v.ravel()])


def write_settings(folder: Path, **changes: Any) -> Path:
    camera, clock = CameraSettings(width=SIZE[0], height=SIZE[1], fps=40), ClockSettings(OFFSET_S, 20.0)
    return saved_settings(folder / "left.json", **{**OF_ANY_PORT, "trust": "open", "camera": camera, "clock": clock,
                                                   **changes}).path


class Node:
    """A running node, and its master's sockets."""

    def __init__(self, settings: Path, camera: str, *options: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "rhot_node", "--settings", str(settings), "--camera", camera, *options],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        readable, _, _ = select.select([self.process.stdout], [], [], READY_S)
        assert readable, "the node did not get ready"
        line = self.process.stdout.readline()
        assert line, self.process.communicate()[1]
        self.ready: dict[str, Any] = json.loads(line)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(PATIENCE_S)

    def say(self, message: Message) -> None:
        self.socket.sendto(encode(message), ("127.0.0.1", self.ready["udp_port"]))

    def start(self, session: int) -> None:
        self.say(Start(session, 0, (StartEntry(3, self.socket.getsockname()[1], 0),)))

    def hear(self) -> Message:
        return decode(self.socket.recv(4096))

    def observations(self, count: int) -> list[Observations]:
        heard: list[Observations] = []
        while len(heard) < count:
            message = self.hear()
            if isinstance(message, Observations):
                heard.append(message)
        return heard

    def clock(self, session: int = 0) -> ClockReply:
        asked_ns = time.monotonic_ns()
        self.say(ClockRequest(3, session, 5, asked_ns))
        while True:
            message = self.hear()
            if isinstance(message, ClockReply) and message.t1_master_ns == asked_ns:  # none to an earlier request
                return message

    def wait_for(self, state: NodeState, session: int = 0) -> None:
        eventually(lambda: self.clock(session).state is state, told=lambda: f"never {state.name}")

    def ask(self, **request: Any) -> list[bytes]:
        with zmq.Context() as context, context.socket(zmq.REQ) as client:
            client.linger = 0
            client.rcvtimeo = round(1e3 * PATIENCE_S)
            client.connect(f"tcp://127.0.0.1:{self.ready['control_port']}")
            client.send(json.dumps(request).encode())
            return client.recv_multipart()

    def end(self, number: int = signal.SIGTERM) -> tuple[int, str, str]:
        self.socket.close()
        if self.process.poll() is None:
            self.process.send_signal(number)
        out, err = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, out, err


class Twin:
    """Sends frames to whoever connects, until closed."""

    def __init__(self, path: Path) -> None:
        self.frame = i420().tobytes()
        self.ending = False
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.listener.bind(str(path))
        self.listener.listen()
        self.listener.settimeout(READY_S)
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self) -> None:
        connection, _ = self.listener.accept()
        with connection, contextlib.suppress(BrokenPipeError):
            number = 0
            while not self.ending:
                header = StreamHeader(*SIZE, number, time.monotonic_ns() - 10_000_000, 4_000_000, 20_000)
                connection.sendall(pack_header(header) + self.frame)
                number += 1
                time.sleep(0.02)

    def close(self) -> None:
        self.ending = True
        self.thread.join(PATIENCE_S)
        self.listener.close()
