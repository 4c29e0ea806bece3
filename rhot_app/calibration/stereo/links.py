"""How two cameras stand to each other, by the consensus of the shots that both have seen.

A shot proposes its own answer; the one that most shots agree with wins, and whoever disagrees is named. Nothing here is
an average over good and bad shots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.poses import PosedView
from rhot_app.geometry.transforms import inverse, log_so3

Array = NDArray[np.float64]

AGREEMENT = 0.01
"""Of the picture's diagonal: as far as a board carried over from one camera to the other may miss. A pose from one
camera alone carries an error in depth with it; a shot that does not belong misses by many times this."""

_MOST_PROPOSALS = 12  # where most shots belong together, one of a dozen surely does

Pair = tuple[PosedView | None, PosedView | None]


@dataclass(frozen=True, slots=True)
class Link:
    """How two cameras stand to each other.

    `second_from_first` (4, 4) m; `agreeing` and `disagreeing` are indices of shots; `misses_px` of all shots, NaN for
    those that one of the two did not see.
    """

    first: int
    second: int
    second_from_first: Array
    agreeing: tuple[int, ...]
    disagreeing: tuple[int, ...]
    misses_px: Array

    @property
    def shared(self) -> int:
        """How many shots both have seen."""
        return len(self.agreeing) + len(self.disagreeing)

    @property
    def coherent(self) -> bool:
        """Whether this is one rig seen by two cameras that belong together: at least two shots and most of them."""
        return len(self.agreeing) >= min(2, self.shared) and len(self.agreeing) > len(self.disagreeing)


def link(pairs: Sequence[Pair], first: int = 0, second: int = 1) -> Link | None:
    """The link between two cameras from their views of the same shots; None when they share none."""
    shared = [shot for shot, (a, b) in enumerate(pairs) if a is not None and b is not None]
    if not shared:
        return None
    asked = shared[::-(-len(shared) // _MOST_PROPOSALS)]
    proposals = [(pose, _misses(pairs, pose)) for shot in asked for pose in _relative_poses(pairs[shot])]
    best, misses = max(proposals, key=lambda proposal: _support(proposal[1]))
    return _refined(pairs, shared, first, second, best, misses)


def _support(misses: Array) -> tuple[int, float]:
    close = misses[misses < 1.0]
    return len(close), -float(np.sum(close))


def miss(pair: Pair, second_from_first: Array) -> float:
    """How far the second camera's corners are from where the first one's board says, in parts of AGREEMENT."""
    a, b = pair
    if a is None or b is None:
        return float("nan")
    diagonal = float(np.hypot(*b.view.size))
    return min(b.off(second_from_first @ pose) for pose in a.camera_from_board) / (AGREEMENT * diagonal)


def _relative_poses(pair: Pair) -> list[Array]:
    a, b = pair
    if a is None or b is None:
        return []
    return [mine @ inverse(yours) for yours in a.camera_from_board for mine in b.every_pose]


def _misses(pairs: Sequence[Pair], candidate: Array) -> Array:
    return np.array([miss(pair, candidate) for pair in pairs])


def _refined(pairs: Sequence[Pair], shared: list[int], first: int, second: int, candidate: Array,
             misses: Array) -> Link:
    """The link after averaging over the shots that agree."""
    nearest = [_nearest(_relative_poses(pairs[shot]), candidate) for shot in shared if misses[shot] < 1.0]
    if nearest:
        mean = average_pose(np.array(nearest))
        averaged = _misses(pairs, mean)
        if np.count_nonzero(averaged < 1.0) >= np.count_nonzero(misses < 1.0):
            candidate, misses = mean, averaged
    diagonals = np.array([np.hypot(*b.view.size) if b is not None else np.nan for _, b in pairs])
    return Link(first, second, candidate, tuple(s for s in shared if misses[s] < 1.0),
                tuple(s for s in shared if not misses[s] < 1.0), misses * AGREEMENT * diagonals)


def _nearest(poses: list[Array], to: Array) -> Array:
    """The pose nearest in rotation; a plane's two poses differ in it by far more than the noise."""
    return min(poses, key=lambda pose: float(np.linalg.norm(log_so3(pose[:3, :3] @ to[:3, :3].T))))


def average_pose(poses: Array) -> Array:
    """Mean of rigid poses (K, 4, 4): rotations by the nearest to the sum (Horn 1987), translations by the median."""
    left, _, right = np.linalg.svd(poses[:, :3, :3].sum(axis=0))
    mean = np.eye(4)
    mean[:3, :3] = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    mean[:3, 3] = np.median(poses[:, :3, 3], axis=0)
    return mean
