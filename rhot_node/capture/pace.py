"""Waiting for an instant: how recordings play in real time."""

from __future__ import annotations

import time

NS_PER_S = 1_000_000_000
WAKE_UP_NS = 50_000  # the kernel wakes a sleeper 50 to 100 us late (its timer slack); this much is left out


def available_delay_ns(exposure_ns: int, row_time_ns: int, height: int) -> int:
    """From the mid-exposure of row 0 until the last row of a frame is exposed and read out, ns."""
    return exposure_ns // 2 + (height - 1) * row_time_ns


def sleep_until(t_host_ns: int) -> None:
    """Sleep until the host's monotonic clock shows `t_host_ns`; returns at once when that is past.

    Wakes some 50 us late on an idle machine; never spins, so that a playing twin leaves the processor to others.
    """
    remaining_ns = t_host_ns - time.monotonic_ns() - WAKE_UP_NS
    if remaining_ns > 0:
        time.sleep(remaining_ns / NS_PER_S)
