"""The marker ``study``: tests that take long and protect something rare. They run with ``--studies`` only.

A plug-in of pytest, which `tests/conftest.py` loads. A study names the files or folders that it covers:
``@pytest.mark.study("rhot_app/barehand")``. ``--studies`` adds all of them to a run, ``--studies=REVISION`` those whose
files differ from that revision. `tests/house/test_studies.py` compares them with the list in CONTRIBUTING.md.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ALL = "all"
COLLECTED = pytest.StashKey[list[pytest.Item]]()
"""All tests that pytest collected, with the studies that do not run."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--studies", nargs="?", const=ALL, metavar="REVISION",
                     help="run the long tests that are marked as studies, too; with a git revision, those of them "
                          "whose files differ from it")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "study(*paths): takes long and covers these files; runs with --studies only")


def covers(item: pytest.Item) -> tuple[str, ...] | None:
    """The files and folders that a study covers; None for a test that is no study."""
    marker = item.get_closest_marker("study")
    return None if marker is None else marker.args


def changed_since(revision: str) -> list[str] | None:
    """Files that differ from a git revision; None when there is no such revision, or no repository."""
    done = subprocess.run(["git", "diff", "--name-only", revision, "--"], cwd=ROOT, capture_output=True, text=True,
                          check=False)
    return done.stdout.splitlines() if done.returncode == 0 else None


def is_covered(file: str, paths: tuple[str, ...]) -> bool:
    """Whether a file is one of these, or lies in one of these folders."""
    return any(file == path or file.startswith(f"{path}/") for path in paths)


def selected(items: list[pytest.Item], option: str | None) -> list[pytest.Item]:
    """The tests to run by the option ``--studies``: `ALL`, a git revision, or None for no studies."""
    if option == ALL:
        return items
    changed = [] if option is None else changed_since(option) or []

    def runs(item: pytest.Item) -> bool:
        paths = covers(item)
        return paths is None or any(is_covered(file, paths) for file in changed)

    return [item for item in items if runs(item)]


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    config.stash[COLLECTED] = list(items)
    kept = selected(items, config.getoption("--studies"))
    deselected = set(items).difference(kept)
    if deselected:
        config.hook.pytest_deselected(items=list(deselected))
        items[:] = kept


def pytest_report_header(config: pytest.Config) -> str | None:
    option = config.getoption("--studies")
    if option not in (None, ALL) and changed_since(option) is None:
        return f"studies: none, as git knows no revision {option!r} here"
    return None
