"""The thesis's text datagrams (RHOT 6.4): ``x,y;x,y;...`` in the rig's marker order, one port per node.

They carry no session, time or key, so they are as trustworthy as the network they come from.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from rhot_node.errors import WireError

LENGTH_MAX = 4096  # bytes; 64 markers with room to spare
COORDINATE_MAX = 16384.0  # px

Point = tuple[float, float]

_NUMBER = re.compile(rb"[+-]?(?:\d{1,9}(?:\.\d{0,12})?|\.\d{1,12})\Z")


def parse_text(data: bytes | bytearray | memoryview, count: int) -> list[Point | None]:
    """The `count` marker positions of a text datagram, px; None for a lost marker (``-1,-1``, ``,`` or nothing).

    A trailing newline, carriage return, NUL or one semicolon too many is tolerated, as `nc` and printf produce them.
    Raises WireError with reason length, count or text.
    """
    if len(data) > LENGTH_MAX:
        raise WireError("length", f"{len(data)} bytes of text")
    pairs = bytes(data).rstrip(b"\r\n\0 \t").split(b";")
    if len(pairs) == count + 1 and not pairs[-1].strip():
        pairs.pop()
    if len(pairs) != count:
        raise WireError("count", f"{len(pairs)} pairs for {count} markers")
    return [_parse_pair(pair) for pair in pairs]


def format_text(points: Sequence[Point | None]) -> bytes:
    """The text datagram of these positions, px; None becomes ``-1,-1``. Ends with a newline."""
    return ";".join("-1,-1" if point is None else f"{point[0]:.3f},{point[1]:.3f}" for point in points).encode() + b"\n"


def _parse_pair(pair: bytes) -> Point | None:
    parts = [part.strip() for part in pair.split(b",")]
    if not any(parts) and len(parts) <= 2:
        return None
    if len(parts) != 2 or not all(_NUMBER.match(part) for part in parts):
        raise WireError("text", f"{pair!r} is not a pair of numbers")
    x, y = float(parts[0]), float(parts[1])
    if x == -1.0 and y == -1.0:
        return None
    if not (0.0 <= x <= COORDINATE_MAX and 0.0 <= y <= COORDINATE_MAX):
        raise WireError("text", f"{pair!r} lies outside any image")
    return x, y
