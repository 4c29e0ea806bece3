"""What was seen of a bare hand in one image, for people to look at: contour, slices, and the edges found on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame
from rhot_app.barehand.contours import SILHOUETTE

Array = NDArray[np.float64]

NEAR_SD = 3.0
"""Standard deviations from the contour within which an edge is shown as the hand's."""


@dataclass(frozen=True, slots=True)
class SeenContour:
    """One image of one camera at master time `t_master_ns`; all places px, raw image.

    `contour` (N, 2): where the estimated hand's contour crosses the slices; `outline` (N,): before the background, not
    within the hand. `slices` (N, 4): their ends, x and y twice. `edges` (M, 2), `of_hand` (M,): which are the hand's.
    """

    camera: str
    t_master_ns: int
    contour: Array
    outline: NDArray[np.bool_]
    slices: Array
    edges: Array
    of_hand: NDArray[np.bool_]


@runtime_checkable
class ShowsContours(Protocol):
    """A tracker that can say what it has seen of a bare hand."""

    def seen(self) -> list[SeenContour]:
        """The newest image of each camera; none while there is no hand. Any thread may ask."""
        ...


def seen_contour(camera: str, t_ns: int, frame: ContourFrame, state: Array) -> SeenContour:
    """What one image shows of a hand in `state`."""
    offset, _, good = frame.predict(state)
    centre, normal, half = frame.slices[:, :2], frame.slices[:, 2:4], frame.slices[:, 4:]
    ends = np.hstack([centre - half * normal, centre + half * normal])
    places, near = np.empty((0, 2)), np.empty(0, np.bool_)
    if frame.edges is not None:
        edges = frame.edges
        row, column = np.nonzero((np.arange(edges.offset.shape[1]) < edges.number[:, None]) & good[:, None])
        along = edges.offset[row, column]
        places = centre[row] + along[:, None] * normal[row]
        near = np.abs(along - offset[row]) < NEAR_SD * np.hypot(frame.expected_sd[row], edges.sd[row, column])
    return SeenContour(camera, t_ns, (centre + offset[:, None] * normal)[good], frame.points.behind[good] == SILHOUETTE,
                       ends[good], places, near)
