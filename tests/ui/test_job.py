"""One-shot work: done or failed in the window's thread, never both, and neither after a cancel."""

from __future__ import annotations

import gc
import subprocess
import sys
import threading
import weakref

import pytest
import shiboken6
from patience import eventually
from PySide6.QtCore import QObject

from rhot_app.errors import RigError
from rhot_app.ui.common.job import THREADS, Job, end_jobs


@pytest.fixture
def heard():
    return []


def test_progress_then_done_in_the_windows_thread(qtbot, heard):
    here = threading.get_ident()

    def op(progress):
        progress.report("half", 0.5)
        assert threading.get_ident() != here
        return 42

    Job(op, lambda result: heard.append(("done", result, threading.get_ident() == here)), heard.append,
        lambda text, fraction: heard.append((text, fraction))).start()
    qtbot.waitUntil(lambda: len(heard) == 2)
    assert heard == [("half", 0.5), ("done", 42, True)]


def test_our_errors_are_told_as_they_are(qtbot, heard):
    def op(progress):
        raise RigError("desk.json: no such file.")

    Job(op, heard.append, lambda sentence: heard.append(("failed", sentence))).start()
    qtbot.waitUntil(lambda: bool(heard))
    assert heard == [("failed", "desk.json: no such file.")]


def test_a_programming_mistake_is_a_sentence_too_and_logged(qtbot, heard, caplog):
    def op(progress):
        return 1 // 0

    Job(op, heard.append, heard.append).start()
    qtbot.waitUntil(lambda: bool(heard))
    assert "ZeroDivisionError" in heard[0] and heard[0].endswith("Please report it.")
    qtbot.waitUntil(lambda: "a job failed" in caplog.text)


def test_a_cancelled_job_is_silent(qtbot, heard):
    gate = threading.Event()

    def op(progress):
        gate.wait(5.0)
        progress.report("too late", 1.0)

    job = Job(op, heard.append, heard.append, lambda *args: heard.append(args)).start()
    job.cancel()
    gate.set()
    assert job.wait(5.0)
    qtbot.wait(50)
    assert heard == [] and not job.running


def test_a_job_that_outlives_its_window_ends_quietly(qtbot, heard, caplog):
    gate = threading.Event()

    def op(progress):
        gate.wait(5.0)
        return "too late"

    window = QObject()
    job = Job(op, heard.append, heard.append, lambda *args: heard.append(args), window).start()
    shiboken6.delete(window)
    gate.set()
    assert job.wait(5.0)
    qtbot.wait(50)
    assert heard == [] and "a job failed" not in caplog.text


def test_a_job_that_is_cancelled_while_it_waits_for_a_thread_never_begins(qtbot, heard):
    gate, begun = threading.Event(), []
    waiting = [Job(lambda progress: gate.wait(20.0), heard.append, heard.append).start() for _ in range(THREADS)]
    late = Job(lambda progress: begun.append(1), heard.append, heard.append).start()
    late.cancel()
    gate.set()
    assert late.wait(20.0) and all(job.wait(20.0) for job in waiting)
    qtbot.waitUntil(lambda: len(heard) == THREADS)
    assert not begun


def test_work_that_asks_the_program_to_end_is_a_mistake_and_costs_no_thread(qtbot, heard):
    def op(progress):
        raise SystemExit(3)

    for _ in range(2 * THREADS):
        Job(op, heard.append, heard.append).start()
    Job(lambda progress: "still here", heard.append, heard.append).start()
    qtbot.waitUntil(lambda: len(heard) == 2 * THREADS + 1)
    assert "still here" in heard and sum("SystemExit" in str(one) for one in heard) == 2 * THREADS


def test_a_callback_that_fails_does_not_stop_the_next_job(qtbot, heard, qapp):
    def clumsy(result):
        raise ValueError("a widget is gone")

    with qtbot.captureExceptions() as raised:
        Job(lambda progress: 1, clumsy, heard.append).start()
        Job(lambda progress: 2, heard.append, heard.append).start()
        qtbot.waitUntil(lambda: heard == [2] and len(raised) == 1)
    assert not Job.under_way()


def test_work_whose_parent_ends_is_asked_to_stop(qtbot, heard):
    begun, stopped = threading.Event(), threading.Event()

    def op(progress):
        begun.set()
        eventually(lambda: progress.cancelled)
        stopped.set()

    window = QObject()
    job = Job(op, heard.append, heard.append, None, window).start()
    assert begun.wait(10.0)
    shiboken6.delete(window)
    assert job.wait(10.0) and stopped.is_set()
    qtbot.wait(50)
    assert heard == []


def test_a_thousand_jobs_leave_nothing_with_their_parent(qtbot):
    window, done = QObject(), []
    for number in range(1000):
        Job(lambda progress, number=number: number, done.append, done.append, None, window).start()
    qtbot.waitUntil(lambda: len(done) == 1000 and not window.children())
    assert sorted(done) == list(range(1000)) and not Job.under_way()


def test_the_end_of_the_app_cancels_and_waits(qtbot, heard):
    def op(progress):
        eventually(lambda: progress.report("on", 0.5))  # until that raises

    Job(op, heard.append, heard.append).start()
    assert end_jobs(10.0) == []
    qtbot.waitUntil(lambda: not Job.under_way())
    assert heard == []


ALONE = """
import os, subprocess, sys, threading, time
from PySide6.QtCore import QCoreApplication
from rhot_app.ui.app import NICENESS, give_way, leave
from rhot_app.ui.common.job import Job, workers
before = os.getpriority(os.PRIO_PROCESS, 0)
workers()
give_way()
assert os.getpriority(os.PRIO_PROCESS, 0) == min(before + NICENESS, 19)
app = QCoreApplication([])
"""
"""In a process of its own, because niceness cannot be taken back, and to see it end."""


def test_what_a_job_starts_is_not_as_nice_as_the_window():
    program = ALONE + """
def start(progress):
    return int(subprocess.check_output([sys.executable, "-c", "import os; print(os.nice(0))"])) - before
def tell(result):
    print(result)
    app.quit()
Job(start, tell, tell).start()
app.exec()
raise SystemExit(leave(0))
"""
    assert subprocess.check_output([sys.executable, "-c", program], text=True, timeout=60).strip() == "0"


def test_work_that_never_ends_does_not_keep_the_app():
    program = ALONE + """
begun = threading.Event()
def never(progress):
    begun.set()
    while True:
        time.sleep(1.0)
Job(never, print, print).start()
begun.wait()
print("closing", flush=True)
raise SystemExit(leave(5, 0.2))
"""
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout) == (5, "closing\n")
    assert "still at work when the app ended: never" in ended.stderr


def test_work_that_outlives_its_window_does_not_keep_the_app_either():
    program = ALONE + """
import shiboken6
from PySide6.QtCore import QObject
begun, window = threading.Event(), QObject()
def slow(progress):
    begun.set()
    time.sleep(20.0)
job = Job(slow, print, print, None, window).start()
begun.wait()
shiboken6.delete(window)
raise SystemExit(leave(5, 0.2))
"""
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout) == (5, "")
    assert "still at work when the app ended: slow" in ended.stderr


def test_the_end_of_abandoned_work_comes_after_its_window(qtbot):
    may_end, window = threading.Event(), QObject()
    job = Job(lambda progress: may_end.wait(60.0), print, print, None, window).start()
    shiboken6.delete(window)
    assert Job.under_way() == [job]
    may_end.set()
    qtbot.waitUntil(lambda: not Job.under_way())


def test_a_job_whose_parent_is_deleted_holds_nothing(qtbot):
    begun, may_end = threading.Event(), threading.Event()

    class Asker(QObject):
        def done(self, result):
            raise AssertionError("the window is gone")

    def work(progress):
        begun.set()
        may_end.wait(60.0)

    asker = Asker()
    job = Job(work, asker.done, asker.done, None, asker).start()
    assert begun.wait(60.0)
    gone = weakref.ref(asker)
    asker.deleteLater()
    del asker, job
    may_end.set()
    qtbot.waitUntil(lambda: gc.collect() >= 0 and gone() is None, timeout=60_000)
