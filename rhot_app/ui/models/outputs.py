"""The live streams to other programs in words, how fast each sends, and changes to them in a running engine."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import msgspec

from rhot_app.engine.status import EngineStatus
from rhot_app.errors import OutputError
from rhot_app.outputs.spec import OPENXR_ONLY, WEB_PORT, OutputStatus, as_run, host_and_port, parse_output, web_settings
from rhot_app.project import OutputSettings, Rig, parse_rig
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.proposal import Command, set_rig
from rhot_app.ui.models.words import Look

WINDOW_NS: Final = 3_000_000_000
"""A rate is counted over the last 3 s: statuses come in steps of 0.2 s."""

SILENT_NS: Final = 1_000_000_000
"""An output that has sent nothing for a second sends nothing."""

EMPTY: Final = tr_noop("No program listens yet. Add OSC for Unity, Blender or TouchDesigner, VMC for avatars, or the "
                       "web view to see the hand in a browser or a headset.")

JOINT_SETS: Final = {
    "own": (tr_noop("own: 21 joints"), tr_noop("Wrist, then four joints of each finger; positions in the rig frame.")),
    "openxr": (tr_noop("openxr: 26 joints"),
               tr_noop("XR_EXT_hand_tracking: positions, orientations and radii in OpenXR's axes.")),
    "mediapipe": (tr_noop("mediapipe: 21 joints"),
                  tr_noop("In the order and by the names of MediaPipe; positions in the rig frame.")),
}


@dataclass(frozen=True, slots=True)
class OutputKind:
    """A kind of output: its name, who listens, what its target means, and one that works on this computer."""

    title: str
    meaning: str
    target: str = tr_noop("What the plug-in understands; see its own documentation.")
    suggestion: str = ""
    joined: str = tr_noop("to")  # between title and target


KINDS: Final = {
    "osc": OutputKind("OSC", tr_noop("Messages by UDP, for Unity, Blender, Unreal, TouchDesigner, Max, Pure Data."),
                      tr_noop("HOST:PORT of the program that listens."), "127.0.0.1:9000"),
    "vmc": OutputKind("VMC", tr_noop("Finger bones for avatars: EVMC4U in Unity, VMC4B in Blender, Warudo, VSeeFace."),
                      tr_noop("HOST:PORT of the program that listens; most take 39539."), "127.0.0.1:39539"),
    "ws": OutputKind("JSON over WebSocket", tr_noop("Programs connect to this port and get every state as JSON."),
                     tr_noop("[HOST:]PORT to listen on, unencrypted. 127.0.0.1 is this computer only; 0.0.0.0 lets "
                             "others in."), "127.0.0.1:9001", tr_noop("on")),
    "web": OutputKind(tr_noop("Web view"), tr_noop("A page that shows the hand in browsers and headsets."),
                      tr_noop("[HOST:]PORT to listen on. 127.0.0.1 is this computer only; 0.0.0.0 lets others in, by "
                              "HTTPS."), f"127.0.0.1:{WEB_PORT}", tr_noop("on")),
    "lsl": OutputKind("Lab Streaming Layer", tr_noop("LabRecorder and others find the streams by name."),
                      tr_noop("Name of the streams; RHOT when empty."), "", tr_noop("as")),
    "zenoh": OutputKind("Zenoh", tr_noop("JSON under the key rhot/state, for robots and ROS 2."),
                        tr_noop("HOST:PORT of a router; when empty, whoever is found on the network."), "",
                        tr_noop("by")),
}
_HOSTS: Final = {"osc": None, "vmc": None, "ws": "127.0.0.1", "zenoh": None}
"""Kinds whose target is HOST:PORT; the host that a port alone means."""

OFF = Look(tr_noop("off"), "square", "neutral", tr_noop("Switched off: kept in the rig, and not opened."))
_STARTING = Look(tr_noop("opens"), "ring", "accent", tr_noop("The output is being opened."))
_WAITING = Look(tr_noop("waits"), "ring", "accent",
                tr_noop("The output is open; nobody listens, or there is nothing to send yet."))
_SENDING = Look(tr_noop("sending"), "disc", "good", tr_noop("States leave for the other program."))
_SLOW = Look(tr_noop("slow"), "half", "caution",
             tr_noop("The receiver takes states too slowly; some are dropped. Tracking goes on."))
_FAILED = Look(tr_noop("failed"), "cross", "bad",
               tr_noop("The output does not work. It is tried again every 3 s; tracking goes on."))
_LEFT_OUT = Look(tr_noop("left out"), "square", "neutral",
                 tr_noop("A replay opens none of the rig's outputs: nothing old is sent anywhere unasked."))


@dataclass(frozen=True, slots=True)
class OutputRow:
    """One output as text. `message`: why it fails, or how to use it; `fixed`: of the engine's command line."""

    title: str
    detail: str
    look: Look
    status: str
    message: str
    tooltip: str
    url: str
    fixed: bool


class SendRates:
    """States/s of each output, from the statuses that come in."""

    def __init__(self) -> None:
        self._changes: dict[str, deque[tuple[int, int]]] = {}  # when the count of a spec had become what it is
        self._now_ns = 0

    def take(self, status: EngineStatus) -> None:
        """Count another status; the same one twice does no harm."""
        self._now_ns = status.t_master_ns
        self._changes = {one.spec: self._changes.get(one.spec, deque()) for one in status.outputs}
        for one in status.outputs:
            changes = self._changes[one.spec]
            if changes and one.sent < changes[-1][1]:  # its process was started again
                changes.clear()
            if not changes or one.sent > changes[-1][1]:
                changes.append((self._now_ns, one.sent))
            while len(changes) > 2 and changes[0][0] < self._now_ns - WINDOW_NS:
                changes.popleft()

    def of(self, spec: str) -> float:
        """States/s now; 0 for an output that sends nothing."""
        changes = self._changes.get(spec)
        if changes is None or len(changes) < 2 or changes[-1][0] < self._now_ns - SILENT_NS:
            return 0.0
        (begin_ns, first), (end_ns, last) = changes[0], changes[-1]
        return 1e9 * (last - first) / (end_ns - begin_ns)


def kind_of(name: str) -> OutputKind:
    """The words for a kind; a plug-in has its own name."""
    return KINDS.get(name) or OutputKind(name, tr("The installed plug-in {name}.", name=name))


def title_of(settings: OutputSettings) -> str:
    """E.g. "OSC to 127.0.0.1:9000"."""
    kind = kind_of(settings.kind)
    return f"{tr(kind.title)} {tr(kind.joined)} {settings.target}" if settings.target else tr(kind.title)


def draft(kind: str, target: str, joints: str, rate_hz: float, others: tuple[OutputSettings, ...]) -> OutputSettings:
    """The output that a form means; `rate_hz` 0: every state. Raises OutputError: what is wrong with it."""
    target = target.strip()
    if kind == "web":
        target = web_settings(target).target
    options = ([] if kind in OPENXR_ONLY else [f"joints={joints}"]) + ([f"hz={rate_hz:g}"] if rate_hz else [])
    settings = parse_output(f"{kind}{':' if target else ''}{target}?{'&'.join(options)}")
    if kind in _HOSTS and (target or kind != "zenoh"):
        host_and_port(settings, _HOSTS[kind])
    if as_run(settings) in (msgspec.structs.replace(as_run(other), enabled=True) for other in others):
        raise OutputError(tr("output {spec!r}: it is in the list already.", spec=settings.spec))
    return settings


def rows(outputs: tuple[OutputSettings, ...], status: EngineStatus | None, rates: SendRates) -> list[OutputRow]:
    """A row for each output of the rig, in its order; then those of the engine's command line."""
    reported = {one.spec: one for one in status.outputs} if status is not None else {}
    found = [_row(settings, reported.get(as_run(settings).spec) if settings.enabled else None, status, rates)
             for settings in outputs]
    return found + [_row(parse_output(one.spec), one, status, rates) for one in reported.values() if one.fixed]


def _row(settings: OutputSettings, reported: OutputStatus | None, status: EngineStatus | None,
         rates: SendRates) -> OutputRow:
    run = as_run(settings)
    rate = tr("every state") if run.rate_hz is None else tr("at most {rate:g} states/s", rate=run.rate_hz)
    detail = tr("{joints} joints, {rate}", joints=run.joints, rate=rate)
    fixed = reported is not None and reported.fixed
    if fixed:
        detail += tr("; asked for when the engine was started")
    if reported is None:
        replay = settings.enabled and status is not None and bool(status.replaying)
        look = OFF if not settings.enabled else _LEFT_OUT if replay else _STARTING
        return OutputRow(title_of(settings), detail, look, tr(look.word), tr(look.meaning) if replay else "",
                         tr(look.meaning), "",
                         fixed)
    look, words = _going(reported, status is not None and status.running, rates.of(reported.spec))
    counts = tr("{sent} states sent, {dropped} dropped.", sent=reported.sent, dropped=reported.dropped)
    return OutputRow(title_of(settings), detail, look, words, reported.message or web_hint(reported.url),
                     f"{tr(look.meaning)}\n{counts}", reported.url if reported.state == "running" else "", fixed)


def _going(reported: OutputStatus, running: bool, rate_hz: float) -> tuple[Look, str]:
    """Look and words of an output that the engine tells of."""
    if reported.state == "failed":
        return _FAILED, tr(_FAILED.word)
    if reported.state != "running":
        return _STARTING, tr(_STARTING.word)
    if reported.message:
        return _SLOW, tr(_SLOW.word)
    if reported.clients == 0:
        return _WAITING, tr("waits for a browser") if reported.kind == "web" else tr("waits for a client")
    clients = "" if reported.clients is None else tr(", {n} client", ", {n} clients", reported.clients)
    if rate_hz > 0.0:
        return _SENDING, tr("sending {rate:.0f} states/s{clients}", rate=rate_hz, clients=clients)
    return _WAITING, (tr("waits for a hand") if running else tr("waits for Start")) + clients


def web_hint(url: str) -> str:
    """Who can open the address of a web view, and how; "" for what is no web view."""
    if url.startswith("https:"):
        return tr("Whoever has this address sees the hand. The connection is encrypted, by a certificate that this "
                  "computer made: the browser warns once; choose Advanced, then Proceed.")
    if url.startswith("http:"):
        return tr("Open it in a browser on this computer. For a headset or telephone change the target to "
                  "0.0.0.0:{port}: other computers are let in, by HTTPS only.", port=WEB_PORT)
    return ""


def keeping(path: str, *, simulated: bool) -> str:
    """How long a change lasts."""
    if simulated:
        return tr("It lasts for this run: the simulated rig is made anew each time.")
    if not path:
        return tr("It lasts until the engine ends: this rig came from no file.")
    return tr("Save rig (Ctrl+S) keeps it in {name}.", name=Path(path).name)


# -- changed settings --------------------------------------------------------------------------------------------------

Edit = Callable[[tuple[OutputSettings, ...]], tuple[OutputSettings, ...]]
"""The outputs as they shall be, from those of the engine's rig; raises OutputError."""


def replacing(old: OutputSettings | None, new: OutputSettings | None) -> Edit:
    """`new` in the place of `old`. `old` None: `new` is added; `new` None: `old` is removed."""
    def edit(outputs: tuple[OutputSettings, ...]) -> tuple[OutputSettings, ...]:
        if old is None:
            return (*outputs, *(() if new is None else (new,)))
        if old not in outputs:
            raise OutputError(tr("output {spec!r}: it is not in the engine's rig any more; another program has changed "
                                 "it.", spec=old.spec))
        place = outputs.index(old)
        return (*outputs[:place], *(() if new is None else (new,)), *outputs[place + 1:])
    return edit


def restoring(before: tuple[OutputSettings, ...], after: tuple[OutputSettings, ...]) -> Edit:
    """Back to what was there before a change, unless somebody has changed it since."""
    def edit(outputs: tuple[OutputSettings, ...]) -> tuple[OutputSettings, ...]:
        if outputs != after:
            raise OutputError(tr("Another program has changed the outputs since; nothing was taken back."))
        return before
    return edit


def change_outputs(command: Command, edit: Edit) -> tuple[tuple[OutputSettings, ...], Rig]:
    """Have the engine go on with other outputs; the outputs before, and the new rig. Waits: call it in a worker.

    The rest of the rig stays as the engine has it, so that tracking is not touched. Raises EngineError, OutputError.
    """
    rig = parse_rig(msgspec.json.encode(command("rig")["document"]), "the engine's rig")
    after = msgspec.structs.replace(rig, outputs=edit(rig.outputs))
    set_rig(command, after)
    return rig.outputs, after
