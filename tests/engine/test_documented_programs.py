"""The programs that the documents print do what the documents say, as written there."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from patience import PATIENCE_S

from rhot_app.project import Rig, save_rig

DOCS = Path(__file__).parents[2] / "docs"


def program(page: str) -> str:
    """The first Python program of a page."""
    found = re.search(r"```python\n(.*?)```", (DOCS / page).read_text(), re.DOTALL)
    assert found is not None, f"docs/{page} shows no program"
    return found[1]


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """One in which an engine's default directory is the test's own."""
    return {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path), "PYTHONUNBUFFERED": "1"}


def test_programs_read_states_of_an_engine_and_of_its_log(tmp_path: Path, environment: dict[str, str],
                                                          streaming_rig: Rig) -> None:
    save_rig(tmp_path / "my_rig.json", streaming_rig)
    command = [sys.executable, "-m", "rhot_app", "engine", "--rig", "my_rig.json", "--start", "--log", "take.rhotlog"]
    with subprocess.Popen(command, cwd=tmp_path, env=environment, stderr=subprocess.PIPE, text=True) as engine:
        assert engine.stderr is not None and any("serves clients" in line for line in engine.stderr)
        with subprocess.Popen([sys.executable, "-c", program("states.md")], env=environment, stdout=subprocess.PIPE,
                              text=True) as reader:
            assert reader.stdout is not None
            assert reader.stdout.readline().startswith("[")
            reader.kill()
        engine.send_signal(signal.SIGTERM)
        assert engine.wait(PATIENCE_S) == 0
    done = subprocess.run([sys.executable, "-c", program("tracking.md")], cwd=tmp_path, env=environment, text=True,
                          capture_output=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "TRACKING" in done.stdout


def test_a_take_is_held_against_its_truth(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "rhot_app", "simulate", "--seconds", "1.5", "--points", "--out", "take"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, timeout=60)
    done = subprocess.run([sys.executable, "-c", program("twin.md")], cwd=tmp_path, text=True, capture_output=True,
                          timeout=60)
    assert done.returncode == 0, done.stderr
    assert 1e-4 < float(done.stdout.split()[0]) < 2e-3
