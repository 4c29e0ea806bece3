"""A sample as a JSON object, the message of WebSocket, Zenoh and the web view. docs/outputs.md lists the fields."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.outputs.joints import HandSample, Sample

_DIGITS = 6  # micrometres, and as fine for quaternions


def json_message(sample: Sample) -> bytes:
    """The whole sample. An unknown joint is null, as is the age of a replayed state."""
    age_s = None if math.isnan(sample.age_s) else round(sample.age_s, _DIGITS)
    return msgspec.json.encode({
        "sequence": sample.state.sequence, "t_master_ns": sample.state.t_master_ns, "age_s": age_s,
        "joint_set": sample.joint_set, "joints": sample.joints, "hands": [_hand(hand) for hand in sample.hands]})


def _hand(hand: HandSample) -> dict[str, Any]:
    document = {
        "name": hand.name, "side": hand.side, "condition": hand.condition, "positions": _rows(hand.positions),
        "knowledge": hand.knowledge.tolist(), "palm_position": _rows(hand.palm_position[None])[0],
        "palm_orientation": _rows(hand.palm_orientation[None])[0]}
    if hand.orientations is not None and hand.radii is not None:
        document |= {"orientations": _rows(hand.orientations), "radii": np.round(hand.radii, _DIGITS).tolist()}
    return document


def _rows(values: NDArray[np.float64]) -> list[list[float] | None]:
    rows: list[list[float]] = np.round(values, _DIGITS).tolist()
    return [row if all(map(math.isfinite, row)) else None for row in rows]
