"""``rhot export`` and what stands against it: one sentence, exit code 2, and no file that is not whole."""

from __future__ import annotations

import contextlib
import os
import resource
import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pandas
import pytest

from rhot_app.__main__ import main
from rhot_app.errors import ExportError
from rhot_app.export import formats
from rhot_app.export.export import export_log
from rhot_app.export.formats import all_formats
from rhot_app.export.plan import ExportOptions
from rhot_app.export.process import export_apart
from rhot_app.project import save_rig, with_tracker
from rhot_app.recording.raw_log import MAGIC, VERSION, LogReader, RecordKind, encode_header, encode_record


def left(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def ending(name: str) -> str:
    return all_formats()[name].endings[0]


TOY = '''
"""Counts states."""
from rhot_app.export.plan import Format


class Tally:
    def __init__(self, plan):
        self.notes, self._plan, self._count = [], plan, 0

    def add(self, states):
        self._count += len(states.t_master_ns)

    def finish(self):
        self._plan.path.write_text(f"{self._count} states in {self._plan.units}")

    def close(self):
        pass


FORMATS = (Format("tally", "Tally: how many", Tally, (".tally",), "mm"),)
'''


def test_one_file_adds_a_format(log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "formats").mkdir()
    (tmp_path / "formats" / "tally.py").write_text(TOY)
    monkeypatch.setattr(formats, "__path__", [*formats.__path__, str(tmp_path / "formats")])
    all_formats.cache_clear()
    try:
        assert main(["export", str(log), "--out", str(tmp_path / "a.tally"), "--tracker", "classic"]) == 0
        assert (tmp_path / "a.tally").read_text() == "72 states in mm"
        assert main(["export", str(log), "--format", "abacus"]) == 2
        assert "tally" in capsys.readouterr().err
    finally:
        all_formats.cache_clear()
        sys.modules.pop("rhot_app.export.formats.tally", None)


def test_the_documents_know_every_format() -> None:
    page = (Path(__file__).parents[2] / "docs" / "export.md").read_text()
    for name, one in all_formats().items():
        word = "MCAP for ROS 2" if name == "ros2" else one.title.split(":")[0]
        assert f"| {word} |" in page and f"`{name}`" in page


@pytest.mark.parametrize("name", all_formats())
def test_every_format_by_its_ending(name: str, log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / f"a{ending(name)}"
    assert main(["export", str(log), "--out", str(out), "--tracker", "classic"]) == 0
    assert capsys.readouterr().out.strip() == f"{out}: 72 states"
    assert left(tmp_path) == [out.name] and out.stat().st_size > 10_000


def test_a_binary_gltf_file_by_the_formats_ending(log: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.rhotlog"
    path.symlink_to(log)
    assert main(["export", str(path), "--format", "glb", "--tracker", "classic"]) == 0
    assert (tmp_path / "a.glb").read_bytes().startswith(b"glTF")


def test_smoothed_states_are_exported_and_the_file_says_so(log: Path, tmp_path: Path,
                                                           capsys: pytest.CaptureFixture[str]) -> None:
    for name, more in (("a", ()), ("b", ("--smooth",))):
        assert main(["export", str(log), "--out", str(tmp_path / f"{name}.npz"), "--tracker", "estimator", *more]) == 0
    with np.load(tmp_path / "a.npz") as filtered, np.load(tmp_path / "b.npz") as smoothed:
        assert (filtered["about_smoothed"], smoothed["about_smoothed"]) == ("no", "yes")
        assert (np.diff(smoothed["t_master_ns"]) >= 0).all()
        _, own, other = np.intersect1d(filtered["t_master_ns"], smoothed["t_master_ns"], return_indices=True)
        assert len(own) > 0.95 * len(filtered["t_master_ns"])
        before, after = filtered["fingertip_covariances"][own], smoothed["fingertip_covariances"][other]
        assert np.nanmedian(np.trace(after, axis1=2, axis2=3) / np.trace(before, axis1=2, axis2=3)) < 0.8
    classic = with_tracker(LogReader(log).rig, "classic")
    save_rig(tmp_path / "classic.json", classic)
    capsys.readouterr()
    rig = ["--rig", str(tmp_path / "classic.json")]
    assert main(["export", str(log), "--out", str(tmp_path / "c.npz"), *rig, "--smooth"]) == 2
    assert "only the estimator smooths" in capsys.readouterr().err
    assert left(tmp_path) == ["a.npz", "b.npz", "classic.json"]


def test_the_file_is_named_as_the_log(log: Path, tmp_path: Path) -> None:
    copy = tmp_path / "grasp.rhotlog"
    copy.write_bytes(log.read_bytes())
    assert main(["export", str(copy), "--format", "csv", "--rate", "20"]) == 0
    assert left(tmp_path) == ["grasp.csv", "grasp.rhotlog"]
    assert len(pandas.read_csv(tmp_path / "grasp.csv")) == pytest.approx(36, abs=1)


@pytest.mark.parametrize(("arguments", "words"), [
    (("--format", "fbx"), "there is no format 'fbx'; choose one of bvh, c3d"),
    ((), "the format is missing"),
    (("--out", "a.xlsx"), "no format has the ending '.xlsx'; give the file one of .bvh"),
    (("--out", "a.csv", "--format", "trc"), "a trc file ends in .trc"),
    (("--out", "a.csv", "--rate", "2000"), "the rate 2000 Hz is out of range"),
    (("--out", "a.csv", "--smooth", "--tracker", "classic"), "only the estimator smooths"),
    (("--out", "a.glb", "--units", "mm"), "gltf files are in m"),
    (("--out", "a.bvh", "--hand", "other_hand"), "has no other_hand to export"),
    (("--out", "nowhere/a.csv"), "nowhere/a.csv: the folder nowhere does not exist"),
    (("--out", "/dev/null/a.csv"), "/dev/null is not a folder"),
    (("--out", "a.csv", "--rig", "no.json"), "no.json: no such file"),
])
def test_mistakes_are_sentences(arguments: tuple[str, ...], words: str, log: Path, tmp_path: Path,
                                monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["export", str(log), *arguments]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith("rhot: ") and words in said
    assert left(tmp_path) == []


def test_logs_that_are_none(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    later = log.read_bytes().replace(MAGIC + struct.pack("<H", VERSION), MAGIC + struct.pack("<H", 9))
    (tmp_path / "later.rhotlog").write_bytes(later)
    (tmp_path / "foreign.rhotlog").write_bytes(b"something else")
    (tmp_path / "nothing.rhotlog").touch()
    reader = LogReader(log)
    (tmp_path / "empty.rhotlog").write_bytes(encode_header(reader.rig, {}))
    before = left(tmp_path)
    for name, words in (("no", "no such file"), ("later", "version 9 of the raw log is not supported"),
                        ("foreign", "this is not a raw log"), ("nothing", "the file is empty"),
                        ("empty", "it holds no observations")):
        arguments = ["export", str(tmp_path / f"{name}.rhotlog"), "--format", "csv", "--tracker", "classic"]
        assert main(arguments) == 2
        assert words in capsys.readouterr().err
        assert left(tmp_path) == before


def test_a_log_of_one_camera_has_no_hand(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    reader = LogReader(log)
    one = [encode_record(record) for record in reader if record.kind is not RecordKind.DATAGRAM or record.node_id == 1]
    path = tmp_path / "one.rhotlog"
    path.write_bytes(encode_header(reader.rig, {}) + b"".join(one))
    assert main(["export", str(path), "--format", "csv", "--tracker", "classic"]) == 0
    assert "the hand is tracked in none of" in capsys.readouterr().err
    assert pandas.read_csv(tmp_path / "one.csv")["joint_wrist_x_mm"].isna().all()
    for name in ("gltf", "bvh"):
        assert main(["export", str(path), "--format", name, "--tracker", "classic"]) == 2
        assert "nowhere tracked" in capsys.readouterr().err
    assert left(tmp_path) == ["one.csv", "one.rhotlog"]


def test_a_torn_log_is_exported_as_far_as_it_can_be_read(log: Path, tmp_path: Path,
                                                         capsys: pytest.CaptureFixture[str]) -> None:
    whole = log.read_bytes()
    (tmp_path / "torn.rhotlog").write_bytes(whole[:len(whole) * 2 // 3])
    assert main(["export", str(tmp_path / "torn.rhotlog"), "--format", "csv"]) == 3
    said = capsys.readouterr()
    assert "torn" in said.err
    assert 30 < len(pandas.read_csv(tmp_path / "torn.csv")) < 60


def test_an_existing_file_is_written_over_only_when_told(log: Path, tmp_path: Path,
                                                         capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "a.csv"
    out.write_text("mine")
    assert main(["export", str(log), "--out", str(out)]) == 2
    assert "exists already" in capsys.readouterr().err and out.read_text() == "mine"
    assert main(["export", str(log), "--out", str(out), "--force"]) == 0
    assert out.read_text().startswith("time_s,")


def test_a_recording_is_never_written_over(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "mine.csv"
    path.write_bytes(log.read_bytes())
    (tmp_path / "same.csv").symlink_to(path)
    for out in ("mine.csv", "same.csv"):
        assert main(["export", str(path), "--out", str(tmp_path / out), "--force"]) == 2
        assert "is the recording itself" in capsys.readouterr().err
    assert main(["batch", str(path), "--do", "export", "--format", "csv", "--out", str(tmp_path), "--force"]) == 2
    assert "never written over" in capsys.readouterr().err
    assert path.read_bytes() == log.read_bytes()


@contextmanager
def small_disk(size: int) -> Iterator[None]:
    """No file may grow beyond `size`: writing fails as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("name", all_formats())
def test_a_full_disk_leaves_nothing(name: str, log: Path, tmp_path: Path) -> None:
    out = tmp_path / f"a{ending(name)}"
    out.write_text("older")
    with small_disk(8192), pytest.raises(ExportError, match="cannot be written"):
        export_log(log, out, options=ExportOptions(tracker="classic"), again=True)
    assert left(tmp_path) == [out.name] and out.read_text() == "older"


@pytest.mark.parametrize("name", all_formats())
def test_an_interrupt_at_the_last_moment_leaves_nothing(name: str, log: Path, tmp_path: Path,
                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(handle: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        export_log(log, tmp_path / f"a{ending(name)}", options=ExportOptions(tracker="classic"))
    assert left(tmp_path) == []


@pytest.mark.parametrize("looks", [2, 4, 6])
def test_a_cancel_while_the_other_process_starts_is_silent(looks: int, log: Path, tmp_path: Path,
                                                           capfd: pytest.CaptureFixture[str]) -> None:
    waits = iter(range(looks))

    def cancelled(text: str, fraction: float) -> None:
        if next(waits, None) is None:
            raise InterruptedError

    with contextlib.suppress(InterruptedError):  # a quick machine may have ended before
        export_apart(log, tmp_path / "a.csv", "csv", ExportOptions(tracker="classic"), cancelled)
    assert "Traceback" not in capfd.readouterr().err


def test_a_cancel_whose_interrupt_is_lost_leaves_nothing(log: Path, tmp_path: Path,
                                                         monkeypatch: pytest.MonkeyPatch) -> None:
    def cancelled(text: str, fraction: float) -> None:
        raise InterruptedError

    monkeypatch.setattr("rhot_app.export.process.os.kill", lambda *args: None)
    with pytest.raises(InterruptedError):
        export_apart(log, tmp_path / "a.csv", "csv", ExportOptions(tracker="classic"), cancelled)
    assert left(tmp_path) == []


def test_an_interrupt_on_the_way_leaves_nothing(log: Path, tmp_path: Path) -> None:
    def interrupted(text: str, fraction: float) -> None:
        if fraction > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export_log(log, tmp_path / "a.csv", options=ExportOptions(tracker="classic"), progress=interrupted)
    assert left(tmp_path) == []


@pytest.mark.parametrize(("name", "package"), [("c3d", "ezc3d"), ("parquet", "pyarrow"), ("mcap", "mcap"),
                                               ("gltf", "pygltflib")])
def test_a_missing_package_is_named_with_its_extra(name: str, package: str, log: Path, tmp_path: Path,
                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ExportError, match=rf"needs the package '{package}'.*rhot\[export\]"):
        export_log(log, tmp_path / f"a{ending(name)}", options=ExportOptions(tracker="classic"))
    assert left(tmp_path) == []
