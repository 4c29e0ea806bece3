"""What ./run says while somebody waits, and which commands it gives a screen."""

from __future__ import annotations

import fcntl
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from rhot_app.__main__ import SUBCOMMANDS

RUN = Path(__file__).parents[2] / "run"


def start(program: str, *functions: str, cwd: Path) -> subprocess.Popen[str]:
    """A program that uses these functions of ./run; one stream has all that it says."""
    text = RUN.read_text()
    found = [re.search(rf"^{name}\(\) \{{.*?(?:^\}}| \}})$", text, re.MULTILINE | re.DOTALL) for name in functions]
    assert all(found), functions
    parts = ["set -euo pipefail", *(one[0] for one in found if one), program]
    return subprocess.Popen(["bash", "-c", "\n".join(parts)], cwd=cwd, stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT, text=True)


def said(process: subprocess.Popen[str]) -> str:
    """All that it says; it must end well."""
    text, _ = process.communicate(timeout=60)
    assert process.returncode == 0, text
    return text


@pytest.mark.parametrize("command", SUBCOMMANDS)
def test_every_command_with_a_window_gets_a_screen(command: str, tmp_path: Path) -> None:
    program = f"opens_window {command} --rig x && echo window; opens_window {command} --help || echo none"
    expected = ["window"] * SUBCOMMANDS[command].module.startswith("rhot_app.ui.") + ["none"]
    assert said(start(program, "opens_window", cwd=tmp_path)).split() == expected


def test_a_long_step_says_how_far_it_is(tmp_path: Path) -> None:
    program = """LOG=log
sleep() { [ ! -e asked ] || touch told; until [ -s log ]; do command sleep 0.02; done; touch asked; }
logged bash -c "echo 1 of 9 steps compiled; until [ -e told ]; do sleep 0.02; done"; echo ended
logged false || echo failed"""
    lines = said(start(program, "say", "logged", cwd=tmp_path)).splitlines()
    assert re.fullmatch(r" +\d+ s: 1 of 9 steps compiled", lines[0]), lines
    assert lines[-2:] == ["ended", "failed"]


@pytest.mark.skipif(shutil.which("flock") is None, reason="needs flock")
def test_who_waits_for_another_set_up_is_told(tmp_path: Path) -> None:
    (tmp_path / "lock").touch()
    program = ('LOCK=lock\nis_set_up() { false; }\nfind_python() { echo python3; }\nmissing_packages() { :; }\n'
               'build_venv() { echo built; }\ncompile_code() { :; }\nset_up core none')
    with (tmp_path / "lock").open() as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        process = start(program, "say", "set_up", cwd=tmp_path)
        assert process.stdout is not None and "Another ./run" in process.stdout.readline()
    assert said(process) == "built\n"
    assert said(start(program, "say", "set_up", cwd=tmp_path)) == "built\n", "nobody waits"
