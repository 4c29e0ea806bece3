"""The raw log: every record comes back, a torn end is tolerated, damage costs what is damaged and is named."""

import contextlib
import json
import multiprocessing
import resource
import threading
import time
import zlib
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest
from patience import eventually
from synthetic_node import synthetic_rig

from rhot_app.__main__ import main
from rhot_app.errors import RecordingError, RhotError
from rhot_app.project import save_rig
from rhot_app.recording.raw_log import (
    LogReader,
    Losses,
    Record,
    RecordKind,
    begun_now,
    encode_header,
    encode_record,
    wall_clock_offset_ns,
)
from rhot_app.recording.recorder import Recorder

RECORDS = [Record(RecordKind.START, 0, 1, b"start"), Record(RecordKind.DATAGRAM, 1, -5, b""),
           Record(RecordKind.CLOCK_REQUEST, 2, 10**18, b"x" * 60000), Record(RecordKind.GAP, 0, 7, b"\1\0\0\0")]
HEADER_SIZE = len(encode_header(synthetic_rig(), {}))


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


def damaged(data: bytes, at: int, patch: bytes) -> bytes:
    at %= len(data)
    return data[:at] + patch + data[at + len(patch):]


def read(path: Path, data: bytes) -> tuple[list[Record], Losses]:
    path.write_bytes(data)
    reader = LogReader(path)
    records = list(reader)
    reader.close()
    return records, reader.losses


LAST_TWO = len(encode_record(RECORDS[2])) + len(encode_record(RECORDS[3]))


@pytest.mark.parametrize("patch", [b"\x07\x01\0\0", b"\xff\xff\xff\xff", b"\0\0\1\0", b"\0\0\0\0"])
def test_a_damaged_length_costs_one_record(tmp_path: Path, patch: bytes) -> None:
    data = write_log(tmp_path / "a.log")
    records, losses = read(tmp_path / "a.log", damaged(data, 13 - LAST_TWO, patch))
    assert records == [RECORDS[0], RECORDS[1], RECORDS[3]]
    assert (losses.places, losses.torn_bytes) == (1, 0)
    assert losses.skipped_bytes == len(encode_record(RECORDS[2]))
    assert "1 damaged place was skipped (60021 bytes, at least 1 record)" in losses.damage


def test_a_damaged_last_record_is_a_loss_and_no_torn_end(tmp_path: Path) -> None:
    records, losses = read(tmp_path / "a.log", write_log(tmp_path / "a.log")[:-2] + b"\0\0")
    assert records == RECORDS[:3]
    assert (losses.places, losses.skipped_bytes, losses.torn_bytes) == (1, 25, 0)


@pytest.mark.parametrize("tail", [bytes(5000), b"\0", bytes(3)])
def test_zeros_at_the_end_cost_no_record(tmp_path: Path, tail: bytes) -> None:
    records, losses = read(tmp_path / "a.log", write_log(tmp_path / "a.log") + tail)
    assert records == RECORDS
    assert (losses.places, losses.skipped_bytes) == (1, len(tail))


def test_zeros_and_noise_in_the_middle_cost_no_record_around_them(tmp_path: Path) -> None:
    data = write_log(tmp_path / "a.log")
    noise = np.random.default_rng(1).integers(0, 256, 300_000, np.uint8).tobytes()
    records, losses = read(tmp_path / "a.log", data[:-LAST_TWO] + noise + bytes(3_000_000) + data[-LAST_TWO:])
    assert records == RECORDS
    assert (losses.places, losses.skipped_bytes) == (1, 3_300_000)


def test_a_flipped_byte_costs_one_record(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    header = encode_header(synthetic_rig(), {})
    records = [Record(RecordKind.DATAGRAM, 1, k, rng.bytes(int(rng.integers(0, 400)))) for k in range(300)]
    data = header + b"".join(encode_record(record) for record in records)
    for at in rng.integers(len(header), len(data), 60).tolist():
        found, losses = read(tmp_path / "a.log", damaged(data, at, bytes([data[at] ^ int(rng.integers(1, 256))])))
        assert set(found) <= set(records)
        assert len(found) >= len(records) - 1
        assert losses.damage or losses.torn_bytes, "a record is missing and nothing says so"


def test_a_header_damaged_in_one_copy_is_read_from_the_other(tmp_path: Path) -> None:
    data = write_log(tmp_path / "a.log")
    size = len(encode_header(synthetic_rig(), {"created": "today"})) // 2
    assert size % 4096 == 0, "one bad block of a disk must not destroy both copies"
    for at in (0, 8, 12, 200, size - 1, size, size + 9, 2 * size - 1):
        records, losses = read(tmp_path / "a.log", damaged(data, at, bytes([data[at] ^ 0x55])))
        assert records == RECORDS
        assert (losses.places, losses.header_bytes) == (0, size)
        assert "copies of its header" in losses.damage
    records, _ = read(tmp_path / "a.log", bytes(4096) + data[4096:])
    assert records == RECORDS


def test_logs_of_version_1_are_read(tmp_path: Path) -> None:
    document = json.dumps({"created": "long ago", "rig": json.loads(msgspec.json.encode(synthetic_rig()))}).encode()
    data = (b"RHOTLOG\0\1\0\0\0" + len(document).to_bytes(4, "little") + document
            + zlib.crc32(document).to_bytes(4, "little") + b"".join(encode_record(record) for record in RECORDS))
    (tmp_path / "a.log").write_bytes(data)
    reader = LogReader(tmp_path / "a.log")
    assert list(reader) == RECORDS
    assert reader.about == {"created": "long ago"}
    assert not reader.losses.damage


def test_a_log_without_any_sound_record_is_an_error(tmp_path: Path) -> None:
    header = encode_header(synthetic_rig(), {})
    with pytest.raises(RecordingError, match=r"a\.log: no record in it can be read"):
        read(tmp_path / "a.log", header + bytes(500))


def test_a_rig_takes_the_place_of_a_lost_header(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(write_log(path)[-LAST_TWO - 70:])
    with pytest.raises(RecordingError, match="not a raw log"):
        LogReader(path)
    reader = LogReader(path, synthetic_rig())
    assert list(reader) == RECORDS
    assert reader.losses.damage


def test_a_record_that_no_reader_takes_is_not_written() -> None:
    with pytest.raises(RecordingError, match="65536 bytes"):
        encode_record(Record(RecordKind.DATAGRAM, 1, 1, bytes(65536)))


@pytest.mark.parametrize("data", [
    b"", b"RHOT", b"{}", b"RHOTLOG\0\x03\0\0\0\0\0\0\0", b"RHOTLOG\0\x01\0\0\0\xff\xff\xff\xff{}",
    encode_header(synthetic_rig(), {})[:4095], encode_header(synthetic_rig(), {"rig": 1})[:60],
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
    with pytest.raises(RecordingError, match=r"cannot be written \(.*\); name a file in a folder that exists"):
        Recorder(tmp_path / "no" / "a.log", synthetic_rig())


@contextlib.contextmanager
def small_disk(size: int) -> Iterator[None]:
    """No file of this process may grow beyond `size` bytes, as on a disk that is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_full_disk_ends_the_recording_with_a_sentence_and_a_log_that_opens(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.log", synthetic_rig())
    with small_disk(100_000):
        for k in range(10_000):
            recorder.put(RecordKind.DATAGRAM, 1, k, b"x" * 79)
        eventually(lambda: not recorder.recording)
        recorder.put(RecordKind.DATAGRAM, 1, 2, b"datagram")  # taken no more, and nothing raises
        recorder.close()
    assert "File too large. Tracking goes on." in recorder.failure
    reader = LogReader(tmp_path / "a.log")
    assert [record.t_master_ns for record in reader] == list(range((100_000 - HEADER_SIZE) // 100))
    assert reader.torn_bytes
    assert not reader.losses.damage


def test_no_file_is_left_where_no_header_can_be_written(tmp_path: Path) -> None:
    with small_disk(100), pytest.raises(RecordingError, match=r"a\.log: cannot be written"):
        Recorder(tmp_path / "a.log", synthetic_rig())
    assert not list(tmp_path.iterdir())


def test_a_datagram_that_does_not_fit_is_a_gap_and_recording_goes_on(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.log", synthetic_rig())
    recorder.put(RecordKind.DATAGRAM, 1, 1, bytes(65536))
    recorder.put(RecordKind.DATAGRAM, 1, 2, b"datagram")
    recorder.close()
    assert sorted(record.kind for record in LogReader(recorder.path)) == [RecordKind.DATAGRAM, RecordKind.GAP]


def test_the_log_reaches_the_disk_within_a_second_and_not_in_the_thread_that_tracks(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    threads: list[str] = []
    monkeypatch.setattr("os.fsync", lambda handle: threads.append(threading.current_thread().name))
    recorder = Recorder(tmp_path / "a.log", synthetic_rig())
    recorder.put(RecordKind.DATAGRAM, 1, 1, b"datagram")
    eventually(lambda: threads)
    recorder.put(RecordKind.DATAGRAM, 1, 2, b"datagram")
    recorder.close()
    assert len(threads) >= 2, "once while recording, and at the end"
    assert threading.current_thread().name not in threads


def test_a_killed_recording_opens_and_misses_at_most_a_second(tmp_path: Path) -> None:
    for k in range(3):
        path = tmp_path / f"{k}.log"
        child = multiprocessing.get_context("fork").Process(target=record_for_ever, args=(path,))
        child.start()
        eventually(lambda path=path, least=HEADER_SIZE + 1000 * k: path.exists() and path.stat().st_size > least)
        child.kill()
        killed_ns = time.monotonic_ns()
        child.join()
        reader = LogReader(path)
        times = [record.t_master_ns for record in reader]
        assert killed_ns - times[-1] < 1_000_000_000
        assert not reader.losses.damage


def record_for_ever(path: Path) -> None:
    recorder = Recorder(path, synthetic_rig())
    pace = threading.Event()
    while not pace.wait(0.001):
        recorder.put(RecordKind.DATAGRAM, 1, time.monotonic_ns(), b"x" * 200)


def test_recover_writes_a_clean_log_of_what_is_sound(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, clean = tmp_path / "a.log", tmp_path / "clean.log"
    unknown = bytes([200]) + bytes(16) + zlib.crc32(bytes([200]) + bytes(16)).to_bytes(4, "little")
    path.write_bytes(damaged(write_log(path), -LAST_TWO, b"\xff") + unknown + b"\1torn")
    assert main(["recover", str(path), "--out", str(clean)]) == 3
    said = capsys.readouterr()
    assert f"{clean}: 4 records" in said.out
    assert "1 damaged place was skipped (60021 bytes, at least 1 record)" in said.err
    reader = LogReader(clean)
    assert list(reader) == [RECORDS[0], RECORDS[1], RECORDS[3]]
    assert (reader.losses.unknown_records, reader.losses.damage, reader.torn_bytes) == (1, "", 0)
    assert reader.about == {"created": "today"}
    assert main(["recover", str(path), "--out", str(clean)]) == 2
    assert "exists already" in capsys.readouterr().err


def test_recover_into_a_missing_folder_is_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = tmp_path / "a.log", tmp_path / "no" / "b.log"
    write_log(path)
    assert main(["recover", str(path), "--out", str(out)]) == 2
    assert f"{out}: cannot be written" in (said := capsys.readouterr().err) and "choose another --out" in said


def test_recover_with_a_rig_reads_a_log_without_a_header(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, clean, rig = tmp_path / "a.log", tmp_path / "clean.log", tmp_path / "rig.json"
    path.write_bytes(bytes(500) + write_log(path)[HEADER_SIZE + 30:])
    save_rig(rig, synthetic_rig())
    assert main(["recover", str(path), "--out", str(clean)]) == 2
    assert "--rig" in capsys.readouterr().err
    assert not clean.exists()
    assert main(["recover", str(path), "--out", str(clean), "--rig", str(rig)]) == 3
    assert list(LogReader(clean)) == RECORDS[2:]


def test_a_command_tells_losses_from_nothing_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.log"
    data = write_log(path)
    for content, code in ((data, 0), (data[:-3], 0), (data + bytes(5000), 3),
                          (damaged(data, -100, b"y"), 3), (data[:HEADER_SIZE] + bytes(5000), 2), (b"", 2)):
        path.write_bytes(content)
        assert main(["replay", str(path), "--json"]) == code
        said = capsys.readouterr()
        if code == 3:
            assert "1 damaged place was skipped" in said.err
            assert json.loads(said.out)["damaged_places"] == 1


@pytest.mark.parametrize(("about", "offset"), [
    ({"created": "1970-01-01T00:01:40.5+00:00", "created_t_master_ns": 7}, 100_500_000_000 - 7),
    ({"created": "1970-01-01T00:01:40"}, 99_000_000_000),  # an older log: its first record stands for its beginning
    ({"created": "1970-01-01T01:01:40+01:00", "created_t_master_ns": 0}, 100_000_000_000),
    ({}, None), ({"created": "today"}, None), ({"created": 5}, None), ({"created": "0001-01-01T00:00:00"}, None),
    ({"created": "9999-01-01T00:00:00"}, None), ({"created": "1970-01-02", "created_t_master_ns": "0"}, None),
    ({"created": "1970-01-02", "created_t_master_ns": -1}, None),
    ({"created": "1970-01-02", "created_t_master_ns": None}, None),  # made of a table, whose hands nobody dated
    ({"created": "1970-01-02", "created_t_master_ns": 0, "films": {}}, None),  # the time of tracking is not the film's
    ({"created": "1970-01-02", "films": {}, "filmed": "1970-01-01T00:01:40+00:00", "filmed_t_master_ns": 7},
     100_000_000_000 - 7),
])
def test_the_wall_clock_is_known_by_the_logs_beginning(about: dict[str, object], offset: int | None) -> None:
    assert wall_clock_offset_ns(about, 1_000_000_000) == offset


def test_a_log_that_begins_now_says_so() -> None:
    assert wall_clock_offset_ns(begun_now(5), 0) == pytest.approx(time.time_ns(), abs=60e9)
