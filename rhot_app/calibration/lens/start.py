"""What is known about a camera's lens before cameras are put together."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.stereo.bundle_layout import LensFreedom

Array = NDArray[np.float64]

K3 = 8  # its place among the lens parameters


@dataclass(frozen=True, slots=True)
class LensStart:
    """One camera's lens: `lens` (9,) fx, fy, cx, cy, k1, k2, p1, p2, k3 for pictures of `size` (width, height).

    `std` (9,) the standard deviations, when known. `origin`: "given" by a file or the rig, or found from the same
    "views" that now put the cameras together.
    """

    lens: Array
    size: tuple[int, int]
    std: Array | None = None
    origin: Literal["given", "views"] = "given"

    def freedom(self, *, refine: bool) -> LensFreedom:
        """How the bundle adjustment may change it.

        Found from the same views: all of it, for these corners say it all. Given: not at all, or with `refine` within
        its standard deviations; a k3 of zero then stays zero, because that lens was described without it.
        """
        if self.origin == "views":
            return LensFreedom.free([True] * len(self.lens), self.lens, loose_prior(self.lens, self.size))
        if not refine:
            return LensFreedom.fixed()
        free = np.ones(len(self.lens), bool)
        free[K3] = self.lens[K3] != 0.0
        return LensFreedom.free(list(free), self.lens, None if self.std is None else np.where(free, self.std, np.inf))

    def mirrored(self) -> LensStart:
        """The lens of the same camera when its pictures are flipped left to right."""
        flipped = self.lens.copy()
        flipped[2] = self.size[0] - 1 - flipped[2]
        flipped[7] = -flipped[7]
        return replace(self, lens=flipped)


def loose_prior(lens: Array, size: tuple[int, int]) -> Array:
    """Standard deviations (9,) of what lenses are: they keep a fit from running away, and pull at nothing that pictures
    determine.

    Radial coefficients are limited by what they do in the picture's corner, each power less than the one before.
    """
    longest = float(max(size))
    corner = (size[0] ** 2 + size[1] ** 2) / (4.0 * lens[0] * lens[1])  # squared radius, normalised
    return np.array([longest, longest, 0.2 * longest, 0.2 * longest, 1.0 / corner, 0.3 / corner**2, 0.05, 0.05,
                     0.05 / corner**3])
