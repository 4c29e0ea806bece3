"""``rhot certify``: what it writes, what it compares, and what it refuses with a sentence."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pytest
from pdf_pages import pages_of
from simulated_protocol import BRIEF, Recorded, recorded, with_baseline

from rhot_app.__main__ import main
from rhot_app.certificate.charts import chart_of
from rhot_app.certificate.collect import collect, merged
from rhot_app.certificate.document import compare, read_certificate
from rhot_app.certificate.recordings import ProtocolFile, read_protocol
from rhot_app.project import save_rig


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return recorded(tmp_path_factory.mktemp("command") / "recordings", 3, BRIEF)


@pytest.fixture
def rig(made: Recorded, tmp_path: Path) -> Path:
    save_rig(tmp_path / "rig.json", made.rig)
    return tmp_path / "rig.json"


def test_a_folder_of_recordings_becomes_a_page_a_pdf_and_numbers(made: Recorded, rig: Path, tmp_path: Path,
                                                                 capsys: pytest.CaptureFixture[str]) -> None:
    out, wrong = tmp_path / "first", tmp_path / "wrong.json"
    assert main(["certify", "--rig", str(rig), "--recordings", str(made.folder), "--out", str(out)]) in (0, 1)
    assert sorted(path.name for path in out.iterdir()) == ["certificate.html", "certificate.json", "certificate.pdf"]
    certificate = read_certificate(out)
    page, pdf = (out / "certificate.html").read_text(), (out / "certificate.pdf").read_bytes()
    assert page.count("<svg") == sum(chart_of(line) is not None for line in certificate.lines) == 5
    assert "http" not in page.replace("http://www.w3.org/2000/svg", ""), "the page needs nothing from elsewhere"
    printed = "".join(text for text, _ in pages_of(pdf))
    for line in certificate.lines:
        assert line.title in page and f"{line.title}: {line.verdict}" in printed
    assert all(f"page {number}" in text for number, (text, _) in enumerate(pages_of(pdf), start=1))
    assert sum((picture.min(axis=-1) < 128).mean() > 0.004 for _, picture in pages_of(pdf)) >= 3, "no page is empty"

    save_rig(wrong, with_baseline(made.rig, 1.01))
    assert main(["certify", "--rig", str(wrong), "--recordings", str(made.folder), "--out", str(tmp_path / "second")]
                ) == 1, "a line that differs is told by the exit code"
    capsys.readouterr()
    assert main(["certify", "--compare", str(out), str(tmp_path / "second"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert any("Rod of known length, length error:" in sentence for sentence in said["changed"])
    found, notes = compare(certificate, certificate)
    assert found and not notes and not any(one.changed for one in found)


def test_logs_by_themselves_are_steps(made: Recorded, rig: Path, tmp_path: Path,
                                      capsys: pytest.CaptureFixture[str]) -> None:
    protocol = made.protocol
    assert protocol.rod is not None and protocol.plumb is not None
    pair = ",".join(protocol.rod.markers)
    code = main(["certify", "--rig", str(rig), "--out", str(tmp_path / "c"), "--json",
                 "--step", f"rod:{protocol.rod.length_mm}:{pair}={made.folder / protocol.rod.log}",
                 "--step", f"plumb:{pair}={made.folder / protocol.plumb.log}",
                 *(word for row in protocol.ruler for word in (
                     "--step", f"ruler:{row.distance_mm}:{row.marker}={made.folder / row.log}"))])
    lines = {line["code"]: line["verdict"] for line in json.loads(capsys.readouterr().out)["certificate"]["lines"]}
    assert code == (1 if "differs" in lines.values() else 0)
    assert lines["static"] == lines["latency"] == lines["handedness"] == "not measured"
    assert lines["upright"] == "agrees" and "not measured" not in (lines["rod"], lines["depth"])
    other = merged(protocol, ProtocolFile(rod=msgspec.structs.replace(protocol.rod, log="/tmp/other.rhotlog")))
    assert other.rod != protocol.rod and (other.static, other.ruler) == (protocol.static, protocol.ruler)


def test_a_batch_certifies_folders_and_none_twice_for_nothing(made: Recorded, tmp_path: Path,
                                                              capsys: pytest.CaptureFixture[str]) -> None:
    out, empty = tmp_path / "out", tmp_path / "empty"
    empty.mkdir()
    order = ["batch", str(made.folder), str(empty), "--do", "certify", "--workers", "1", "--out", str(out)]
    assert main(order) == 2, "one of them has no protocol"
    said = capsys.readouterr().out
    assert "protocol.json: no such file" in said and "1 whole" in said
    assert read_certificate(out / "recordings.json").rig == made.rig.name
    assert (out / "recordings.html").is_file() and (out / "recordings.pdf").is_file()
    main(order)
    assert "unchanged" in capsys.readouterr().out


@pytest.mark.parametrize(("arguments", "words"), [
    ([], "--rig FILE says which rig"),
    (["--rig", "RIG"], "no terminal to ask in"),
    (["--rig", "RIG", "--recordings", "nowhere"], "there is no such folder"),
    (["--rig", "nowhere.json", "--recordings", "EMPTY"], "nowhere.json: no such file"),
    (["--rig", "RIG", "--recordings", "EMPTY"], "protocol.json: no such file"),
    (["--rig", "RIG", "--recordings", "MISSING"], "there is no such recording"),
    (["--rig", "RIG", "--recordings", "BROKEN"], "gone.rhotlog"),
    (["--rig", "RIG", "--recordings", "EMPTY", "--simulated"], "makes its own recordings"),
    (["--rig", "RIG", "--sketched", "--recordings", "EMPTY"], "give --simulated too"),
    (["--rig", "RIG", "--step", "walk=x.log"], "write static[:palm|:back]=FILE, ruler:MM:MARKER=FILE"),
    (["--rig", "RIG", "--step", "ruler:far:index=x.log"], "write ruler:MM:MARKER=FILE"),
    (["--rig", "RIG", "--step", "ruler:300=x.log"], "the marker that was held"),
    (["--rig", "RIG", "--step", "rod:long:a,b=x.log"], "write rod:MM:UPPER,LOWER=FILE"),
    (["--rig", "RIG", "--step", "rod:300=x.log"], "write rod:MM:UPPER,LOWER=FILE"),
    (["--rig", "RIG", "--step", "static:side=x.log"], "the side of the hand"),
    (["--rig", "RIG", "--step", "plumb:a=x.log"], "write plumb:UPPER,LOWER=FILE"),
    (["--rig", "RIG", "--step", "flash=x.log"], "the times of its screen"),
    (["--simulated", "--out", "EMPTY"], "exists already"),
    (["--simulated", "--out", "nowhere/here"], "is not a folder"),
    (["--compare", "nowhere", "EMPTY"], "nowhere: no such file"),
])
def test_mistakes_have_a_sentence_and_leave_nothing(made: Recorded, rig: Path, tmp_path: Path, arguments: list[str],
                                                    words: str, monkeypatch: pytest.MonkeyPatch,
                                                    capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    static = made.protocol.static
    assert static is not None
    gone = ProtocolFile(static=msgspec.structs.replace(static, log="gone.rhotlog"))
    for name, protocol in (("EMPTY", None), ("MISSING", gone), ("BROKEN", gone)):
        (tmp_path / name).mkdir()
        if protocol is not None:
            (tmp_path / name / "protocol.json").write_bytes(msgspec.json.encode(protocol))
    (tmp_path / "BROKEN" / "gone.rhotlog").write_bytes(b"no log at all")
    before = sorted(tmp_path.rglob("*"))
    assert main(["certify", *(str(rig) if word == "RIG" else word for word in arguments)]) == 2
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1, said
    assert sorted(tmp_path.rglob("*")) == before


def test_the_terminal_leads_through_the_steps(made: Recorded, tmp_path: Path) -> None:
    """Each question once; what the engine is asked; what stands in the folder."""
    asked: list[str] = []
    commands: list[str] = []
    answers = iter(["", "p", "", "300", "", "far", "", "250,5", "", "knuckle", "", "s", ""])

    class Engine:
        def command(self, name: str, **arguments: object) -> dict[str, object]:
            commands.append(name)
            return {"running": False}

    def ask(question: str) -> str:
        asked.append(question)
        return next(answers)

    protocol = collect(tmp_path, made.rig, Engine(), ask, wait=lambda _: None, say=lambda _: None)
    assert protocol == read_protocol(tmp_path)
    assert protocol.static is not None and protocol.static.facing == "palm"
    assert [row.distance_mm for row in protocol.ruler] == [300.0]
    assert protocol.rod is None and protocol.plumb is not None and protocol.plumb.lower == made.rig.markers.ids[1]
    assert commands == ["hello", "start", *["record", "record_stop"] * 3]
