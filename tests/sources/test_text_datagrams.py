"""The thesis's text datagrams: what people and old nodes type, and what they may not."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot_app.sources.validation import Point, parse_text
from rhot_node.errors import WireError


@pytest.mark.parametrize("data", [
    b"10,20;30.5,40.25;-1,-1", b"10,20;30.5,40.25;-1,-1;", b"10,20;30.5,40.25;-1,-1;\r\n", b"10,20;30.5,40.25;,\n",
    b"10,20;30.5,40.25;\n", b"10,20;30.5,40.25;;\n", b" 10 , 20 ; +30.5,40.250 ; -1.0,-1.0 \0", b"10.,20;30.5,40.25;;",
])
def test_lost_markers_and_line_ends_in_every_spelling(data: bytes) -> None:
    assert parse_text(data, 3) == [(10.0, 20.0), (30.5, 40.25), None]
    assert parse_text(memoryview(data), 3) == [(10.0, 20.0), (30.5, 40.25), None]


@pytest.mark.parametrize(("data", "count", "reason"), [
    (b"", 3, "count"), (b"1,2;3,4", 3, "count"), (b"1,2;3,4;5,6;7,8", 3, "count"), (b"1,2;3,4;5,6;;;", 3, "count"),
    (b"1", 1, "text"), (b"1,2,3", 1, "text"), (b",,", 1, "text"), (b"1,", 1, "text"), (b"a,b", 1, "text"),
    (b"nan,nan", 1, "text"), (b"inf,1", 1, "text"), (b"1e3,1", 1, "text"), (b"1_0,1", 1, "text"),
    (b"-2,5", 1, "text"), (b"-1,5", 1, "text"), (b"99999,5", 1, "text"), ("٣,٤".encode(), 1, "text"),
    (b"1;2", 2, "text"), (b"\xff\xfe,1", 1, "text"), (b"1,2" + b" " * 5000, 1, "length"),
])
def test_anything_else_is_refused_by_its_reason(data: bytes, count: int, reason: str) -> None:
    with pytest.raises(WireError) as caught:
        parse_text(data, count)
    assert caught.value.reason == reason


def format_text(points: list[Point | None]) -> bytes:
    """The text datagram of these positions, as the thesis's nodes send it."""
    return ";".join("-1,-1" if point is None else f"{point[0]:.3f},{point[1]:.3f}" for point in points).encode() + b"\n"


points = st.one_of(st.none(), st.tuples(st.integers(0, 16_384_000), st.integers(0, 16_384_000)))


@settings(deadline=None)
@given(st.lists(points, min_size=1, max_size=64))
def test_there_and_back(milli: list[tuple[int, int] | None]) -> None:
    values = [None if p is None else (p[0] / 1000, p[1] / 1000) for p in milli]
    assert parse_text(format_text(values), len(values)) == values


@settings(max_examples=500, deadline=None)
@given(st.one_of(st.binary(max_size=60), st.text("0123456789,;.-+eE \n", max_size=60).map(str.encode)),
       st.integers(1, 8))
def test_anything_gives_points_or_a_wire_error(data: bytes, count: int) -> None:
    try:
        parsed = parse_text(data, count)
    except WireError:
        return
    assert len(parsed) == count
    assert all(p is None or (0 <= p[0] <= 16384 and 0 <= p[1] <= 16384) for p in parsed)
