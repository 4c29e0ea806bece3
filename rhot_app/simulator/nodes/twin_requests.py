"""What may be asked of a live twin, as JSON, and its answers (docs/twin.md). No sockets.

Stage, lamp and caps on lenses belong to the room, not to the rig: nothing that is asked here reaches nodes or engine
but as pictures.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import msgspec

from rhot_app.simulator.scene.lamp import Lamp
from rhot_app.simulator.scene.scene_description import Show
from rhot_node.files import decode_message

SERVER_NAME: Final = "twin.ipc"


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
        chosen = {name: value for name in ("brightness", "kelvin", "mains_hz", "flicker")
                  if (value := getattr(self, name)) is not None}
        return msgspec.convert(msgspec.to_builtins(lamp) | chosen, Lamp)


class CoverRequest(_Request, frozen=True, tag="cover"):
    """Cover these cameras' lenses, by name, and uncover all others."""

    cameras: tuple[str, ...] = ()


class StateRequest(_Request, frozen=True, tag="state"):
    """What is shown, by which lamp, to which cameras, by which settings of the cameras, and how fast."""


Request = ShowRequest | LampRequest | CoverRequest | StateRequest

_decoder = msgspec.json.Decoder(Request)


def decode_request(data: bytes) -> Request:
    """Read a request; raises msgspec.DecodeError."""
    return decode_message(data, _decoder)


def refusal(sentence: str) -> dict[str, Any]:
    """The answer to what cannot be done."""
    return {"ok": False, "error": sentence}
