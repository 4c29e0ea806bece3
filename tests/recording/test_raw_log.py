"""The raw log: every record comes back, a torn end is tolerated, anything else broken is named."""

import time
from pathlib import Path

import pytest
from patience import eventually

from rhot_app.errors import RecordingError, RhotError
from rhot_app.recording.raw_log import LogReader, Record, RecordKind, encode_header, encode_record
from rhot_app.recording.recorder import Recorder
from rhot_app.simulator.synthetic_node import synthetic_rig

RECORDS = [Record(RecordKind.START, 0, 1, b"start"), Record(RecordKind.DATAGRAM, 1, -5, b""),
           Record(RecordKind.CLOCK_REQUEST, 2, 10**18, b"x" * 60000), Record(RecordKind.GAP, 0, 7, b"\1\0\0\0")]


def write_log(path: Path) -> bytes:
    data = encode_header(synthetic_rig(), {"created": "today"}) + b"".join(encode_record(r) for r in RECORDS)
    path.write_bytes(data)
    return data


def test_records_come_back(tmp_path: Path) -> None:
    write_log(tmp_path / "a.log")
    reader = LogReader(tmp_path / "a.log")
    assert list(reader) == RECORDS
    assert reader.rig.markers == synthetic_rig().markers
    assert reader.about == {"created": "today"}
    assert reader.torn_bytes == 0


@pytest.mark.parametrize("cut", [1, 4, 20, 24])
def test_torn_end_is_tolerated_and_reported(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "a.log"
    data = write_log(path)
    path.write_bytes(data[:-cut])
    reader = LogReader(path)
    assert list(reader) == RECORDS[:3]
    assert reader.torn_bytes == 25 - cut


def test_broken_last_record_counts_as_torn(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    data = write_log(path)
    path.write_bytes(data[:-2] + b"\0\0")
    reader = LogReader(path)
    assert len(list(reader)) == 3
    assert reader.torn_bytes == 25


def test_broken_middle_is_an_error_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    data = bytearray(write_log(path))
    data[-100] ^= 1
    path.write_bytes(data)
    reader = LogReader(path)
    with pytest.raises(RecordingError, match=r"a\.log: the record at byte \d+ is broken"):
        list(reader)


@pytest.mark.parametrize("data", [
    b"", b"RHOT", b"{}", b"RHOTLOG\0\x02\0\0\0\0\0\0\0", b"RHOTLOG\0\x01\0\0\0\xff\xff\xff\xff{}",
    encode_header(synthetic_rig(), {})[:-1], encode_header(synthetic_rig(), {"rig": 1})[:60],
])
def test_foreign_files_are_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(data)
    with pytest.raises(RhotError, match=r"a\.log"):
        LogReader(path)


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"b\.log"):
        LogReader(tmp_path / "b.log")


def test_recorder_writes_everything_and_nothing_over(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    recorder = Recorder(path, synthetic_rig())
    for k in range(20_000):
        recorder.put(RecordKind.DATAGRAM, 1, k, b"datagram")
    recorder.close()
    assert [record.t_master_ns for record in LogReader(path)] == list(range(20_000))
    assert recorder.bytes_written == path.stat().st_size
    with pytest.raises(RecordingError, match="exists already"):
        Recorder(path, synthetic_rig())
    with pytest.raises(RecordingError, match="cannot be written"):
        Recorder(tmp_path / "no" / "a.log", synthetic_rig())


def test_full_disk_ends_the_recording_with_a_sentence() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("needs /dev/full")

    class FullDisk(Recorder):
        def __init__(self, path: Path) -> None:
            super().__init__(path, synthetic_rig())
            self._file.close()
            self._file = Path("/dev/full").open("wb", buffering=0)  # noqa: SIM115

    path = Path(f"/tmp/rhot-full-{time.monotonic_ns()}.log")
    recorder = FullDisk(path)
    recorder.put(RecordKind.DATAGRAM, 1, 1, b"datagram")
    eventually(lambda: not recorder.recording)
    assert "No space left" in recorder.failure
    recorder.put(RecordKind.DATAGRAM, 1, 2, b"datagram")  # taken no more, and nothing raises
    recorder.close()
    path.unlink()
