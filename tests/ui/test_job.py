"""One-shot work: done or failed in the window's thread, never both, and neither after a cancel."""

from __future__ import annotations

import gc
import subprocess
import sys
import threading
import weakref

import pytest
import shiboken6
from PySide6.QtCore import QObject

from rhot_app.errors import RigError
from rhot_app.ui.common.job import Job


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
    gate, left = threading.Event(), threading.Event()

    def op(progress):
        gate.wait(5.0)
        progress.report("half", 0.5)
        left.set()

    window = QObject()
    job = Job(op, heard.append, heard.append, lambda *args: heard.append(args), window).start()
    shiboken6.delete(window)
    gate.set()
    assert job.wait(5.0) and left.is_set()
    qtbot.wait(50)
    assert heard == [] and "a job failed" not in caplog.text


def test_what_a_job_starts_is_not_as_nice_as_the_window():
    """In a process of its own, because niceness cannot be taken back."""
    program = """
import os, subprocess, sys, threading
from rhot_app.ui.app import NICENESS, give_way
from rhot_app.ui.common.job import workers
before = os.getpriority(os.PRIO_PROCESS, 0)
workers()
give_way()
assert os.getpriority(os.PRIO_PROCESS, 0) == min(before + NICENESS, 19)
done = threading.Event()
def start():
    print(int(subprocess.check_output([sys.executable, "-c", "import os; print(os.nice(0))"])) - before)
    done.set()
workers().submit(start)
assert done.wait(20)
"""
    assert subprocess.check_output([sys.executable, "-c", program], text=True).strip() == "0"


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
