"""A board's own errors, found together with the lens: printed, glued or bent boards are off by a tenth of a millimetre.

On the real images of the tests the corners of one hand-glued board are off by 0.09 mm; taken as drawn it leaves 0.16 px
of rms and pulls the focal length by more than its stated error, with its own shape 0.06 px are left, and both cameras
find the same shape to 0.02 mm (Strobl and Hirzinger 2011, "More accurate pinhole camera calibration with imperfect
planar target"). How large the errors are is itself taken from the pictures, so that few views of a good board do not
bend it: the variances follow from the evidence (MacKay 1992, "Bayesian interpolation").
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from rhot_app.calibration.stereo.bundle import Bundle, adjust
from rhot_app.calibration.stereo.bundle_layout import BoardFreedom, LensFreedom
from rhot_app.calibration.stereo.bundle_model import POINT, Array, Observations
from rhot_app.progress import Progress, silent

FEWEST_VIEWS = 5
MOST_CORNERS = 400
"""Of a board: its errors are three unknowns a corner, and the solve grows with their cube."""

_CHANCE = 1e-3  # of taking a perfect board for an imperfect one
_FIRST_GUESS = 0.005  # of a square's side: SD of the errors along x, y and z before the pictures say
_LEAST = 1e-5  # of a square's side
_ROUNDS = 6
_SETTLED = 0.1
_EXACT_PX = 2e-3  # computed corners, not seen ones


@dataclass(frozen=True, slots=True)
class BoardErrors:
    """What the pictures say about the board: `places` (N, 3) m, how far each corner is from where it was drawn, and the
    standard deviations in and across the board's plane, m."""

    places: Array
    in_plane_m: float
    across_m: float

    @property
    def freedom(self) -> BoardFreedom:
        """The same board's freedom in another adjustment."""
        return BoardFreedom(len(self.places), np.array([self.in_plane_m, self.in_plane_m, self.across_m]))


def find_board_errors(plain: Bundle, seen: Observations, lenses: Sequence[LensFreedom], count: int, side_m: float, *,
                      progress: Progress = silent) -> tuple[Bundle, BoardErrors | None]:
    """Adjust again with the board's `count` corners free to be off; `plain` is the adjustment without.

    `side_m` of a square. Returns `plain` and None when a perfect board explains the pictures as well, or there are too
    few to tell.
    """
    if len(plain.state.world_from_board) < FEWEST_VIEWS or count > MOST_CORNERS or plain.noise_px < _EXACT_PX:
        return plain, None
    spread = np.full(POINT, _FIRST_GUESS * side_m)
    state = plain.state
    for number in range(_ROUNDS):
        bundle = adjust(state, seen, lenses, board_errors=BoardFreedom(count, spread), progress=progress)
        if not number and not _better(plain, bundle, len(seen)):
            return plain, None
        state = bundle.state
        before, spread = spread, np.maximum(_evidence(bundle, spread), _LEAST * side_m)
        if np.all(np.abs(spread - before) < _SETTLED * before):
            break
    assert state.board_errors is not None
    return bundle, BoardErrors(state.board_errors, float(before[0]), float(before[2]))


def _better(plain: Bundle, bent: Bundle, corners: int) -> bool:
    """F-test: whether the residuals shrink by more than as many free numbers shrink them by chance."""
    more = bent.determined - plain.determined
    left = 2 * corners - bent.determined
    if more <= 1 or left <= 1:
        return False
    before = plain.noise_px**2 * (2 * corners - plain.determined)
    after = bent.noise_px**2 * left
    ratio = (before - after) / more / max(after / left, 1e-300)
    return bool(stats.f.sf(ratio, more, left) < _CHANCE)


def _evidence(bundle: Bundle, spread: Array) -> Array:
    """The standard deviations (3,) that make the pictures most likely: x and y alike, z apart."""
    assert bundle.state.board_errors is not None
    certainty = np.diag(bundle.covariance)[bundle.layout.errors].reshape(-1, POINT)
    determined = np.maximum(1.0 - certainty / spread**2, 0.0).sum(axis=0)  # numbers the pictures determine, per axis
    squares = np.square(bundle.state.board_errors).sum(axis=0)
    in_plane = np.sqrt((squares[0] + squares[1]) / max(determined[0] + determined[1], 1e-9))
    across = np.sqrt(squares[2] / max(determined[2], 1e-9))
    return np.array([in_plane, in_plane, across])
