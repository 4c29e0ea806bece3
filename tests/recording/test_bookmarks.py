"""Bookmarks: written while recording or into a finished log, read back by time, replaced and removed."""

from __future__ import annotations

import zlib
from pathlib import Path

import pytest
from synthetic_node import synthetic_rig

from rhot_app.errors import RecordingError
from rhot_app.recording.bookmarks import Bookmark, append_bookmark, bookmark_record, read_bookmarks
from rhot_app.recording.raw_log import LogReader, Record, RecordKind, encode_header, encode_record
from rhot_app.recording.recorder import Recorder

DATAGRAM = Record(RecordKind.DATAGRAM, 1, 5, b"datagram")


def write_log(path: Path, *records: Record, tail: bytes = b"") -> Path:
    path.write_bytes(encode_header(synthetic_rig(), {}) + b"".join(encode_record(r) for r in records) + tail)
    return path


def test_bookmarks_come_back_by_time_and_the_last_word_stands(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.log", bookmark_record(Bookmark(30, "third")), DATAGRAM)
    append_bookmark(path, Bookmark(10, "first"))
    append_bookmark(path, Bookmark(20, "wrong"))
    append_bookmark(path, Bookmark(20, "der Daumen fehlt – überall"))
    append_bookmark(path, Bookmark(40, "removed"))
    append_bookmark(path, Bookmark(40, ""))
    assert read_bookmarks(path) == [Bookmark(10, "first"), Bookmark(20, "der Daumen fehlt – überall"),
                                    Bookmark(30, "third")]
    assert [record for record in LogReader(path) if record.kind is RecordKind.DATAGRAM] == [DATAGRAM]


def test_a_torn_end_is_cut_off_before_a_bookmark_is_appended(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.log", DATAGRAM, tail=encode_record(DATAGRAM)[:-3])
    append_bookmark(path, Bookmark(10, "here"))
    reader = LogReader(path)
    assert list(reader) == [DATAGRAM, bookmark_record(Bookmark(10, "here"))]
    assert not reader.torn_bytes
    assert not reader.losses.damage


def test_a_log_that_is_being_recorded_takes_no_bookmark_from_others(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.log", synthetic_rig())
    try:
        with pytest.raises(RecordingError, match="being recorded"):
            append_bookmark(recorder.path, Bookmark(1, "mine"))
        recorder.put(RecordKind.BOOKMARK, 0, 2, b"the engine's")
    finally:
        recorder.close()
    append_bookmark(recorder.path, Bookmark(3, "afterwards"))
    assert read_bookmarks(recorder.path) == [Bookmark(2, "the engine's"), Bookmark(3, "afterwards")]


@pytest.mark.parametrize("text", ["two\nlines", "bell\a", "x" * 1025, "\x9b31m"])
def test_a_bookmark_is_one_printable_line(tmp_path: Path, text: str) -> None:
    path = write_log(tmp_path / "a.log", DATAGRAM)
    before = path.read_bytes()
    with pytest.raises(RecordingError, match="one line"):
        append_bookmark(path, Bookmark(1, text))
    assert path.read_bytes() == before


def test_a_bookmark_of_another_program_reaches_no_terminal_with_control_characters(tmp_path: Path) -> None:
    path = write_log(tmp_path / "a.log", Record(RecordKind.BOOKMARK, 0, 1, b"\x1b[31mred\xff"))
    (bookmark,) = read_bookmarks(path)
    assert bookmark.text.isprintable()


def test_records_of_unknown_and_reserved_kinds_are_skipped_without_being_losses(tmp_path: Path) -> None:
    foreign = [bytes([kind]) + encode_record(DATAGRAM)[1:-4] for kind in (9, 200, 201)]
    path = tmp_path / "a.log"
    with path.open("wb") as file:
        file.write(encode_header(synthetic_rig(), {}))
        for body in foreign:
            file.write(body + zlib.crc32(body).to_bytes(4, "little"))
        file.write(encode_record(DATAGRAM))
    reader = LogReader(path)
    assert list(reader) == [DATAGRAM]
    assert reader.losses.unknown_records == 3
    assert not reader.losses.damage
