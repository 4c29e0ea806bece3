"""The ``rhot`` command: fast help, sentences and exit codes, the engine and the replay as real processes."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest
from patience import PATIENCE_S, eventually
from synthetic_node import synthetic_rig

from rhot_app.engine.client import EngineClient
from rhot_app.engine.process import ensure_engine, running_engine, started_processes, stop_engine
from rhot_app.errors import EngineError
from rhot_app.project import Rig, save_rig
from rhot_app.recording.raw_log import LogReader
from rhot_app.state import HandState

IMPORTED = """
import sys
from rhot_app.__main__ import main
for arguments in ["--help"], ["--version"], ["engine", "--help"], ["replay", "--help"]:
    try:
        main(arguments)
    except SystemExit as exit:
        assert not exit.code, exit.code
heavy = sorted({"numba", "cv2", "scipy", "PySide6"} & set(sys.modules))
assert not heavy, heavy
"""


def rhot(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "rhot_app", *arguments], capture_output=True, text=True, timeout=90)


def test_help_imports_nothing_heavy() -> None:
    done = subprocess.run([sys.executable, "-c", IMPORTED], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert all(word in done.stdout for word in ("COMMAND", "--rig", "--speed"))


def test_mistakes_end_with_a_sentence_and_2(tmp_path: Path) -> None:
    (tmp_path / "half.json").write_text('{"format": "rhot-rig", "ver')
    (tmp_path / "foreign.log").write_bytes(b"something else")
    (tmp_path / "binary.log").write_bytes(b"\xae\xff\x00")
    for arguments, words in [
        (("engine", "--rig", str(tmp_path / "no.json")), "no.json: no such file"),
        (("engine", "--rig", str(tmp_path / "half.json")), "half.json: not valid JSON"),
        (("replay", str(tmp_path / "foreign.log"), "--json"), "foreign.log: this is not a raw log"),
        (("engine", "--rig", str(tmp_path / "foreign.log")), "foreign.log: not valid JSON"),
        (("engine", "--rig", str(tmp_path / "binary.log")), "binary.log: this is no text, so no rhot-rig file"),
        (("replay", str(tmp_path / "foreign.log"), "--smooth"), "foreign.log: this is not a raw log"),
        (("replay", str(tmp_path / "foreign.log"), "--speed", "fast"), "fast is neither a number nor max"),
        (("replay", str(tmp_path / "foreign.log"), "--jsn"), "no option '--jsn' here; did you mean --json?"),
        (("export", "--trakcer", "classic", "no.log"), "no option '--trakcer' here; did you mean --tracker?"),
        (("--motoin", "wave"), "there is no option '--motoin' here"),
        (("--frobnicate",), "there is no option '--frobnicate' here"),
        (("exprt", "no.log"), "there is no command 'exprt'; did you mean export?"),
        (("nonsense",), "there is no command 'nonsense'. See --help."),
        (("dance",), "there is no command 'dance'"), (("engine",), "--rig"), (("engine", "--rig"), "--rig"),
        (("replay",), "LOG"),
    ]:
        done = rhot(*arguments)
        assert done.returncode == 2, done
        assert words in done.stderr and "Traceback" not in done.stderr


def test_engine_process_from_start_to_end(tmp_path: Path, streaming_rig: Rig) -> None:
    rig_path, log_path, place = tmp_path / "rig.json", tmp_path / "a.log", tmp_path / "e"
    save_rig(rig_path, streaming_rig)
    command = [sys.executable, "-m", "rhot_app", "engine", "--rig", str(rig_path), "--log", str(log_path),
               "--directory", str(place), "--start", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as engine:
        assert engine.stdout is not None and engine.stderr is not None
        assert json.loads(engine.stdout.readline())["pid"] == engine.pid == running_engine(place)
        assert ensure_engine(rig_path, place) == engine.pid
        second = rhot("engine", "--rig", str(rig_path), "--directory", str(place))
        assert second.returncode == 2 and str(engine.pid) in second.stderr
        with EngineClient(place) as client:
            states: list[object] = []
            eventually(lambda: states.extend(m for m in client.poll(0.05) if isinstance(m, HandState))
                       or len(states) > 40)
            assert client.status is not None and client.status.log_bytes > 0
        engine.send_signal(signal.SIGTERM)
        assert engine.wait(PATIENCE_S) == 0
        assert engine.stderr.read() == ""
    assert running_engine(place) is None
    assert len(list(LogReader(log_path))) > 100
    by_model = json.loads(rhot("replay", str(log_path), "--json", "--tracker", "estimator").stdout)
    summary = json.loads(rhot("replay", str(log_path), "--json").stdout)
    assert by_model["states"] > 1.5 * summary["states"], "one per frame, not one per pair"
    smoothed = json.loads(rhot("replay", str(log_path), "--json", "--tracker", "estimator", "--smooth").stdout)
    assert smoothed["states"] == pytest.approx(by_model["states"], rel=0.1)
    assert (smoothed["smoothed"], by_model["smoothed"]) == (True, False)
    refused = rhot("replay", str(log_path), "--smooth", "--tracker", "classic")
    assert refused.returncode == 2 and "only the estimator smooths" in refused.stderr
    assert summary["states"] > 20
    assert summary["markers"]["wrist"]["measured_fraction"] > 0.9
    ended = rhot("replay", str(log_path), "--speed", "max", "--directory", str(place))
    assert ended.returncode == 0
    assert f"the log is over: {summary['states']} states in" in ended.stdout
    kept_replay_serves_on(log_path, place)


def test_an_engine_with_an_uncalibrated_rig_says_so_once_and_tells_its_clients(tmp_path: Path) -> None:
    rig_path, place = tmp_path / "rig.json", tmp_path / "e"
    save_rig(rig_path, msgspec.structs.replace(synthetic_rig(), calibration=None))
    command = [sys.executable, "-m", "rhot_app", "engine", "--rig", str(rig_path), "--directory", str(place)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as engine:
        assert engine.stderr is not None
        while "serves clients" not in engine.stderr.readline():
            assert engine.poll() is None
        assert engine.stderr.readline().startswith("rhot: Not calibrated: millimetres are not reliable.")
        with EngineClient(place) as client:
            eventually(lambda: client.poll(0.05) is not None and client.status is not None)
            assert client.status is not None
            told = [advice for advice in client.status.advice if advice.text.startswith("Not calibrated")]
            assert len(told) == 1 and told[0].lasting and told[0].mender == "lens"
        engine.send_signal(signal.SIGTERM)
        assert engine.wait(PATIENCE_S) == 0
        assert engine.stderr.read() == ""


def kept_replay_serves_on(log_path: Path, place: Path) -> None:
    """After the log's end there still is an engine, and it can replay again."""
    command = [sys.executable, "-m", "rhot_app", "replay", str(log_path), "--speed", "max", "--keep",
               "--directory", str(place)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as kept:
        assert kept.stdout is not None
        assert "Ctrl+C ends it" in kept.stdout.readline()
        with EngineClient(place) as client:
            assert client.command("hello")["pid"] == kept.pid
            client.command("start")
            eventually(lambda: client.poll(0.1) and client.state is not None)
        kept.send_signal(signal.SIGTERM)
        assert kept.wait(PATIENCE_S) == 0


def test_background_engine_is_killed_found_dead_and_started_again(tmp_path: Path) -> None:
    rig_path, place = tmp_path / "rig.json", tmp_path / "e"
    save_rig(rig_path, synthetic_rig())
    pid = ensure_engine(rig_path, place)
    directory = EngineClient(place).directory
    (started,) = started_processes(directory)
    assert (started.pid, started.role) == (pid, "engine")
    assert f"serves clients in {place}" in directory.log_file.read_text()
    os.kill(pid, signal.SIGKILL)
    eventually(lambda: running_engine(place) is None)
    again = ensure_engine(rig_path, place)
    assert again != pid
    with EngineClient(place) as client:
        eventually(lambda: client.poll(0.1) and client.status is not None)
    stop_engine(place)
    assert running_engine(place) is None
    assert started_processes(directory) == []


def test_background_engine_that_cannot_start_says_why(tmp_path: Path) -> None:
    with pytest.raises(EngineError, match=r"no\.json: no such file"):
        ensure_engine(tmp_path / "no.json", tmp_path / "e")
