"""Rates and losses of the nodes and of the states, from the engine's status messages."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.engine.status import EngineStatus

Array = NDArray[np.float64]


class LossMeter:
    """Turns the ever growing counts of lost and dropped datagrams into losses per second."""

    def __init__(self) -> None:
        self._last: EngineStatus | None = None

    def clear(self) -> None:
        """Forget the last counts."""
        self._last = None

    def per_second(self, status: EngineStatus) -> float:
        """Lost and dropped datagrams of all nodes per second since the last status; NaN when that is not known.

        Counts that fell (a new session, another engine) start anew instead of giving a negative rate.
        """
        last, self._last = self._last, status
        if last is None or last.session != status.session or last.pid != status.pid:
            return float("nan")
        elapsed = (status.t_master_ns - last.t_master_ns) * 1e-9
        lost = count_lost(status) - count_lost(last)
        return lost / elapsed if elapsed > 0 and lost >= 0 else float("nan")


def count_lost(status: EngineStatus) -> int:
    """Datagrams that never came or were rejected, all nodes together."""
    return sum(node.lost + sum(node.dropped.values()) for node in status.nodes)


def rate_names(status: EngineStatus) -> tuple[str, ...]:
    """Names of the columns of `rate_row`."""
    return ("states", *(node.name for node in status.nodes))


def rate_row(status: EngineStatus) -> Array:
    """Rates (1 + nodes,) Hz; NaN while nothing arrives, so that a silence is a gap and not a line at zero."""
    values = [status.state_rate_hz, *(node.rate_hz for node in status.nodes)]
    return np.array([value if value > 0 else np.nan for value in values])
