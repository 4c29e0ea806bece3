"""What the engine publishes <-> msgpack bytes. No sockets here.

Dataclasses travel as maps by field name; a numpy array as the map ``{d: dtype, s: shape, b: raw bytes}``.
"""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np

from rhot_app.engine.status import EngineStatus, Preview
from rhot_app.errors import EngineError
from rhot_app.tracking.state import HandState

TOPIC_STATE = b"state"
TOPIC_STATUS = b"status"
TOPIC_PREVIEW = b"preview"

Published = HandState | EngineStatus | Preview


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
    TOPIC_PREVIEW: msgspec.msgpack.Decoder(Preview),
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
