"""Why pictures of two cameras do not belong together: each lie is tried, and the one that explains them is named.

A plain chessboard cannot show by itself that a picture is mirrored: with one odd and one even number of corners it
is its own mirror image, colours included. But one mirrored camera sees the board move as no rigid rig could, and turned
back it fits; what two mirrored cameras show is in `stereo.checks`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from rhot_app.calibration.board.boards import AprilGrid, Board, CharucoBoard, Chessboard, CircleGrid
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.poses import PosedView, pose_view
from rhot_app.calibration.board.shared_views import Dropped
from rhot_app.calibration.lens.fit import LensStart
from rhot_app.calibration.stereo.start import Link, link, miss
from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.geometry.transforms import inverse

Array = NDArray[np.float64]

_SAME_ROTATION = 0.05  # Frobenius norm of the difference of two rotations: 2 degrees
_SAME_PLACE = 0.03  # of the distance to the board
_MOST_COMPARED = 40  # views of one camera; more add nothing but time


@dataclass(frozen=True, slots=True)
class Doubtful:
    """Two cameras whose shots do not agree: their names, lenses and posed views, one entry per shot of each."""

    names: tuple[str, str]
    lenses: tuple[LensStart, LensStart]
    views: tuple[Sequence[PosedView | None], Sequence[PosedView | None]]
    shots: Sequence[str]
    board: Board


def explain(doubt: Doubtful, found: Link | None) -> Finding:
    """The likeliest reason why two cameras do not fit together; always poor."""
    return _one_mirrored(doubt) or _wrong_order(doubt) or _no_reason(doubt, found)


def explain_shot(doubt: Doubtful, shot: int, second_from_first: Array) -> Dropped:
    """One shot that does not agree with a rig that all others confirm, and why."""
    (first, second), names = doubt.views, doubt.names
    fits_first = _fitting(lambda other: miss((first[other], second[shot]), second_from_first), doubt.shots, shot)
    fits_second = _fitting(lambda other: miss((first[shot], second[other]), second_from_first), doubt.shots, shot)
    if fits_second is not None:
        return Dropped(doubt.shots[shot], f"the picture of {names[0]} fits that of {names[1]} in "
                       f"{doubt.shots[fits_second]}, not its own partner", "order")
    if fits_first is not None:
        return Dropped(doubt.shots[shot], f"the picture of {names[1]} fits that of {names[0]} in "
                       f"{doubt.shots[fits_first]}, not its own partner", "order")
    return Dropped(doubt.shots[shot], f"{names[0]} and {names[1]} disagree where the board is: it or a camera moved "
                   "between the pictures, or they are of different moments", "apart")


def mirrored_view(view: BoardView, board: Chessboard | CircleGrid) -> BoardView:
    """The view as it would be in the picture flipped left to right, with the corners counted as the board says."""
    row, col = np.divmod(view.ids, board.cols)
    if isinstance(board, CircleGrid) or board.rows % 2 == 0:  # the flip that keeps the pattern
        row = board.rows - 1 - row
    else:
        col = board.cols - 1 - col
    ids = row * board.cols + col
    order = np.argsort(ids)
    pixels = np.column_stack([view.width - 1 - view.pixels[:, 0], view.pixels[:, 1]])
    return replace(view, pixels=pixels[order], ids=ids[order])


def _one_mirrored(doubt: Doubtful) -> Finding | None:
    """Whether the pictures of one camera, flipped, make one rig with the other's."""
    board = doubt.board
    if isinstance(board, CharucoBoard | AprilGrid):
        return None  # mirrored, these are not found at all
    for which in (1, 0):
        flipped = [_flip(view, board, doubt.lenses[which]) for view in doubt.views[which]]
        sides = list(doubt.views)
        sides[which] = flipped
        found = link(list(zip(*sides, strict=True)))
        if found is None or not found.coherent:
            continue
        culprit = _culprit(doubt.names, which, found)
        return Finding(
            "mirrored", Grade.POOR,
            f"The pictures of {culprit} are mirrored: with them flipped left to right {len(found.agreeing)} of "
            f"{found.shared} shots fit one rig, as they are none does.",
            "A driver or a setting (hflip, selfie view) mirrors one camera.",
            f"Switch the mirroring of {culprit} off and take the pictures again; never calibrate on flipped copies.")
    return None


def _culprit(names: tuple[str, str], flipped: int, found: Link) -> str:
    """Which camera is mirrored. Flipping the other one fits as well, but puts left on the right: names decide."""
    if set(names) != {"left", "right"}:
        return f"either {names[0]} or {names[1]}"
    offset = float(found.second_from_first[0, 3]) * (1.0 if names[0] == "left" else -1.0)
    return names[flipped] if offset < 0.0 else names[1 - flipped]


def _flip(posed: PosedView | None, board: Chessboard | CircleGrid, lens: LensStart) -> PosedView | None:
    if posed is None:
        return None
    flipped = lens.mirrored() if lens.origin == "views" else lens
    return pose_view(mirrored_view(posed.view, board), board, flipped.lens)


def _wrong_order(doubt: Doubtful) -> Finding | None:
    """Whether the pictures of the two cameras fit in another order."""
    pairing = fitting_order(*doubt.views)
    shared = sum(a is not None and b is not None for a, b in zip(*doubt.views, strict=True))
    if len(pairing) < max(3, 0.6 * shared):
        return None
    offsets = {second - first for first, second in pairing.items()}
    first, second = doubt.names
    if len(offsets) == 1 and offsets != {0}:
        (offset,) = offsets
        late, early, count = (second, first, offset) if offset > 0 else (first, second, -offset)
        figure = (f"The pictures are out of order by {count}: {len(pairing)} pictures of {first} fit the picture of "
                  f"{second} {count} {'later' if offset > 0 else 'earlier'} in the list.")
        remedy = f"Leave out the first {count} of {late} and the last {count} of {early}, or mend the file names."
    else:
        some = ", ".join(f"{doubt.shots[a]} of {first} with {doubt.shots[b]} of {second}"
                         for a, b in list(pairing.items())[:4])
        figure = f"The pictures are out of order: {len(pairing)} fit when paired otherwise ({some} ...)."
        remedy = "Rename the files so that pictures of the same moment have the same number."
    return Finding("order", Grade.POOR, figure, "A picture is missing in one list, or the numbers do not belong "
                   "together.", remedy)


def fitting_order(first: Sequence[PosedView | None], second: Sequence[PosedView | None]) -> dict[int, int]:
    """Which view of the first camera fits which of the second, when all combinations are allowed.

    Each combination proposes how the cameras stand; the right ones all propose the same, the wrong ones anything.
    """
    left = {i: view.camera_from_board[0] for i, view in enumerate(first) if view is not None}
    left = dict(list(left.items())[:_MOST_COMPARED])
    right = {j: view.camera_from_board[0] for j, view in enumerate(second) if view is not None}
    pairs = [(i, j) for i in left for j in right]
    if not pairs:
        return {}
    poses = np.array([right[j] @ inverse(left[i]) for i, j in pairs])
    distance = np.median([pose[2, 3] for pose in left.values()])
    near = ((cdist(*2 * [poses[:, :3, :3].reshape(-1, 9)]) < _SAME_ROTATION)
            & (cdist(*2 * [poses[:, :3, 3]]) < _SAME_PLACE * distance))
    support = [len({pairs[k][0] for k in np.flatnonzero(row)}) for row in near]
    winner = near[int(np.argmax(support))]
    return {pairs[k][0]: pairs[k][1] for k in np.flatnonzero(winner)}


def _fitting(miss_of: Callable[[int], float], shots: Sequence[str], shot: int) -> int | None:
    """The other shot that fits best, if one fits at all."""
    misses = [np.inf if other == shot else miss_of(other) for other in range(len(shots))]
    best = int(np.nanargmin(misses)) if np.any(np.isfinite(misses)) else shot
    return best if best != shot and misses[best] < 1.0 else None


def _no_reason(doubt: Doubtful, found: Link | None) -> Finding:
    agreeing, shared = (len(found.agreeing), found.shared) if found is not None else (0, 0)
    return Finding(
        "incoherent", Grade.POOR,
        f"The pictures of {doubt.names[0]} and {doubt.names[1]} do not fit one rig: at most {agreeing} of {shared} "
        "shots agree.",
        "The cameras moved against each other, were not exposed at the same moment, or the pictures are of different "
        "boards or moments.",
        "Fix both cameras to one rail, hold the board still for each picture, and take them again.")
