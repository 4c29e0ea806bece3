"""Output specs, as typed behind ``--output``: ``KIND[:TARGET][?joints=SET&hz=RATE]``. No sockets here.

The rig's types are imported inside the functions, so that ``--help`` stays fast.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

import msgspec

from rhot_app.errors import OutputError

if TYPE_CHECKING:
    from rhot_app.project import OutputSettings


HELP: Final = """output specs, KIND:TARGET, each with ?joints=own|openxr|mediapipe and &hz=RATE behind it if wanted:
  osc:HOST:PORT      OSC messages by UDP
  vmc:HOST:PORT      finger bones for avatars, Virtual Motion Capture protocol (usual port 39539)
  ws:[HOST:]PORT     JSON over WebSocket; programs connect to this port (HOST 127.0.0.1 unless given)
  lsl[:NAME]         Lab Streaming Layer
  zenoh[:HOST:PORT]  Zenoh; with HOST:PORT by that router, else whoever is found on the network
  NAME[:TARGET]      an installed plug-in (docs/plugins.md)"""

WEB_PORT: Final = 47810
"""Of the web view: beside those of the nodes."""

OPENXR_ONLY: Final = ("vmc", "web")
"""Kinds that always have these joints, whatever is asked: their messages are made of them."""

_WEB_RATE_HZ: Final = 60.0  # of most screens
_OPTIONS: Final = {"joints": "joints", "hz": "rate_hz"}


def parse_output(text: str) -> OutputSettings:
    """The settings that a spec means. Raises OutputError saying what is wrong with it; whether there is such a kind is
    asked later."""
    from rhot_app.project import OutputSettings
    head, _, query = text.partition("?")
    kind, _, target = head.partition(":")
    fields: dict[str, Any] = {"kind": kind, "target": target}
    for item in filter(None, query.split("&")):
        key, equals, value = item.partition("=")
        if key not in _OPTIONS or not equals or not value:
            raise OutputError(f"output {text!r}: option {item!r} is not known; there are joints=own, openxr or "
                              "mediapipe and hz=RATE.")
        fields[_OPTIONS[key]] = value if key == "joints" else _rate(value, text)
    try:
        return msgspec.convert(fields, OutputSettings)
    except msgspec.ValidationError as exc:
        if "joints" in str(exc):
            raise OutputError(f"output {text!r}: there are no joints {fields['joints']!r}; there are own, openxr and "
                              "mediapipe.") from exc
        raise OutputError(f"output {text!r}: begins with no kind of output; write one such as osc:HOST:PORT or "
                          "ws:PORT, see `rhot engine --help`.") from exc


def web_settings(text: str) -> OutputSettings:
    """The settings of the web view on ``[HOST:]PORT``, or on HOST alone; empty: on WEB_PORT of this computer only."""
    from rhot_app.project import OutputSettings
    target = text if re.search(r"(^|:)\d+$", text) and not text.endswith("]") else f"{text or '127.0.0.1'}:{WEB_PORT}"
    settings = OutputSettings("web", target, "openxr")
    try:
        host_and_port(settings, "127.0.0.1")
    except OutputError as exc:
        raise OutputError(f"web view on {text}: this is not [HOST:]PORT with a port of 1 to 65535, such as 47810 or "
                          "0.0.0.0:47810.") from exc
    return settings


def as_run(settings: OutputSettings) -> OutputSettings:
    """The settings that an output runs with, where its kind leaves no choice; its status has their spec."""
    joints = "openxr" if settings.kind in OPENXR_ONLY else settings.joints
    rate_hz = _WEB_RATE_HZ if settings.kind == "web" and settings.rate_hz is None else settings.rate_hz
    return msgspec.structs.replace(settings, joints=joints, rate_hz=rate_hz)


def host_and_port(settings: OutputSettings, default_host: str | None = None) -> tuple[str, int]:
    """HOST and PORT of a target; an IPv6 address stands in brackets. `default_host`: what PORT alone means; None: it is
    refused. Raises OutputError."""
    found = re.fullmatch(r"(?:(\[[0-9A-Fa-f:.]+\]|[^:\[\]\s/]+):)?(\d{1,5})", settings.target)
    host = None if found is None else (found[1] or default_host)
    if found is None or host is None:
        wanted = "HOST:PORT" if default_host is None else "[HOST:]PORT"
        raise OutputError(f"output {settings.spec!r}: {settings.target!r} is not {wanted}, such as "
                          f"{settings.kind}:{default_host or '192.168.1.20'}:9000.")
    port = int(found[2])
    if not 1 <= port <= 65535:
        raise OutputError(f"output {settings.spec!r}: there is no port {port}; ports are 1 to 65535.")
    return host.strip("[]"), port


def _rate(value: str, text: str) -> float:
    try:
        rate = float(value)
    except ValueError as exc:
        raise OutputError(f"output {text!r}: {value!r} is not a number of states/s.") from exc
    if not 0.0 < rate <= 1000.0:
        raise OutputError(f"output {text!r}: {value} is not a rate above 0 and up to 1000 states/s; leave hz out for "
                          "every state.")
    return rate


SECRET_VARIABLE: Final = "RHOT_WEB_SECRET"
"""Environment variable in which the engine keeps the secret of all its web views, so that a page that is open finds
them again whenever its outputs are started anew."""

OutputWord = Literal["starting", "running", "failed", "stopped"]


@dataclass(frozen=True, slots=True)
class OutputStatus:
    """How an output goes. `spec`: as typed behind ``--output``. `sent` and `dropped` count states: a state that came
    too soon for the output's rate is neither. `clients` is None for an output that nobody connects to."""

    spec: str
    kind: str
    state: OutputWord
    message: str = ""  # why it failed, or is slow
    sent: int = 0
    dropped: int = 0
    clients: int | None = None
    url: str = ""
    fixed: bool = False  # of the command line: no other rig closes it
