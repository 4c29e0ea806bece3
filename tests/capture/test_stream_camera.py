"""The live twin's socket: frames, latest wins, and what happens when the twin goes away."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from patience import PATIENCE_S, quickest

from rhot_node.capture.stream import (
    HEADER_BYTES,
    StreamCamera,
    StreamHeader,
    pack_header,
    pack_settings,
    take_settings,
    unpack_header,
)
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings
from rhot_node.errors import CameraError

WIDTH, HEIGHT = 64, 48


def frame_bytes(number: int, width: int = WIDTH, height: int = HEIGHT) -> bytes:
    header = StreamHeader(width, height, number, 1_000_000 * number, 4_000_000, 48_000)
    return pack_header(header) + bytes([number % 256]) * header.frame_bytes


def until_closed(connection: socket.socket) -> None:
    """Send nothing more until the other side has closed, or its test is over."""
    connection.settimeout(PATIENCE_S)
    with contextlib.suppress(OSError):
        while connection.recv(4096):
            pass


def sending(data: bytes, stays: bool = True) -> Callable[[socket.socket], None]:
    """What a twin does that sends this and nothing more."""
    def serve(connection: socket.socket) -> None:
        connection.sendall(data)
        if stays:
            until_closed(connection)
    return serve


class Twin:
    """A listening socket that gives each connection to `serve`."""

    def __init__(self, path: Path, serve: Callable[[socket.socket], None]) -> None:
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.listener.bind(str(path))
        self.listener.listen()
        self.serve = serve
        self.settings: CameraSettings | None = None
        self.connection: socket.socket | None = None
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self) -> None:
        try:
            connection, _ = self.listener.accept()
        except OSError:  # closed while nobody came
            return
        self.connection = connection
        with connection:
            self.settings = take_settings(bytearray(connection.recv(4096)))
            self.serve(connection)

    def close(self) -> None:
        self.listener.close()
        if self.connection is not None:
            with contextlib.suppress(OSError):
                self.connection.shutdown(socket.SHUT_RDWR)
        self.thread.join(PATIENCE_S)


@pytest.fixture
def twin(tmp_path: Path) -> Iterator[Callable[[Callable[[socket.socket], None]], Path]]:
    twins: list[Twin] = []

    def start(serve: Callable[[socket.socket], None]) -> Path:
        twins.append(Twin(tmp_path / "twin.sock", serve))
        return tmp_path / "twin.sock"

    yield start
    for each in twins:
        each.close()


def test_header_is_forty_bytes_and_survives_the_way() -> None:
    header = StreamHeader(640, 480, 7, 123_456_789_012, 4_000_000, 48_000)
    data = pack_header(header)
    assert len(data) == HEADER_BYTES == 40
    assert data[:12] == b"RYUV" + bytes.fromhex("8002 e001 01000000")
    assert unpack_header(data) == header


@pytest.mark.parametrize("data", [b"JUNK" + bytes(36), b"RYUV" + bytes(36),
                                  pack_header(StreamHeader(3, 2, 0, 0, 0, 0))])
def test_a_foreign_header_is_refused(data: bytes) -> None:
    with pytest.raises(CameraError):
        unpack_header(data)


def test_settings_survive_the_way_in_pieces() -> None:
    settings = CameraSettings(exposure_us=2500.0, gain=2.0, blue_gain=1.5)
    whole, received = pack_settings(settings) * 2, bytearray()
    taken = []
    for byte in whole:
        received.append(byte)
        told = take_settings(received)
        if told is not None:
            taken.append(told)
    assert taken == [settings, settings] and not received
    for junk in (b"JUNKjunk", b"RSET" + bytes([255] * 4), b"RSET" + bytes([2, 0, 0, 0]) + b"{]"):
        with pytest.raises(CameraError):
            take_settings(bytearray(junk))


def test_the_twin_is_told_the_settings_before_it_sends(tmp_path: Path) -> None:
    twin = Twin(tmp_path / "twin.sock", sending(frame_bytes(1)))
    settings = CameraSettings(exposure_us=1234.0, contrast=0.5)
    StreamCamera(tmp_path / "twin.sock", settings, NodeClock()).close()
    twin.close()
    assert twin.settings == settings


def test_frames_arrive_with_times_in_the_nodes_clock(twin: Callable[..., Path]) -> None:
    go_on = threading.Event()

    def serve(connection: socket.socket) -> None:
        connection.sendall(frame_bytes(1))
        go_on.wait(PATIENCE_S)
        connection.sendall(frame_bytes(2))
        until_closed(connection)

    clock = NodeClock(offset_ns=10**12)
    camera = StreamCamera(twin(serve), CameraSettings(), clock)
    assert camera.size == (WIDTH, HEIGHT)
    first = camera.read(PATIENCE_S)
    assert first is not None and first.number == 1 and (first.image.v == 1).all()
    assert type(first.image.u) is np.ndarray and first.image.u.flags.writeable, "as detectors are compiled for"
    assert first.t_node_ns == 10**12 + 1_000_000
    assert (first.exposure_ns, first.row_time_ns) == (4_000_000, 48_000)
    assert abs(first.t_available_node_ns - clock.now_ns()) < 10**9
    assert camera.read(0.01) is None
    go_on.set()
    second = camera.read(PATIENCE_S)
    assert second is not None and second.number == 2 and (second.image.y == 2).all()
    camera.close()


def test_the_newest_of_several_waiting_frames_wins(twin: Callable[..., Path]) -> None:
    sent = threading.Event()

    def serve(connection: socket.socket) -> None:
        for number in range(5):
            connection.sendall(frame_bytes(number))
        sent.set()
        until_closed(connection)

    camera = StreamCamera(twin(serve), CameraSettings(), NodeClock())
    assert sent.wait(PATIENCE_S)
    frame = camera.read(PATIENCE_S)
    assert frame is not None and frame.number == 4 and (frame.image.y == 4).all()


def test_a_flood_does_not_keep_the_reader_for_ever(twin: Callable[..., Path]) -> None:
    def serve(connection: socket.socket) -> None:
        number = 0
        try:
            while True:
                connection.sendall(frame_bytes(number))
                number += 1
        except OSError:
            return

    camera = StreamCamera(twin(serve), CameraSettings(), NodeClock())

    def five() -> None:
        for _ in range(5):
            assert camera.read(PATIENCE_S) is not None

    assert quickest(five, 1.0) < 1.0
    camera.close()


def test_waits_for_a_twin_that_starts_later(twin: Callable[..., Path], tmp_path: Path) -> None:
    threading.Timer(0.3, lambda: twin(sending(frame_bytes(1)))).start()
    camera = StreamCamera(tmp_path / "twin.sock", CameraSettings(), NodeClock(), connect_s=PATIENCE_S)
    assert camera.read(PATIENCE_S) is not None


def test_no_twin_is_an_error_with_a_remedy(tmp_path: Path) -> None:
    with pytest.raises(CameraError, match="Start the simulator"):
        StreamCamera(tmp_path / "nobody.sock", CameraSettings(), NodeClock(), connect_s=0.1)


def test_a_twin_that_never_sends_is_an_error(twin: Callable[..., Path]) -> None:
    with pytest.raises(CameraError, match="no frame came"):
        StreamCamera(twin(until_closed), CameraSettings(), NodeClock(), connect_s=0.2)


@pytest.mark.parametrize(("data", "stays", "silence_s", "words"), [
    (frame_bytes(1) + frame_bytes(2)[:1000], False, PATIENCE_S, "closed"),
    (frame_bytes(1), True, 0.2, "no frame for"),
    (frame_bytes(1) + frame_bytes(2, width=32), True, PATIENCE_S, "size changed from 64 x 48 to 32 x 48")])
def test_what_ends_a_stream_is_an_error(twin: Callable[..., Path], data: bytes, stays: bool, silence_s: float,
                                        words: str) -> None:
    camera = StreamCamera(twin(sending(data, stays)), CameraSettings(), NodeClock(), silence_s=silence_s)
    with pytest.raises(CameraError, match=words):
        for _ in range(round(PATIENCE_S / 0.1)):
            camera.read(0.1)
