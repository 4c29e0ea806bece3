"""Whatever file a command is given: one sentence that names it, exit code 2, and it neither hangs nor writes."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import signal
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from rhot_app.__main__ import SUBCOMMANDS, main
from rhot_app.errors import RhotError
from rhot_app.project import load_rig, save_rig
from rhot_node.files import TABLE_LINES_MAX, resource_path
from rhot_node.markers import load_markers

RIG = resource_path("rigs", "two_pis.json")
LANDMARKS = resource_path("markers", "landmarks21.json")
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
    "hand": ["hand", "FILE"], "scene": ["simulate", "--scene", "FILE", "--out", "FOLDER/out"],
    "motion": ["simulate", "--motion", "FILE", "--seconds", "0.1", "--out", "FOLDER/out"],
    "markers": ["simulate", "--markers", "FILE", "--seconds", "0.1", "--out", "FOLDER/out"],
    "landmarks": ["landmarks", "FILE", "FILE", "--rig", "RIG", "--fps", "30", "--out", "FOLDER/out"],
    "alignment": ["calibrate", "alignment", "--foreign", "FILE", "--rig-points", "FILE"],
    "layers": ["layers", "FILE", "--out", "FOLDER/layers.png"], "object": ["object", "FILE"],
    "depth": ["calibrate", "depth", "--table", "FILE"], "replay": ["replay", "FILE", "--json"],
    "bones": ["calibrate", "bones", "--tsv", "FILE"],
    "import": ["calibrate", "import", "FILE", "--out", "FOLDER/rig.json"],
    "pictures": ["calibrate", "intrinsics", "--images", "FILE", "--board", "9x6", "--square-mm", "20"],
    "colours": ["calibrate", "colours", "--image", "FILE", "--sample", "a=1,1,2,2", "--out", "FOLDER/markers.json"],
}


def code_of(arguments: list[str]) -> int:
    """The exit code, also of what argparse refuses."""
    try:
        return main(arguments)
    except SystemExit as exc:
        return int(exc.code or 0)


@pytest.fixture(autouse=True, scope="module")
def landmark_rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rig of landmarks, for what takes no other."""
    path = tmp_path_factory.mktemp("rig") / "rig.json"
    save_rig(path, msgspec.structs.replace(load_rig(RIG), markers=load_markers(LANDMARKS)))
    READERS["landmarks"] = [word.replace("RIG", str(path)) for word in READERS["landmarks"]]
    return path


def words_of(arguments: list[str], path: Path | str, folder: Path) -> list[str]:
    return [word.replace("FILE", str(path)).replace("FOLDER", str(folder)) for word in arguments]


def assert_refused(arguments: list[str], path: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    entries = sorted(folder.iterdir())
    code = main(words_of(arguments, path, folder))
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
    assert_refused(READERS[command], path, tmp_path, capsys)


@pytest.mark.parametrize("command", READERS)
def test_pipes_and_folders_are_not_read(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "folder.json").mkdir()
    os.mkfifo(tmp_path / "pipe.json")
    for name in ("pipe.json", "folder.json"):
        assert_refused(READERS[command], tmp_path / name, tmp_path, capsys)


LINES = TABLE_LINES_MAX + 1
MUCH = {"picture": b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + struct.pack(">IIBBBBB", 30000, 30000, 8, 2, 0, 0, 0) + bytes(99),
        "lines": b"\n" * LINES, "line": b"1,2,3,4;" * 500_000,
        "loop": json.dumps({"format": "rhot-articulated", "version": 1, "name": "loop", "root": {"name": "root"},
                            "frames": [{"name": f"f{k}", "parent": f"f{(k + 1) % 40_000}"} for k in range(40_000)]}
                           ).encode()}


@pytest.mark.parametrize("content", MUCH)
@pytest.mark.parametrize("command", READERS)
def test_no_file_is_too_much(command: str, content: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / f"{content}.json"
    path.write_bytes(MUCH[content])
    assert_refused(READERS[command], path, tmp_path, capsys)


@pytest.mark.parametrize("name", ["a" * 300, "b" * 5000, "c\x1b[31m\x07.json", "d\udcff"],
                         ids=["long", "longer", "escape", "no UTF-8"])
@pytest.mark.parametrize("command", READERS)
def test_no_name_is_more_than_a_sentence(command: str, name: str, tmp_path: Path,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words_of(READERS[command], name, tmp_path)) == 2
    said = capsys.readouterr()
    assert said.err.strip() and "Traceback" not in said.err and "\x1b" not in said.err + said.out


MEASURE = """
import os, subprocess, sys
program = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)
_, status, used = os.wait4(program.pid, 0)
print(os.waitstatus_to_exitcode(status), used.ru_maxrss, used.ru_utime + used.ru_stime)
"""
"""Runs a program; exit code, most resident KiB, s. A process counts what its parent had when it was started: a small
one."""


@pytest.mark.study("rhot_app", "rhot_node")
def test_no_input_takes_a_gigabyte_or_twenty_seconds(landmark_rig: Path, tmp_path: Path) -> None:
    signal.alarm(0)  # of `_no_hang`: there are two hundred programs
    with (tmp_path / "sparse").open("wb") as file:
        file.truncate(6 << 30)
    os.mkfifo(tmp_path / "pipe")
    for name, content in (CONTENTS | MUCH).items():
        (tmp_path / name).write_bytes(content)
    for name in ("/dev/zero", *(path.name for path in sorted(tmp_path.iterdir()))):
        for arguments in READERS.values():
            words = words_of(arguments, tmp_path / name, tmp_path / "new")
            ran = subprocess.run([sys.executable, "-S", "-c", MEASURE, sys.executable, "-m", "rhot_app", *words],
                                 stdin=subprocess.DEVNULL, capture_output=True)
            code, most_kib, cpu_s = ran.stdout.split()
            assert int(code) == 2 and b"Traceback" not in ran.stderr, (words, ran.stderr)
            assert int(most_kib) < 1_000_000 and float(cpu_s) < PATIENCE_S, (words, ran.stdout)


# -- numbers of options ------------------------------------------------------------------------------------------------

NOT_FINITE = ("nan", "inf", "-inf", "1e999", "9" * 5000, "x\x1b[31m")
MAY_BE_ZERO = {"--seed", "--at", "--loss", "--points", "--places"}
"""Options that mean something with 0. None does with a number below."""


def parsers(parser: argparse.ArgumentParser, words: tuple[str, ...]) -> Iterator[
        tuple[tuple[str, ...], argparse.ArgumentParser]]:
    """A command's parser and those of its subcommands, each with the words that lead to it."""
    yield words, parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, inner in action.choices.items():
                yield from parsers(inner, (*words, name))


def takes_a_number(action: argparse.Action) -> bool:
    """Whether an option's type makes a number of "1"."""
    try:
        return bool(action.option_strings and callable(action.type) and isinstance(action.type("1"), int | float))
    except (RhotError, ValueError, argparse.ArgumentTypeError):
        return False


def numeric_options() -> list[tuple[tuple[str, ...], str]]:
    """Every option of every command that takes a number."""
    found = []
    for name, command in SUBCOMMANDS.items():
        whole = argparse.ArgumentParser()
        importlib.import_module(command.module).add_arguments(whole)
        found += [(words, action.option_strings[0]) for words, parser in parsers(whole, (name,))
                  for action in parser._actions if takes_a_number(action)]
    return found


def test_every_option_that_takes_a_number_is_found() -> None:
    options = numeric_options()
    assert len(options) > 50 and (("calibrate", "depth"), "--baseline-mm") in options


@pytest.mark.parametrize(("words", "option"), numeric_options(), ids=lambda part: part if isinstance(part, str) else
                         " ".join(part))
def test_no_number_is_more_than_a_sentence(words: tuple[str, ...], option: str,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    senseless = ["-1", *([] if option in MAY_BE_ZERO else ["0"])]
    for number in (*NOT_FINITE, *senseless):
        assert code_of([*words, f"{option}={number}"]) == 2, number
        said = capsys.readouterr().err
        assert option in said and "\x1b" not in said and "Traceback" not in said, number


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
        assert_refused(WRITERS[command], tmp_path / name, tmp_path, capsys)
        assert (tmp_path / name).lstat().st_mode == mode


@pytest.mark.parametrize("command", ["simulate", "evaluate live", "evaluate compare", "evaluate bare-hand", "nodes"])
@pytest.mark.parametrize("seconds", ["1e12", "inf", "nan", "-1", "0"])
def test_a_time_that_never_ends_is_refused(command: str, seconds: str, tmp_path: Path,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    out = ["--out", str(tmp_path / "out")] if command == "simulate" else []
    assert code_of([*command.split(), f"--seconds={seconds}", *out]) == 2
    assert "seconds" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
