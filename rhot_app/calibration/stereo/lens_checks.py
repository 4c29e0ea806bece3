"""Whether given lenses belong to the pictures: a lens is not symmetric, so it knows mirrored and swapped pictures.

The principal point stands tens of pixels off the middle. Corners of mirrored pictures fit the mirrored lens better than
the given one, and pictures of the other camera fit the other camera's lens better.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.boards import Board
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.poses import pose_view
from rhot_app.calibration.lens.start import LensStart
from rhot_app.calibration.stereo.adjust import StereoSolution
from rhot_app.calibration.stereo.bundle import adjust
from rhot_app.calibration.verdict import Finding, Grade

Array = NDArray[np.float64]

_CLEARLY = 1.15  # another lens leaves this many times less error
_MOSTLY = 0.7  # of the views
_SUSPECT_PX = 0.15  # below this a given lens is good enough whatever a free one would do
_BETTER = 0.7  # a free lens leaves less than this share of the given one's error


@dataclass(frozen=True, slots=True)
class LensEvidence:
    """What the given lenses say about the pictures: of which cameras they look `mirrored`, and whether the first two
    cameras' pictures fit each other's lens (`swapped`)."""

    mirrored: tuple[bool, ...]
    swapped: bool

    @property
    def all_mirrored(self) -> bool:
        """Whether every camera's pictures look mirrored."""
        return bool(self.mirrored) and all(self.mirrored)


def lens_evidence(solution: StereoSolution, lenses: Sequence[LensStart | None]) -> LensEvidence:
    """Try the mirrored and the other camera's lens on every view.

    `lenses` that were calibrated apart from these views, None where there is none: that camera says nothing.
    """
    views = [[those[camera] for those in solution.views if those[camera] is not None]
             for camera in range(len(lenses))]
    mirrored = tuple(lens is not None and _fits_better(seen, solution.board, lens, lens.mirrored()) for seen, lens
                     in zip(views, lenses, strict=True))
    known = [lens for lens in lenses if lens is not None]
    pair = len(lenses) == len(known) == 2 and known[0].size == known[1].size
    swapped = pair and all(_fits_better(views[i], solution.board, known[i], known[1 - i]) for i in (0, 1))
    return LensEvidence(mirrored, swapped)


def mismatch_finding(solution: StereoSolution, lenses: Sequence[LensStart]) -> Finding | None:
    """Whether lenses estimated afresh from these pictures fit far better than the given ones, and whose those are."""
    fixed = [lens for lens, freedom in zip(lenses, solution.bundle.layout.lenses, strict=True)
             if freedom.basis.shape[1] == 0]
    rms = _rms(solution.bundle.residuals)
    if not fixed or rms < _SUSPECT_PX:
        return None
    free = [LensStart(lens.lens, lens.size, None, "views").freedom(refine=True) for lens in lenses]
    fresh = adjust(solution.bundle.state, solution.seen, free)
    better = _rms(fresh.residuals)
    if better > _BETTER * rms:
        return None
    return _of_another_camera(solution, lenses, fresh.state.lenses) or Finding(
        "lens", Grade.POOR if rms > 1.0 else Grade.FAIR,
        f"With the given intrinsics the corners are {rms:.2f} px off, with fresh ones {better:.2f} px.",
        "The intrinsics are of another camera, another focus or zoom, another picture size or mode.",
        "Calibrate the intrinsics of this camera again, or leave them out and let these pictures find them.")


def _of_another_camera(solution: StereoSolution, lenses: Sequence[LensStart], fresh: Array) -> Finding | None:
    """Whether a kept lens fits another camera's pictures as that one's own does; `fresh` (C, 9) fit each camera's."""
    views = [[those[camera] for those in solution.views] for camera in range(len(lenses))]
    own = [_rms(_errors(seen, solution.board, lens)[:, None]) for seen, lens in zip(views, fresh, strict=True)]
    for camera, freedom in enumerate(solution.bundle.layout.lenses):
        if freedom.basis.shape[1]:
            continue
        here, *there = (_rms(_errors(views[i], solution.board, lenses[camera].lens)[:, None]) / own[i]
                        for i in (camera, *(other for other in range(len(lenses)) if other != camera)))
        others = [name for name in solution.cameras if name != solution.cameras[camera]]
        if here > _CLEARLY and min(there) < _CLEARLY:
            name, other = solution.cameras[camera], others[int(np.argmin(there))]
            return Finding(
                "lenses_swapped", Grade.POOR,
                f"The intrinsics given for {name} fit the pictures of {other}; in those of {name} they leave "
                f"{here:.1f} times the error of its own lens.",
                f"The file is that of {other}, or the pictures of {name} are.",
                f"Give the file of {name}, or none: these pictures find the lens, too.")
    return None


def _fits_better(views: Sequence[BoardView | None], board: Board, lens: LensStart, other: LensStart) -> bool:
    if np.allclose(lens.lens, other.lens):
        return False
    own, others = (_errors(views, board, each.lens) for each in (lens, other))
    return bool(_rms(own[:, None]) > _CLEARLY * _rms(others[:, None]) and np.mean(others < own) >= _MOSTLY)


def _errors(views: Sequence[BoardView | None], board: Board, lens: Array) -> Array:
    """(V,) px, error of the best pose of the board in every view."""
    posed = [pose_view(view, board, lens) for view in views if view is not None]
    return np.array([np.inf if each is None else each.rms_px[0] for each in posed])


def _rms(off: Array) -> float:
    """Rms distance of residuals (M, K)."""
    return float(np.sqrt(np.mean(np.sum(np.square(off), axis=1))))
