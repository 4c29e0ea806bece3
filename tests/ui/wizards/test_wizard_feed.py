"""What works behind a wizard's window: live pictures, looks at them, long work in another process."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import slow_work
from fake_engine import synthetic_rig
from patience import PATIENCE_S, eventually, quickest, settled
from wizard_rig import FakeRigClient

from rhot_app.errors import CalibrationError
from rhot_app.ui.app import NICENESS as WINDOW_NICENESS
from rhot_app.ui.backend.feed import LiveFeed, StateFeed
from rhot_app.ui.backend.reader import Reader
from rhot_app.ui.backend.solver import Solver, StoppedError
from rhot_app.ui.backend.solver_process import NICENESS as SOLVER_NICENESS
from rhot_app.ui.language import use_language
from rhot_app.ui.wizards.framework.picture_worker import PictureWorker
from rhot_app.ui.wizards.framework.step import Step


@pytest.fixture
def client():
    return FakeRigClient(synthetic_rig())


@pytest.fixture
def feed(client):
    feed = LiveFeed({"left": 1, "right": 2}, client.connect, rate_hz=50.0).start()
    yield feed
    feed.stop()


@pytest.fixture(scope="module")
def environment():
    """The process can import the work."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(Path(slow_work.__file__).parent))
        yield


@pytest.fixture(scope="module")
def solver(environment):
    solver = Solver(niceness=0)
    yield solver
    solver.stop()


class Counting(Step):
    """Counts what it sees."""

    watches = True

    def observe(self, pictures):
        time.sleep(0.02)
        return {name: picture.number for name, picture in pictures.items()}


def test_the_feed_keeps_newest_pictures_of_both_cameras(feed):
    eventually(lambda: feed.newest("left") is not None and feed.newest("right") is not None)
    first = feed.newest("left")
    eventually(lambda: feed.newest("left").number > first.number)
    assert first.bgr.shape == (240, 320, 3)
    assert int(first.bgr[0, 0, 0]) == 80 and int(feed.newest("right").bgr[0, 0, 0]) == 100
    together = feed.together(("left", "right"))
    assert abs(together["left"].received_ns - together["right"].received_ns) < 100_000_000


def test_the_feed_says_why_there_is_no_picture_and_goes_on_afterwards(feed, client):
    client.refuse = "node left does not answer."
    eventually(lambda: feed.problem("left") == client.refuse)
    client.refuse = ""
    eventually(lambda: feed.problem("left") == "")
    assert feed.newest("left") is not None


def test_a_paused_feed_asks_for_nothing(feed, client):
    eventually(lambda: feed.newest("left") is not None)
    feed.pause(True)

    def silent():
        asked = len(client.commands)
        return settled(lambda: len(client.commands) == asked, 0.3)

    eventually(silent)  # what was under way is still asked
    asked = len(client.commands)
    feed.pause(False)
    eventually(lambda: len(client.commands) > asked)
    assert feed.problem("left") == ""


def test_a_picture_that_was_overtaken_is_left_out(client):
    feed = LiveFeed({"left": 1}, client.connect)
    feed.step("left", client)
    newest = feed.newest("left")
    client.number = newest.number - 2
    feed.step("left", client)
    assert feed.newest("left") is newest


def test_a_stopped_feed_closes_its_connections(client):
    feed = LiveFeed({"left": 1}, client.connect, rate_hz=50.0).start()
    eventually(lambda: feed.newest("left") is not None)
    feed.stop()
    assert client.closed == 2


class Stubborn(Reader):
    """Reads from what does not answer."""

    def __init__(self) -> None:
        super().__init__([(1,), (2,), (3,)])
        self.begun: list[int] = []
        self.answer = threading.Event()

    def _run(self, number: int) -> None:
        self.begun.append(number)
        self.answer.wait(60.0)


def test_the_end_of_a_reader_is_bounded_and_final():
    reader = Stubborn()
    assert reader.start() is reader.start()
    eventually(lambda: sorted(reader.begun) == [1, 2, 3])
    assert quickest(lambda: reader.stop(0.2), 0.5) < 0.5, "the three share the time"
    assert not reader.stop(0.0)
    reader.answer.set()
    assert reader.stop()
    reader.start()
    assert settled(lambda: len(reader.begun) == 3, 0.1)


def test_a_paused_feed_ends_at_once(feed):
    feed.pause(True)
    assert feed.stop()


def test_a_mistake_in_a_reader_is_logged(caplog):
    def connect():
        raise ValueError("no context")

    feed = StateFeed(connect).start()
    eventually(lambda: "no context" in caplog.text)
    assert "StateFeed" in caplog.text and feed.recent() == []
    assert feed.stop()


def test_the_worker_gives_each_finding_once_and_only_to_its_step(feed):
    worker, step, other = PictureWorker(feed).start(), Counting(), Counting()
    worker.watch(step)
    found = []

    def take():
        seen = worker.found(step)
        if seen is not None:
            found.append(tuple(seen.items()))
        return len(found) >= 3

    eventually(take)
    worker.watch(other)
    assert worker.found(step) is None
    worker.stop()
    assert len(set(found)) == len(found), "the same pictures were looked at twice"


def test_a_look_that_fails_does_not_end_the_live_view(feed):
    class Clumsy(Counting):
        looks = 0

        def observe(self, pictures):
            self.looks += 1
            raise ValueError("a strange picture")

    worker, step = PictureWorker(feed).start(), Clumsy()
    worker.watch(step)
    eventually(lambda: step.looks >= 2)
    other = Counting()
    worker.watch(other)
    eventually(lambda: worker.found(other) is not None)
    worker.stop()


def test_work_reports_progress_and_gives_its_result(solver):
    reports = []
    assert solver.run(slow_work.count, (4, 0.06), lambda text, fraction: reports.append((text, fraction))) == 4
    assert reports[-1] == ("counting", 1.0) and len(reports) >= 3
    assert solver.run(slow_work.count, (1, 0.0), lambda text, fraction: None) == 1, "the process serves again"


def test_errors_of_work_are_sentences(solver):
    with pytest.raises(CalibrationError, match="too few pictures"):
        solver.run(slow_work.refuse, (), lambda text, fraction: None)
    with pytest.raises(CalibrationError, match="ended unexpectedly"):
        solver.run(slow_work.die, (), lambda text, fraction: None)
    assert solver.run(slow_work.count, (1, 0.0), lambda text, fraction: None) == 1


def test_work_is_stopped_at_once_however_busy_it_is(solver):
    solver.prepare("slow_work")
    errors, stopped_s, begun = [], [], threading.Event()

    def run():
        try:
            solver.run(slow_work.hold_the_interpreter, (60.0,), lambda text, fraction: begun.set())
        except StoppedError as exc:
            errors.append(exc)

    for count in range(1, 6):  # the quickest of a few counts: the machine has other things to do
        thread = threading.Thread(target=run)
        begun.clear()
        thread.start()
        assert begun.wait(PATIENCE_S)
        began = time.monotonic()
        solver.stop()
        thread.join(PATIENCE_S)
        stopped_s.append(time.monotonic() - began)
        assert len(errors) == count
        if stopped_s[-1] < 2.0:
            break
    assert min(stopped_s) < 2.0


def test_work_runs_in_another_process_that_gives_way(environment):
    solver = Solver()
    pid, niceness, threads = solver.run(slow_work.who, (), lambda text, fraction: None)
    solver.stop()
    assert pid != os.getpid() and niceness == SOLVER_NICENESS and threads == "1"
    assert WINDOW_NICENESS < SOLVER_NICENESS < 19, "it gives way to the window, and is not starved by a busy computer"


def test_work_speaks_the_language_of_the_window(environment, capfd):
    use_language("de")
    solver, said = Solver(niceness=0), []
    try:
        result = solver.run(slow_work.say_what_is_done, (), lambda text, fraction: said.append(text))
    finally:
        solver.stop()
        use_language("en")
    assert (said, result) == (["Der Tracker wird vorbereitet …"], "Alles andere wird gezeigt.")
    assert capfd.readouterr().err == ""


def test_the_solving_process_imports_no_qt():
    module = "rhot_app.ui.backend.solver_process"
    code = f"import {module}, sys; sys.exit(any('PySide6' in m for m in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
