"""Boards on which other programs' users failed (``../shared/cases``): read, or refused for the true cause."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from rhot_app.__main__ import main

CASES = Path(__file__).parents[2] / "../shared/cases"


def calibrated(case: str, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    """The report on a case's pictures."""
    folder = CASES / case
    if not folder.exists():
        pytest.skip(f"{folder} is absent: its pictures are needed")
    assert main(["calibrate", "stereo", "--left", f"{folder}/left/*.png", "--right", f"{folder}/right/*.png", "--board",
                 "10x7", "--square-mm", "25", "--marker-mm", "18.75", "--baseline-mm", "75", "--json"]) == 0
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    return answer


def test_a_board_printed_in_negative_calibrates(capsys: pytest.CaptureFixture[str]) -> None:
    answer = calibrated("inverted_charuco", capsys)
    assert answer["views_used"] == 10 and answer["baseline_mm"] == pytest.approx(75.0, abs=0.1)
    assert answer["cameras"][0]["fx"] == pytest.approx(530.47, abs=0.5)


@pytest.mark.filterwarnings("error")
def test_a_board_that_is_whole_but_far_is_used_or_called_too_small(capsys: pytest.CaptureFixture[str]) -> None:
    answer = calibrated("charuco_far", capsys)
    assert answer["views_used"] >= 13 and answer["baseline_mm"] == pytest.approx(75.0, abs=0.1)
    assert all("too small" in one["reason"] for one in answer["views_rejected"])
