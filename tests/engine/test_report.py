"""A fault report: what a helper needs is in it, keys and codes are not, and it is made also when little is there."""

from __future__ import annotations

import io
import json
import secrets
import zipfile
from pathlib import Path
from typing import Any

import msgspec
import pytest
from synthetic_node import synthetic_rig
from zmq.utils import z85

from rhot_app.__main__ import main
from rhot_app.engine.client import EngineClient
from rhot_app.engine.offline.report import last_part, without_keys
from rhot_app.errors import EngineError
from rhot_app.keys import keys_path, load_master_keys
from rhot_app.recording.bookmarks import Bookmark, bookmark_record
from rhot_app.recording.raw_log import LogReader, Record, RecordKind, encode_header, encode_record
from rhot_node.keys import new_key_pair
from rhot_node.network.pairing import new_code, show_code

SECOND = 1_000_000_000


def minutes(count: int) -> list[Record]:
    """A start, a datagram and a clock exchange every second."""
    start = Record(RecordKind.START, 0, 0, b"start")
    return [start, *(Record(kind, 1, t_s * SECOND, b"") for t_s in range(60 * count)
                     for kind in (RecordKind.CLOCK_REQUEST, RecordKind.CLOCK_REPLY, RecordKind.DATAGRAM))]


def test_the_last_minute_keeps_sessions_clocks_and_bookmarks() -> None:
    mark = bookmark_record(Bookmark(5, "early"))
    part = last_part([mark, *minutes(3)], 60.0)
    datagrams = [record.t_master_ns for record in part if record.kind is RecordKind.DATAGRAM]
    clocks = [record.t_master_ns for record in part if record.kind is RecordKind.CLOCK_REPLY]
    assert datagrams == [t_s * SECOND for t_s in range(119, 180)]
    assert clocks[0] == 117 * SECOND
    assert part[0].kind is RecordKind.START
    assert mark in part
    assert last_part([], 60.0) == []


def entries(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(path.read_bytes())) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


class FakeClient(EngineClient):
    """An engine whose nodes say more than they should."""

    own_rig = synthetic_rig()
    key = ""

    def command(self, name: str, *, timeout_s: float = 3.0, **arguments: Any) -> dict[str, Any]:
        """What an engine would answer."""
        if name == "status":
            return {"status": {"log_path": ""}}
        if name == "rig":
            return {"document": msgspec.to_builtins(self.own_rig), "path": ""}
        if arguments["node_id"] == 2:
            raise EngineError("node right does not answer on its control channel.")
        return {"answer": {"health": [{"code": "heat", "sentence": "76 degrees"}], "key": self.key}}


def test_no_key_and_no_code_is_in_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RHOT_KEYS", str(tmp_path / "keys.json"))
    own, node, code, link = load_master_keys().own, new_key_pair(), new_code(), secrets.token_bytes(32)
    left = msgspec.structs.replace(FakeClient.own_rig.nodes[0], public_key=node.public_key)
    rig = msgspec.structs.replace(FakeClient.own_rig, nodes=(left, FakeClient.own_rig.nodes[1]))
    monkeypatch.setattr(FakeClient, "own_rig", rig)
    monkeypatch.setattr(FakeClient, "key", link.hex())
    monkeypatch.setattr("rhot_app.engine.offline.report.EngineClient", FakeClient)
    place = tmp_path / "engine"
    place.mkdir(mode=0o700)
    said = f"key {own.public_key}\n{own.secret_key.upper()}\ncode {show_code(code)} {code}\n"
    (place / "engine.log").write_text(said)
    log = tmp_path / "a.log"
    log.write_bytes(encode_header(rig, {"note": own.secret_key}) + b"".join(map(encode_record, minutes(2))))
    assert keys_path().exists()
    assert main(["report", str(log), "--directory", str(place), "--out", str(tmp_path / "bug.zip")]) == 0
    found = entries(tmp_path / "bug.zip")
    everything = (tmp_path / "bug.zip").read_bytes() + b"".join(found.values())
    for key in (own.public_key, own.secret_key, node.public_key, node.secret_key, link.hex()):
        for spelling in (key.encode(), key.upper().encode(), bytes.fromhex(key), z85.encode(bytes.fromhex(key))):
            assert spelling not in everything
    assert code.encode() not in everything
    assert show_code(code).encode() not in everything
    assert json.loads(found["nodes.json"])["left"]["state"]["health"][0]["code"] == "heat"
    assert "does not answer" in json.loads(found["nodes.json"])["right"]["error"]
    assert "numpy" in json.loads(found["versions.json"])["packages"]
    assert json.loads(found["rig.json"])["nodes"][0]["public_key"] == without_keys(rig).nodes[0].public_key
    (tmp_path / "part.log").write_bytes(found["last_minute.log"])
    assert 0 < len(list(LogReader(tmp_path / "part.log"))) < len(minutes(2))


def test_a_report_without_an_engine_says_what_is_not_in_it(tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                                           monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FakeClient, "command", lambda *_, **__: (_ for _ in ()).throw(EngineError("no answer")))
    monkeypatch.setattr("rhot_app.engine.offline.report.EngineClient", FakeClient)
    arguments = ["report", "--directory", str(tmp_path / "none"), "--out", str(tmp_path / "bug.zip")]
    assert main(arguments) == 0
    assert "not in it: rig, status and nodes of the engine (no answer)" in capsys.readouterr().out
    assert list(entries(tmp_path / "bug.zip")) == ["versions.json"]
    assert main([*arguments[:1], str(tmp_path / "gone.log"), *arguments[1:-1], str(tmp_path / "other.zip")]) == 2
    assert not (tmp_path / "other.zip").exists()


def test_a_report_is_written_over_only_when_that_is_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                                              monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rhot_app.engine.offline.report.EngineClient", FakeClient)
    out = tmp_path / "bug.zip"
    out.write_bytes(b"another one")
    arguments = ["report", "--directory", str(tmp_path / "none"), "--out", str(out)]
    assert main(arguments) == 2
    assert "exists already" in capsys.readouterr().err and out.read_bytes() == b"another one"
    assert main([*arguments, "--force"]) == 0
    assert "versions.json" in entries(out)
