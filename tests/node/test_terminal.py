"""What commands print is safe for a terminal, and what the system refuses is a sentence."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest

from rhot_app.__main__ import main
from rhot_app.progress import ProgressLine
from rhot_node.__main__ import main as node_main
from rhot_node.terminal import PrintableStream, printable_output


def printed(text: str, encoding: str = "utf-8") -> str:
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding=encoding, newline="")
    print(text, end="", file=PrintableStream(stream))
    stream.flush()
    return raw.getvalue().decode(encoding)


@pytest.mark.parametrize(("text", "safe"), [
    ("plain, with a tab\t and\nlines", "plain, with a tab\t and\nlines"), ("größer 手 😀", "größer 手 😀"),
    ("\x1b[31mred\x07", r"\x1b[31mred\x07"), ("over\rwritten", r"over\rwritten"), ("\x9b2J", r"\x9b2J"),
    ("a\u202eb\u2066c", r"a\u202eb\u2066c"), ("half \udcff", r"half \udcff"),
])
def test_what_moves_the_cursor_is_escaped(text: str, safe: str) -> None:
    assert printed(text) == safe


def test_a_terminal_without_a_character_gets_its_escape() -> None:
    assert printed("größer", "ascii") == r"gr\xf6\xdfer"


def test_a_progress_line_is_rewritten_and_its_words_are_safe() -> None:
    terminal = io.StringIO()
    terminal.isatty = lambda: True  # type: ignore[method-assign]
    line = ProgressLine("reading a\x1b[2Jb", PrintableStream(terminal))  # type: ignore[arg-type]
    line(1, 2)
    assert terminal.getvalue().startswith("\rreading a\\x1b[2Jb: 50 %")


def test_output_is_as_before_behind_the_block(capsys: pytest.CaptureFixture[str]) -> None:
    before = sys.stdout, sys.stderr
    with printable_output():
        print("\x1b")
    assert (sys.stdout, sys.stderr) == before and capsys.readouterr().out == "\\x1b\n"


def test_names_of_files_are_printed_safe(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a\x1b[31m.json"
    assert main(["check", str(path)]) == 2 and node_main(["doctor", "--settings", str(path)]) == 2
    said = capsys.readouterr()
    assert "\x1b" not in said.err + said.out and r"\x1b" in said.err


@pytest.mark.parametrize("name", ["a" * 300, "b" * 5000])
def test_a_name_that_is_too_long_is_a_sentence(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (["recover", name, "--out", str(tmp_path / "a")], ["hand", "--out", str(tmp_path / name)],
                      ["recover", str(tmp_path / "no.log"), "--out", str(tmp_path / name)]):
        assert main(arguments) == 2
        said = capsys.readouterr().err
        assert said.startswith("rhot: ") and said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
