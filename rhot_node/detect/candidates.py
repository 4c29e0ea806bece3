"""Which blob of a search is which marker: by motion and size while it is remembered, else by colour and the hand."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect import measure as m
from rhot_node.detect.gate import merits
from rhot_node.detect.search import AREA, SUM_U, SUM_V, SUM_X, SUM_Y, X_MAX, X_MIN, Y_MAX, Y_MIN
from rhot_node.detect.track import MARGIN, RIVAL_MARGIN, Track
from rhot_node.detect.whereabouts import Whereabouts, middle_of
from rhot_node.markers import Marker, Shape
from rhot_node.wire.messages import MarkerFlag

Blobs = NDArray[np.float64]
Merits = NDArray[np.float64]

AS_PLAUSIBLE = 0.3  # merit of a second blob, as a fraction of the best, that makes the choice ambiguous
HAND_PASSES = 2  # of finding the hand by its likeliest markers, and those by the hand


def worth_of(own: dict[int, Blobs], markers: Sequence[Marker], tracks: Sequence[Track],
             shape: tuple[int, ...]) -> tuple[dict[int, Merits], Whereabouts | None]:
    """(N,) merit of every blob of each lost marker, and where the hand is, if that is known.

    By themselves at first, then by where that puts the hand. `shape`: (H/2, W/2) of the chroma planes.
    """
    size, hand = (shape[0], shape[1]), None
    for _ in range(HAND_PASSES):
        worth = {index: merits(blobs, markers[index], size, hand) for index, blobs in own.items()}
        hand = _whereabouts(own, worth, markers, tracks)
    return {index: merits(blobs, markers[index], size, hand) for index, blobs in own.items()}, hand


def _whereabouts(own: dict[int, Blobs], worth: dict[int, Merits], markers: Sequence[Marker],
                 tracks: Sequence[Track]) -> Whereabouts | None:
    """Where the hand is: by the worn markers that are tracked, and by the likeliest blob of each lost one."""
    worn = [(track.x, track.y, track.area) for index, track in enumerate(tracks)
            if index not in own and markers[index].role is not None]
    for index, blobs in own.items():
        if markers[index].role is not None and len(blobs):
            blob = blobs[int(np.argmax(worth[index]))]
            worn.append((blob[SUM_X] / blob[AREA], blob[SUM_Y] / blob[AREA], blob[AREA]))
    return middle_of(worn)


def ranked_by(track: Track, blobs: Blobs, worth: Merits) -> tuple[Blobs, MarkerFlag]:
    """The blobs from the likeliest on: by motion and size while the marker is remembered, else by `worth`."""
    if track.remembered:
        costs = np.array([track.candidate_cost(blob[SUM_X] / blob[AREA], blob[SUM_Y] / blob[AREA], blob[AREA])
                          for blob in blobs])
        order = np.argsort(costs)
        doubtful = len(blobs) > 1 and costs[order[1]] < costs[order[0]] + RIVAL_MARGIN
    else:
        order = np.argsort(-worth)
        doubtful = len(blobs) > 1 and worth[order[1]] > AS_PLAUSIBLE * worth[order[0]]
    return blobs[order], MarkerFlag.ACQUIRED | MarkerFlag.AMBIGUOUS if doubtful else MarkerFlag.ACQUIRED


def request_of(blob: Blobs, direction: NDArray[np.float64], shape: Shape,
               out: NDArray[np.float64]) -> NDArray[np.float64]:
    """Write the request to measure a blob as a marker of this shape and hue `direction` (cb, cr) to `out`."""
    area = blob[AREA]
    out[m.PX], out[m.PY] = blob[SUM_X] / area, blob[SUM_Y] / area
    out[m.HALF_X] = max(blob[X_MAX] - out[m.PX], out[m.PX] - blob[X_MIN]) + MARGIN
    out[m.HALF_Y] = max(blob[Y_MAX] - out[m.PY], out[m.PY] - blob[Y_MIN]) + MARGIN
    out[m.SIGMA] = 1.0 + 0.25 * math.sqrt(area)
    out[m.AREA_REF] = area
    out[m.LEVEL_REF] = (blob[SUM_U] * direction[0] + blob[SUM_V] * direction[1]) / area
    out[m.IS_BAND] = shape == "band"
    return out
