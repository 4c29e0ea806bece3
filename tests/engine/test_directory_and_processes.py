"""The private directory, its lock, and processes found again and ended by their own ids only."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from rhot_app.engine import process as processes
from rhot_app.engine.directory import EngineLock, default_directory, lock_holder, open_directory
from rhot_app.errors import EngineError

HOLD = """
import sys, time
from pathlib import Path
from rhot_app.engine.directory import EngineLock, open_directory
lock = EngineLock(open_directory(Path(sys.argv[1])))
print("held", flush=True)
time.sleep(60)
"""


def test_directory_is_private(tmp_path: Path) -> None:
    place = open_directory(tmp_path / "engine")
    assert place.path.stat().st_mode & 0o777 == 0o700
    assert open_directory(tmp_path / "engine") == place


def test_open_or_foreign_directories_are_refused(tmp_path: Path) -> None:
    (tmp_path / "open").mkdir(mode=0o755)
    with pytest.raises(EngineError, match="chmod 700"):
        open_directory(tmp_path / "open")
    (tmp_path / "real").mkdir(mode=0o700)
    (tmp_path / "link").symlink_to(tmp_path / "real")
    with pytest.raises(EngineError, match="link"):
        open_directory(tmp_path / "link")
    with pytest.raises(EngineError, match="too long"):
        open_directory(tmp_path / ("x" * 100))
    (tmp_path / "file").touch()
    with pytest.raises(EngineError):
        open_directory(tmp_path / "file")
    if os.getuid() == 0:
        (tmp_path / "other").mkdir(mode=0o700)
        os.chown(tmp_path / "other", 12345, -1)
        with pytest.raises(EngineError, match="belongs to user 12345"):
            open_directory(tmp_path / "other")


def test_default_directory_follows_the_runtime_directory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/7")
    assert default_directory() == Path("/run/user/7/rhot")
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    assert default_directory() == Path(f"/tmp/rhot-{os.getuid()}")


def test_lock_names_its_holder_and_dies_with_it(tmp_path: Path) -> None:
    place = open_directory(tmp_path / "e")
    assert lock_holder(place) is None
    with subprocess.Popen([sys.executable, "-c", HOLD, str(place.path)], stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == b"held\n"
        assert lock_holder(place) == holder.pid
        with pytest.raises(EngineError, match=f"pid {holder.pid}"):
            EngineLock(place)
        holder.kill()
    lock = EngineLock(place)
    assert lock_holder(place) == os.getpid()
    lock.release()
    lock.release()
    assert lock_holder(place) is None


def spawn(code: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)


def test_started_processes_are_ended_and_only_they(tmp_path: Path) -> None:
    place = open_directory(tmp_path / "e")
    stubborn = "import signal, time; signal.signal(15, signal.SIG_IGN); print('up', flush=True); time.sleep(60)"
    children = [spawn("print('up', flush=True); import time; time.sleep(60)"), spawn(stubborn),
                spawn("print('up', flush=True); import time; time.sleep(60)")]
    for child in children:
        assert child.stdout is not None and child.stdout.readline() == b"up\n"
    for child, role in zip(children[:2], ("engine", "node left"), strict=True):
        processes.remember_process(place, child.pid, role)
    assert [process.role for process in processes.started_processes(place)] == ["engine", "node left"]
    processes.end_started(place, roles=["engine"])
    assert [process.role for process in processes.started_processes(place)] == ["node left"]
    processes.end_processes(processes.started_processes(place), timeout_s=0.3)
    assert processes.started_processes(place) == []
    assert children[2].poll() is None
    children[2].kill()
    for child in children:
        child.wait()
        assert child.stdout is not None
        child.stdout.close()


def test_a_number_given_to_another_process_is_never_signalled(tmp_path: Path) -> None:
    place = open_directory(tmp_path / "e")
    child = spawn("print('up', flush=True); import time; time.sleep(60)")
    assert child.stdout is not None and child.stdout.readline() == b"up\n"
    ticks = processes.start_ticks(child.pid)
    assert ticks is not None
    processes.end_processes([processes.StartedProcess(child.pid, ticks - 1, "engine")])
    assert child.poll() is None
    place.session_file.write_text(f'{{"processes": [{{"pid": {child.pid}, "started_ticks": 1, "role": "engine"}}]}}')
    assert processes.started_processes(place) == []
    place.session_file.write_text("{broken")
    assert processes.started_processes(place) == []
    child.kill()
    child.wait()
    child.stdout.close()
    assert processes.start_ticks(child.pid) is None
