"""What the engine tells its clients about itself a few times a second, beside the stream of hand states."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol, TypeVar, get_args

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import EngineError
from rhot_app.outputs.spec import OutputStatus
from rhot_app.state import HandState, SeenContour

Level = Literal["info", "warning", "error"]
Subject = Literal["recording", "tracking", "sight", "equipment", "calibration", "information"]
"""What a sentence is about, most urgent first: data are lost; nothing can be tracked; a camera does not see what it
should; a machine or a connection works badly; a calibration is missing or in doubt; there is nothing to do."""
SLOW_S = {"set_rig": 600.0}
"""s, by command that another thread of the engine carries out: a tracker is compiled and loaded first, a minute's work
where nothing else runs. A client waits so long."""

NodeWord = Literal["silent", "starting", "ready", "streaming", "fault"]


@dataclass(frozen=True, slots=True)
class NodeStatus:
    """One node as the master sees it. `lost` counts gaps in the sequence; `dropped` rejected datagrams by reason."""

    node_id: int
    name: str
    state: NodeWord
    text_datagrams: bool
    rate_hz: float
    received: int
    lost: int
    dropped: dict[str, int]
    clock_offset_s: float | None
    clock_bound_s: float | None
    clock_round_trip_s: float | None
    message: str = ""  # the node's own words when in fault, or why it is silent
    paired: bool = False  # only what is tagged by the node's key is believed
    turned_away: bool = False  # the node is there, but does not know this master


@dataclass(frozen=True, slots=True)
class Advice:
    """One sentence for the operator: what is wrong, where, and what to do. `mender` names the calibration that
    mends it, as the app's wizards are named; empty for none. `lasting`: it stays until the rig is calibrated, so it is
    shown apart from the others. `pattern` and `values`: what `text` is made of, for clients that speak another
    language; empty where the sentence comes from elsewhere."""

    level: Level
    text: str
    mender: str = ""
    lasting: bool = False
    subject: Subject = "equipment"
    pattern: str = field(default="", compare=False)
    values: dict[str, str | int | float] = field(default_factory=dict, compare=False)


def advise(pattern: str, /, *, level: Level = "warning", mender: str = "", lasting: bool = False,
           subject: Subject = "equipment", **values: str | int | float) -> Advice:
    """A sentence: a literal with named placeholders, as `str.format` has them, and their `values`. Words among these
    are marked by `words`."""
    text = pattern.format(**{name: with_numbers(value, values) for name, value in values.items()})
    return Advice(level, text, mender, lasting, subject, pattern, values)


def words(text: str) -> str:
    """Mark a literal that is a value of `advise`, so that it is translated, too. It may have placeholders of its own
    for numbers among the values: `with_numbers`."""
    return text


def with_numbers(value: str | float, values: Mapping[str, str | float]) -> str | float:
    """`value` with the numbers among `values` for its placeholders, whose names alone stand in braces."""
    if isinstance(value, str):
        for name, number in values.items():
            if not isinstance(number, str):
                value = value.replace(f"{{{name}}}", str(number))
    return value


class _Ranked(Protocol):
    @property
    def level(self) -> Level: ...
    @property
    def subject(self) -> Subject: ...


_Sentence = TypeVar("_Sentence", bound=_Ranked)


def most_urgent_first(sentences: Iterable[_Sentence]) -> list[_Sentence]:
    """In the order in which the operator must act: by subject, then errors before warnings; otherwise as they were."""
    subjects, levels = get_args(Subject), ("error", "warning", "info")
    return sorted(sentences, key=lambda one: (subjects.index(one.subject), levels.index(one.level)))


@dataclass(frozen=True, slots=True)
class LatencySummary:
    """Median and 99th percentile over the last seconds, s."""

    p50_s: float
    p99_s: float


@dataclass(frozen=True, slots=True)
class EngineStatus:
    """The engine itself. `condition` is a `Condition` value; `latency` is by `LATENCY_STAGES`."""

    t_master_ns: int
    pid: int
    session: int
    running: bool
    condition: str
    rig_name: str
    rig_path: str
    state_rate_hz: float
    nodes: tuple[NodeStatus, ...]
    advice: tuple[Advice, ...]
    latency: dict[str, LatencySummary] = field(default_factory=dict)
    log_path: str = ""  # empty when nothing is recorded
    log_bytes: int = 0
    outputs: tuple[OutputStatus, ...] = ()  # the live streams to other programs
    log_seconds: float = 0.0  # how long it has been recorded
    replaying: str = ""  # the log that is replayed; empty when nodes are live


@dataclass(frozen=True, slots=True, eq=False)
class Preview:
    """A small picture of one camera for people, JPEG bytes, and what its node found in this very frame.

    `width`, `height`: of the frame, px. `pixels` (M, 2) px of the frame, NaN when lost, and `flags` (M,): without rows
    while nothing is known of the frame. `t_node_ns`: its stamp by the node's clock; `t_master_ns`: the same in master
    time, 0 while nothing is known of it.
    """

    camera: str
    t_master_ns: int
    width: int
    height: int
    jpeg: bytes
    t_node_ns: int = 0
    pixels: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    flags: NDArray[np.uint16] = field(default_factory=lambda: np.empty(0, np.uint16))


# -- encoding in msgpack -----------------------------------------------------------------------------------------------
# Dataclasses travel as maps by field name; a numpy array as the map ``{d: dtype, s: shape, b: raw bytes}``.

TOPIC_STATE = b"state"
TOPIC_STATUS = b"status"
TOPIC_PREVIEW = b"preview"
TOPIC_CONTOUR = b"contour"

Published = HandState | EngineStatus | Preview | SeenContour


def _encode_array(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return {"d": value.dtype.str, "s": value.shape, "b": value.tobytes()}
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a {type(value).__name__} cannot be published")


def _decode_array(kind: Any, value: Any) -> Any:
    if getattr(kind, "__origin__", kind) is not np.ndarray:
        raise TypeError(f"a {kind} cannot be received")
    return np.frombuffer(value["b"], dtype=value["d"]).reshape(value["s"])


_encoder = msgspec.msgpack.Encoder(enc_hook=_encode_array)
_decoders: dict[bytes, msgspec.msgpack.Decoder[Any]] = {
    TOPIC_STATE: msgspec.msgpack.Decoder(HandState, dec_hook=_decode_array),
    TOPIC_STATUS: msgspec.msgpack.Decoder(EngineStatus),
    TOPIC_PREVIEW: msgspec.msgpack.Decoder(Preview, dec_hook=_decode_array),
    TOPIC_CONTOUR: msgspec.msgpack.Decoder(SeenContour, dec_hook=_decode_array),
}


def encode(message: Published) -> bytes:
    """Bytes of one published message."""
    return _encoder.encode(message)


def decode(topic: bytes, payload: bytes) -> Published:
    """The message that `encode` turned into `payload`; arrays of a state are read-only views of it.

    Raises EngineError when topic or bytes are not the engine's (it may be of another version).
    """
    decoder = _decoders.get(topic)
    if decoder is None:
        raise EngineError(f"the engine published an unknown topic {topic!r}; is it of another version?")
    try:
        return decoder.decode(payload)
    except (msgspec.MsgspecError, TypeError, ValueError, KeyError) as exc:
        raise EngineError(f"the engine's {topic.decode()} message cannot be read ({exc}); "
                          "is it of another version? Restart engine and app.") from exc
