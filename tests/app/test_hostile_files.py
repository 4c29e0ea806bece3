"""Whatever file a command is given: one sentence that names it, exit code 2, and it neither hangs nor writes."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from rhot_app.__main__ import main
from rhot_node.files import resource_path

RIG = resource_path("rigs", "two_pis.json")
PATIENCE_S = 20


@pytest.fixture(autouse=True)
def _no_hang() -> Iterator[None]:
    def give_up(*_: object) -> None:
        raise AssertionError(f"it hangs: nothing came of it in {PATIENCE_S} s")
    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(PATIENCE_S)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def rig_with(fx: str) -> bytes:
    """The sample rig, the first camera's fx written so."""
    document = json.loads(RIG.read_bytes())
    document["nodes"][0]["intrinsics"]["fx"] = "HERE"
    return json.dumps(document).replace('"HERE"', fx).encode()


DEEP = 50_000
CONTENTS = {
    "lists": b"[" * DEEP + b"]" * DEEP, "objects": b'{"a":' * DEEP + b"1" + b"}" * DEEP, "digits": b"9" * 5000,
    "infinite": b"1e999", "zeros": bytes(1000), "deep_rig": rig_with("[" * DEEP + "]" * DEEP),
    "digits_rig": rig_with("9" * 5000), "large_rig": rig_with("9" * 300),
}
READERS = {
    "check": ["check", "FILE"], "engine": ["engine", "--rig", "FILE", "--directory", "FOLDER/engine"],
    "hand": ["hand", "FILE"],
    "motion": ["simulate", "--motion", "FILE", "--seconds", "0.1", "--out", "FOLDER/out"],
    "markers": ["simulate", "--markers", "FILE", "--seconds", "0.1", "--out", "FOLDER/out"],
    "depth": ["calibrate", "depth", "--table", "FILE"], "replay": ["replay", "FILE", "--json"],
    "bones": ["calibrate", "bones", "--tsv", "FILE"],
    "pictures": ["calibrate", "intrinsics", "--images", "FILE", "--board", "9x6", "--square-mm", "20"],
    "colours": ["calibrate", "colours", "--image", "FILE", "--sample", "a=1,1,2,2", "--out", "FOLDER/markers.json"],
}


def refused(arguments: list[str], path: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    entries = sorted(folder.iterdir())
    code = main([word.replace("FILE", str(path)).replace("FOLDER", str(folder)) for word in arguments])
    said = capsys.readouterr().err
    assert code == 2
    assert path.name in said, "the sentence names the file"
    assert "Traceback" not in said
    assert sorted(entry for entry in folder.iterdir() if entry.name != "engine") == entries


@pytest.mark.parametrize("content", CONTENTS)
@pytest.mark.parametrize("command", READERS)
def test_no_content_is_more_than_a_sentence(command: str, content: str, tmp_path: Path,
                                            capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / f"{content}.json"
    path.write_bytes(CONTENTS[content])
    refused(READERS[command], path, tmp_path, capsys)


@pytest.mark.parametrize("command", READERS)
def test_pipes_and_folders_are_not_read(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "folder.json").mkdir()
    os.mkfifo(tmp_path / "pipe.json")
    for name in ("pipe.json", "folder.json"):
        refused(READERS[command], tmp_path / name, tmp_path, capsys)


WRITERS = {
    "hand": ["hand", "--out", "FILE"], "drawing": ["hand", "--draw", "FILE"],
    "target": ["target", "chessboard", "--board", "9x6", "--square-mm", "20", "--out", "FILE"],
}


@pytest.mark.parametrize("command", WRITERS)
def test_pipes_and_folders_are_not_replaced(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "folder.pdf").mkdir()
    os.mkfifo(tmp_path / "pipe.pdf")
    for name in ("pipe.pdf", "folder.pdf"):
        mode = (tmp_path / name).lstat().st_mode
        refused(WRITERS[command], tmp_path / name, tmp_path, capsys)
        assert (tmp_path / name).lstat().st_mode == mode


@pytest.mark.parametrize("command", ["simulate", "evaluate", "nodes"])
@pytest.mark.parametrize("seconds", ["1e12", "inf", "nan", "-1", "0"])
def test_a_time_that_never_ends_is_refused(command: str, seconds: str, tmp_path: Path,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [command, f"--seconds={seconds}", *(["--out", str(tmp_path / "out")] if command == "simulate" else [])]
    assert main(arguments) == 2
    assert "seconds" in capsys.readouterr().err or command == "evaluate"
    assert not (tmp_path / "out").exists()
