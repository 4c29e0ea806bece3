"""What a chart shows, without the widget or the paper that draws it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Style = Literal["line", "dashes", "dots", "faint dots", "band"]


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One curve: `x` and `y` (N,). A band reaches from `y` to `high` (N,). `colour` ``#rrggbb``: its own, if it has
    one; a curve without a `name` stays out of the legend."""

    name: str
    x: Array
    y: Array
    style: Style = "line"
    high: Array | None = None
    colour: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """Curves over one pair of axes with their units; `log_x`, `log_y`: a logarithmic axis, all values above 0."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    log_x: bool = False
    log_y: bool = False
