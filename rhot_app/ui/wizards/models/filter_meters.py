"""Jitter and lag of every marker while the hand is held still or moves: for the page, and for the coaches."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from rhot_app.calibration.filter_judgement import BRISK_M_S, MOVING_M_S
from rhot_app.calibration.filter_meters import FilterMeter, MeterReading
from rhot_app.tracking.state import HandState
from rhot_app.ui.wizards.models.step import Bar

_READ_S = 0.25
_ENOUGH_SPEED = 0.8  # of a brisk speed: go on waving


class LiveMeters:
    """Takes each state once; `reading` is of the last two seconds, None before there are any."""

    def __init__(self) -> None:
        self.names: tuple[str, ...] = ()
        self.reading: MeterReading | None = None
        self._meter: FilterMeter | None = None
        self._last = -1
        self._due_s = 0.0

    def watch(self, states: Sequence[HandState]) -> None:
        """Take what is new in the states of the last seconds."""
        for state in states:
            if self._meter is None or state.marker_ids != self.names:
                self.names, self._meter = state.marker_ids, FilterMeter(len(state.marker_ids))
            if state.t_master_ns > self._last:
                self._last = state.t_master_ns
                self._meter.add(state.t_master_ns, state.marker_raw_positions, state.marker_positions)
        now = time.monotonic()
        if self._meter is not None and states and now >= self._due_s:
            self._due_s = now + _READ_S
            self.reading = self._meter.read()

    @property
    def speed_m_s(self) -> float:
        """Of the fastest marker; NaN when none is seen."""
        speeds = self.reading.speed_m_s if self.reading is not None else np.full(1, np.nan)
        seen = speeds[speeds > 0.0]
        return float(seen.max()) if len(seen) else float("nan")

    def rows(self) -> tuple[tuple[str, str, str, str], ...]:
        """Per marker: name, jitter without and with filters in mm, lag in ms; dashes for what cannot be told."""
        if self.reading is None:
            return ()
        one = self.reading
        return tuple((name, _text(1e3 * raw, 2), _text(1e3 * filtered, 2), _text(1e3 * lag, 1)) for name, raw, filtered,
                     lag in zip(self.names, one.raw_jitter_m, one.jitter_m, one.lag_s, strict=True))

    def seen_bar(self) -> Bar:
        """How many markers are located."""
        jitter = self.reading.raw_jitter_m if self.reading is not None else np.zeros(0)
        seen = float(np.isfinite(jitter).mean()) if len(jitter) else 0.0
        return Bar("markers", seen, "markers that both cameras have seen in the last two seconds")


class StillCoach:
    """Rest the hand."""

    def __init__(self, meters: LiveMeters) -> None:
        self._meters = meters

    def watch(self, states: Sequence[HandState]) -> None:
        """See what is new."""
        self._meters.watch(states)

    def bars(self) -> tuple[Bar, ...]:
        """The markers in sight."""
        return (self._meters.seen_bar(),)

    def sentence(self) -> str:
        """Rest it, or go on so."""
        speed = self._meters.speed_m_s
        return "It moves: rest the hand on something." if speed > MOVING_M_S else "Good, hold still."


class FastCoach:
    """Wave the hand briskly."""

    def __init__(self, meters: LiveMeters) -> None:
        self._meters = meters

    def watch(self, states: Sequence[HandState]) -> None:
        """See what is new."""
        self._meters.watch(states)

    @property
    def _share(self) -> float:
        speed = self._meters.speed_m_s
        return min(speed / BRISK_M_S, 1.0) if speed == speed else 0.0

    def bars(self) -> tuple[Bar, ...]:
        """The speed, and the markers in sight."""
        return (Bar("speed", self._share, f"of {BRISK_M_S:.1f} m/s, the fastest marker of the last two seconds"),
                self._meters.seen_bar())

    def sentence(self) -> str:
        """Faster, or go on so."""
        return "Good, go on." if self._share >= _ENOUGH_SPEED else "Faster, 20 cm wide."


def _text(value: float, decimals: int) -> str:
    return f"{value:.{decimals}f}" if np.isfinite(value) else "–"
