"""Compiled code belongs to one state of the sources: any change that could mix old and new gets a new folder."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from rhot_node.compiled import VARIABLE, is_complete, mark_complete, sources_hash

ROOT = Path(__file__).parents[2]


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


def test_an_update_compiles_what_has_changed_only(tmp_path: Path) -> None:
    """Old code of an unchanged function that calls a changed one would be wrong."""
    package = Path(shutil.copytree(ROOT / "rhot_node", tmp_path / "rhot_node", ignore=lambda *_: ["__pycache__"]))
    (package / "inner.py").write_text("from numba import njit\n\n@njit(cache=True)\ndef number(): return 1\n")
    (package / "calls.py").write_text("from numba import njit\nfrom rhot_node.inner import number\n\n\n"
                                      "@njit(cache=True)\ndef calls(): return number() + 10\n")
    (package / "alone.py").write_text("from numba import njit\n\n\n@njit(cache=True)\ndef alone(): return 20\n")
    program = ("import rhot_node\nfrom rhot_node.alone import alone\nfrom rhot_node.calls import calls\n"
               "print(calls(), alone(), sum(calls.stats.cache_hits.values()), sum(alone.stats.cache_hits.values()))")

    def run() -> list[int]:
        environment = {key: value for key, value in os.environ.items() if key != VARIABLE}
        environment |= {"XDG_CACHE_HOME": str(tmp_path / "cache"), "PYTHONPATH": str(tmp_path)}
        said = subprocess.run([sys.executable, "-P", "-c", program], env=environment, cwd=tmp_path, text=True,
                              capture_output=True, check=True).stdout
        return [int(word) for word in said.split()]

    assert run() == [11, 20, 0, 0]
    (package / "inner.py").write_text("from numba import njit\n\n@njit(cache=True)\ndef number(): return 2  # longer\n")
    assert run() == [12, 20, 0, 1]
    (package / "markers.py").write_text((package / "markers.py").read_text() + "\n# changed\n")
    assert run() == [12, 20, 1, 1]


def test_the_environment_decides(tmp_path: Path) -> None:
    assert start(tmp_path, **{VARIABLE: "/elsewhere"}) == "/elsewhere"


def test_without_a_home_code_is_kept_elsewhere_and_not_where_others_could_replace_it(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    of_environment = Path(start(tmp_path / "file"))
    assert of_environment.is_dir() and of_environment.is_relative_to(sys.prefix)
    temporary = tmp_path / f"rhot-cache-{os.getuid()}"
    code = ("import sys; sys.prefix = sys.base_prefix; import os, rhot_node; "
            f"print(os.environ.get({VARIABLE!r}, ''))")
    environment = {key: value for key, value in os.environ.items() if key != VARIABLE}
    environment |= {"XDG_CACHE_HOME": str(tmp_path / "file"), "TMPDIR": str(tmp_path)}

    def folder() -> str:
        return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True,
                              check=True).stdout.strip()

    assert Path(folder()).is_relative_to(temporary) and temporary.stat().st_mode & 0o077 == 0
    temporary.chmod(0o777)
    assert folder() == ""


def test_complete_belongs_to_one_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    assert not is_complete()
    mark_complete()
    assert is_complete() and not is_complete("window")
    mark_complete("window")
    assert is_complete("window")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "next"))
    assert not is_complete()
    monkeypatch.delenv(VARIABLE)
    assert not is_complete()
    mark_complete()


def test_a_process_says_at_once_and_only_then_that_it_compiles(tmp_path: Path) -> None:
    program = ("from numba import njit\nfrom rhot_node.compiled import announce_compilation\n"
               "announce_compilation()\nannounce_compilation()\n"
               "@njit(cache=True)\ndef twice(x): return x + x\ntwice(1)\ntwice(1.0)\n")
    (tmp_path / "program.py").write_text(program)
    environment = os.environ | {VARIABLE: str(tmp_path / "cache")}

    def said() -> str:
        return subprocess.run([sys.executable, "program.py"], cwd=tmp_path, env=environment, capture_output=True,
                              text=True, check=True).stderr

    first = said()
    assert first.count("being compiled") == 1 and "minutes" in first
    assert said() == "", "it is in the cache"
    (tmp_path / "cache" / "complete-all").touch()
    (tmp_path / "program.py").write_text(f"{program}twice(1j)\n")
    assert "some seconds" in said()


def test_a_process_says_how_long_it_has_compiled_while_it_goes_on(tmp_path: Path) -> None:
    program = ("import time\nfrom numba.core import event\nfrom rhot_node import compiled\n"
               "compiled.STILL_S = 0.01\ncompiled.announce_compilation()\n"
               "event.start_event('numba:compile')\ntime.sleep(0.2)\nevent.end_event('numba:compile')\n")
    done = subprocess.run([sys.executable, "-c", program], env=os.environ | {VARIABLE: str(tmp_path)},
                          capture_output=True, text=True, check=True)
    assert "being compiled" in done.stderr and "s so far" in done.stderr.splitlines()[1]


def test_a_program_that_loads_numba_first_uses_the_same_folder() -> None:
    folders = []
    for first in ("rhot_node", "numba"):
        program = (f"import {first}; from rhot_node.detect.coverage import centroid; "
                   "print(centroid.stats.cache_path)")
        environment = {name: value for name, value in os.environ.items() if name != VARIABLE}
        said = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True,
                              check=True)
        folders.append(said.stdout)
    assert folders[0] == folders[1]
    assert "__pycache__" not in folders[0]
