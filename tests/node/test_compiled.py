"""Compiled code belongs to one state of the sources: any change that could mix old and new gets a new folder."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rhot_node.compiled import VARIABLE, announce_compilation, is_cold, is_complete, mark_complete, sources_hash


@pytest.fixture
def package(tmp_path: Path) -> Path:
    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "fast.py").write_text("from numba import njit\n")
    (folder / "slow.py").write_text("x = 1\n")
    return folder


def test_the_hash_follows_compiled_sources_only(package: Path) -> None:
    imported = "from numba import njit"
    before = sources_hash([package])
    (package / "slow.py").write_text("x = 2\n")
    assert sources_hash([package]) == before
    (package / "fast.py").write_text(f"{imported}  # changed\n")
    changed = sources_hash([package])
    assert changed != before
    (package / "fast.py").write_text(f"{imported}\nfrom package.slow import x\nfrom package import (\n    other,\n)\n")
    with_imports = sources_hash([package])
    (package / "slow.py").write_text("x = 3\n")
    assert sources_hash([package]) != with_imports, "numbers of what is imported are compiled in"
    with_imports = sources_hash([package])
    (package / "other.py").write_text("y = 3\n")
    assert sources_hash([package]) != with_imports
    (package / "other.py").unlink()
    (package / "fast.py").rename(package / "other.py")
    assert sources_hash([package]) not in (before, changed)


def test_the_same_sources_in_another_place_are_compiled_anew(package: Path) -> None:
    before = sources_hash([package])
    twin = Path(shutil.copytree(package, package.parent / "clone" / package.name))
    assert sources_hash([twin]) != before == sources_hash([package.parent / "clone" / ".." / package.name])


def start(cache: Path, **more: str) -> str:
    environment = {key: value for key, value in os.environ.items() if key != VARIABLE}
    environment |= {"XDG_CACHE_HOME": str(cache), **more}
    code = f"import os, rhot_node; print(os.environ.get({VARIABLE!r}, ''))"
    return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True,
                          check=True).stdout.strip()


def test_a_start_uses_its_own_folder_and_forgets_old_ones(tmp_path: Path) -> None:
    base = tmp_path / "rhot" / "numba"
    for k in range(5):
        (base / f"old{k}").mkdir(parents=True)
        os.utime(base / f"old{k}", (k, k))
    folder = Path(start(tmp_path))
    assert folder.is_dir() and folder.parent == base
    assert sorted(path.name for path in base.iterdir()) == sorted(["old3", "old4", folder.name])
    assert start(tmp_path) == str(folder)


def test_the_environment_decides_and_a_missing_home_is_no_obstacle(tmp_path: Path) -> None:
    assert start(tmp_path, **{VARIABLE: "/elsewhere"}) == "/elsewhere"
    (tmp_path / "file").write_text("")
    assert start(tmp_path / "file") == ""


def test_complete_belongs_to_one_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    assert not is_complete()
    mark_complete()
    assert is_complete()
    monkeypatch.setenv(VARIABLE, str(tmp_path / "next"))
    assert not is_complete()
    monkeypatch.delenv(VARIABLE)
    assert not is_complete()
    mark_complete()


def test_a_cache_is_cold_until_anything_was_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                     capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    assert is_cold()
    announce_compilation()
    assert "being compiled" in capsys.readouterr().err
    (tmp_path / "detect_1").mkdir()
    (tmp_path / "detect_1" / "kernel.py311.nbi").touch()
    assert not is_cold()
    announce_compilation()
    assert "being compiled" in capsys.readouterr().err, "the tracker is not compiled yet"
    (tmp_path / "tracking_2").mkdir()
    (tmp_path / "tracking_2" / "tracker.py311.nbi").touch()
    announce_compilation()
    assert capsys.readouterr().err == ""
    announce_compilation("objects", "some seconds")
    assert "takes some seconds" in capsys.readouterr().err, "this command needs something else"
    monkeypatch.delenv(VARIABLE)
    assert is_cold()


def test_a_program_that_loads_numba_first_uses_the_same_folder() -> None:
    folders = []
    for first in ("rhot_node", "numba"):
        program = (f"import {first}; from rhot_node.detect.region.position import centroid; "
                   "print(centroid.stats.cache_path)")
        environment = {name: value for name, value in os.environ.items() if name != VARIABLE}
        said = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True,
                              check=True)
        folders.append(said.stdout)
    assert folders[0] == folders[1]
    assert "__pycache__" not in folders[0]
