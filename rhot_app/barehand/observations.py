"""Observations of images without markers, edges along slices and foreground maps, and the requests for them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.edges import EDGES_MAX, Edges

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SliceRequest:
    """What one camera's node searches from its next frame on. `slices` (N, 5) as `find_edges` takes them, rounded as
    `wire.search` rounds them. `map_step`: px between samples of the foreground map; 0: no map. `expected`: data of the
    requester, which comes back with the answer and is not sent."""

    camera: int
    slices: Array
    map_step: int = 0
    expected: Any = None


@dataclass(frozen=True, slots=True)
class EdgeFrame:
    """The edges of one frame of one camera on the slices of `request`, in master time; times are as in
    `CameraObservations`."""

    camera: int
    t_row0_master_ns: int
    row_time_ns: int
    t_receive_ns: int
    detect_s: float
    network_s: float
    request: SliceRequest
    edges: Edges
    t_row0_node_ns: int = 0


@dataclass(frozen=True, slots=True)
class ForegroundFrame:
    """Foreground probabilities (h, w) of every `step`-th pixel of one frame of one camera, in master time."""

    camera: int
    t_row0_master_ns: int
    row_time_ns: int
    t_receive_ns: int
    step: int
    probability: NDArray[np.float32]


ImageFrame = EdgeFrame | ForegroundFrame
"""An observation of an image other than markers and tags."""


def edges_of(count: int, indices: NDArray[np.int64], values: Array) -> Edges:
    """The edges of `count` slices from a list of K edges: `indices` (K,) of their slices, `values` (K, 5) offset px, sd
    px, strength, inside and outside. Of more than EDGES_MAX on a slice, the first are kept."""
    order = np.argsort(indices, kind="stable")
    indices, values = indices[order], values[order]
    rank = np.arange(len(indices)) - np.searchsorted(indices, indices)
    kept = rank < EDGES_MAX
    columns = [np.zeros((count, EDGES_MAX)) for _ in range(5)]
    for number, column in enumerate(columns):
        column[indices[kept], rank[kept]] = values[kept, number]
    return Edges(np.minimum(np.bincount(indices, minlength=count), EDGES_MAX), *columns)
