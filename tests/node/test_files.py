"""Files that people name: what is read of JSON, what is no file, and what a write leaves alone."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from rhot_node.errors import SettingsError, printable
from rhot_node.files import (
    decode_json,
    decode_message,
    open_input,
    read_input,
    read_json,
    replacing,
    require_file,
    write_atomically,
)
from rhot_node.markers import load_markers


def fifo(path: Path) -> Path:
    os.mkfifo(path)
    return path


def device(path: Path) -> Path:
    """A device like /dev/zero, of this test's own."""
    if os.geteuid() != 0:
        pytest.skip("only root can make a device")
    try:
        os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(1, 5))
        path.open("rb").close()
    except PermissionError:
        pytest.skip("no devices here")
    return path


def folder(path: Path) -> Path:
    path.mkdir()
    return path


OTHERS = pytest.mark.parametrize("make", [fifo, device, folder])
Make = Callable[[Path], Path]


@OTHERS
def test_only_regular_files_are_read(tmp_path: Path, make: Make) -> None:
    path = make(tmp_path / "input.json")
    link = tmp_path / "link.json"
    link.symlink_to(path)
    for name in (path, link):
        for read in (open_input, read_input, require_file):
            with pytest.raises(OSError, match="only files are read"):
                read(name)
        with pytest.raises(SettingsError, match=rf"{name.name}: cannot be read \(it is a "):
            load_markers(name)


@OTHERS
def test_only_regular_files_are_replaced(tmp_path: Path, make: Make) -> None:
    path = make(tmp_path / "output")
    before = path.lstat()
    with pytest.raises(OSError, match="only files are replaced"):
        write_atomically(path, b"data")
    assert path.lstat().st_mode == before.st_mode
    assert path.lstat().st_ino == before.st_ino
    assert [entry.name for entry in tmp_path.iterdir()] == ["output"], "a temporary file is left"


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "output"
    path.write_bytes(b"old")
    with pytest.raises(ZeroDivisionError), replacing(path) as file:
        file.write(b"half")
        raise ZeroDivisionError
    assert path.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["output"]
    write_atomically(path, b"new")
    assert path.read_bytes() == b"new"


@pytest.mark.parametrize(("data", "sentence"), [
    (b"[" * 50_000 + b"]" * 50_000, "nested deeper than 64"),
    (b'{"a":' * 65 + b"1" + b"}" * 65, "nested deeper than 64"),
    (b"9" * 5000, "too many digits"),
    (b"[1e999]", "1e999 is no number"),
    (b"[-Infinity]", "-Infinity is no number"),
    (b"[NaN]", "NaN is no number"),
    (b'"' + b"x" * (16 << 20) + b'"', "more than 16 MiB"),
    (b"{", "not valid JSON"),
    (b"", "not valid JSON"),
    (b"\xff\xfe\xfd", "no text"),
], ids=lambda value: value[:12] if isinstance(value, bytes) else None)
def test_json_has_limits_that_are_sentences(tmp_path: Path, data: bytes, sentence: str) -> None:
    with pytest.raises(SettingsError, match=sentence) as caught:
        decode_json(data, "a.json", SettingsError)
    assert str(caught.value).startswith("a.json: ")
    (tmp_path / "a.json").write_bytes(data)
    for read in (load_markers, lambda path: read_json(path, SettingsError)):
        with pytest.raises(SettingsError, match=r"a\.json: "):
            read(tmp_path / "a.json")


def test_brackets_in_strings_are_not_nesting() -> None:
    text = '[{"' + 100 * "[" + '": "' + 100 * '\\"{' + '"}]'
    assert decode_json(text.encode(), "a.json", SettingsError) == [{100 * "[": 100 * '"{'}]


def test_a_message_that_is_nested_too_deeply_is_a_decode_error() -> None:
    with pytest.raises(msgspec.DecodeError):
        decode_message(b'{"a":' + b"[" * 50_000 + b"]" * 50_000 + b"}", dict)


def test_a_field_name_cannot_steer_the_terminal(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text('{"format": "rhot-markers", "version": 1, "name": "a", "markers": [], '
                                     '"\\u001b[2J\\u009b": 1}')
    with pytest.raises(SettingsError) as caught:
        load_markers(tmp_path / "a.json")
    assert str(caught.value).isprintable()


def test_what_others_wrote_is_printed_on_one_line_without_control_characters() -> None:
    assert printable("Gästezimmer 日本") == "Gästezimmer 日本"
    assert printable("a\x1b[31m\nb\x9b\u202e\0") == r"a\x1b[31m\nb\x9b\u202e\x00"
    assert len(printable("x" * 10_000)) < 500
