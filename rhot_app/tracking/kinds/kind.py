"""What a kind of observations does with the messages of one node."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

from rhot_app.project import Rig
from rhot_app.tracking.tracker import CameraFrame


class FrameTimes(NamedTuple):
    """Master times of one frame, ns: of its row 0, of its message's departure and arrival; and the clock's bound, s."""

    t_row0_ns: int
    t_send_ns: int
    t_receive_ns: int
    bound_s: float


class Kind:
    """One kind of observations of one node. One thread."""

    name: ClassVar[str]
    """By which its frames are counted."""

    messages: ClassVar[tuple[type, ...]]
    """Types of the messages that it takes. Of several kinds, the newest in the registry that `accepts` one gets it."""

    def configure(self, rig: Rig, camera: int) -> None:
        """Expect what the rig says. `camera`: the node's index in the rig."""
        self.camera = camera

    def restart(self) -> None:
        """Another session begins: what is on its way is of none."""

    def accepts(self, message: Any) -> bool:
        """Whether a message of these types is of this kind."""
        return True

    def refusal(self, message: Any) -> str | None:
        """Why a message is not as the rig says, one word; None when it is."""
        return None

    def collect(self, message: Any, times: FrameTimes) -> Any:
        """What `observe` needs of a verified message, without building it: a flood of them may come. None: it waits for
        further parts. Raises WireError when the parts do not fit together."""
        return message

    def observe(self, collected: Any, times: FrameTimes) -> CameraFrame:
        """The observations of a frame: arrays in the rig's order, times in master time."""
        raise NotImplementedError


Collected = tuple[Kind, Any, FrameTimes]
"""What is verified, and which kind observes it."""
