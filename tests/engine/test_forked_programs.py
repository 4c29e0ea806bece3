"""A program that begins as a fork does what it does when it begins from nothing (tests/processes.py)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from processes import ForkingPopen, Popen


@pytest.mark.parametrize("words", [
    ["rhot_app", "--version"], ["rhot_app", "dance"], ["rhot_app", "check", "rig.json"], ["rhot_node", "--help"],
    ["rhot_node", "--settings", "none.json", "--camera", "0"]])
def test_both_say_and_return_the_same(words: list[str], tmp_path: Path) -> None:
    (tmp_path / "rig.json").write_text('{"format": "rhot-rig", "ver')
    ended = []
    for start in (Popen, ForkingPopen):
        with start([sys.executable, "-m", *words], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                   text=True) as program:
            out, err = program.communicate()
        ended.append((program.returncode, out, err.splitlines()[-1:]))
    assert ended[0] == ended[1]
