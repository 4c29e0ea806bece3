"""Rates and losses of the nodes and of the states, from the engine's status messages."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.engine.status import EngineStatus, NodeStatus

Array = NDArray[np.float64]

_GAPS_TOO = ("time", "kernel_overflow")
_AT_START = frozenset({"clock_in_doubt", "no_clock", "not_started", "session"})

SETTLE_NS = 1_200_000_000


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
    """Frames that could not be used, all nodes together."""
    return sum(sum(unused_frames(node).values()) for node in status.nodes)


def unused_frames(node: NodeStatus) -> dict[str, int]:
    """How many frames of a node could not be used, by reason ("lost": never arrived); each is counted once.

    A frame that came too late is a gap in the sequence too. What comes before the clock and the session are agreed is
    no loss: every start has some.
    """
    twice = sum(node.dropped.get(reason, 0) for reason in _GAPS_TOO)
    found = {reason: count for reason, count in node.dropped.items() if count and reason not in _AT_START}
    lost = max(node.lost - twice, 0)
    return {**({"lost": lost} if lost else {}), **found}


class RateRows:
    """Rates of a status as a row; unknown until a run has lasted as long as the engine's own window of one second.

    Before that the engine counts what had piled up while it started as if it had come in that moment.
    """

    def __init__(self) -> None:
        self._run: tuple[int, int] | None = None
        self._began_ns = 0

    def clear(self) -> None:
        """Forget the run."""
        self._run = None

    def row(self, status: EngineStatus) -> Array:
        """Rates (1 + nodes,) Hz; NaN while nothing arrives, so that a silence is a gap and not a line at zero."""
        run = (status.pid, status.session)
        if run != self._run:
            self._run, self._began_ns = run, status.t_master_ns
        values = [status.state_rate_hz, *(node.rate_hz for node in status.nodes)]
        settled = status.t_master_ns - self._began_ns >= SETTLE_NS
        return np.array([value if value > 0 and settled else np.nan for value in values])


def rate_names(status: EngineStatus) -> tuple[str, ...]:
    """Names of the columns of `RateRows.row`."""
    return ("states", *(node.name for node in status.nodes))
