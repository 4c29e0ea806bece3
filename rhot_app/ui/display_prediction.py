"""The hand as the scene shows it: where it is when it is seen, not where it was in the newest pictures."""

from __future__ import annotations

import time

from rhot_app.project import Rig
from rhot_app.tracking.extrapolation import Extrapolator
from rhot_app.tracking.state import HandState
from rhot_app.ui.controller import Controller

_FRESH_NS = 500_000_000
"""A state that is older is of a recording, or of a hand that is gone: nothing is predicted of it."""


class DisplayPrediction:
    """Predicts the newest state while `wanted`, where the rig's tracker estimates velocities."""

    def __init__(self, controller: Controller) -> None:
        self.wanted = True
        self._controller = controller
        self._rig: Rig | None = None
        self._extrapolator: Extrapolator | None = None

    def shown(self, newest: HandState | None, ahead_s: float) -> HandState | None:
        """What to draw of the `newest` state when it will be seen `ahead_s` from now: the hand predicted to then, else
        that state."""
        now_ns, rig = time.monotonic_ns(), self._controller.rig
        if (not self.wanted or newest is None or rig is None or rig.tracker.kind == "classic"
                or abs(now_ns - newest.t_master_ns) > _FRESH_NS):
            return newest
        if self._extrapolator is None or rig is not self._rig:
            self._rig, self._extrapolator = rig, Extrapolator(rig)
        return self._extrapolator.at(newest, now_ns + round(1e9 * ahead_s)) or newest
