"""ZeroMQ as nodes and masters use it: the one kind of context, and the one client of a node's channels."""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence
from typing import Any, Final

import msgspec
import zmq

from rhot_node.errors import NodeError, printable
from rhot_node.files import decode_message
from rhot_node.keys import KeyPair, connect_with

_RECONNECT_MS: Final = 100
_ANSWERS_QUEUED: Final = 8  # a slow reader of pictures misses some instead of piling them up
_numbers = itertools.count(1)


class Context(zmq.Context["zmq.Socket[bytes]"]):
    """Its sockets do not linger: closing it, or dropping it unclosed, never waits for a peer or for a socket.

    pyzmq knows the sockets of a context by weak references. The garbage collector clears those before it calls the
    context's `__del__`, which then waits for sockets that nobody closes any more. So this one keeps them.
    """

    _unclosed: set[zmq.Socket[bytes]]

    def __init__(self) -> None:
        super().__init__()
        self._unclosed = set()
        self.setsockopt(zmq.LINGER, 0)

    def socket(self, *args: Any, **options: Any) -> zmq.Socket[bytes]:
        """A socket of the context; its owner closes it, or the whole context."""
        socket: zmq.Socket[bytes] = super().socket(*args, **options)
        for earlier in [*self._unclosed]:
            if earlier.closed:
                self._unclosed.discard(earlier)
        self._unclosed.add(socket)
        return socket

    def __del__(self) -> None:
        for socket in self._unclosed:
            socket.close(0)
        super().__del__()


class Client:
    """Requests to a node, and its answers. Never waits. One thread."""

    def __init__(self, context: Context, endpoint: str, own: KeyPair | None = None, node_key: str = "", *,
                 kind: int = zmq.DEALER, longest: int = -1, once: bool = False) -> None:
        """With keys it talks encrypted to the holder of `node_key` and nobody else. `kind`: of the socket. `longest`:
        bytes of a message part that ends the connection when it is longer, -1: none does.

        Nothing is queued for a node that is not there, to reach it much later; but an answer is then lost when the
        connection ends before it is read. `once`: for one request, which is queued, and whose answer is not lost.
        Raises zmq.ZMQError, UnicodeError; nothing stays open then.
        """
        self.socket = socket = context.socket(kind)
        socket.setsockopt(zmq.RECONNECT_IVL, _RECONNECT_MS)
        socket.setsockopt(zmq.IMMEDIATE, int(not once))
        socket.setsockopt(zmq.RCVHWM, _ANSWERS_QUEUED)
        socket.maxmsgsize = longest
        if own is not None and node_key:
            connect_with(socket, own, node_key)
        try:
            socket.connect(endpoint)
        except (zmq.ZMQError, UnicodeError):
            socket.close()
            raise

    def send(self, request: bytes, number: int = 0) -> bool:
        """Send a request, whose answer will have its `number`; False without a connection."""
        try:
            self.socket.send_multipart([number.to_bytes(8, "little"), b"", request], zmq.DONTWAIT)
        except zmq.Again:
            return False
        return True

    def receive(self) -> tuple[int, list[bytes]] | None:
        """The next answer that has come: the number of its request, and its message parts, one or more."""
        while True:
            try:
                number, _, *parts = self.socket.recv_multipart(zmq.DONTWAIT)
            except zmq.Again:
                return None
            except ValueError:  # no answer to a request
                continue
            if parts:
                return int.from_bytes(number, "little"), parts


def ask_all(questions: Sequence[tuple[Client, bytes]], timeout_s: float) -> list[list[bytes] | None]:
    """One request to each client: the message parts of the answers, None for silence. Returns after the last answer, or
    after `timeout_s`."""
    number, end_s = next(_numbers), time.monotonic() + timeout_s
    waiting = {client.socket: place for place, (client, _) in enumerate(questions)}
    answers: list[list[bytes] | None] = [None] * len(questions)
    poller = zmq.Poller()
    for socket in waiting:
        poller.register(socket, zmq.POLLOUT)
    while waiting and (left_s := end_s - time.monotonic()) > 0.0:
        for socket, event in poller.poll(round(1e3 * left_s) + 1):
            client, request = questions[waiting[socket]]
            if event & zmq.POLLOUT:
                if client.send(request, number):
                    poller.modify(socket, zmq.POLLIN)
            elif (found := client.receive()) is not None and found[0] == number:
                answers[waiting.pop(socket)] = found[1]
                poller.unregister(socket)
    return answers


def read_answer(data: bytes) -> dict[str, Any]:
    """What a node answers. Raises NodeError with its words when it refuses, msgspec.MsgspecError for what no node
    answers."""
    answer = decode_message(data, dict[str, Any])
    if answer.pop("ok", False) is True:
        return answer
    if not isinstance(answer.get("error"), str):
        raise msgspec.ValidationError("neither ok nor error")
    raise NodeError(printable(answer["error"]))
