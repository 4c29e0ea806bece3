"""What the trials of trackers print: what they were tried on, figures that line up, and what the columns mean."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import pytest

BENCHMARK = Path(__file__).resolve().parents[2] / "benchmarks" / "trackers.py"
sys.path.insert(0, str(BENCHMARK.parent))

from scenarios import legend, run_table  # noqa: E402

BLIND = {"classic": {"tips_mm": 33.25, "within_3_sd_share": None},
         "estimator": {"tips_mm": 1234.5, "within_3_sd_share": 0.99}}


def test_a_table_lines_up_and_says_what_was_tried() -> None:
    head, columns, classic, model = run_table("blind", "grasp, 8 s", BLIND).rstrip("\n").splitlines()
    assert head == "blind: grasp, 8 s"
    assert columns.split() == ["tips_mm", "within_3_sd_share"] and len({len(columns), len(classic), len(model)}) == 1
    assert classic.split() == ["classic", "33.250", "-"] and model.split() == ["estimator", "1234", "0.990"]


def test_the_legend_tells_of_the_columns_that_were_shown_once() -> None:
    told = legend([BLIND, {"estimator": {"tips_mm": 1.0, "lag_ms": 0.1}}]).splitlines()
    assert [line.split()[0] for line in told] == ["tips_mm", "within_3_sd_share", "lag_ms"]
    assert legend([{"estimator": {"starts": 3.0}}]) == ""


def test_the_command_says_seeds_motion_and_markers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                   capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", [str(BENCHMARK), "--only", "blind", "wrist", "--sketched", "--seeds", "2",
                                      "--seed", "7", "--motion", "wave", "--seconds", "3.5", "--logs", str(tmp_path)])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(str(BENCHMARK), run_name="__main__")
    printed = capsys.readouterr().out
    assert end.value.code == 0
    assert "blind: wave, 3.5 s, seeds 7 to 8, rhot6, sketched" in printed
    assert "wrist: wave, 3.5 s, seeds 7 to 8, rhot6, sketched" in printed
    assert "back_after_s" in printed and "palm turned off the truth" in printed
