"""One node's counters turned into what the operator reads: rate, recent losses, recent refusals, one word of state."""

from __future__ import annotations

import contextlib
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import msgspec

from rhot_app.engine.status import Advice, NodeStatus, NodeWord, advise
from rhot_app.sources.node_link import NodeLink
from rhot_app.sources.receiver import NodeReceiver
from rhot_node.errors import printable
from rhot_node.health.checks import BLACK_PICTURE
from rhot_node.wire.messages import NodeState

RECENT_NS = 2_000_000_000
"""What was refused or lost within this time counts as going on."""

_RATE_NS = 1_000_000_000
_WORDS: dict[NodeState, NodeWord] = {NodeState.STARTING: "starting", NodeState.READY: "ready",
                                     NodeState.STREAMING: "streaming", NodeState.FAULT: "fault"}


@dataclass(frozen=True, slots=True)
class Recent:
    """What happened at one node within the last two seconds."""

    accepted: int
    lost: int
    dropped: dict[str, int]
    skipped: int


@dataclass(frozen=True, slots=True)
class _Sample:
    t_ns: int
    accepted: int
    lost: int
    dropped: dict[str, int]
    skipped: int


class NodeMeter:
    """Watches one node's link and receiver; `sample` is called with every status."""

    def __init__(self, link: NodeLink, receiver: NodeReceiver | None) -> None:
        self.link = link
        self.receiver = receiver
        self._samples: deque[_Sample] = deque([self._read(0)])

    def sample(self, now_ns: int) -> None:
        """Read the counters."""
        self._samples.append(self._read(now_ns))
        while len(self._samples) > 2 and now_ns - self._samples[1].t_ns >= RECENT_NS:
            self._samples.popleft()

    def recent(self) -> Recent:
        """Differences over the last two seconds."""
        first, last = self._samples[0], self._samples[-1]
        dropped = Counter(last.dropped)
        dropped.subtract(first.dropped)
        return Recent(last.accepted - first.accepted, last.lost - first.lost,
                      {reason: count for reason, count in dropped.items() if count > 0}, last.skipped - first.skipped)

    def rate_hz(self) -> float:
        """Accepted frames per second over the last second."""
        last = self._samples[-1]
        first = next(sample for sample in self._samples if last.t_ns - sample.t_ns <= _RATE_NS)
        span_ns = last.t_ns - first.t_ns
        return 1e9 * (last.accepted - first.accepted) / span_ns if span_ns else 0.0

    def status(self, now_ns: int, message: str) -> NodeStatus:
        """The node as clients see it; `message`: its own words. A text node whose datagrams wait for the start is
        ready."""
        link, clock = self.link, self.link.clock
        return NodeStatus(
            node_id=link.node.node_id, name=link.node.name, state=self._word(now_ns),
            text_datagrams=link.node.text_datagrams, rate_hz=self.rate_hz(), received=link.door.received,
            lost=link.door.sequence.lost, dropped=self._dropped(), clock_offset_s=clock.offset_s,
            clock_bound_s=clock.bound_s, clock_round_trip_s=clock.round_trip_s,
            message=message or (link.address_problem if link.silent(now_ns) else ""),
            paired=link.paired, turned_away=link.turned_away and link.silent(now_ns))

    def _word(self, now_ns: int) -> NodeWord:
        if self.receiver is None:  # a replay: its times are not of now
            return "streaming" if self.rate_hz() > 0.0 else "silent"
        if self.link.silent(now_ns):
            waits = self.link.node.text_datagrams and not self.link.wanted and self.recent().dropped.get("not_started")
            return "ready" if waits else "silent"
        if self.link.node.text_datagrams or self.link.state is None:
            return "streaming"
        return _WORDS[self.link.state]

    def _dropped(self) -> dict[str, int]:
        dropped = self.link.door.dropped.copy()
        if self.receiver is not None and self.receiver.overflowed:
            dropped["kernel_overflow"] = self.receiver.overflowed
        return dropped

    def _read(self, now_ns: int) -> _Sample:
        door = self.link.door
        return _Sample(now_ns, door.accepted, door.sequence.lost, self._dropped(),
                       0 if self.receiver is None else self.receiver.skipped)


# -- advice on the nodes' machines -------------------------------------------------------------------------------------
# A node's answer is another program's: whatever is not as docs/node.md describes it is passed over.

SENTENCE_MAX = 300  # characters
_TOLD_MAX = 8  # per node


class _Trouble(msgspec.Struct):
    """One thing that a node complains of; what else it says is not needed."""

    level: Literal["warning", "error"]
    text: str
    remedy: str = ""
    code: str = ""


def health_advice(name: str, state: Mapping[str, Any]) -> tuple[Advice, ...]:
    """The sentences of node `name`, by the `health` of its answer to a state request. A black picture is left out:
    `sees_black` tells of it, and the engine says it instead of what the camera does not see."""
    found = []
    for trouble in _troubles(state):
        if trouble.code == BLACK_PICTURE.code:
            continue
        sentence = printable(f"{trouble.text} {trouble.remedy}".rstrip())[:SENTENCE_MAX]
        found.append(Advice(trouble.level, f"Node {name}: {sentence[:1].lower()}{sentence[1:]}"))
    return tuple(found)


def foreground_advice(name: str, state: Mapping[str, Any]) -> tuple[Advice, ...]:
    """What node `name` lacks to show a bare hand, by the `foreground` of its answer to a state request."""
    known = state.get("foreground")
    if not isinstance(known, Mapping):
        return (advise("Node {name} cannot search for a bare hand. Does rhot-node have the version of this program "
                       "there?", level="error", subject="tracking", name=name),)
    if known.get("problem"):
        return (Advice("warning", f"Node {name}: {printable(str(known['problem']))[:SENTENCE_MAX]}", "foreground",
                       subject="tracking"),)
    if known.get("learning_s"):
        return (advise("Node {name} learns the background: keep the hand out of its picture.", level="info",
                       subject="sight", name=name),)
    if not known.get("background") and known.get("skin") == "none":
        return (advise("Node {name} has learnt neither background nor skin, so no bare hand can be tracked by its "
                       "contours. Use Calibrate, Background and skin.", mender="foreground", subject="tracking",
                       name=name),)
    return ()


def sees_black(state: Mapping[str, Any]) -> bool:
    """Whether a node says that its camera's picture is black."""
    return any(trouble.code == BLACK_PICTURE.code for trouble in _troubles(state))


def _troubles(state: Mapping[str, Any]) -> list[_Trouble]:
    """What can be read of the `health` of a node's answer."""
    told = state.get("health")
    found = []
    for item in told[:_TOLD_MAX] if isinstance(told, list) else ():
        with contextlib.suppress(msgspec.ValidationError):
            found.append(msgspec.convert(item, _Trouble))
    return found
