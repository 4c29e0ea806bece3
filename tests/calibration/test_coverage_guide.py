"""What views cover, and the guide that collects them from live pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from board_rendering import LENS, corners_px, pose
from intrinsics_twin import BOARD, seen, twin_views

from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.lens.coverage import CELLS, CaptureGuide, board_corners_px, cover, place


def view_at(x: float, y: float, depth: float, turn: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> BoardView:
    """The board with its middle at (x, y, depth) m before the camera."""
    return seen(corners_px(BOARD, pose(turn, (x, y, depth), BOARD), LENS), BOARD)


MIDDLE = view_at(0, 0, 0.6)


def test_bars_grow_with_what_is_shown() -> None:
    alone = cover([MIDDLE], BOARD)
    assert alone.x == alone.y == 0.0 and 0.0 < alone.size < 1.0 and alone.skew < 0.05
    wide = cover([MIDDLE, view_at(-0.2, 0, 0.6), view_at(0.2, 0, 0.6)], BOARD)
    assert wide.x > 0.9 and wide.y < 0.05
    assert cover([MIDDLE, view_at(0, 0, 0.6, (0.9, 0, 0.6))], BOARD).skew > 0.9
    assert cover([view_at(0, 0, 0.33)], BOARD).size == 1.0
    assert cover([], BOARD).share == 0.0


def test_the_map_counts_every_corner_once() -> None:
    coverage = cover([MIDDLE, view_at(-0.15, -0.1, 0.6)], BOARD)
    assert coverage.cells.shape == CELLS and coverage.cells.sum() == 108
    assert coverage.cells[0, 0] == 0 and coverage.cells[3, 4] > 0


def test_part_of_a_board_tells_where_the_whole_is() -> None:
    part = replace(MIDDLE, pixels=MIDDLE.pixels[:40], ids=MIDDLE.ids[:40])
    np.testing.assert_allclose(board_corners_px(part, BOARD), board_corners_px(MIDDLE, BOARD), atol=1.5)
    np.testing.assert_allclose(place(part, BOARD)[2:], place(MIDDLE, BOARD)[2:], atol=0.03)


def hold(guide: CaptureGuide, view: BoardView | None, t_s: float) -> bool:
    """Show a view for two frames; whether it was taken."""
    first = guide.offer(view, t_s)
    return first.capture or guide.offer(view, t_s + 0.05).capture


def test_a_still_board_is_taken_once() -> None:
    guide = CaptureGuide(BOARD)
    first = guide.offer(MIDDLE, 0.0)
    assert not first.capture and first.sentence == "Hold still."
    second = guide.offer(MIDDLE, 0.05)
    assert second.capture and second.sentence.startswith("Taken: 1. Bring the board to the")
    assert not hold(guide, MIDDLE, 1.0), "the same view was taken twice"
    assert len(guide.views) == 1
    guide.discard_last()
    assert not guide.views


def test_a_moving_board_is_not_taken() -> None:
    guide = CaptureGuide(BOARD)
    for step in range(20):
        decision = guide.offer(view_at(-0.1 + 0.01 * step, 0, 0.6), 0.05 * step)
        assert not decision.capture and decision.sentence == "Hold still."


@pytest.mark.parametrize(("fields", "word"), [({"square_px": 5.0}, "nearer"), ({"blur_px": 3.0}, "blurred")])
def test_useless_views_are_told_why(fields: dict[str, float], word: str) -> None:
    guide = CaptureGuide(BOARD)
    bad = replace(MIDDLE, **fields)
    assert not hold(guide, bad, 0.0)
    assert word in guide.offer(bad, 0.1).sentence


def test_nothing_is_taken_without_a_board() -> None:
    guide = CaptureGuide(BOARD)
    assert guide.offer(None, 0.0).sentence == "Show the whole board to the camera."
    assert not guide.offer(MIDDLE, 0.05).capture, "movement is unknown after a frame without a board"


def test_it_asks_for_what_is_missing_until_it_is_complete() -> None:
    guide = CaptureGuide(BOARD)
    views = twin_views(np.random.default_rng(3), count=60, tilt=0.5)
    asked = set()
    for number, view in enumerate(views):
        if guide.complete:
            break
        if hold(guide, view, float(number)):
            asked.add(guide.offer(view, number + 0.1).sentence.split(":")[0].split(" to the ")[0])
    assert guide.complete, guide.coverage
    assert len(guide.views) < 45
    assert guide.offer(None, 99.0).sentence == "That is enough."
    assert {"Bring the board", "Tilt the board"} & asked
    assert min(guide.coverage.bars.values()) > 0.99


def test_another_picture_size_begins_anew() -> None:
    guide = CaptureGuide(BOARD)
    assert hold(guide, MIDDLE, 0.0)
    large = replace(MIDDLE, width=1280, height=960)
    assert hold(guide, large, 1.0)
    assert len(guide.views) == 1
