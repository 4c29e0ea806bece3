"""A target test in the style of ISO 9241-411: how many bits per second a pointer conveys.

Round targets lie in a circle on the ground; each is to be clicked with the thumb, across the circle and back. Effective
width and amplitude follow Soukoreff and MacKenzie 2004. No Qt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.mouse.pointer import MouseState

Array = NDArray[np.float64]

TARGETS: Final = 9
DIAMETER_M: Final = 0.24
"""Of the circle."""

WIDTH_M: Final = 0.04
"""Of a target: across the circle it has 2.8 bits, between the 2 and 6 bits of the standard."""

EFFECTIVE: Final = 4.133
"""Widths in standard deviations between which 96 % of normally distributed clicks lie (ISO 9241-411)."""


@dataclass(frozen=True, slots=True)
class Throughput:
    """What came of a test. Times in s, lengths in m."""

    bits_per_s: float
    movement_s: float
    effective_width_m: float
    missed: int
    clicks: int

    @property
    def sentence(self) -> str:
        """For people."""
        return (f"{self.bits_per_s:.2f} bit/s over {self.clicks} targets: {self.movement_s:.2f} s each, effective "
                f"width {1e3 * self.effective_width_m:.0f} mm, {self.missed} missed.")


class TargetTest:
    """Feed it mouse states; `targets` (N, 2) m, `wanted` is the next one's number, None when all are clicked.

    The first click only starts the clock.
    """

    def __init__(self) -> None:
        around = 2.0 * math.pi * np.arange(TARGETS) / TARGETS
        ring = 0.5 * DIAMETER_M * np.stack([np.sin(around), np.cos(around)], axis=1)
        order = np.arange(TARGETS + 1) * ((TARGETS + 1) // 2) % TARGETS  # across, and back beside the first
        self.targets: Array = ring
        self.order = [int(number) for number in order]
        self._clicks: list[tuple[float, Array]] = []
        self._held = True  # a thumb that is spread already does not click

    @property
    def wanted(self) -> int | None:
        """The target to click next."""
        done = len(self._clicks)
        return self.order[done] if done < len(self.order) else None

    def feed(self, mouse: MouseState) -> None:
        """Count a click when the thumb comes down."""
        held, self._held = self._held, mouse.is_pressed("thumb")
        if self._held and not held and self.wanted is not None and mouse.cursor is not None:
            self._clicks.append((1e-9 * mouse.t_master_ns, mouse.cursor[:2].copy()))

    def result(self) -> Throughput | None:
        """The figures; None before all targets were clicked."""
        if self.wanted is not None:
            return None
        centres = self.targets[self.order]
        times = np.array([t_s for t_s, _ in self._clicks])
        places = np.array([place for _, place in self._clicks])
        ways = np.diff(centres, axis=0)
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        beyond = np.einsum("ni,ni->n", places[1:] - centres[1:], ways)  # along each way
        short = np.einsum("ni,ni->n", places[:-1] - centres[:-1], ways)
        amplitude = float(np.mean(np.linalg.norm(np.diff(centres, axis=0), axis=1) + beyond - short))
        width = EFFECTIVE * float(np.std(beyond, ddof=1))
        movement = float(np.mean(np.diff(times)))
        missed = int((np.linalg.norm(places[1:] - centres[1:], axis=1) > 0.5 * WIDTH_M).sum())
        bits = math.log2(amplitude / max(width, 1e-9) + 1.0)
        return Throughput(bits / movement, movement, width, missed, len(ways))
