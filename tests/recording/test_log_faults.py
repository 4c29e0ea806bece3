"""A disk that fails: every read and every write of a log fails once, each block for good, and the folder is removed."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from collections.abc import Callable, Iterator
from io import FileIO
from pathlib import Path
from typing import Any

import pytest
from patience import eventually, quickest
from synthetic_node import synthetic_rig

from rhot_app.__main__ import main
from rhot_app.errors import RecordingError
from rhot_app.project import save_rig
from rhot_app.recording import bookmarks, raw_log, recorder
from rhot_app.recording.bookmarks import Bookmark, append_bookmark
from rhot_app.recording.raw_log import LogReader, Losses, Record, RecordKind, encode_header, encode_log, encode_record
from rhot_app.recording.recorder import Recorder

RIG = synthetic_rig()
RECORDS = [Record(RecordKind.DATAGRAM, 1, k, bytes([k]) * 900) for k in range(40)]
HEADER = len(encode_header(RIG, {}, marks_end=True))
BLOCK = 4096


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "a.rhotlog"
    path.write_bytes(b"".join(encode_log(RIG, {}, RECORDS)))
    return path


def read(path: Path) -> tuple[list[Record], Losses]:
    with contextlib.closing(LogReader(path)) as reader:
        return list(reader), reader.losses


class Disk:
    """What of a file cannot be read or written: the call of this number, or these blocks for ever."""

    def __init__(self, failing_call: int = -1, blocks: tuple[int, ...] = ()) -> None:
        self.failing_call, self.blocks, self.calls = failing_call, blocks, 0

    def call(self) -> None:
        self.calls += 1
        if self.calls - 1 == self.failing_call:
            raise OSError(errno.EIO, "Input/output error")

    def open_file(self, *arguments: Any) -> FileIO:
        disk = self

        class FaultyFile(FileIO):
            def readinto(self, buffer: Any, /) -> int | None:
                disk.call()
                at = self.tell()
                touched = range(at // BLOCK, (at + len(memoryview(buffer)) + BLOCK - 1) // BLOCK)
                if any(block in touched for block in disk.blocks):
                    raise OSError(errno.EIO, "Input/output error")
                return super().readinto(buffer)

            def write(self, data: Any, /) -> int:
                try:
                    disk.call()
                except OSError:
                    super().write(data[:len(data) // 2])
                    raise
                return super().write(data)

            def close(self) -> None:
                if not self.closed:
                    super().close()
                    disk.call()
        return FaultyFile(*arguments)


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> Callable[[Disk], Disk]:
    def use(disk: Disk) -> Disk:
        monkeypatch.setattr(raw_log, "open_input", lambda path, buffering: disk.open_file(path))
        return disk
    return use


def test_a_read_that_fails_once_costs_nothing(log: Path, reads: Callable[[Disk], Disk]) -> None:
    disk = reads(Disk())
    assert read(log) == (RECORDS, Losses())
    for call in range(disk.calls - 1):  # the last one closes
        reads(Disk(call))
        assert read(log) == (RECORDS, Losses())


def test_a_block_that_cannot_be_read_costs_the_records_in_it(log: Path, reads: Callable[[Disk], Disk]) -> None:
    size = log.stat().st_size
    for block in range((size + BLOCK - 1) // BLOCK):
        reads(Disk(blocks=(block,)))
        found, losses = read(log)
        begin, end = block * BLOCK, (block + 1) * BLOCK
        step = len(encode_record(RECORDS[0]))
        whole = [one for k, one in enumerate(RECORDS)
                 if end <= HEADER + k * step or begin >= HEADER + (k + 1) * step]
        assert found == whole
        assert losses.unreadable_bytes == min(end, size) - begin
        assert f"{losses.unreadable_bytes} bytes" in losses.damage
        assert bool(losses.header_bytes) == (begin < HEADER), "the other copy of the header is used"


def test_a_log_whose_header_cannot_be_read_in_both_copies_is_read_with_its_rig(
        log: Path, reads: Callable[[Disk], Disk], capsys: pytest.CaptureFixture[str]) -> None:
    reads(Disk(blocks=(0, HEADER // 2 // BLOCK)))
    assert main(["recover", str(log), "--out", str(log) + ".clean"]) == 2
    assert f"does not give {2 * BLOCK} bytes of its header" in (said := capsys.readouterr().err) and "--rig" in said
    save_rig(log.with_name("rig.json"), RIG)
    assert main(["recover", str(log), "--rig", str(log.with_name("rig.json")), "--out", str(log) + ".clean"]) == 3
    reads(Disk())
    assert read(log.with_name(f"{log.name}.clean")) == (RECORDS, Losses())


def test_a_disk_that_is_gone_is_a_sentence(log: Path, reads: Callable[[Disk], Disk]) -> None:
    reads(Disk(blocks=tuple(range(100))))
    with pytest.raises(RecordingError, match=r"a\.rhotlog: the disk does not give"):
        LogReader(log)


@pytest.mark.parametrize("command", [["replay", "--json"], ["recover", "--out", "clean.log"], ["export", "--out",
                                                                                              "a.csv"]])
def test_memory_is_no_log(command: list[str], capsys: pytest.CaptureFixture[str], tmp_path: Path,
                          monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([command[0], "/proc/self/mem", *command[1:]]) == 2
    assert "/proc/self/mem: cannot be read (Input/output error)" in capsys.readouterr().err


# -- writing -----------------------------------------------------------------------------------------------------------

def written(path: Path, count: int) -> Recorder:
    """A recording of `count` records, written one by one."""
    log = Recorder(path, RIG)
    for record in RECORDS[:count]:
        before = log.bytes_written
        log.put(record.kind, record.node_id, record.t_master_ns, record.data)
        eventually(lambda before=before: log.bytes_written > before or log.failure)
    log.close()
    return log


def test_every_write_may_fail_and_what_was_written_before_is_read(tmp_path: Path,
                                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    calls = 1 + 2 + 1 + 1  # header, records, end mark, close
    for call in range(calls):
        disk, path = Disk(call), tmp_path / f"{call}.rhotlog"
        monkeypatch.setattr(recorder, "FileIO", disk.open_file)
        if call == 0:
            with pytest.raises(RecordingError, match="cannot be written"):
                written(path, 2)
            assert not path.exists()
            continue
        log = written(path, 2)
        assert "has stopped: Input/output error. Tracking goes on." in log.failure
        found, losses = read(path)
        assert found == RECORDS[:min(call - 1, 2)] and not losses.damage
        assert bool(losses.end) == (call < calls - 1), "without its end mark the log says that it was cut off"


def test_every_flush_to_the_disk_may_fail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = os.fsync
    for call in range(2):  # of the folder's name, of the end
        disk = Disk(call)
        monkeypatch.setattr(os, "fsync", lambda handle, disk=disk: (disk.call(), real(handle)))
        log = written(tmp_path / f"{call}.rhotlog", 1)
        assert disk.calls == 2
        assert bool(log.failure) == (call == 1), "not every file system keeps folders so"
        assert read(log.path)[0] == RECORDS[:1]


def test_a_bookmark_that_cannot_be_written_harms_no_log(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    disk = Disk(0)
    monkeypatch.setattr(bookmarks, "FileIO", disk.open_file)
    with pytest.raises(RecordingError, match="the bookmark cannot be written"):
        append_bookmark(log, Bookmark(3, "here"))
    assert read(log) == (RECORDS, Losses())
    append_bookmark(log, Bookmark(3, "here"))
    assert len(read(log)[0]) == len(RECORDS) + 1 and not read(log)[1].end


def test_a_folder_that_is_removed_while_recording_is_noticed_within_a_second(tmp_path: Path) -> None:
    numbers: Iterator[int] = iter(range(100))

    def noticed() -> None:
        folder = tmp_path / str(next(numbers))
        folder.mkdir()
        log = Recorder(folder / "a.rhotlog", RIG)
        shutil.rmtree(folder)
        eventually(lambda: log.failure)
        assert "removed" in log.failure
        log.close()
    assert quickest(noticed, 1.0) < 1.0


def test_a_recording_that_is_moved_goes_on_and_says_so(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    log = Recorder(tmp_path / "a" / "a.rhotlog", RIG)
    (tmp_path / "a").rename(tmp_path / "b")
    eventually(lambda: log.notice)
    log.put(RecordKind.DATAGRAM, 1, 1, b"after it")
    log.close()
    assert "moved" in log.notice and not log.failure
    assert len(read(tmp_path / "b" / "a.rhotlog")[0]) == 1


# -- the end mark ------------------------------------------------------------------------------------------------------

def test_a_log_that_was_cut_between_two_records_says_so(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole, step = log.read_bytes(), len(encode_record(RECORDS[0]))
    for cut in (HEADER, HEADER + step, HEADER + 40 * step):
        log.write_bytes(whole[:cut])
        found, losses = read(log)
        assert found == RECORDS[:(cut - HEADER) // step]
        assert losses.end_missing and not losses.torn_bytes and not losses.damage and "end is missing" in losses.end
    log.write_bytes(whole[:-1])
    assert read(log)[1].torn_bytes
    clean = log.with_name("clean.rhotlog")
    assert main(["recover", str(log), "--out", str(clean)]) == 0
    assert "torn" in capsys.readouterr().out and not read(clean)[1].end


def test_a_log_of_before_end_marks_is_not_called_cut(log: Path) -> None:
    log.write_bytes(encode_header(RIG, {}) + b"".join(encode_record(record) for record in RECORDS))
    assert read(log) == (RECORDS, Losses())


def test_a_reader_of_before_end_marks_reads_a_log_that_has_one(log: Path) -> None:
    """It knows no kind 12, and skips it as it does any that is unknown; the header is of the same version."""
    data = log.read_bytes()
    assert data[8] == raw_log.VERSION == 2
    kind, length = data[-21], data[-8:-4]
    assert (kind, length) == (12, bytes(4))
