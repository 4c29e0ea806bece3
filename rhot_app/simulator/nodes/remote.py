"""A client of the live twin's door: what its cameras see, asked for from another process.

For the app's wizards on the simulated rig ("hold up the board") and for tests::

    with TwinRemote(directory) as twin:                        # the directory that the live twin was started with
        twin.show(BoardShow(size="9x6", square_mm=25.0))       # a board is moved about, with pauses
        twin.show(BoardShow(on_table=True))                    # the board lies on the table
        twin.show(MarkerShow(marker="index", distance_m=0.4))  # one marker, held at 0.4 m
        twin.show(MarkerShow(moving=True))                     # one marker that sweeps fast to and fro
        twin.show(RulerShow(length_mm=200.0))                  # a paper ruler
        twin.show(HandShow("rest"))                            # a hand again
        twin.lamp(brightness=0.8, kelvin=3200.0)               # what is not named stays
        twin.cover("left")                                     # a cap on that lens alone; cover() takes all off
        twin.state().lamp.kelvin

Every call returns when the cameras show the change, and raises SimulatorError with a sentence when they cannot. The
cameras' own settings (exposure, gains, ...) are not the twin's business: write them to the nodes, as for a real rig.
"""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Any, Final

import msgspec
import zmq

from rhot_app.errors import SimulatorError
from rhot_app.simulator.render.camera_controls import Controls, Lamp
from rhot_app.simulator.scene.scene_description import Show
from rhot_node.files import decode_message
from rhot_node.network.context import Context

# Stage, lamp and caps on lenses belong to the room, not to the rig: nothing that is asked here reaches nodes or engine
# but as pictures.

SERVER_NAME: Final = "twin.ipc"

SCENE_NAME: Final = "twin.scene.json"
"""The scene that the twin was started with, in its directory."""


def server_address(directory: Path) -> str:
    """ZeroMQ endpoint of the twin whose directory this is (the client asks with REQ)."""
    return f"ipc://{directory / SERVER_NAME}"


class _Request(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="request"):
    """Root of all requests; the field "request" tells them apart."""


class ShowRequest(_Request, frozen=True, tag="show"):
    """Show something else, from its beginning."""

    what: Show


class LampRequest(_Request, frozen=True, tag="lamp"):
    """Change the lamp; what is null stays."""

    brightness: float | None = None
    kelvin: float | None = None
    mains_hz: float | None = None
    flicker: float | None = None

    def change(self, lamp: Lamp) -> Lamp:
        """The lamp as asked for; raises msgspec.ValidationError when there can be none like it."""
        chosen = {name: value for name, value in msgspec.structs.asdict(self).items() if value is not None}
        return msgspec.convert(msgspec.structs.asdict(lamp) | chosen, Lamp)


class CoverRequest(_Request, frozen=True, tag="cover"):
    """Cover these cameras' lenses, by name, and uncover all others."""

    cameras: tuple[str, ...] = ()


class StateRequest(_Request, frozen=True, tag="state"):
    """What is shown, by which lamp, to which cameras, by which settings of the cameras, and how fast."""


class TrackerRequest(_Request, frozen=True, tag="tracker"):
    """The poses that a foreign tracker on the hand reports after this monotonic time, of the last second."""

    since_ns: int = 0


Request = ShowRequest | LampRequest | CoverRequest | StateRequest | TrackerRequest

_decoder = msgspec.json.Decoder(Request)


def decode_request(data: bytes) -> Request:
    """Read a request; raises msgspec.DecodeError."""
    return decode_message(data, _decoder)


def refusal(sentence: str) -> dict[str, Any]:
    """The answer to what cannot be done."""
    return {"ok": False, "error": sentence}


ANSWER_S = 180.0
"""A show that was never shown on this machine is compiled first."""

STATE_S = 3.0
COVER_S = 8.0
"""A cap takes as long as the next frame, on a machine that can hardly keep up."""


class CameraState(Controls, frozen=True, kw_only=True):
    """What one simulated camera obeys."""

    exposure_us: float


class TwinState(msgspec.Struct, frozen=True):
    """What the twin shows: `name` in words, as `show`, under `lamp`; `cameras` by name; frames per second of late
    (0: not known yet), and as they should be; `covered` cameras see nothing."""

    name: str
    show: Show
    lamp: Lamp
    covered: tuple[str, ...] = ()
    cameras: dict[str, CameraState] = {}
    rate_hz: float = 0.0
    preset_hz: float = 0.0


class TrackerPoses(msgspec.Struct, frozen=True):
    """Monotonic time, ns, with position, m, and quaternion wxyz in the foreign tracker's own world."""

    poses: tuple[tuple[int, tuple[float, float, float, float, float, float, float]], ...]


class TwinRemote:
    """A connection to one live twin; it may start before or after. One thread only. A context manager."""

    def __init__(self, directory: Path) -> None:
        """`directory`: that of the twin; in the app, the session's. Nothing is sent yet."""
        self._directory = directory
        self._context = Context()

    def show(self, what: Show) -> TwinState:
        """Show something else, from its beginning."""
        return self._ask(ShowRequest(what), ANSWER_S)

    def lamp(self, **change: float | None) -> TwinState:
        """Change the room's lamp by some fields of `LampRequest`."""
        return self._ask(LampRequest(**change), ANSWER_S)

    def cover(self, *cameras: str) -> TwinState:
        """Cover the lenses of these cameras, by name, and uncover all others."""
        return self._ask(CoverRequest(cameras), COVER_S)

    def state(self) -> TwinState:
        """What is shown now."""
        return self._ask(StateRequest(), STATE_S)

    def tracker(self, since_ns: int) -> TrackerPoses:
        """What a foreign tracker on the hand reports after `since_ns`."""
        return msgspec.convert(self._answer(TrackerRequest(since_ns), STATE_S), TrackerPoses)

    def close(self) -> None:
        """Disconnect. May be called twice."""
        self._context.destroy(0)

    def __enter__(self) -> TwinRemote:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    def _ask(self, request: Request, timeout_s: float) -> TwinState:
        return msgspec.convert(self._answer(request, timeout_s), TwinState)

    def _answer(self, request: Request, timeout_s: float) -> dict[str, Any]:
        socket = self._context.socket(zmq.REQ)
        try:
            socket.connect(server_address(self._directory))
            socket.send(msgspec.json.encode(request))
            if not socket.poll(round(1e3 * timeout_s)):
                raise SimulatorError(f"the simulated rig in {self._directory} gave no answer in {timeout_s:g} s. "
                                     "Open the simulated rig again.")
            answer: dict[str, Any] = decode_message(socket.recv(), dict[str, Any])
        finally:
            socket.close()
        if not answer.pop("ok", False):
            raise SimulatorError(str(answer.get("error", "the simulated rig refused without a reason.")))
        return answer
