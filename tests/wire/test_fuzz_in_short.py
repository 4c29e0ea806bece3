"""benchmarks/fuzz.py in short: every kind of broken datagram at every receiver, without and with the right key."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.skipif(importlib.util.find_spec("rhot_app") is None, reason="the master's side is not installed")
def test_nothing_broken_is_taken_and_nothing_raises(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, str(ROOT / "benchmarks" / "fuzz.py"), "--count", "8192", "--short",
                           "--json", str(tmp_path / "figures.json")], capture_output=True, text=True, timeout=150)
    assert done.returncode == 0, done.stdout + done.stderr
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert (figures["wild"]["datagrams"], figures["wild"]["taken"]) == (8192, 0)
    assert {"tag", "untagged", "replay", "duplicate", "marker", "time", "index", "range", "image_size",
            "unasked"} <= figures["wild"]["refused"].keys() | figures["keyed"]["refused"].keys()
