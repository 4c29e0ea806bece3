"""Installing the hand networks: the right files with their licence, or nothing and a sentence."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest
from fake_networks import CONTENT, made_up_files, write_wheel

from rhot_app.__main__ import main as rhot
from rhot_node.__main__ import main as rhot_node
from rhot_node.errors import KeypointError
from rhot_node.landmarks import install
from rhot_node.landmarks.install import (
    FILES,
    PACKAGE,
    download_wheel,
    install_networks,
    installed_folder,
    read_network,
    read_wheel,
)

PROGRAMS = {"rhot": rhot, "rhot-node": rhot_node}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the networks go, which are small texts."""
    made_up_files(monkeypatch)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setattr(install, "SERVICE_FOLDER", tmp_path / "service")
    return tmp_path / "data" / "rhot" / "networks"


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("program", PROGRAMS)
def test_networks_come_out_of_a_wheel_with_their_licence(
        program: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wheel = write_wheel(tmp_path / "any.whl")
    assert installed_folder() is None
    for _ in range(2):  # a second time changes nothing
        assert PROGRAMS[program](["landmarks", "install", "--wheel", str(wheel)]) == 0
        assert content(folder) == CONTENT
    said = capsys.readouterr().out
    assert "Apache" in said and str(folder / "LICENSE") in said
    assert installed_folder() == folder
    assert {read_network(folder, name) for name in CONTENT} == set(CONTENT.values())


def test_the_services_folder_is_readable_by_its_user(folder: Path, tmp_path: Path) -> None:
    mask = os.umask(0o077)
    try:
        install_networks(tmp_path / "service", write_wheel(tmp_path / "any.whl"))
    finally:
        os.umask(mask)
    assert installed_folder() == tmp_path / "service"
    assert (tmp_path / "service").stat().st_mode & 0o555 == 0o555
    assert all(path.stat().st_mode & 0o444 == 0o444 for path in (tmp_path / "service").iterdir())


def bad_wheel(kind: str, tmp_path: Path) -> Path:
    path = tmp_path / "bad.whl"
    if kind == "missing":
        return path
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "text":
        path.write_text("no wheel at all")
    elif kind == "cut":
        whole = write_wheel(path).read_bytes()
        path.write_bytes(whole[:len(whole) // 2])
    elif kind == "damaged":
        whole = bytearray(write_wheel(path, hand_landmark_full=bytes(range(256)) * 9).read_bytes())
        whole[len(whole) // 2 - 200] ^= 0xFF
        path.write_bytes(whole)
    elif kind == "longer":
        write_wheel(path, hand_landmark_lite=CONTENT["hand_landmark_lite.tflite"] + bytes(10_000_000))
    else:
        write_wheel(path, **{"other": {"palm_detection_full": b"palm fuII"}, "incomplete": {"LICENSE": None}}[kind])
    return path


@pytest.mark.parametrize("kind", ["missing", "folder", "pipe", "text", "cut", "damaged", "longer", "other",
                                  "incomplete"])
def test_a_bad_wheel_replaces_nothing(kind: str, folder: Path, tmp_path: Path,
                                      capsys: pytest.CaptureFixture[str]) -> None:
    install_networks(folder, write_wheel(tmp_path / "good.whl"))
    wheel = bad_wheel(kind, tmp_path)
    assert rhot_node(["landmarks", "install", "--wheel", str(wheel)]) == 2
    said = capsys.readouterr().err
    assert str(wheel) in said and "--wheel" in said and "Traceback" not in said
    assert content(folder) == CONTENT


@pytest.mark.parametrize("calls", [1, 3, 5])
def test_a_full_disk_replaces_nothing(calls: int, folder: Path, tmp_path: Path,
                                      monkeypatch: pytest.MonkeyPatch) -> None:
    wheel, left = write_wheel(tmp_path / "good.whl"), [calls]
    folder.mkdir(parents=True)
    (folder / "hand_landmark_full.tflite").write_bytes(b"older")

    def full(handle: int) -> None:
        left[0] -= 1
        if not left[0]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(KeypointError, match="No space left"):
        install_networks(folder, wheel)
    assert content(folder) == {"hand_landmark_full.tflite": b"older"}


@pytest.mark.parametrize("spoil", ["changed", "longer", "removed", "folder"])
def test_a_network_that_is_not_as_installed_is_not_used(spoil: str, folder: Path, tmp_path: Path) -> None:
    install_networks(folder, write_wheel(tmp_path / "good.whl"))
    path = folder / "hand_landmark_full.tflite"
    path.unlink()
    if spoil == "folder":
        path.mkdir()
    elif spoil != "removed":
        path.write_bytes(b"hand fulL" if spoil == "changed" else b"hand full and more")
    with pytest.raises(KeypointError, match="landmarks install") as refused:
        read_network(folder, path.name)
    assert str(path) in str(refused.value)


# -- download ----------------------------------------------------------------------------------------------------------

def pretend_pip(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, program: str) -> None:
    """A program in Python's place that is called as `python -m pip ...`."""
    path = tmp_path / "python"
    path.write_text(f"#!/bin/sh\n{program}\n")
    path.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(path))


def test_the_wheel_is_what_pip_downloads(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wheel = write_wheel(tmp_path / "good.whl")
    pretend_pip(tmp_path, monkeypatch, f'for last; do :; done; echo "$*" > {tmp_path}/asked; cp {wheel} "$last/x.whl"')
    steps: list[float] = []
    install_networks(folder, progress=lambda text, fraction: steps.append(fraction))
    assert content(folder) == CONTENT
    asked = (tmp_path / "asked").read_text()
    assert "-m pip" in asked and f"{PACKAGE} " in asked and "--no-deps" in asked
    assert steps == sorted(steps) and steps[-1] == 1.0


@pytest.mark.parametrize("program", ["echo 'ERROR: No matching distribution found' >&2; exit 1",
                                     "echo 'No module named pip' >&2; exit 1", "exit 0"])
def test_without_network_the_command_says_what_to_do(program: str, folder: Path, tmp_path: Path,
                                                     monkeypatch: pytest.MonkeyPatch,
                                                     capsys: pytest.CaptureFixture[str]) -> None:
    pretend_pip(tmp_path, monkeypatch, program)
    assert rhot(["landmarks", "install"]) == 2
    said = capsys.readouterr().err
    assert PACKAGE in said and "--wheel" in said and "pip download" in said
    assert not folder.exists()


def test_a_cancelled_download_leaves_nothing(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class CancelledError(Exception):
        pass

    def cancel(text: str, fraction: float) -> None:
        raise CancelledError

    pretend_pip(tmp_path, monkeypatch, "exec sleep 600")
    begun: list[subprocess.Popen[bytes]] = []
    real = subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda *args, **more: begun.append(real(*args, **more)) or begun[-1])
    with pytest.raises(CancelledError):
        install_networks(folder, progress=cancel)
    assert len(begun) == 1 and begun[0].returncode not in (None, 0) and not folder.exists()


@pytest.mark.study("rhot_node/landmarks/install.py")
def test_the_real_wheel_has_these_files(tmp_path: Path) -> None:
    try:
        wheel = download_wheel(tmp_path, lambda text, fraction: None)
    except KeypointError as exc:
        pytest.skip(f"the package index is not reachable: {exc}")
    assert read_wheel(wheel).keys() == FILES.keys(), "their hashes agree"


# -- beside the tables -------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("words", ["install table.csv", "install --rig RIG", "table.csv --out x.log", "table.csv",
                                   "table.csv --rig RIG --out x.log --wheel x.whl"])
def test_tables_and_install_do_not_mix(words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("table.csv").write_text("frame\n")
    rig = Path(__file__).parents[2] / "resources" / "rigs" / "two_pis.json"
    with pytest.raises(SystemExit) as end:
        rhot(["landmarks", *words.replace("RIG", str(rig)).split()])
    assert end.value.code == 2 and [path.name for path in tmp_path.iterdir()] == ["table.csv"]
