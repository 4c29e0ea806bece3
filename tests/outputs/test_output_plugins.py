"""Outputs from other packages: the example of docs/plugins.md installed by pip, and what broken ones do."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from patience import eventually
from streams import Stream
from synthetic_node import SyntheticNode

from rhot_app.errors import OutputError
from rhot_app.outputs.outputs import make_sink
from rhot_app.outputs.spec import parse_output
from rhot_app.project import Rig, save_rig

PAGE = (Path(__file__).parents[2] / "docs" / "plugins.md").read_text()


def block(language: str) -> str:
    """The page's first block of a language."""
    found = re.search(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    assert found is not None
    return found[1]


def test_the_example_is_installed_and_gets_every_state(tmp_path: Path, rig: Rig) -> None:
    package, site = tmp_path / "package", tmp_path / "site"
    package.mkdir()
    (package / "pyproject.toml").write_text(block("toml"))
    (package / "rhot_example.py").write_text(block("python"))
    subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-index",
                    "--no-deps", "--no-build-isolation", "--target", str(site), str(package)], check=True)
    save_rig(tmp_path / "rig.json", rig)
    nodes = [SyntheticNode(rig, camera) for camera in (0, 1)]
    for node in nodes:
        node.start()
    lines = tmp_path / "lines.txt"
    command = [sys.executable, "-m", "rhot_app", "engine", "--rig", "rig.json", "--start", "--directory", "engine",
               "--output", f"lines:{lines}?joints=mediapipe"]
    with subprocess.Popen(command, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(site)}) as engine:
        try:
            eventually(lambda: lines.exists() and lines.read_text().count("\n") > 20)
        finally:
            engine.send_signal(signal.SIGTERM)
    assert engine.returncode == 0
    for node in nodes:
        node.close()
    assert re.fullmatch(r"WRIST of right: -?\d\.\d{3} -?\d\.\d{3} \d\.\d{3}", lines.read_text().splitlines()[10])


@pytest.fixture
def broken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A package of broken outputs on the path."""
    (tmp_path / "rhot_broken_outputs.py").write_text('''
import time
from rhot_app.errors import OutputError

def raises(settings):
    raise ZeroDivisionError("nothing there")

def refuses(settings):
    raise OutputError("give me a colour.")

def poor(settings):
    return object()

def exits(settings):
    raise SystemExit(0)

def hangs(settings):
    time.sleep(3600)

class leaves:
    def __init__(self, settings):
        pass
    def open(self):
        pass
    def write(self, sample):
        raise SystemExit(3)
    def close(self):
        raise SystemExit(4)

class late:
    def __init__(self, settings):
        pass
    def open(self):
        pass
    def write(self, sample):
        raise KeyError("thumb")
    def close(self):
        raise RuntimeError("no end")
''')
    info = tmp_path / "rhot_broken_outputs-2.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: rhot-broken-outputs\nVersion: 2.0\n")
    (info / "entry_points.txt").write_text("[rhot.outputs]\n" + "".join(
        f"{name} = rhot_broken_outputs:{name}\n" for name in ("raises", "refuses", "poor", "late", "exits", "hangs",
                                                           "leaves"))
        + "missing = rhot_nowhere:thing\n")
    monkeypatch.syspath_prepend(str(tmp_path))


@pytest.mark.parametrize(("name", "sentence"), [
    ("raises", "the plug-in 'raises' of rhot-broken-outputs 2.0 failed to begin (ZeroDivisionError: nothing there)"),
    ("poor", "has no open and no write and no close()"), ("missing", "cannot be loaded (ModuleNotFoundError"),
    ("refuses", "give me a colour."), ("late", "it failed (KeyError: 'thumb')"), ("exits", "SystemExit"),
    ("leaves", "it failed (SystemExit: 3)"), ("hangs", "it has not opened for")])
def test_a_broken_output_is_a_sentence_and_others_go_on(broken: None, stream: Callable[..., Stream], name: str,
                                                        sentence: str, tmp_path: Path) -> None:
    running = stream(name, "osc:127.0.0.1:9")
    eventually(lambda: sentence in running.outputs.status()[0].message, told=running.outputs.status)
    eventually(lambda: running.outputs.status()[1].sent > 5)


def test_an_unknown_name_lists_the_plug_ins(broken: None) -> None:
    with pytest.raises(OutputError, match="plug-ins exits, hangs, late, leaves, missing, poor, raises, refuses"):
        make_sink(parse_output("nothing"))
