"""The real processes behind the window: started, found again, restarted, and ended with nothing left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from fake_engine import synthetic_rig
from patience import PATIENCE_S, eventually

from rhot_app.engine.client import EngineClient
from rhot_app.engine.process import running_engine, start_ticks
from rhot_app.errors import EngineError, RecordingError, RigError, SimulatorError
from rhot_app.project import save_rig, with_tracker
from rhot_app.ui.backend import session as session_module
from rhot_app.ui.backend.contract import TwinChoice, TwinPace
from rhot_app.ui.backend.session import Session


def quiet(text: str, fraction: float) -> None:
    """Nobody looks."""


@pytest.fixture
def session(tmp_path):
    session = Session(tmp_path / "e")
    yield session
    session.close()
    assert session.processes == []


@pytest.fixture
def rig_path(tmp_path):
    save_rig(tmp_path / "desk.json", synthetic_rig())
    return tmp_path / "desk.json"


def test_an_engine_is_started_found_restarted_and_ended(session, rig_path):
    opened = session.open_rig(rig_path, quiet)
    assert (opened.rig.name, opened.ours, opened.simulated, opened.running) == ("test bench", True, False, False)
    first = running_engine(session.directory)
    later = Session(session.directory)
    assert later.found() and later.attach(quiet).ours
    os.kill(first, signal.SIGKILL)
    eventually(lambda: not later.found())
    assert later.restart_engine(str(rig_path), True, quiet).running
    second = running_engine(session.directory)
    assert second not in (None, first)
    assert later.close() == ""
    assert not session.found() and start_ticks(second) is None


def test_an_engine_started_by_hand_is_left_running(session, rig_path):
    process = subprocess.Popen([sys.executable, "-m", "rhot_app", "engine", "--rig", str(rig_path), "--unchecked",
                                "--directory", str(session.directory), "--json"], stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None and process.stdout.readline()
        assert not session.attach(quiet).ours
        with pytest.raises(EngineError, match="started by hand"):
            session.open_rig(rig_path, quiet)
        assert "goes on running" in session.close()
        assert process.poll() is None
    finally:
        process.terminate()
        process.wait(PATIENCE_S)


def test_an_engine_that_records_is_not_replaced(session, rig_path, tmp_path):
    session.open_rig(rig_path, quiet)
    engine = running_engine(session.directory)
    with EngineClient(session.directory) as client:
        client.command("record", path=str(tmp_path / "r.rhotlog"))
        with pytest.raises(RecordingError, match=r"r\.rhotlog"):
            session.open_rig(rig_path, quiet)
        assert running_engine(session.directory) == engine
        client.command("record_stop")
    session.open_rig(rig_path, quiet)
    assert running_engine(session.directory) not in (None, engine)


def test_an_engine_that_hangs_is_replaced_and_its_recording_continued(session, rig_path, tmp_path, monkeypatch):
    session.open_rig(rig_path, quiet)
    hung = running_engine(session.directory)
    with session.command_client() as client:
        client.command("record", path=str(tmp_path / "r.rhotlog"))
        eventually(lambda: "r.rhotlog" in (session.directory / "engine.json").read_text())
        os.kill(hung, signal.SIGSTOP)
        monkeypatch.setattr(session_module, "ANSWER_S", 0.3)
        with pytest.raises(RecordingError, match=rf"r\.rhotlog.*kill {hung}"):
            session.open_rig(rig_path, quiet)
        assert running_engine(session.directory) == hung, "an engine that records is not replaced by another rig"
        monkeypatch.setattr(session_module, "ANSWER_S", PATIENCE_S)
        os.kill(hung, signal.SIGCONT)
        with pytest.raises(RecordingError, match="Stop that recording"):
            session.open_rig(rig_path, quiet)
        os.kill(hung, signal.SIGSTOP)
        monkeypatch.setattr(session_module, "ANSWER_S", 0.3)
        session.restart_engine(str(rig_path), False, quiet)
        assert running_engine(session.directory) not in (None, hung)
        assert client.command("status", timeout_s=PATIENCE_S)["status"]["log_path"] == str(tmp_path / "r-part2.rhotlog")


def test_a_missing_rig_starts_nothing(session, tmp_path):
    with pytest.raises(RigError, match="no such file"):
        session.open_rig(tmp_path / "none.json", quiet)
    assert not session.found()


STAND_IN = """
import pathlib, shutil, sys, time
arguments = dict(zip(sys.argv[2::2], sys.argv[3::2]))
assert arguments["--motion"] in ("rest", "slow"), "there is no such motion"
shutil.copy(sys.argv[1], arguments["--rig"])
time.sleep(30.0 if arguments["--motion"] == "slow" else 0.2)
print('{"nodes": ["left", "right"]}', flush=True)
print('{"event": "slow", "achieved_hz": 11.25, "preset_hz": 40}', flush=True)
print('{"event": "slow", "achi', end="", flush=True)
time.sleep(600)
"""


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """A program in the twin's place that does nothing but be there; the real one has its own end-to-end test."""
    script, rig_path = tmp_path / "twin.py", tmp_path / "twin.json"
    script.write_text(STAND_IN)
    save_rig(rig_path, with_tracker(synthetic_rig(), "estimator"))
    monkeypatch.setattr(session_module, "TWIN_COMMAND", (sys.executable, str(script), str(rig_path)))


def test_simulated_nodes_are_started_watched_and_ended(session, stand_in):
    opened = session.open_twin(TwinChoice(motion="rest", tracker="classic"), quiet)
    assert opened.rig.tracker.kind == "classic", "the twin's own rig has the other one"
    assert opened.simulated and opened.ours and session.twin_alive()
    eventually(lambda: session.twin_pace() == TwinPace(11.25, 40.0))
    assert {process.role for process in session.processes} == {"engine", session_module.TWIN_ROLE}
    twin = next(process for process in session.processes if process.role == session_module.TWIN_ROLE)
    os.kill(twin.pid, signal.SIGKILL)
    eventually(lambda: not session.twin_alive())


def test_the_twin_may_catch_up(tmp_path):
    output = tmp_path / "twin.out"
    slow, in_time = (f'{{"event": "{word}", "achieved_hz": 20.0, "preset_hz": 40.0}}\n' for word in ("slow", "in_time"))
    output.write_text(slow + in_time)
    assert session_module.pace_in(output) is None
    output.write_text(slow + in_time + slow)
    assert session_module.pace_in(output) == TwinPace(20.0, 40.0)


def test_a_twin_that_cannot_start_says_why(session, stand_in):
    with pytest.raises(SimulatorError, match=r"did not start.*no such motion"):
        session.open_twin(TwinChoice(motion="no_such_motion"), quiet)
    assert not session.found() and session.twin_alive()


def test_a_cancelled_start_leaves_nothing(session, stand_in):
    def stop_soon(text: str, fraction: float) -> None:
        if fraction > 0.16:
            raise RigError("cancelled by the test")

    with pytest.raises(RigError):
        session.open_twin(TwinChoice(motion="slow"), stop_soon)
    assert session.processes == [] and not Path(session.directory / "session.json").exists()
