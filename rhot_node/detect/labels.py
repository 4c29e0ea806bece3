"""Colour tables: for every chroma pair (U, V), the number of the marker whose colour it may be."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_node.markers import MarkerSet

Table = NDArray[np.uint8]

SECTOR_MAGNITUDE_MIN = 6.0  # grey levels; below, the hue of an 8-bit chroma pair means nothing


def sector_table(markers: MarkerSet) -> Table:
    """(256, 256) label of [U, V] by hue alone: 1 + marker index, 0 for none.

    Where sectors overlap the nearest hue wins. Used inside the window of a marker whose local chroma level is known.
    """
    return _table(markers, [SECTOR_MAGNITUDE_MIN] * len(markers.markers))


def acquisition_table(markers: MarkerSet) -> Table:
    """(256, 256) label of [U, V] by hue and magnitude: what a full search believes to be marker paint.

    The magnitude gate matters: skin and wood reach into the hues of red and yellow, but not into their saturation.
    """
    return _table(markers, [marker.chroma.magnitude_min for marker in markers.markers])


def directions(markers: MarkerSet) -> NDArray[np.float64]:
    """(M, 2) unit vectors (cb, cr) of the markers' hues."""
    hues = [marker.chroma.hue_rad for marker in markers.markers]
    return np.array([(math.cos(hue), math.sin(hue)) for hue in hues])


def _table(markers: MarkerSet, magnitude_min: list[float]) -> Table:
    cb, cr = np.meshgrid(np.arange(256) - 128.0, np.arange(256) - 128.0, indexing="ij")
    angle, magnitude = np.arctan2(cr, cb), np.hypot(cb, cr)
    best = np.full((256, 256), np.inf)
    table = np.zeros((256, 256), dtype=np.uint8)
    for index, marker in enumerate(markers.markers):
        away = np.abs(np.remainder(angle - marker.chroma.hue_rad + math.pi, 2 * math.pi) - math.pi)
        inside = (away <= math.radians(marker.chroma.hue_tolerance_deg)) & (magnitude >= magnitude_min[index])
        nearer = inside & (away < best)
        table[nearer] = index + 1
        best[nearer] = away[nearer]
    return table
