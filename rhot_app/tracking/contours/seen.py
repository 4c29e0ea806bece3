"""What was seen of a bare hand in one image, for people to look at: contour, slices, and the edges found on them."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contour_residual import ContourFrame
from rhot_app.barehand.contours import SILHOUETTE
from rhot_app.state import SeenContour

Array = NDArray[np.float64]

NEAR_SD = 3.0
"""Standard deviations from the contour within which an edge is shown as the hand's."""


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
