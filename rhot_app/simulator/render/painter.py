"""What a painter is: it puts something that moves over the background of one camera, at the times of a frame."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rhot_app.simulator.render.exposure_samples import FrameTime

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Image = NDArray[np.float32]
Box = tuple[int, int, int, int]
"""Pixels x0 <= x < x1, y0 <= y < y1; (0, 0, 0, 0) when there are none."""


class PoseSource(Protocol):
    """Anything that says where the thing shown is at a time."""

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        """world_from_palm (T, 4, 4) m, or of whatever is shown, and a hand's angles (T, 21) rad (others: (T, 0)) at
        times (T,) s of the scene."""
        ...


class Solids(Protocol):
    """Capsules and cylinders that some pose places in the world, painted ones first; fields as of `body.HandBody`."""

    @property
    def kind(self) -> Indices: ...
    @property
    def group(self) -> Indices: ...
    @property
    def marker(self) -> Indices: ...
    @property
    def size(self) -> Array: ...
    @property
    def rgb(self) -> Array: ...
    @property
    def margin(self) -> Array: ...
    @property
    def paint(self) -> Array: ...
    @property
    def marker_count(self) -> int: ...

    def place(self, transforms: Array, angles: Array) -> Array:
        """(T, N, 12) parameters of the solids for poses (T, 4, 4) and angles (T, A)."""
        ...

    def marker_positions(self, transforms: Array, angles: Array) -> Array:
        """(T, M, 3) m, the centres of the set's markers; NaN for those that are not there."""
        ...


class Painter(Protocol):
    """Paints one kind of thing before one camera. Holds work space: one thread only."""

    @property
    def image(self) -> Image:
        """(3, H, W) light before lens and sensor, as grey levels: what was painted last, the background elsewhere."""
        ...

    def relight(self, background: Image, level: Array) -> None:
        """Another light: the `background` (3, H, W) as it is lit now, and factors (3,) on the grey levels of everything
        else. The image becomes the background."""
        ...

    def paint(self, source: PoseSource, time: FrameTime, number: int) -> tuple[Box, Array]:
        """Paint frame `number`; returns what may differ from the background, and the markers' visible parts (M,)."""
        ...
