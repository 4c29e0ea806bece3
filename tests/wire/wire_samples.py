"""One message of every kind, whose bytes lie in tests/packets. Values are exact in single precision."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

from rhot_node.wire.messages import (
    NO_FLAGS,
    ClockReply,
    ClockRequest,
    Fiducial,
    Fiducials,
    Find,
    ForegroundPart,
    HandLandmarks,
    Here,
    LandmarkedHand,
    MarkerFlag,
    MarkerObservation,
    Message,
    NodeState,
    Observations,
    SliceEdge,
    SliceEdges,
    Slices,
    Start,
    StartEntry,
    Stop,
    TrustState,
)

PACKETS = Path(__file__).parents[1] / "packets"
SESSION = 0x1122334455667788
FRAME_NS = 3_600_000_000_000
RHOT6_CHECKSUM = 0xC0FFEE01
OF_A_FRAME: dict[str, int] = {
    "node_id": 2, "session": SESSION, "sequence": 7, "t_frame_node_ns": FRAME_NS,
    "t_send_node_ns": FRAME_NS + 27_000_000, "processing_ns": 1_500_000, "exposure_ns": 4_000_000,
    "row_time_ns": 48_000, "width": 640, "height": 480, "frame_number": 41}
"""What all messages about a frame have."""


def packet(name: str) -> bytes:
    """The golden packet of that name."""
    return (PACKETS / f"{name}.bin").read_bytes()


def lost(index: int) -> MarkerObservation:
    return MarkerObservation(index, math.nan, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, MarkerFlag.LOST)


def found(index: int, x: float, y: float, flags: MarkerFlag = NO_FLAGS) -> MarkerObservation:
    return MarkerObservation(index, x, y, 16.0, 0.0009765625, -0.000244140625, 0.001953125, 0.875, flags)


def observations(markers: tuple[MarkerObservation, ...], sequence: int = 7) -> Observations:
    return Observations(**OF_A_FRAME | {"sequence": sequence}, marker_checksum=RHOT6_CHECKSUM, markers=markers)


def fiducial(family: int, number: int, x: float, y: float, side: float = 32.0) -> Fiducial:
    return Fiducial(family, number, (x, y, x + side, y + 0.5, x + side - 0.25, y + side, x - 0.5, y + side + 0.125),
                    (0.0009765625, -0.000244140625, 0.001953125) * 4)


def fiducials(found: tuple[Fiducial, ...], truncated: bool = False) -> Fiducials:
    return Fiducials(**OF_A_FRAME, fiducials=found, truncated=truncated)


def edges(found: tuple[SliceEdge, ...], part: int = 0, parts: int = 1) -> SliceEdges:
    return SliceEdges(**OF_A_FRAME, request=12, slice_count=232, part=part, parts=parts, edges=found)


def slices(records: bytes, count: int, map_step: int = 0, part: int = 0, parts: int = 1) -> Slices:
    return Slices(node_id=2, session=SESSION, sequence=3, request=12, width=640, height=480, slice_count=count,
                  part=part, parts=parts, map_step=map_step, records=records)


def foreground(data: bytes, part: int = 0, parts: int = 1) -> ForegroundPart:
    return ForegroundPart(**OF_A_FRAME, request=12, step=8, part=part, parts=parts, data=data)


def landmarked_hand(x: float, right: float, *, absent: int = -1) -> LandmarkedHand:
    return LandmarkedHand(0.875, right, tuple(
        (x + 8.0 * k, 400.5 - 16.25 * k, 2.0, -0.5, 1.5) if k != absent else (0.0,) * 5 for k in range(21)))


def hand_landmarks(*hands: LandmarkedHand) -> HandLandmarks:
    return HandLandmarks(**OF_A_FRAME, hands=hands)


SIX = tuple(found(i, 100.5 + 64.25 * i, 200.125 - 8.5 * i) for i in range(6))

SAMPLES: dict[str, Message] = {
    "observations_six": observations(SIX),
    "observations_some_lost": observations(
        (SIX[0], lost(1), found(2, -3.5, 479.25, MarkerFlag.EDGE | MarkerFlag.PARTIAL), lost(3),
         found(4, 12.0, 13.0, MarkerFlag.AMBIGUOUS | MarkerFlag.ACQUIRED), found(5, 0.0, 0.0, MarkerFlag.REFERENCE))),
    "observations_all_lost": observations(tuple(lost(i) for i in range(6))),
    "observations_two": observations((SIX[0], lost(1))),
    "observations_none": observations(()),
    "observations_candidates": observations(
        (found(0, 4.0, 5.0, MarkerFlag.AMBIGUOUS), lost(1), found(2, 6.0, 7.0), found(0, 99.5, 8.0), found(2, 2.0, 1.0),
         found(0, 300.0, 9.0, MarkerFlag.ACQUIRED), found(0, 301.0, 9.0))),
    "observations_truncated": dataclasses.replace(
        observations(tuple(found(i, 8.0 * i, 4.0 * i) for i in range(43)), 2**32 - 1), truncated=True),
    "clock_request": ClockRequest(2, SESSION, 99, 7_200_000_000_123),
    "clock_request_idle": ClockRequest(2**32 - 1, 0, 0, -5),
    "clock_reply_streaming": ClockReply(2, SESSION, 99, 7_200_000_000_123, FRAME_NS + 1, FRAME_NS + 20_001, 0xB007_B007,
                                        NodeState.STREAMING),
    "clock_reply_fault": ClockReply(2, 0, 0, -5, -1_000, -900, 1, NodeState.FAULT),
    "start_two": Start(SESSION, 3, (StartEntry(1, 50001, FRAME_NS + 250_000_000), StartEntry(2, 50002, 0))),
    "start_nobody": Start(SESSION, 4, ()),
    "stop": Stop(SESSION, 5),
    "stop_any": Stop(0, 6),
    "find_all": Find(0, 8, 0x0123456789ABCDEF),
    "find_one": Find(2, 9, 1),
    "here": Here(2, 8, 0x0123456789ABCDEF, 0xB007_B007, 47800, 47801, 47802, 47803, NodeState.STREAMING,
                 TrustState.PAIRED, "right"),
    "here_longest_name": Here(2**32 - 1, 2**32 - 1, 2**64 - 1, 1, 1, 65535, 2, 3, NodeState.FAULT, TrustState.OPEN,
                              "\U0001d4d7" * 64),
    "fiducials_none": fiducials(()),
    "fiducials_two": fiducials((fiducial(20, 586, 100.5, 200.125), fiducial(0, 49, -3.5, 440.25))),
    "fiducials_truncated": fiducials(tuple(fiducial(3, 999 - k, 30.0 * k, 20.5 * k) for k in range(16)), True),
    "edges_none": edges(()),
    "edges_two": edges((SliceEdge(0, -3.5, 0.25, -12.5, 1.0, 0.0),
                        SliceEdge(231, 17.0078125, 3.0, 40.03125, 51 / 255, 1.0)), 1, 3),
    "slices_none": slices(b"", 0, 8),
    "slices_two": slices(bytes.fromhex("91010203004014" "fc09000000c0ff"), 232, 0, 1, 2),
    "hand_landmarks_none": hand_landmarks(),
    "hand_landmarks_two": hand_landmarks(landmarked_hand(-3.5, 0.9375, absent=4), landmarked_hand(300.25, 0.0625)),
    "foreground_part": foreground(b"\x78\x9c\x03\x00", 1, 2),
}

SIXTY_FOUR = observations(tuple(found(i, 8.0 * i, 4.0 * i) for i in range(64)), 2**32 - 1)
VERSION_1 = {f"version_1_{name}": SAMPLES.get(name, SIXTY_FOUR) for name in (
    "observations_six", "observations_some_lost", "observations_all_lost", "observations_two", "observations_none",
    "observations_sixty_four")}
"""What older nodes send: one record of each marker, lost or not."""

KEY = bytes(range(32))
TAGGED: dict[str, Message] = {f"tagged_{name}": SAMPLES[name] for name in (
    "observations_six", "observations_none", "clock_request", "clock_reply_streaming", "start_two", "stop")}
