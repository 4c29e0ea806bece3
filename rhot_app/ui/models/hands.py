"""The hands of a rig as people call them, and of its states."""

from __future__ import annotations

from rhot_app.project import Rig
from rhot_app.tracking.state import HandState


def hand_names(rig: Rig | None) -> tuple[str, ...]:
    """What the hands that the rig's tracker follows are called, the rig's `hand` first.

    A hand that is alone needs no name: it is called "".
    """
    if rig is None or rig.other_hand is None or rig.tracker.kind == "classic":
        return ("",)
    sides = rig.hand.side, rig.other_hand.side
    return sides if sides[0] != sides[1] else (f"first {sides[0]}", f"other {sides[1]}")


def each_hand(state: HandState | None) -> list[HandState]:
    """The states of the hands that `state` tells of, the rig's `hand` first; none without a state."""
    return [hand for hand in (state, state.other if state is not None else None) if hand is not None]
