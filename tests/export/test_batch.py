"""``rhot batch``: the same files as one by one, by any number of workers, and nothing twice."""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import distributed
import pytest

from rhot_app.__main__ import main
from rhot_app.export.batch import MANIFEST, BatchJob, run_batch
from rhot_app.export.export import export_log
from rhot_app.export.plan import ExportOptions


@pytest.fixture
def folder(log: Path, gappy: Path, tmp_path: Path) -> Path:
    """Four logs: two whole ones, a torn one and something else."""
    shutil.copy(log, tmp_path / "a.rhotlog")
    shutil.copy(gappy, tmp_path / "b.rhotlog")
    (tmp_path / "torn.rhotlog").write_bytes(log.read_bytes()[:-500])
    (tmp_path / "other.rhotlog").write_bytes(b"something else")
    return tmp_path


def batch(folder: Path, names: str, *more: str) -> int:
    logs = [str(folder / f"{name}.rhotlog") for name in names.split()]
    workers = [] if "--workers" in more else ["--workers", "1"]
    return main(["batch", *logs, "--do", "export", "--format", "csv", "--tracker", "classic", "--out",
                 str(folder / "out"), *workers, *more])


def results(folder: Path) -> dict[str, int]:
    """The files and when they were written."""
    return {path.name: path.stat().st_mtime_ns for path in (folder / "out").glob("*.csv")}


def test_files_are_those_of_one_by_one_and_a_bad_log_stops_nobody(folder: Path,
                                                                  capsys: pytest.CaptureFixture[str]) -> None:
    assert batch(folder, "a other b torn", "--workers", "2") == 2
    said = capsys.readouterr().out
    assert "4 logs: 2 whole, 1 read with losses, 1 failed" in said and "other.rhotlog: this is not a raw log" in said
    assert sorted(results(folder)) == ["a.csv", "b.csv", "torn.csv"]
    for name in ("a", "b", "torn"):
        alone = folder / f"{name}-alone.csv"
        export_log(folder / f"{name}.rhotlog", alone, options=ExportOptions(tracker="classic"))
        assert (folder / "out" / f"{name}.csv").read_bytes() == alone.read_bytes()


def test_a_missing_log_is_reported_once(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert batch(folder, "nothere") == 2
    said = capsys.readouterr()
    assert (said.out + said.err).count("nothere.rhotlog: cannot be read") == 1
    assert "1 log: 0 whole, 0 read with losses, 1 failed" in said.out


def test_only_what_changed_is_done_again(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert batch(folder, "a torn") == 3
    first = results(folder)
    capsys.readouterr()
    assert batch(folder, "a torn") == 3, "what was lost stays lost"
    assert results(folder) == first and capsys.readouterr().out.count("unchanged") == 2
    (folder / "a.rhotlog").write_bytes((folder / "b.rhotlog").read_bytes())
    (folder / "out" / "torn.csv").unlink()
    assert batch(folder, "a torn") == 3
    second = results(folder)
    assert second["a.csv"] > first["a.csv"] and second["torn.csv"] > first["torn.csv"]
    assert batch(folder, "a", "--frame", "wrist") == 0
    assert results(folder)["a.csv"] > second["a.csv"], "another order"
    third = results(folder)
    assert batch(folder, "a", "--frame", "wrist", "--force") == 0
    assert results(folder)["a.csv"] > third["a.csv"]


def test_tracking_sums_up(folder: Path) -> None:
    out = folder / "sums"
    command = ["batch", str(folder / "a.rhotlog"), "--do", "track", "--tracker", "classic", "--out", str(out)]
    assert main([*command, "--workers", "1"]) == 0
    figures = json.loads((out / "a.json").read_text())
    assert figures["states"] == 72 and figures["state_rate_hz"] == pytest.approx(40.0, abs=0.5)
    assert figures["markers"]["wrist"]["measured_fraction"] > 0.9
    assert 300.0 < figures["markers"]["wrist"]["mean_mm"][2] < 900.0
    assert figures["tracked_fraction"] > 0.9 and figures["losses"] == []


@pytest.mark.parametrize(("more", "words"), [
    (("--scheduler", "tcp://127.0.0.1:1", "--workers", "2"), "leave one of them out"),
    (("--rate", "2000"), "the rate 2000 Hz is out of range"),
    (("--smooth",), "only the estimator smooths"),
])
def test_mistakes_are_sentences(more: tuple[str, ...], words: str, folder: Path,
                                capsys: pytest.CaptureFixture[str]) -> None:
    assert batch(folder, "a", *more) == 2
    assert words in capsys.readouterr().err and not (folder / "out").exists()


@pytest.mark.parametrize("content", ["[]", "1", '{"format": "rhot-batch", "version": 1, "done": [1]}', "{",
                                     '{"format": "rhot-batch", "version": 1, "done": {"a.csv": {"states": "x"}}}'])
def test_a_list_of_another_shape_is_written_anew(content: str, folder: Path) -> None:
    (folder / "out").mkdir()
    (folder / "out" / MANIFEST).write_text(content)
    assert batch(folder, "a") == 0
    assert json.loads((folder / "out" / MANIFEST).read_text())["done"]["a.csv"]["states"] > 0


def test_a_rig_that_is_a_pipe_fails_by_itself(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(folder / "rig.json")
    assert batch(folder, "a", "--rig", str(folder / "rig.json")) == 2
    said = capsys.readouterr()
    assert "only files are read" in said.out + said.err


def test_two_logs_of_one_name_are_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "more").mkdir()
    shutil.copy(folder / "a.rhotlog", folder / "more")
    assert batch(folder, "a more/a") == 2
    assert "would both become a.csv" in capsys.readouterr().err


@dataclass(frozen=True, slots=True)
class Deadly(ExportOptions):
    """Options that end the process that receives them."""

    def __reduce__(self) -> Any:
        return os._exit, (9,)


def test_a_worker_that_dies_takes_its_own_log_only(folder: Path) -> None:
    out, options = folder / "out", ExportOptions(tracker="classic")
    jobs = [BatchJob(folder / "a.rhotlog", out / "a.csv", "csv", None, options),
            BatchJob(folder / "torn.rhotlog", out / "torn.csv", "csv", None, Deadly())]
    whole, dead = run_batch(jobs, out, workers=2)
    assert whole.status == "done" and (out / "a.csv").exists()
    assert dead.status == "failed" and "its process died" in dead.message


def test_a_cluster_does_the_same(folder: Path) -> None:
    out, options = folder / "out", ExportOptions(tracker="classic")
    jobs = [BatchJob(folder / f"{name}.rhotlog", out / f"{name}.csv", "csv", None, options) for name in ("a", "other")]
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as one:
        whole, failed = run_batch(jobs, out, scheduler=one.scheduler_address)
    assert (whole.status, failed.status) == ("done", "failed")
    export_log(jobs[0].log, folder / "alone.csv", options=options)
    assert (out / "a.csv").read_bytes() == (folder / "alone.csv").read_bytes()


def test_an_interrupt_ends_the_batch_and_leaves_nothing_half_done(folder: Path,
                                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(handle: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupted)
    assert batch(folder, "a b") == 130
    assert list((folder / "out").iterdir()) == []
