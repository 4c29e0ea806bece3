"""The hand as the scene shows it: where it is when it is seen, not where it was in the newest pictures."""

from __future__ import annotations

import time
from dataclasses import replace

from rhot_app.errors import EngineError
from rhot_app.tracking.state import Condition, HandState
from rhot_app.ui.controller import Controller

_PATIENCE_S = 0.02
"""An engine that answers later than this is busy; the newest state is shown then."""

_AGAIN_S = 1.0
_FRESH_NS = 500_000_000
"""A state that is older is of a recording, or of a hand that is gone: nothing is predicted of it."""


class DisplayPrediction:
    """Asks the engine, in the window's thread, while `wanted`; for a millisecond where the tracker predicts, else not
    at all."""

    def __init__(self, controller: Controller) -> None:
        self.wanted = True
        self._controller = controller
        self._not_before_s = 0.0

    def shown(self, newest: HandState | None, ahead_s: float) -> HandState | None:
        """What to draw of the `newest` state when it will be seen `ahead_s` from now: the hand predicted to then, else
        that state."""
        now_ns, client, rig = time.monotonic_ns(), self._controller.link.client, self._controller.rig
        if (not self.wanted or newest is None or client is None or rig is None or rig.tracker.kind == "classic"
                or newest.condition not in (Condition.TRACKING, Condition.PARTIAL)
                or abs(now_ns - newest.t_master_ns) > _FRESH_NS or 1e-9 * now_ns < self._not_before_s):
            return newest
        try:
            predicted = client.predict(now_ns + round(1e9 * ahead_s), timeout_s=_PATIENCE_S)
        except EngineError:
            self._not_before_s = 1e-9 * now_ns + _AGAIN_S
            return newest
        return newest if predicted is None else _known_as(predicted, newest)


def _known_as(predicted: HandState, newest: HandState) -> HandState:
    """What is predicted is soon no longer measured. The scene shows what pictures tell and what they do not: that of
    `newest`, whose place is predicted. How well it is, ellipsoids say."""
    other = predicted.other
    if other is not None and newest.other is not None:
        other = _known_as(other, newest.other)
    return replace(predicted, condition=newest.condition, marker_knowledge=newest.marker_knowledge,
                   joint_knowledge=newest.joint_knowledge, angle_knowledge=newest.angle_knowledge,
                   palm_knowledge=newest.palm_knowledge, other=other)
