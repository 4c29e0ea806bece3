"""A track's filter keeps what has become final, in the order of time, also when late observations come."""

from __future__ import annotations

import numpy as np
from hand_states import make_process, moving_state

from rhot_app.estimation.residual import Rows
from rhot_app.estimation.track import TrackFilter


class Pulled:
    """One number of the state, observed."""

    def __init__(self, size: int) -> None:
        self.row = np.eye(1, size)

    def linearise(self, state: np.ndarray) -> Rows:
        return Rows(np.zeros(1), self.row, np.ones(1), first=np.zeros(1, np.int64))


def begun() -> TrackFilter:
    process, state = make_process(), moving_state(np.random.default_rng(1))
    track = TrackFilter(process)
    track.history = []
    track.begin(10**9, state, process.stationary.copy())
    return track


def test_a_restart_after_a_late_observation_goes_on_from_the_newest_knot() -> None:
    track = begun()
    for t_s in (0.01, 0.03, 0.02):
        track.add(t_s, [Pulled(track.process.size)])
    larger = 4.0 * track.newest.covariance
    track.restart(larger)
    assert track.newest.t_s == 0.03 and track.history is not None
    final = [one for one in track.history if one is not None and one.knot.residuals]
    assert [one.knot.t_s for one in final] == [0.01, 0.02, 0.03]
    assert [one.inflated is not None for one in final] == [False, False, True]
    np.testing.assert_array_equal(track.newest.covariance, larger)


def test_the_end_of_a_track_is_kept_once() -> None:
    track = begun()
    track.add(0.01, [Pulled(track.process.size)])
    track.end()
    assert track.history is not None and track.history[-1] is None
    track.end()
    assert sum(one is not None and bool(one.knot.residuals) for one in track.history) == 1
