"""From links between pairs of cameras to one start for the bundle adjustment: all cameras, all boards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.poses import PosedView
from rhot_app.calibration.stereo.links import AGREEMENT, Link, link
from rhot_app.geometry.transforms import inverse

Array = NDArray[np.float64]

PosedShots = Sequence[Sequence[PosedView | None]]
"""[shot][camera]"""


def all_links(posed: PosedShots, cameras: int) -> list[Link]:
    """The links of all pairs of cameras that share a shot."""
    found = [link([(shot[a], shot[b]) for shot in posed], a, b) for a in range(cameras) for b in range(a + 1, cameras)]
    return [each for each in found if each is not None]


def spanning_tree(links: Sequence[Link], cameras: int) -> tuple[dict[int, Array], tuple[Link, ...]]:
    """camera_from_first (4, 4) of every camera that coherent links connect with the first, strongest links first, and
    the links used (Prim)."""
    placed, used = {0: np.eye(4)}, []
    while len(placed) < cameras:
        edges = [each for each in links if each.coherent and (each.first in placed) != (each.second in placed)]
        if not edges:
            break
        best = max(edges, key=lambda each: len(each.agreeing))
        if best.first in placed:
            placed[best.second] = best.second_from_first @ placed[best.first]
        else:
            placed[best.first] = inverse(best.second_from_first) @ placed[best.second]
        used.append(best)
    return placed, tuple(used)


@dataclass(frozen=True, slots=True)
class PlacedShot:
    """Where the board was in one shot, `world_from_board` (4, 4) m, and the cameras whose views agree with it."""

    shot: int
    world_from_board: Array
    agreeing: tuple[int, ...]
    disagreeing: tuple[int, ...]


def place_shot(shot: int, views: Sequence[PosedView | None], camera_from_world: dict[int, Array]) -> PlacedShot | None:
    """The board's pose with which most cameras agree, by the least error among equals; None when nobody sees it."""
    seen = [(camera, view) for camera, view in enumerate(views) if view is not None and camera in camera_from_world]
    best, most = None, (-1, 0.0)
    for camera, view in seen:
        for pose in view.camera_from_board:
            world_from_board = inverse(camera_from_world[camera]) @ pose
            misses = {other: its.off(camera_from_world[other] @ world_from_board)
                      / (AGREEMENT * float(np.hypot(*its.view.size))) for other, its in seen}
            agreeing = tuple(other for other, value in misses.items() if value < 1.0)
            score = len(agreeing), -sum(misses[other] for other in agreeing)
            if score > most:
                rest = tuple(other for other, _ in seen if other not in agreeing)
                best, most = PlacedShot(shot, world_from_board, agreeing, rest), score
    return best
