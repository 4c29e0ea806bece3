"""A state as messages of ROS 2's own types in CDR: the topics and bytes of the export for ROS 2 (docs/export.md)."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from typing import Final

import numpy as np

from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.hand.skeleton import ANGLES
from rhot_app.outputs.joints import Sample
from rhot_app.project import OTHER_HAND
from rhot_app.state import HandState

FRAME: Final = "rig"
_IDENTITY_XYZW: Final = (0.0, 0.0, 0.0, 1.0)


class _Cdr:
    """Plain CDR, little-endian (OMG DDS-RTPS 2.5, 10.2): numbers are aligned to their size after the header."""

    def __init__(self) -> None:
        self.data = bytearray(b"\x00\x01\x00\x00")

    def numbers(self, kind: str, *values: float) -> None:
        if values:
            size = struct.calcsize(f"<{kind}")
            self.data += bytes(-(len(self.data) - 4) % size) + struct.pack(f"<{len(values)}{kind}", *values)

    def text(self, text: str) -> None:
        encoded = text.encode() + b"\0"
        self.numbers("I", len(encoded))
        self.data += encoded

    def header(self, t_ns: int) -> None:
        self.numbers("i", t_ns // 1_000_000_000)
        self.numbers("I", t_ns % 1_000_000_000)
        self.text(FRAME)


def ros2_messages(sample: Sample) -> Iterator[tuple[str, bytes]]:
    """(topic, CDR) of one state, in the rig frame. Times are the wall clock's, of a replay the master's. A hand that is
    not tracked has no message, because ROS's types have no word for unknown."""
    state = sample.state
    t_ns = state.t_master_ns if sample.t_unix_ns is None else sample.t_unix_ns
    frames: list[tuple[str, np.ndarray]] = []
    for prefix, hand in (("", state), (OTHER_HAND, state.other)):
        if hand is None or not (hand.tracked and np.isfinite(hand.joint_positions).all()):
            continue
        yield f"{prefix}hand/joint_states", _joint_state(t_ns, prefix, hand)
        yield f"{prefix}hand/joints", _pose_array(t_ns, hand.joint_positions.tolist())
        frames.append((f"{prefix}palm", hand.world_from_palm))
    frames += [(one.name, one.world_from_object) for one in state.objects if np.isfinite(one.world_from_object).all()]
    if frames:
        yield "tf", _transforms(t_ns, frames)


def _joint_state(t_ns: int, prefix: str, hand: HandState) -> bytes:
    cdr = _Cdr()
    cdr.header(t_ns)
    cdr.numbers("I", len(ANGLES))
    for angle in ANGLES:
        cdr.text(f"{prefix}{angle}")
    cdr.numbers("I", len(ANGLES))
    cdr.numbers("d", *hand.angles.tolist())
    cdr.numbers("I", 0, 0)  # neither velocity nor effort
    return bytes(cdr.data)


def _pose_array(t_ns: int, points: list[list[float]]) -> bytes:
    cdr = _Cdr()
    cdr.header(t_ns)
    cdr.numbers("I", len(points))
    for point in points:
        cdr.numbers("d", *point, *_IDENTITY_XYZW)
    return bytes(cdr.data)


def _transforms(t_ns: int, frames: Iterable[tuple[str, np.ndarray]]) -> bytes:
    cdr, listed = _Cdr(), list(frames)
    cdr.numbers("I", len(listed))
    for child, place in listed:
        cdr.header(t_ns)
        cdr.text(child)
        w, x, y, z = quaternion_from_rotation(place[:3, :3]).tolist()
        cdr.numbers("d", *place[:3, 3].tolist(), x, y, z, w)
    return bytes(cdr.data)
