"""The threads of a process: one that fails is named and goes on, one that hangs is named until it comes round."""

from __future__ import annotations

import re
import threading
from pathlib import Path

import pytest
from patience import PATIENCE_S, eventually

from rhot_node import threads
from rhot_node.threads import OneShotThread, TimedCalls, Worker, complaints

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "PAUSE_S", 0.01)
    monkeypatch.setattr(threads, "LASTING_S", 0.2)


def said(what: str) -> bool:
    return any(what in text for text in complaints())


@pytest.mark.parametrize("raised", [ValueError("not so"), SystemExit(0), MemoryError()])
def test_a_turn_that_fails_is_named_and_the_next_one_comes(raised: BaseException) -> None:
    turns: list[int] = []
    well = threading.Event()

    def turn() -> None:
        turns.append(1)
        if not well.is_set():
            raise raised
        worker.ending.wait(0.01)
    worker = Worker("counts turns", turn)
    worker.start()
    eventually(lambda: len(turns) > 3 and said("The part that counts turns failed"))
    assert said(type(raised).__name__)
    well.set()
    eventually(lambda: not said("counts turns"))
    assert worker.running
    worker.close()
    assert not worker.running


def test_a_turn_that_hangs_is_named_until_it_comes_round() -> None:
    go_on = threading.Event()
    worker = Worker("waits for ever", lambda: go_on.wait(PATIENCE_S), hang_s=0.05)
    worker.start()
    eventually(lambda: said("The part that waits for ever has not come round"))
    go_on.set()
    worker.ending.set()
    eventually(lambda: not said("waits for ever"))
    worker.close()


def test_waiting_for_work_is_no_hang() -> None:
    go_on = threading.Event()
    worker = Worker("waits for work", lambda: None, wait=lambda: go_on.wait(PATIENCE_S), hang_s=0.0)
    worker.start()
    eventually(lambda: worker.running)
    assert not said("waits for work")
    worker.ending.set()
    go_on.set()
    worker.close()


def test_begin_and_end_are_the_threads_own_and_may_fail() -> None:
    calls: list[str] = []

    def begin() -> None:
        calls.append(threading.current_thread().name)
        raise OSError("no priority")
    worker = Worker("begins badly", lambda: worker.ending.wait(), begin=begin, end=lambda: calls.append("end"))
    worker.start()
    eventually(lambda: calls)
    worker.close()
    assert calls == ["begins badly", "end"]


def test_a_task_that_fails_says_why() -> None:
    task = OneShotThread("does one thing", lambda: [][1])
    task.join(PATIENCE_S)
    assert not task.running and task.failure == "IndexError: list index out of range"
    assert said("does one thing")


def test_somebody_elses_call_is_waited_for_only_so_long_and_always_in_one_thread() -> None:
    calls, go_on = TimedCalls("calls others"), threading.Event()
    names = {calls.call(lambda: threading.current_thread().name, PATIENCE_S) for _ in range(3)}
    assert names == {"calls others"}
    with pytest.raises(SystemExit):
        calls.call(lambda: (_ for _ in ()).throw(SystemExit(1)), PATIENCE_S)
    with pytest.raises(TimeoutError):
        calls.call(go_on.wait, 0.01)
    with pytest.raises(TimeoutError):
        calls.call(lambda: None, PATIENCE_S)  # at once
    go_on.set()
    calls.close()


def test_every_thread_is_watched() -> None:
    """All but the window's own start here: what no supervisor knows of dies in silence."""
    started = {path.relative_to(ROOT).as_posix() for path in ROOT.glob("rhot_*/**/*.py")
               if re.search(r"\bThread\(", path.read_text())}
    assert {path for path in started if not path.startswith("rhot_app/ui/")} == {"rhot_node/threads.py"}
