"""A target test in the style of ISO 9241-411: the throughput of a pointer in bits per second.

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
"""Diameter of the circle of targets."""

WIDTH_M: Final = 0.04
"""Diameter of a target: across the circle its index of difficulty is 2.8 bits; the standard has 2 to 6 bits."""

EFFECTIVE: Final = 4.133
"""Effective width in standard deviations: 96 % of normally distributed clicks lie within it (ISO 9241-411)."""


@dataclass(frozen=True, slots=True)
class Throughput:
    """The result of a test. Times in s, lengths in m."""

    bits_per_s: float
    movement_s: float
    effective_width_m: float
    missed: int
    clicks: int

    @property
    def sentence(self) -> str:
        """For display."""
        return (f"{self.bits_per_s:.2f} bit/s over {self.clicks} targets: {self.movement_s:.2f} s each, effective "
                f"width {1e3 * self.effective_width_m:.0f} mm, {self.missed} missed.")


class TargetTest:
    """A test that is fed mouse states. `targets` (N, 2) m; `wanted`: index of the next one, None when all are clicked.

    The first click only starts the clock.
    """

    def __init__(self) -> None:
        around = 2.0 * math.pi * np.arange(TARGETS) / TARGETS
        ring = 0.5 * DIAMETER_M * np.stack([np.sin(around), np.cos(around)], axis=1)
        order = np.arange(TARGETS + 1) * ((TARGETS + 1) // 2) % TARGETS  # across the circle, to the next on each side
        self.targets: Array = ring
        self.order = [int(number) for number in order]
        self._clicks: list[tuple[float, Array]] = []
        self._held = True  # a thumb that is spread at the start does not click

    @property
    def wanted(self) -> int | None:
        """The target to click next."""
        done = len(self._clicks)
        return self.order[done] if done < len(self.order) else None

    def feed(self, mouse: MouseState) -> None:
        """Record a click when the thumb's button is pressed."""
        held, self._held = self._held, mouse.is_pressed("thumb")
        if self._held and not held and self.wanted is not None and mouse.cursor is not None:
            self._clicks.append((1e-9 * mouse.t_master_ns, mouse.cursor[:2].copy()))

    def result(self) -> Throughput | None:
        """The throughput; None before all targets are clicked."""
        if self.wanted is not None:
            return None
        centres = self.targets[self.order]
        times = np.array([t_s for t_s, _ in self._clicks])
        places = np.array([place for _, place in self._clicks])
        ways = np.diff(centres, axis=0)
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        beyond = np.einsum("ni,ni->n", places[1:] - centres[1:], ways)  # along each movement
        short = np.einsum("ni,ni->n", places[:-1] - centres[:-1], ways)
        amplitude = float(np.mean(np.linalg.norm(np.diff(centres, axis=0), axis=1) + beyond - short))
        width = EFFECTIVE * float(np.std(beyond, ddof=1))
        movement = float(np.mean(np.diff(times)))
        missed = int((np.linalg.norm(places[1:] - centres[1:], axis=1) > 0.5 * WIDTH_M).sum())
        bits = math.log2(amplitude / max(width, 1e-9) + 1.0)
        return Throughput(bits / movement, movement, width, missed, len(ways))
