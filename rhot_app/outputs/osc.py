"""OSC by UDP: one bundle of messages per hand and state, split where a datagram would be too long.

Bytes are packed here (OSC 1.0: strings and blobs padded to four bytes, big-endian numbers): what is said in every state
has fixed addresses, so their bytes are kept, and a state costs one pack per joint.
"""

from __future__ import annotations

import contextlib
import math
import re
import socket
import struct
from collections.abc import Collection, Iterable, Iterator
from functools import cache
from typing import Final

from rhot_app.errors import OutputError
from rhot_app.outputs.joints import HandSample, Sample
from rhot_app.outputs.spec import host_and_port
from rhot_app.project import OutputSettings

NOW: Final = 1  # the time tag of what is meant for now (OSC 1.0)
NTP_S: Final = 2_208_988_800  # from NTP's epoch, 1900, to 1970 (RFC 5905)
DATAGRAM_MAX: Final = 1432  # bytes: what passes through Ethernet in one piece, with IPv6
_WORD: Final = re.compile(r"[^A-Za-z0-9_.-]")  # OSC's addresses have no spaces and no wild cards
Argument = int | float | str


def osc_message(address: str, *arguments: Argument) -> bytes:
    """One message; arguments become int32, float32 and strings."""
    values = b"".join(_string(value) if isinstance(value, str)
                      else struct.pack(">i" if isinstance(value, int) else ">f", value) for value in arguments)
    return _head(address, "".join("s" if isinstance(value, str) else "i" if isinstance(value, int) else "f"
                                  for value in arguments)) + values


def time_tag(t_unix_ns: int | None) -> int:
    """The time tag of an instant by the wall clock, ns since 1970: seconds since 1900 and their fraction, 32 bits each;
    `NOW` where it is unknown."""
    return NOW if t_unix_ns is None else ((t_unix_ns << 32) // 1_000_000_000 + (NTP_S << 32)) % (1 << 64)


def bundles(messages: Iterator[bytes], t_unix_ns: int | None = None) -> Iterator[bytes]:
    """Messages of one instant, ns since 1970 or unknown, in as few bundles as DATAGRAM_MAX allows."""
    head = b"#bundle\0" + struct.pack(">Q", time_tag(t_unix_ns))
    parts, length = [head], len(head)
    for message in messages:
        if length + 4 + len(message) > DATAGRAM_MAX:
            yield b"".join(parts)
            parts, length = [head], len(head)
        parts += [struct.pack(">i", len(message)), message]
        length += 4 + len(message)
    yield b"".join(parts)


def hand_messages(sample: Sample, hand: HandSample) -> Iterator[bytes]:
    """What is said of one hand; joints and palm that are unknown are left out."""
    begin = f"/rhot/{hand.name}"
    yield osc_message(f"{begin}/hand", sample.state.sequence & 0x7FFFFFFF, hand.condition,
                      -1.0 if math.isnan(sample.age_s) else sample.age_s)
    palm = [*hand.palm_position.tolist(), *hand.palm_orientation.tolist()]
    if all(map(math.isfinite, palm)):
        yield osc_message(f"{begin}/palm", *palm)
    rows = hand.positions.tolist()
    if hand.orientations is not None and hand.radii is not None:
        turns = hand.orientations.tolist()
        rows = [[*row, *turn, radius] for row, turn, radius in zip(rows, turns, hand.radii.tolist(), strict=True)]
    pack = struct.Struct(f">{len(rows[0])}fi").pack
    types = "f" * len(rows[0]) + "i"
    for joint, row, known in zip(sample.joints, rows, hand.knowledge.tolist(), strict=True):
        if all(map(math.isfinite, row)):
            yield _head(f"{begin}/joint/{joint}", types) + pack(*row, known)


def object_messages(sample: Sample) -> Iterator[bytes]:
    """What is said of the tracked objects; a pose that is unknown is left out, and distances without a shape."""
    for one in sample.objects:
        begin = f"/rhot/object/{_WORD.sub('_', one.name)}"
        yield osc_message(f"{begin}/validity", one.validity)
        pose = [*one.position.tolist(), *one.orientation.tolist()]
        if all(map(math.isfinite, pose)):
            yield osc_message(f"{begin}/pose", *pose)
        distances = one.distances.tolist()
        if all(map(math.isfinite, distances)):
            yield osc_message(f"{begin}/fingertips", *distances, *map(int, one.contacts.tolist()))


def mouse_messages(cursor: Iterable[float] | None, pressed: Collection[str]) -> Iterator[bytes]:
    """What is said of the 3-D mouse: its cursor, m, left out while it is unknown, and its two buttons, 1 when held."""
    if cursor is not None:
        yield osc_message("/rhot/mouse/cursor", *map(float, cursor))
    yield osc_message("/rhot/mouse/buttons", *(int(button in pressed) for button in ("thumb", "little")))


class UdpSink:
    """Datagrams to one host and port."""

    def __init__(self, settings: OutputSettings) -> None:
        """Raises OutputError when the target is not HOST:PORT. Nothing is opened yet."""
        self._host, self._port = host_and_port(settings)
        self._socket: socket.socket | None = None
        self._address: tuple[object, ...] = ()

    def open(self) -> None:
        """Find the host; raises OutputError when there is none of that name."""
        try:
            family, kind, protocol, _, self._address = socket.getaddrinfo(self._host, self._port,
                                                                          type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, kind, protocol)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        except (OSError, UnicodeError) as exc:  # a name with a part of more than 63 letters
            reason = (exc.strerror or exc) if isinstance(exc, OSError) else "it is no name of a host"
            raise OutputError(f"the host {self._host[:80]!r} cannot be found ({reason}); check its name and "
                              "the network.") from exc

    def send(self, datagram: bytes) -> None:
        """Send one; raises OutputError when there is no way to the host. That nobody listens there is no error."""
        assert self._socket is not None
        try:
            self._socket.sendto(datagram, self._address)
        except ConnectionRefusedError:  # an earlier datagram came back: nobody listens yet
            return
        except OSError as exc:
            raise OutputError(f"{self._host} port {self._port} cannot be reached ({exc.strerror or exc}); check the "
                              "address and the network.") from exc

    def close(self) -> None:
        """Close the socket."""
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.close()
            self._socket = None


class OscSink(UdpSink):
    """Every hand of every state, as docs/outputs.md says."""

    def write(self, sample: Sample) -> None:
        """Send one state."""
        for hand in sample.hands:
            for datagram in bundles(hand_messages(sample, hand), sample.t_unix_ns):
                self.send(datagram)
        if sample.objects:
            for datagram in bundles(object_messages(sample), sample.t_unix_ns):
                self.send(datagram)


@cache
def _head(address: str, types: str) -> bytes:
    return _string(address) + _string(f",{types}")


def _string(text: str) -> bytes:
    data = text.encode()
    return data + bytes(4 - len(data) % 4)
