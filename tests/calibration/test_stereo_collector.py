"""Collecting live: what is kept, and what the operator is told to do next."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from stereo_twin import BOARD, Twin, stereo_twin

from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.shared_views import BoardShot, SharedViews
from rhot_app.calibration.stereo.collector import StereoCollector, guide

NAMES = ("left", "right")


def moved(view: BoardView | None, by: float) -> BoardView | None:
    return None if view is None else replace(view, pixels=view.pixels + by)


def shots(twin: Twin) -> list[tuple[BoardView | None, ...]]:
    return [shot.views for shot in twin.views().shots]


def test_only_a_still_board_is_kept() -> None:
    collector = StereoCollector(NAMES, BOARD)
    (views,) = shots(stereo_twin(shots=1))
    assert collector.offer(views).why == "Hold still."
    assert collector.offer([moved(view, 3.0) for view in views]).why == "Hold still."
    assert collector.offer([moved(view, 3.2) for view in views]).taken
    assert len(collector.views().shots) == 1


def test_one_camera_is_not_enough() -> None:
    collector = StereoCollector(NAMES, BOARD)
    (views,) = shots(stereo_twin(shots=1))
    refused = collector.offer((views[0], None), still=True)
    assert not refused.taken
    assert "at least two cameras" in refused.why


def test_the_same_place_again_adds_nothing() -> None:
    collector = StereoCollector(NAMES, BOARD)
    (views,) = shots(stereo_twin(shots=1))
    assert collector.offer(views, still=True).taken
    again = collector.offer([moved(view, 5.0) for view in views], still=True)
    assert not again.taken
    assert "there already" in again.why
    collector.discard_last()
    assert collector.offer(views, still=True).taken


def test_guidance_leads_to_a_complete_set() -> None:
    collector = StereoCollector(NAMES, BOARD)
    told = [collector.guidance().advice]
    for views in shots(stereo_twin(seed=3, shots=40)):
        collector.offer(views, still=True)
        told.append(collector.guidance().advice)
    assert told[0] == "Show the board to left and right at once, 15 more times."
    assert told[-1] == ""
    assert collector.guidance().complete
    assert len(collector.views().shots) >= 15


def test_views_all_alike_are_not_complete() -> None:
    (views,) = shots(stereo_twin(shots=1))
    rng = np.random.default_rng(0)
    same = tuple(BoardShot(str(i), tuple(moved(view, rng.normal()) for view in views)) for i in range(20))
    guidance = guide(SharedViews(NAMES, BOARD, same))
    assert not guidance.near_and_far
    assert not guidance.complete


def test_a_tilt_counts_at_any_distance() -> None:
    """From far away opposite sides of a tilted board look equally long; it is tilted all the same."""
    corners = BOARD.object_points()[:, :2] * 900.0
    flat = BoardView(corners + 100.0, np.arange(BOARD.count), 640, 480, 20.0, 2.0)
    tilted = replace(flat, pixels=corners * [np.cos(np.radians(35.0)), 1.0] + 100.0)

    def seen(view: BoardView) -> bool:
        return guide(SharedViews(NAMES, BOARD, tuple(BoardShot(str(i), (view, view)) for i in range(6)))).tilted

    assert seen(tilted) and not seen(flat)


def test_the_pairs_that_need_views_are_those_that_link_the_cameras() -> None:
    twin = stereo_twin(shots=16)
    three = tuple(BoardShot(shot.name, (*shot.views, shot.views[1] if i < 5 else None))
                  for i, shot in enumerate(twin.views().shots))
    needs = guide(SharedViews((*NAMES, "third"), BOARD, three)).pairs
    assert [(need.first, need.second, need.shared, need.missing) for need in needs] in (
        [("left", "third", 5, 10)], [("right", "third", 5, 10)])
