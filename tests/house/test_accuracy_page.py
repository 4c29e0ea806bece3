"""Every table of figures on docs/accuracy.md has a command that renews it, or names its source."""

from __future__ import annotations

import importlib
import re
import sys
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """benchmarks/accuracy_page.py."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return importlib.import_module("accuracy_page")


@pytest.fixture
def small(page: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The command with a page of two sections in `tmp_path`."""
    monkeypatch.setattr(page, "PAGE", tmp_path / "accuracy.md")
    monkeypatch.setattr(page, "README", tmp_path / "README.md")
    page.PAGE.write_text("by hand\n<!-- figures: a -->\nold a\n<!-- end -->\nmore\n<!-- figures: b -->\nold b\n"
                         "<!-- end -->\n")
    page.README.write_text("<!-- figures: times -->\n<!-- end -->\n")
    return page


def run(page: ModuleType, monkeypatch: pytest.MonkeyPatch, *words: str, **commands: str) -> int:
    monkeypatch.setattr(page, "SECTIONS", {name: page.Section(command, 0.1) for name, command in commands.items()})
    monkeypatch.setattr(sys, "argv", ["accuracy_page.py", *words])
    code: int = page.main()
    return code


def test_blocks_and_commands_agree(page: ModuleType) -> None:
    assert page.faults() == []


def test_a_table_outside_of_a_block_names_its_source(page: ModuleType) -> None:
    text = re.sub(r"<!-- figures: .*?<!-- end -->\n", "", page.PAGE.read_text(), flags=re.DOTALL)
    paragraphs = text.split("\n\n")
    silent = [table for above, table in pairwise(paragraphs)
              if table.startswith("|") and not re.search(r"`(python|rhot) [^`]+`", above)]
    assert not silent, "\n\n".join(silent)


def test_each_fault_is_said(small: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(small, "SECTIONS", {
        "b": small.Section("python benchmarks/clock.py --sedes 5", 1.0),
        "c": small.Section("python benchmarks/nothing.py", 1.0)})
    said = "\n".join(small.faults())
    assert "block a has no command" in said and "c has 0 blocks" in said
    assert "no option --sedes" in said and "nothing.py does not exist" in said


def test_new_figures_replace_old_ones_and_nothing_else(small: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run(small, monkeypatch, "--only", "a", a="python -c 'print(12)'", b="python -c 'print(13)'") == 0
    found = re.fullmatch(r"by hand\n<!-- figures: a -->\n`python -c 'print\(12\)'`, (.+)\n\n12\n<!-- end -->\nmore\n"
                         r"<!-- figures: b -->\nold b\n<!-- end -->\n", small.PAGE.read_text(), re.DOTALL)
    assert found is not None and re.search(r"20\d\d", found.group(1))


@pytest.mark.parametrize("command", ["python -c 'print(12); raise SystemExit(2)'", "python -c '1 / 0'"])
def test_a_failure_leaves_the_old_block_and_is_named(small: ModuleType, monkeypatch: pytest.MonkeyPatch,
                                                     capfd: pytest.CaptureFixture[str], command: str) -> None:
    assert run(small, monkeypatch, a=command, b="python -c 'print(13)'") == 2
    text = small.PAGE.read_text()
    assert "\nold a\n" in text and "\n13\n" in text
    assert "a: the old figures stay" in capfd.readouterr().err


def test_a_missed_aim_is_written(small: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run(small, monkeypatch, a="python -c 'print(12); raise SystemExit(1)'", b="python -c 'print(13)'") == 0
    assert "\n12\n" in small.PAGE.read_text()
