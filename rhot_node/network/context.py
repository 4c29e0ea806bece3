"""The one kind of ZeroMQ context: closing it, or dropping it unclosed, never waits for a peer or for a socket."""

from __future__ import annotations

from typing import Any

import zmq


class Context(zmq.Context["zmq.Socket[bytes]"]):
    """Its sockets do not linger.

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
