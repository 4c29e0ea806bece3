"""An engine that was killed is started again and continues; one that nobody uses ends, but never while it records."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import msgspec
import pytest
from fake_tracker import FakeTracker
from patience import eventually, settled
from synthetic_node import synthetic_rig
from test_server_and_client import Bench

from rhot_app.engine.activity import ActivityNote, read_activity
from rhot_app.engine.client import EngineClient
from rhot_app.engine.core import Engine
from rhot_app.engine.directory import open_directory
from rhot_app.engine.process import ensure_engine, running_engine, stop_engine
from rhot_app.engine.serve import Server
from rhot_app.engine.status import EngineStatus
from rhot_app.project import OutputSettings, Rig, save_rig
from rhot_app.recording.raw_log import CONTINUES, LogReader, RecordKind, next_part
from rhot_app.sources.replay import LogReplay

SOON_S = 0.2


def datagrams(log: Path) -> int:
    reader = LogReader(log)
    return sum(record.kind == RecordKind.DATAGRAM for record in reader)


@pytest.mark.parametrize(("log", "part"), [
    ("take.rhotlog", "take-part2.rhotlog"), ("take-part2.rhotlog", "take-part3.rhotlog"),
    ("2026-11-27_19-30-00.rhotlog", "2026-11-27_19-30-00-part2.rhotlog"), ("take", "take-part2")])
def test_a_part_is_called_after_the_recording(tmp_path: Path, log: str, part: str) -> None:
    assert next_part(tmp_path / log) == tmp_path / part


def test_a_part_takes_no_name_that_is_taken(tmp_path: Path) -> None:
    (tmp_path / "take-part2.rhotlog").touch()
    assert next_part(tmp_path / "take.rhotlog") == tmp_path / "take-part3.rhotlog"


def status_of(client: EngineClient) -> EngineStatus:
    client.status = None
    eventually(lambda: client.poll(0.05) is not None and client.status is not None)
    assert client.status is not None
    return client.status


def test_a_killed_engine_continues_with_its_rig_and_its_recording(tmp_path: Path, streaming_rig: Rig) -> None:
    rig_path, place, log = tmp_path / "rig.json", tmp_path / "e", tmp_path / "take.rhotlog"
    save_rig(rig_path, streaming_rig)
    in_force = msgspec.structs.replace(streaming_rig, name="changed and not saved")
    try:
        ensure_engine(rig_path, place, start=True)
        with EngineClient(place) as client:
            client.command("set_rig", document=msgspec.to_builtins(in_force))
            client.command("record", path=str(log))
            eventually(lambda: (found := read_activity(client.directory)) is not None and found.log_path)
            eventually(lambda: status_of(client).log_bytes > 40_000)
            killed = running_engine(place)
            assert killed is not None
            os.kill(killed, signal.SIGKILL)
            eventually(lambda: running_engine(place) is None)
            assert ensure_engine(rig_path, place, resume=True) != killed
            part = tmp_path / "take-part2.rhotlog"
            status = status_of(client)
            assert status.running and (status.rig_name, status.log_path) == (in_force.name, str(part))
            assert status.rig_path == str(rig_path)
            assert any("take-part2" in advice.text and "take.rhotlog" in advice.text for advice in status.advice)
            eventually(lambda: status_of(client).log_bytes > 40_000)
            assert client.command("record_stop")["path"] == str(part)
            assert not any("take-part2" in advice.text for advice in status_of(client).advice)
    finally:
        stop_engine(place)
    assert datagrams(log) > 20 and datagrams(part) > 20
    assert LogReader(part).about[CONTINUES] == log.name and LogReader(part).rig.name == in_force.name
    ended = read_activity(open_directory(place))
    assert ended is not None and ended.running and ended.log_path == ""


def test_a_recording_that_cannot_be_continued_is_said(tmp_path: Path) -> None:
    bench = Bench(synthetic_rig(), tmp_path / "e")
    try:
        bench.engine.record_on(tmp_path / "gone" / "take.rhotlog")
        status = bench.engine.status()
        assert status.log_path == ""
        assert any(advice.level == "error" and "not continued" in advice.text and "take.rhotlog" in advice.text
                   for advice in status.advice)
    finally:
        bench.close()


def test_the_note_says_what_the_engine_does(tmp_path: Path) -> None:
    bench, directory = Bench(synthetic_rig(), tmp_path / "e"), open_directory(tmp_path / "e")
    outputs = (OutputSettings("osc", "127.0.0.1:9000"),)
    try:
        note = ActivityNote(directory, bench.engine, outputs)
        bench.engine.record(tmp_path / "take.rhotlog")
        note.step()
        found = read_activity(directory)
        assert found is not None and found.rig == bench.engine.rig and found.outputs == outputs
        assert (found.log_path, found.running) == (str(tmp_path / "take.rhotlog"), False)
        note.step(ended=True)
        found = read_activity(directory)
        assert found is not None and found.log_path == ""
        directory.activity_file.write_text('{"document": {}, "rig_path": "", "running": true}')
        assert read_activity(directory) is None, "its rig is none"
    finally:
        bench.close()


def test_a_replay_leaves_no_note(tmp_path: Path) -> None:
    bench = Bench(synthetic_rig(), tmp_path / "e")
    bench.engine.record(tmp_path / "take.rhotlog")
    directory, rig = open_directory(tmp_path / "e"), bench.engine.rig
    ActivityNote(directory, bench.engine).step()
    bench.close()
    assert read_activity(directory) is not None
    replay = Engine(rig, None, lambda rig: LogReplay(tmp_path / "take.rhotlog", rig, None),
                    FakeTracker, lambda payload: None)
    try:
        ActivityNote(directory, replay).step()
        assert read_activity(directory) is None
    finally:
        replay.close()


class UnusedBench(Bench):
    """Its server ends when nobody has used the engine for a moment."""

    def make_server(self, *parts: object) -> Server:
        return Server(*parts, end_unused=True, unused_s=SOON_S)  # type: ignore[arg-type]


def test_an_engine_that_nobody_uses_ends(tmp_path: Path) -> None:
    bench = UnusedBench(synthetic_rig(), tmp_path / "e")
    try:
        with EngineClient(tmp_path / "e") as client:
            status_of(client)
            assert settled(lambda: not bench.server.ending, 3 * SOON_S), "it has a client"
        eventually(lambda: bench.server.ending)
    finally:
        bench.close()


def test_an_engine_that_records_does_not_end(tmp_path: Path) -> None:
    bench = UnusedBench(synthetic_rig(), tmp_path / "e")
    try:
        bench.engine.record(tmp_path / "take.rhotlog")
        assert settled(lambda: not bench.server.ending, 3 * SOON_S)
        bench.engine.record_stop()
        eventually(lambda: bench.server.ending)
    finally:
        bench.close()


def test_an_engine_that_is_asked_does_not_end(tmp_path: Path) -> None:
    bench = UnusedBench(synthetic_rig(), tmp_path / "e")
    try:
        with EngineClient(tmp_path / "e", states=False, events=False) as client:
            end_s = time.monotonic() + 3 * SOON_S
            while time.monotonic() < end_s:
                client.command("hello")
            assert not bench.server.ending
            eventually(lambda: bench.server.ending)
    finally:
        bench.close()
