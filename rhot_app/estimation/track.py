"""The life of a track: when it is predicted only, wrong, or lost; and its filter, in master time.

A track begins with a measured state and lasts as long as observations are accepted. `Life` has the rules for objects
and for hands tracked by markers or landmarks; contours have their own, from the same limits
(`tracking.contours.evidence`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.filter import Estimate, IteratedFilter, Knot
from rhot_app.estimation.quantiles import chi_squared
from rhot_app.estimation.residual import Process, Residual, stack

Array = NDArray[np.float64]

NEVER: Final = -(1 << 62)
"""ns: the time of what has not happened."""

LOST_NS: Final = 500_000_000
"""ns without an accepted observation: a hand at 1 m/s may be anywhere before the cameras."""

LOST_PERIODS, WRONG_PERIODS = 5.0, 3.0
"""Frame periods that must pass as well, with slow cameras: until it is lost, and until it is wrong."""

WRONG_NS: Final = 100_000_000
"""ns in which most observations are rejected: the estimate is wrong."""

GATE: Final = 0.999
"""Probability with which an observation lies within the gate of `TrackFilter.weigh`."""

PREDICTED_NS: Final = 100_000_000
"""ns without an accepted observation: the state is a prediction."""

SESSION_NS: Final = 1_000_000_000
"""ns: frames whose times are farther apart or back are of different sessions, or a clock was set."""


def comes_late(t_ns: int, newest_ns: int) -> bool:
    """Whether `t_ns` is at or before `newest_ns`, in the same session."""
    return 0 <= newest_ns - t_ns < SESSION_NS


class FinalKnot(NamedTuple):
    """A knot of master time `t_ns` that no late observation changes. `inflated` (n, n): the covariance with which the
    track led on from it, if it was inflated."""

    t_ns: int
    knot: Knot
    inflated: Array | None


class Life:
    """When a track was begun, and when its observations were last accepted, and plausible; master times, ns."""

    def __init__(self) -> None:
        self.ever = self.alive = False
        self.accepted_ns = self.plausible_ns = NEVER

    def begin(self, t_ns: int) -> None:
        """Begin the track with a state measured at `t_ns`."""
        self.ever = self.alive = True
        self.accepted_ns = self.plausible_ns = t_ns

    def end(self) -> None:
        """End the track, which is lost or wrong."""
        self.alive = False

    def observe(self, t_ns: int, *, accepted: bool = True, plausible: bool = True) -> None:
        """Note observations of `t_ns`. `accepted`: whether some passed the gate; `plausible`: whether most did."""
        if accepted:
            self.accepted_ns = max(self.accepted_ns, t_ns)
        if plausible:
            self.plausible_ns = max(self.plausible_ns, t_ns)

    def predicted(self, t_ns: int) -> bool:
        """Whether the state of `t_ns` is a prediction."""
        return t_ns - self.accepted_ns > PREDICTED_NS

    def lost(self, t_ns: int, period_ns: float = 0.0) -> bool:
        """Whether nothing was accepted for too long, by cameras with this frame period."""
        return t_ns - self.accepted_ns > max(LOST_NS, LOST_PERIODS * period_ns)

    def wrong(self, t_ns: int, period_ns: float = 0.0) -> bool:
        """Whether most observations were rejected for too long."""
        return t_ns - self.plausible_ns > max(WRONG_NS, WRONG_PERIODS * period_ns)


class TrackFilter(IteratedFilter):
    """A filter whose times are counted from the master time at which its track began."""

    def __init__(self, process: Process, begun_ns: int = 0) -> None:
        super().__init__(process)
        self.begun_ns = begun_ns
        self.history: list[FinalKnot | None] | None = None
        """What has become final, for a smoother, which takes it away: knots, and None where a track ended. None: it is
        not kept."""

    def begin(self, t_ns: int, state: Array, covariance: Array) -> None:
        """Begin a track with a prior of master time `t_ns`."""
        self.end()
        self.begun_ns = t_ns
        self.start(0.0, state, covariance)

    def restart(self, covariance: Array) -> None:
        """Go on from the newest knot with a larger covariance, so that no late frame undoes it."""
        newest = self.newest
        for one in self.knots:
            self.release(one, covariance if one is newest else None)
        self.start(newest.t_s, newest.state, covariance)

    def weigh(self, t_ns: int, residuals: Callable[[Array], Sequence[Residual]],
              beside: Sequence[Residual] = ()) -> bool:
        """Update by what is observed at `t_ns`, by the state predicted for then, and by `beside`; False when it is
        outside the gate, or before the oldest knot."""
        if self.forgot(t_ns):
            return False
        t_s = self.seconds(t_ns)
        prediction = self.predict(t_s)
        observed = residuals(prediction[0])
        error, jacobian, variances, _, _ = stack([one.linearise(prediction[0]) for one in observed], self.process.size,
                                                 weigh=False)
        if len(error):
            spread = jacobian @ prediction[1] @ jacobian.T + np.diag(variances)
            if error @ np.linalg.solve(spread, error) > chi_squared(GATE, len(error)):
                return False
        self.add(t_s, [*observed, *beside], prediction)
        return True

    def end(self) -> None:
        """The track has ended: all its knots are final."""
        if self.history is not None:
            for one in self.knots:
                self.release(one)
            self.history.append(None)
            self.knots = [Knot(one.t_s, one.state, one.covariance) for one in self.knots[-1:]]

    def release(self, knot: Knot, inflated: Array | None = None) -> None:
        """Keep a final knot in the history."""
        if self.history is not None:
            self.history.append(FinalKnot(self.time_ns(knot.t_s), knot, inflated))

    def seconds(self, t_ns: int) -> float:
        """Master time `t_ns` as the filter counts it."""
        return 1e-9 * (t_ns - self.begun_ns)

    def forgot(self, t_ns: int) -> bool:
        """Whether `t_ns` is before the oldest knot."""
        return self.seconds(t_ns) < self.knots[0].t_s

    def predict_ns(self, t_ns: int) -> Estimate:
        """`predict` at master time `t_ns`."""
        return self.predict(self.seconds(t_ns))

    def time_ns(self, t_s: float) -> int:
        """The master time of `t_s`."""
        return self.begun_ns + round(1e9 * t_s)

    @property
    def newest_ns(self) -> int:
        """Master time of the newest knot."""
        return self.time_ns(self.newest.t_s)
