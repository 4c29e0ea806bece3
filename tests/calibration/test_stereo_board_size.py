"""A board that is larger than was said is noticed in real pictures; one of the right size is not blamed."""

from __future__ import annotations

from dataclasses import replace

from stereo_pictures import BOARD, NUMBERS, needs_pictures, picture

from rhot_app.calibration.board.corners import detect
from rhot_app.calibration.board.size_check import look_beyond, size_finding
from rhot_app.calibration.verdict import Finding


def judged(cols: int) -> Finding | None:
    board = replace(BOARD, cols=cols)
    seen = []
    for number in NUMBERS:
        gray = picture("left", number)
        view = detect(gray, board, thorough=False)
        if view is not None:
            seen.append(look_beyond(gray, view, board))
    assert len(seen) >= 10
    return size_finding(seen, board)


@needs_pictures
def test_nine_by_six_said_to_be_eight_by_six_is_named() -> None:
    finding = judged(8)
    assert finding is not None
    assert finding.code == "board_size"
    assert "--board 9x6" in finding.remedy


@needs_pictures
def test_the_right_size_is_not_doubted() -> None:
    assert judged(9) is None


def test_nothing_seen_says_nothing() -> None:
    assert size_finding([], BOARD) is None
