"""The engine as client of the nodes' control channels: requests handed on without waiting, previews, fault messages.

Used by the server's thread only, except `message` and `black`, which any thread may read.
"""

from __future__ import annotations

import itertools
import logging
import time
from dataclasses import dataclass, field
from typing import Any

import msgspec
import zmq

from rhot_app.engine.commands import Answer, Arguments, refusal
from rhot_app.engine.node_meter import foreground_advice, health_advice, sees_black
from rhot_app.engine.status import Advice, EngineStatus, Preview, advise
from rhot_app.errors import EngineError
from rhot_app.project import Rig, RigNode
from rhot_node.errors import NodeError, printable
from rhot_node.files import decode_message
from rhot_node.keys import KeyPair
from rhot_node.network.context import Client, Context, read_answer

TIMEOUT_S = 2.7
"""A still may take two seconds on a node whose camera has just stopped; a client waits for three."""

_STATE_PERIOD_S = 1.0  # a black picture is known before its markers are missed (`advice.UNSEEN_S`)
_VIDEO_PERIOD_S = 3.0  # a node ends a video that it was not reminded of for LEASE_S (rhot_node.video.recorder)
_LAST_WORDS_MS = 200

log = logging.getLogger(__name__)

_Reply = tuple[bytes, tuple[Answer, bytes | None]]


@dataclass(slots=True)
class _Asked:
    """A request on its way. `client` None: the engine's own question about a fault."""

    number: int
    client: bytes | None
    command: str
    payload: bytes
    deadline_s: float
    sent: bool = False


@dataclass(slots=True)
class _Peer:
    """One node's control channel."""

    node: RigNode
    requests: Client
    previews: zmq.Socket[bytes] | None = None
    asked: dict[int, _Asked] = field(default_factory=dict)
    message: str = ""
    health: tuple[Advice, ...] = ()
    black: bool = False
    asked_s: float = -1e9
    video: str = ""  # what it was told to record
    video_told_s: float = -1e9
    video_dropped: int = 0
    video_advice: tuple[Advice, ...] = ()
    tag_advice: tuple[Advice, ...] = ()
    foreground_advice: tuple[Advice, ...] = ()


class NodeControl:
    """Talks to the control channels of the rig's nodes that have one (text nodes have none)."""

    commands = frozenset({"node", "still"})

    def __init__(self, context: Context, own: KeyPair | None = None) -> None:
        """`own`: the master's keys; without them, as in a replay, paired nodes are not spoken to."""
        self._context = context
        self._own = own
        self._peers: dict[int, _Peer] = {}
        self._rig: Rig | None = None
        self._dictionaries: list[str] = []  # of the tags on the rig's objects
        self._preview = False
        self._numbers = itertools.count(1)

    def follow(self, rig: Rig) -> None:
        """Connect to the nodes of `rig`, keeping what stays the same. Cheap when nothing changed."""
        if rig is self._rig:
            return
        self._rig = rig
        self._dictionaries = sorted({tag.family for model in rig.models for tag in model.fiducials})
        wanted = {node.node_id: node for node in rig.nodes
                  if not node.text_datagrams and (self._own is not None or not node.public_key)}
        for node_id in [*self._peers]:
            node = wanted.get(node_id)
            if node is None or _reached(node) != _reached(self._peers[node_id].node):
                _close(self._peers.pop(node_id))
            else:
                self._peers[node_id].node = node
        for node_id, node in wanted.items():
            if node_id not in self._peers:
                try:
                    self._peers[node_id] = _Peer(node, Client(self._context, _endpoints(node)[0], self._own,
                                                              node.public_key))
                except zmq.ZMQError as exc:  # the node is tracked all the same; only its settings are out of reach
                    log.warning("node %s: %s is no address to connect to (%s)", node.name, _endpoints(node)[0], exc)
        self.set_preview(self._preview)

    def ask(self, client: bytes, command: str, arguments: Arguments) -> None:
        """Hand a client's request to its node; raises EngineError when it names none."""
        node_id = arguments.get("node_id")
        peer = self._peers.get(node_id) if isinstance(node_id, int) else None
        if peer is None:
            known = ", ".join(f"{peer.node.node_id} ({peer.node.name})" for peer in self._peers.values())
            raise EngineError(f"there is no node {printable(repr(node_id), 80)} with a control channel; there is "
                              f"{known or 'none'}.")
        request = _still_request(arguments) if command == "still" else arguments.get("request")
        if not isinstance(request, dict):
            raise EngineError('node needs a "request": an object as docs/node.md describes.')
        self._put(peer, client, command, request)

    def answers(self) -> list[_Reply]:
        """(client, (answer, attachment)) for every request that was answered, or was not in time."""
        now_s = time.monotonic()
        done: list[_Reply] = []
        for peer in self._peers.values():
            self._send_waiting(peer)
            for asked, answer, attachment in _receive(peer):
                if asked.command == "video":
                    _take_video_answer(peer, answer)
                elif asked.command == "tags":
                    peer.tag_advice = () if answer.get("ok") else (Advice(
                        "warning", f"The tags of objects are not looked for: {answer.get('error')} Does rhot-node have "
                        "the version of this program there?"),)
                elif asked.command == "spare":
                    continue  # a node of an older version goes on searching
                elif asked.client is None:
                    state = answer.get("answer", {})
                    peer.message = printable(str(state.get("message", "")))
                    peer.health, peer.black = health_advice(peer.node.name, state), sees_black(state)
                    self._want_tags(peer, state.get("tags"))
                    bare = self._rig is not None and self._rig.tracker.contours
                    peer.foreground_advice = foreground_advice(peer.node.name, state) if bare else ()
                else:
                    done.append((asked.client, (answer, attachment)))
            for asked in [asked for asked in peer.asked.values() if now_s > asked.deadline_s]:
                del peer.asked[asked.number]
                if asked.command == "video":
                    peer.video_advice = (advise(
                        "Node {name} cannot be told to record its video: its control channel does not answer.",
                        subject="recording", name=peer.node.name),) if peer.video else ()
                elif asked.client is not None:
                    error = EngineError(f"node {peer.node.name} does not answer on its control channel "
                                        f"{_endpoints(peer.node)[0]}; is rhot-node running "
                                        "there, and is it paired with this computer?")
                    done.append((asked.client, (refusal(error), None)))
        return done

    def set_preview(self, on: bool) -> None:
        """Subscribe to the nodes' previews, or no longer; a node encodes them only while somebody does."""
        self._preview = on
        for peer in self._peers.values():
            if on and peer.previews is None:
                peer.previews = Client(self._context, _endpoints(peer.node)[1], self._own, peer.node.public_key,
                                       kind=zmq.SUB).socket
                peer.previews.setsockopt(zmq.SUBSCRIBE, b"")
            elif not on and peer.previews is not None:
                peer.previews.close()
                peer.previews = None

    @property
    def previewing(self) -> bool:
        """Whether somebody looks at the pictures."""
        return self._preview

    def previews(self) -> list[Preview]:
        """The pictures that came since the last call, without what was found in them."""
        found = []
        for peer in self._peers.values():
            while peer.previews is not None:
                try:
                    parts = peer.previews.recv_multipart(zmq.DONTWAIT)
                except zmq.Again:
                    break
                preview = _read_preview(peer.node.name, parts)
                if preview is not None:
                    found.append(preview)
        return found

    def ask_for_states(self, status: EngineStatus) -> None:
        """Ask nodes for their own words: of a fault and of their machines' health once a second. What is over is
        forgotten. Cameras that are not tracked with are spared the search for landmarks, unless a log is recorded: it
        may be tracked again when they are put together."""
        apart = set() if self._rig is None or self._own is None or status.log_path else {
            node.node_id for node, used in zip(self._rig.nodes, self._rig.tracked_with, strict=True) if not used}
        now_s = time.monotonic()
        for node in status.nodes:
            peer = self._peers.get(node.node_id)
            if peer is None:
                continue
            if node.state != "fault":
                peer.message = ""
            if node.state == "silent":
                peer.health, peer.black, peer.foreground_advice = (), False, ()
            elif now_s - peer.asked_s > _STATE_PERIOD_S:
                peer.asked_s = now_s
                self._put(peer, None, "node", {"request": "state"})
                if node.node_id in apart:
                    self._put(peer, None, "spare", {"request": "spare_landmarks"})

    def record_video(self, name: str) -> None:
        """Have every node record the video `name`, or none when it is empty. Called often; nodes are reminded."""
        now_s = time.monotonic()
        for peer in self._peers.values():
            if name != peer.video:
                if peer.video:
                    self._put(peer, None, "video", {"request": "video_stop", "name": peer.video})
                peer.video, peer.video_told_s, peer.video_dropped, peer.video_advice = name, -1e9, 0, ()
            if name and now_s - peer.video_told_s > _VIDEO_PERIOD_S:
                peer.video_told_s = now_s
                self._put(peer, None, "video", {"request": "video_start", "name": name})

    def advice(self) -> tuple[Advice, ...]:
        """What the nodes' machines lack, and what their videos do, for the operator."""
        return tuple(advice for peer in self._peers.values()
                     for advice in (*peer.health, *peer.video_advice, *peer.tag_advice, *peer.foreground_advice))

    def _want_tags(self, peer: _Peer, sought: object) -> None:
        """Have a node look for the tags of the rig's objects, if its state says that it does not. It does so until it
        starts anew; its file stays as it is."""
        known = [str(name) for name in sought] if isinstance(sought, list) else []
        if self._own is None or not self._dictionaries:
            peer.tag_advice = ()
        elif not set(self._dictionaries) <= set(known):
            tags = {"enabled": True, "dictionaries": sorted({*known, *self._dictionaries})}
            self._put(peer, None, "tags", {"request": "set_settings", "settings": {"tags": tags}, "save": False})

    def message(self, node_id: int) -> str:
        """What the node says about its fault; empty when it has none or did not say yet."""
        peer = self._peers.get(node_id)
        return "" if peer is None else peer.message

    def black(self, node_id: int) -> bool:
        """Whether the node says that its camera's picture is black."""
        peer = self._peers.get(node_id)
        return peer is not None and peer.black

    def close(self) -> None:
        """End the nodes' videos and close all sockets. May be called twice."""
        self.record_video("")
        while self._peers:
            _close(self._peers.popitem()[1])

    def _put(self, peer: _Peer, client: bytes | None, command: str, request: dict[str, Any]) -> None:
        asked = _Asked(next(self._numbers), client, command, msgspec.json.encode(request),
                       time.monotonic() + TIMEOUT_S)
        peer.asked[asked.number] = asked
        self._send_waiting(peer)

    def _send_waiting(self, peer: _Peer) -> None:
        """Send what could not be sent yet: nothing is queued for a node that is not there, to reach it much later."""
        for asked in peer.asked.values():
            if not asked.sent:
                if not peer.requests.send(asked.payload, asked.number):
                    return
                asked.sent = True


def _receive(peer: _Peer) -> list[tuple[_Asked, Answer, bytes | None]]:
    found: list[tuple[_Asked, Answer, bytes | None]] = []
    while (received := peer.requests.receive()) is not None:
        number, parts = received
        asked = peer.asked.pop(number, None)
        if asked is not None:
            found.append((asked, *_translate(peer.node.name, asked.command, parts)))
    return found


def _take_video_answer(peer: _Peer, answer: Answer) -> None:
    """What there is to say of a node's video."""
    if not peer.video:
        return
    if not answer.get("ok"):
        peer.video_advice = (advise("No video is recorded: {message}", subject="recording",
                                    message=str(answer.get("error"))),)
        return
    video = answer.get("answer", {}).get("video")
    if not isinstance(video, dict):
        return
    name, message, dropped = peer.node.name, printable(str(video.get("message", ""))), video.get("dropped")
    peer.video_advice = ()
    if message:
        peer.video_advice = (advise("The video of node {name} has ended. {message}", subject="recording", name=name,
                                    message=message),)
    elif isinstance(dropped, int) and dropped > peer.video_dropped:
        peer.video_advice = (advise("Node {name} drops frames of its video, {dropped} so far: its processor or disk is "
                                    "too slow. Detection goes first.", subject="recording", name=name,
                                    dropped=dropped),)
    if isinstance(dropped, int):
        peer.video_dropped = dropped


def _translate(name: str, command: str, parts: list[bytes]) -> tuple[Answer, bytes | None]:
    """A node's reply as the engine's answer to its client."""
    try:
        reply = read_answer(parts[0])
    except NodeError as exc:
        return refusal(EngineError(f"node {name}: {exc}")), None
    except msgspec.MsgspecError as exc:
        return refusal(EngineError(f"node {name} gave an answer that cannot be read ({printable(str(exc))}).")), None
    if len(parts) > 1:
        name_of_part = str(reply.get("format", "png")) if command == "still" else "data"
        return {"ok": True, "answer": reply, "attachment": name_of_part}, parts[1]
    return {"ok": True, "answer": reply}, None


def _still_request(arguments: Arguments) -> dict[str, Any]:
    """The format goes along when it is named; a node knows what it can do."""
    kind = arguments.get("format")
    return {"request": "still"} if kind is None else {"request": "still", "format": kind}


def _read_preview(name: str, parts: list[bytes]) -> Preview | None:
    try:
        header = decode_message(parts[0], dict[str, Any])
        return Preview(name, 0, int(header["width"]), int(header["height"]), parts[1], int(header["t_node_ns"]))
    except (msgspec.MsgspecError, KeyError, TypeError, ValueError, IndexError):
        return None


def _endpoints(node: RigNode) -> tuple[str, str]:
    return f"tcp://{node.address}:{node.control_port}", f"tcp://{node.address}:{node.preview_port}"


def _reached(node: RigNode) -> tuple[str, ...]:
    """How a node is reached; when it changes, the connections begin anew."""
    return (*_endpoints(node), node.public_key)


def _close(peer: _Peer) -> None:
    peer.requests.socket.close(_LAST_WORDS_MS if peer.asked else 0)
    if peer.previews is not None:
        peer.previews.close()
