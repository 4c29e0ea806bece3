"""What was seen of a bare hand in one image, for people to look at: contour, slices, and the edges found on them."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from rhot_app.state import SeenContour

Array = NDArray[np.float64]


@runtime_checkable
class ShowsContours(Protocol):
    """A tracker that can say what it has seen of a bare hand."""

    def seen(self) -> list[SeenContour]:
        """The newest image of each camera; none while there is no hand. Any thread may ask."""
        ...
