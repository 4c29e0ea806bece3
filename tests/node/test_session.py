"""Sessions: what a node makes of starts and stops that come twice, late, in the wrong order or not at all."""

from __future__ import annotations

from rhot_node.network.session import ENDED_MAX, MASTER_SILENCE_S, Sessions

MASTER = ("10.0.0.1", 5000)
OTHER = ("10.0.0.2", 6000)


def start(sessions: Sessions, session: int, address: tuple[str, int] = MASTER, t_start: int = 0,
          now_s: float = 0.0) -> str:
    return sessions.start(session, address, t_start, now_node_ns=10**12, now_s=now_s)


def test_a_repeated_start_changes_nothing() -> None:
    sessions = Sessions()
    start(sessions, 1)
    first = sessions.current
    assert start(sessions, 1, OTHER) == "repeated"
    assert sessions.current is first


def test_a_new_session_replaces_the_old_one_for_good() -> None:
    sessions = Sessions()
    start(sessions, 1)
    assert start(sessions, 2, OTHER) == "started"
    assert start(sessions, 1) == "stale"
    assert sessions.current is not None and sessions.current.session == 2 and sessions.current.address == OTHER


def test_a_late_start_does_not_wake_a_stopped_session() -> None:
    sessions = Sessions()
    start(sessions, 1)
    sessions.stop(1)
    assert start(sessions, 1) == "stale" and sessions.current is None


def test_a_stop_that_overtakes_its_start_wins() -> None:
    sessions = Sessions()
    assert not sessions.stop(1)
    assert start(sessions, 1) == "stale"


def test_a_stop_of_another_session_does_not_stop_ours() -> None:
    sessions = Sessions()
    start(sessions, 2)
    assert not sessions.stop(1)
    assert sessions.current is not None


def test_stop_zero_stops_whatever_runs_and_only_that() -> None:
    sessions = Sessions()
    assert not sessions.stop(0)
    start(sessions, 3)
    assert sessions.stop(0) and start(sessions, 3) == "stale"
    assert start(sessions, 4) == "started"


def test_a_silent_master_ends_the_session_and_may_come_back() -> None:
    sessions = Sessions()
    start(sessions, 1, now_s=100.0)
    sessions.hear(1, 104.0)
    sessions.hear(2, 108.0)  # of another session
    assert not sessions.expire(104.0 + MASTER_SILENCE_S)
    assert sessions.expire(104.1 + MASTER_SILENCE_S) and sessions.current is None
    assert start(sessions, 1, now_s=200.0) == "started"


def test_a_start_by_another_clock_begins_at_once() -> None:
    sessions = Sessions()
    start(sessions, 1, t_start=10**12 + 3 * 10**9)
    assert sessions.current is not None and sessions.current.t_start_node_ns == 10**12 + 3 * 10**9
    start(sessions, 2, t_start=10**12 + 3600 * 10**9)
    assert sessions.current.t_start_node_ns == 0 if sessions.current else False


def test_memory_of_ended_sessions_is_bounded() -> None:
    sessions = Sessions()
    for session in range(1, ENDED_MAX + 100):
        sessions.stop(session)
    assert start(sessions, ENDED_MAX + 50) == "stale"
    assert start(sessions, 1) == "started"
