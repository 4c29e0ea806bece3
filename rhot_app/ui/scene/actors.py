"""What moves in the scene: every hand of a rig with its markers, and those of a second run that is compared."""

from __future__ import annotations

from dataclasses import replace

from rhot_app.project import Rig
from rhot_app.tracking.state import HandState
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.scene.ellipsoid_mesh import EllipsoidChoice
from rhot_app.ui.scene.hand_actors import HandActors
from rhot_app.ui.scene.hands import hands_of


class Actors:
    """The moving items of one rig in one colour scheme. `items` are to be added to the view.

    `ellipsoids` chooses what is drawn of the uncertainty, None for nothing. `opacity` 0..1 is of everything.
    """

    def __init__(self, rig: Rig, scheme: Scheme, opacity: float = 1.0) -> None:
        self._hands = tuple(HandActors(hand, scheme, opacity) for hand in hands_of(rig))
        self.ellipsoids: EllipsoidChoice | None = EllipsoidChoice()
        self.items = tuple(item for hand in self._hands for item in hand.items)

    @property
    def cut(self) -> bool:
        """Whether an ellipsoid is drawn smaller than it is."""
        return self.ellipsoids is not None and any(hand.cut for hand in self._hands)

    def hide(self) -> None:
        """Show nothing until the next pose."""
        for hand in self._hands:
            hand.hide()

    def pose(self, state: HandState) -> None:
        """Show everything at a state of this rig."""
        for hand in self._hands:
            hand.pose(state, self.ellipsoids)


_SECOND_OPACITY = 0.45


def second_actors(rig: Rig, scheme: Scheme) -> Actors:
    """The hands of a second run of the same recording: translucent, in the accent colour, without ellipsoids."""
    actors = Actors(rig, replace(scheme, hand=scheme.accent, text=scheme.accent), _SECOND_OPACITY)
    actors.ellipsoids = None
    return actors
