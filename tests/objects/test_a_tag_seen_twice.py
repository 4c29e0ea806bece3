"""A recording and a picture with a spare print of an object's tag (../shared/cases/duplicate_tag)."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from rhot_app.__main__ import main

CASE = Path(__file__).resolve().parents[3] / "shared" / "cases" / "duplicate_tag"
pytestmark = pytest.mark.skipif(not CASE.exists(), reason="../shared/cases/duplicate_tag is not there")


def picture(name: str) -> list[str]:
    return ["object", str(CASE / "lid.json"), "--rig", str(CASE / "rig.json"), "--images", f"left={CASE / name}"]


def test_the_recording_is_exported_with_hand_and_object(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, out = CASE / "two_tags.rhotlog", tmp_path / "x.csv"
    assert main(["export", str(log), "--out", str(out)]) == 0
    said = capsys.readouterr().err
    assert "tag 2" in said and "more than once" in said and "left" in said and "Traceback" not in said
    with out.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    column = {word: next(name for name in rows[0] if word in name) for word in ("condition", "cube_validity")}
    assert len(rows) > 300
    assert sum(row[column["condition"]] in ("TRACKING", "PARTIAL") for row in rows) > 0.9 * len(rows)
    assert sum(row[column["cube_validity"]] == "tracked" for row in rows) > 0.9 * len(rows)


def test_a_picture_of_two_prints_has_no_pose_and_one_of_one_print_has(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(picture("dup.png")) == 2
    said = capsys.readouterr()
    assert "more than once" in said.err and not said.out
    assert main([*picture("one.png"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["validity"] == "tracked"
