"""Bones: what six markers do not show, lengths by a ruler, and the command's refusals."""

from __future__ import annotations

from pathlib import Path

import pytest
from bones_twin import SIX, Sloppiness, base_hand, person, record

from rhot_app.__main__ import main
from rhot_app.calibration.bones import solve_bones
from rhot_app.calibration.bones_entry import enter_bones
from rhot_app.calibration.bones_report import Known
from rhot_app.errors import CalibrationError


def test_six_markers_show_the_size_and_no_single_bone() -> None:
    hand = person(2)
    report = solve_bones(record(hand, SIX, 2, seconds=40.0, rate_hz=40.0, sloppiness=Sloppiness(noise_m=0.5e-3)),
                         base_hand())
    assert all(bone.known is Known.PRIOR for bone in report.bones)
    assert "not_observed" in report.verdict.codes
    assert 0.0 < report.size_std < 0.05


def test_lengths_by_a_ruler_stand_in_the_hand() -> None:
    report = enter_bones(base_hand(), {"index.proximal": 41.0})
    assert report.hand.fingers["index"].bones_mm[0] == pytest.approx(41.0, abs=0.01)
    assert report.verdict.acceptable
    with pytest.raises(CalibrationError):
        enter_bones(base_hand(), {"index.nose": 41.0})


def test_the_command_refuses_with_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = tmp_path / "notes.tsv"
    text.write_text("not a recording\n")
    for arguments in (["--tsv", str(tmp_path / "none.tsv")], ["--tsv", str(text)], ["--set", "index.proximal=long"]):
        assert main(["calibrate", "bones", *arguments, "--out", str(tmp_path / "hand.json")]) == 2
        assert "rhot: " in capsys.readouterr().err
    assert not (tmp_path / "hand.json").exists()
