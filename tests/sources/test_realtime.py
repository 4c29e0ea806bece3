"""Real-time scheduling is taken where it is permitted, for one thread alone, and never missed."""

import os
import sys
import threading

import pytest

from rhot_app.sources import receiver


def in_a_thread(call):
    results = []
    thread = threading.Thread(target=lambda: results.append(call()))
    thread.start()
    thread.join()
    return results[0]


def test_only_the_calling_thread_is_hurried():
    def hurried() -> int:
        receiver.hurry_this_thread()
        return os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK

    before = os.sched_getscheduler(0)
    policy = in_a_thread(hurried)
    assert os.sched_getscheduler(0) == before
    if policy != os.SCHED_RR:
        pytest.skip("this user may not schedule in real time")


def test_without_permission_nothing_changes(monkeypatch):
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    def policy_after_hurrying() -> int:
        receiver.hurry_this_thread()
        return os.sched_getscheduler(0)

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert in_a_thread(policy_after_hurrying) == os.sched_getscheduler(0)


def test_the_interpreter_is_kept_only_while_a_datagram_is_worked_on() -> None:
    before = sys.getswitchinterval()
    try:
        receiver.claim_interpreter()
        assert sys.getswitchinterval() >= 1e-3
        receiver.share_interpreter()
        assert sys.getswitchinterval() <= 2 * receiver.PATIENCE_S
    finally:
        sys.setswitchinterval(before)
