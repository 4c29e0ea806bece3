"""Compiling in processes of their own: said while it lasts, ended with whoever asked, and failing in a sentence."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest
from patience import PATIENCE_S, eventually

from rhot_app.engine.compilation import BackgroundCompilation, compile_part, part_of
from rhot_app.engine.process import start_ticks
from rhot_app.errors import EngineError
from rhot_app.project import TrackerSettings, load_rig
from rhot_app.warm import PARTS
from rhot_node.compiled import ALL, VARIABLE, WINDOW, mark_complete
from rhot_node.files import resource_path

STEPS = "print('0 of 2 steps compiled'); print('a warning'); print('1 of 2 steps compiled; tracker: 3 s')"
WAITING = f"import time; {STEPS.replace(')', ', flush=True)')}; time.sleep(1000)"


def program(code: str) -> tuple[str, ...]:
    return sys.executable, "-c", code


@pytest.fixture(autouse=True)
def nothing_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))


def test_progress_is_reported_and_what_is_compiled_is_not_compiled_again() -> None:
    reports: list[float] = []
    compile_part(WINDOW, lambda text, fraction: reports.append(fraction), command=program(STEPS))
    assert reports[0] == 0.0 and reports[-1] == 0.5
    mark_complete(WINDOW)
    compile_part(WINDOW, lambda text, fraction: pytest.fail("it is compiled"), command=program("raise SystemExit(1)"))


def test_it_is_said_how_long_a_step_has_been_compiled_that_takes_long() -> None:
    texts: list[str] = []
    compile_part(WINDOW, lambda text, fraction: texts.append(text),
                 command=program("print('0 of 2 steps compiled'); print('0 of 2 steps compiled, 12 s so far')"))
    assert len(texts) == 3 and "so far" in texts[-1]


def test_nothing_is_compiled_where_nothing_can_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE)
    said: list[str] = []
    started: list[int] = []
    compile_part(WINDOW, lambda text, fraction: said.append(text), started.append, program(STEPS))
    assert not said and not started, "for whom?"


@pytest.mark.parametrize(("code", "reason"), [("print('rhot: the disk is full'); raise SystemExit(2)", "disk is full"),
                                              ("import os; os.kill(os.getpid(), 9)", "ended")])
def test_a_failure_says_why(code: str, reason: str) -> None:
    with pytest.raises(EngineError, match=reason):
        compile_part(WINDOW, lambda text, fraction: None, command=program(code))


def test_who_gives_up_ends_the_process() -> None:
    started: list[int] = []

    def report(text: str, fraction: float) -> None:
        if fraction > 0.0:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        compile_part(WINDOW, report, started.append, program(WAITING))
    assert start_ticks(started[0]) is None


def test_the_rest_is_compiled_in_the_background_and_ends_with_the_window() -> None:
    compilation = BackgroundCompilation(program(WAITING))
    compilation.start()
    eventually(lambda: compilation.advice is not None and "1 of 2" in compilation.advice.text)
    compilation.close()
    eventually(lambda: compilation.advice is None)
    broken = BackgroundCompilation(program("print('rhot: no room'); raise SystemExit(2)"))
    broken.start()
    eventually(lambda: broken.advice is not None and "no room" in broken.advice.text)
    mark_complete(ALL)
    done = BackgroundCompilation(program("raise SystemExit(2)"))
    done.start()
    assert done.advice is None


@pytest.mark.parametrize("settings", [TrackerSettings(), TrackerSettings(ik="dls"), TrackerSettings("estimator"),
                                      TrackerSettings("estimator", observe="contours")])
def test_every_rigs_tracker_is_a_part_that_can_be_compiled(settings: TrackerSettings) -> None:
    rig = msgspec.structs.replace(load_rig(resource_path("rigs", "two_pis.json")), tracker=settings)
    assert part_of(rig) in PARTS


def children_of(process: subprocess.Popen[bytes]) -> list[int]:
    return [int(pid) for pid in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()]


def test_an_ended_compilation_leaves_no_process() -> None:
    process = subprocess.Popen([sys.executable, "-m", "rhot_app.warm", "contours"], stdout=subprocess.PIPE)
    eventually(lambda: len(children_of(process)) == 2)  # the worker, and what watches over its semaphores
    pids = children_of(process)
    process.terminate()
    process.communicate()
    eventually(lambda: not any(start_ticks(pid) for pid in pids))


def test_an_interrupt_ends_all_steps(tmp_path: Path) -> None:
    process = subprocess.Popen([sys.executable, "-m", "rhot_app.warm", "window"], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, start_new_session=True)
    eventually(lambda: any(tmp_path.rglob("*.nbi")))  # the first steps are being compiled, others wait
    pids = children_of(process)
    os.killpg(process.pid, signal.SIGINT)  # Ctrl-C reaches all processes in the terminal
    try:
        process.communicate(timeout=PATIENCE_S)
    finally:
        process.kill()
    assert process.returncode == -signal.SIGINT
    eventually(lambda: not any(start_ticks(pid) for pid in pids))
