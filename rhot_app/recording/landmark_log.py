"""Landmark tables, or the hands that networks find in films, one per camera, as a raw log.

Then every command that takes a log takes landmarks.

A table is a CSV file with a header. docs/landmarks.md describes its columns.
"""

from __future__ import annotations

import csv
import io
import math
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import RecordingError
from rhot_app.hand.places import LANDMARK_ROLES
from rhot_app.project import Rig, RigNode
from rhot_app.recording.raw_log import Record, RecordKind, begun_now, encode_log
from rhot_node.files import read_table, replacing
from rhot_node.wire.codec import encode
from rhot_node.wire.fields import IMAGE_SIZE_MAX
from rhot_node.wire.messages import (
    ClockReply,
    ClockRequest,
    FrameHead,
    FrameMessage,
    HandLandmarks,
    LandmarkedHand,
    MarkerFlag,
    MarkerObservation,
    NodeState,
    Observations,
    Start,
    StartEntry,
)

Array = NDArray[np.float64]
Times = NDArray[np.int64]

LANDMARKS: Final = len(LANDMARK_ROLES)

SIGMA_PX: Final = 0.3
"""px: stated of landmarks whose table has no column `sigma_px`: they are rounded to pixels (1 / sqrt(12))."""

DIAMETER_PX: Final = 1.0  # a point has none
_BEGIN_NS, _EXCHANGE_NS = 1_000_000_000_000, 500_000_000
_BOUND_NS = 10_000  # of the times in a table

_LEAD_NS = 10 * _EXCHANGE_NS

FIRST_NS = _BEGIN_NS + _LEAD_NS
"""Master time, ns, of the first frame of a log that is made of tables."""
_SESSION, _LONGEST_S = 1, 86_400.0


@dataclass(frozen=True, slots=True)
class LandmarkTable:
    """One camera's landmarks in T frames: `times_s` (T,), ascending; `pixels` (T, 21, 2) px, raw image, NaN where there
    is none; `scores` (T,) 0..1; `sigma_px` (T,), standard deviation that the detector states."""

    times_s: Array
    pixels: Array
    scores: Array
    sigma_px: Array


@dataclass(frozen=True, slots=True)
class HandFilm:
    """The hands that networks find in T frames of one camera: `times_s` (T,), ascending; `hands` of each frame."""

    times_s: Array
    hands: Sequence[tuple[LandmarkedHand, ...]]


Film = TypeVar("Film", LandmarkTable, HandFilm)


def read_landmark_table(path: Path, fps: float | None) -> LandmarkTable:
    """Read a table; its frames are `fps` per second unless it has times. Raises RecordingError naming file and row."""
    try:
        rows = csv.DictReader(io.StringIO(read_table(path).decode("utf-8-sig"), newline=""))
        return _parse(path, list(rows.fieldnames or []), rows, fps)
    except OSError as exc:
        raise RecordingError(f"{path}: cannot be read ({exc.strerror}).") from exc
    except (UnicodeDecodeError, csv.Error) as exc:
        raise RecordingError(f"{path}: cannot be read as a landmark table ({exc}). Give a CSV file with the columns "
                             "of docs/landmarks.md.") from exc


def _parse(path: Path, names: list[str], rows: Iterable[dict[str, str]], fps: float | None) -> LandmarkTable:
    places = [f"{axis}{k}" for k in range(LANDMARKS) for axis in "xy"]
    missing = [name for name in places if name not in names]
    timed = "time_s" in names
    if missing or not (timed or "frame" in names):
        what = missing[0] if missing else "frame or time_s"
        raise RecordingError(f"{path}: has no column {what}; a landmark table has frame or time_s and x0, y0 to "
                             f"x{LANDMARKS - 1}, y{LANDMARKS - 1}.")
    if not timed and fps is None:
        raise RecordingError(f"{path}: has frame numbers but no column time_s; give --fps, the frames per second.")
    numbers = array("d")  # a table's cells as text take ten times as much
    for number, row in enumerate(rows):
        try:
            numbers.extend([float(row["time_s"]) if timed else float(row["frame"]) / (fps or 1.0),
                            float(row.get("score") or 1.0), float(row.get("sigma_px") or SIGMA_PX),
                            *(float(row[name] or "nan") for name in places)])
        except (TypeError, ValueError) as exc:
            raise RecordingError(f"{path}: line {number + 2} holds something that is no number ({exc}). Mend or "
                                 "remove the line.") from exc
    if not numbers:
        raise RecordingError(f"{path}: holds no frames.")
    table = np.array(numbers).reshape(-1, 3 + 2 * LANDMARKS)
    times, scores, sigma, pixels = table[:, 0], table[:, 1], table[:, 2], table[:, 3:].reshape(-1, LANDMARKS, 2)
    pixels[~np.isfinite(pixels).all(axis=2)] = np.nan
    for wrong, what in ((~np.isfinite(times) | (np.abs(times) > _LONGEST_S), "a time beyond a day"),
                        (np.diff(times, prepend=-math.inf) <= 0.0, "a time that is not after the one before"),
                        (~((scores >= 0.0) & (scores <= 1.0)), "a score that is not from 0 to 1"),
                        (~((sigma > 0.0) & (sigma <= 1e3)), "a sigma_px that is not from 0 to 1000"),
                        ((np.abs(pixels) > IMAGE_SIZE_MAX).any(axis=(1, 2)), "a pixel in no image")):
        if wrong.any():
            raise RecordingError(f"{path}: line {int(np.argmax(wrong)) + 2} has {what}.")
    return LandmarkTable(times, pixels, scores, sigma)


def landmark_order(rig: Rig) -> list[int]:
    """The landmark of each of the rig's markers, -1 for another marker. Raises RecordingError when it has none."""
    order = [LANDMARK_ROLES.index(marker.role) if marker.role in LANDMARK_ROLES else -1
             for marker in rig.markers.markers]
    if max(order) < 0:
        raise RecordingError(f"rig {rig.name!r}: none of its markers is a landmark. Give it the marker set "
                             "landmarks21 (resources/markers/landmarks21.json).")
    return order


def write_landmark_log(path: Path, rig: Rig, tables: Sequence[LandmarkTable]) -> int:
    """Write one table per node as a raw log; returns the number of frames.

    Frames of tables without times are taken to be synchronous: those of one number are of one instant. Raises
    RecordingError when tables and nodes do not match, or the file cannot be written.
    """
    if len(tables) != len(rig.nodes):
        raise RecordingError(f"rig {rig.name!r} has {len(rig.nodes)} cameras, but the landmark tables are "
                             f"{len(tables)}. Give one table for each, in the rig's order.")
    order = landmark_order(rig)
    return _write(path, rig, tables, lambda node, table, number, head: Observations(
        *head, rig.markers.checksum, _observations(node, order, table, number)))


def write_hand_log(path: Path, rig: Rig, films: Sequence[HandFilm], about: Mapping[str, Any] | None = None) -> int:
    """Write what networks find in one film per node as their nodes would send it; returns the number of frames.
    `about`: what the header says beside. Raises RecordingError when the file cannot be written."""
    return _write(path, rig, films, lambda node, film, number, head: HandLandmarks(*head, film.hands[number]), about)


def _write(path: Path, rig: Rig, films: Sequence[Film],
           message: Callable[[RigNode, Film, int, FrameHead], FrameMessage],
           about: Mapping[str, Any] | None = None) -> int:
    """A log of what was found in one film per node: `message` says it of frame `number`, with the head of its time."""
    first_s = min(float(film.times_s[0]) for film in films)
    times_ns = [FIRST_NS + np.rint(1e9 * (film.times_s - first_s)).astype(np.int64) for film in films]
    frames_ns = np.unique(np.concatenate(times_ns))
    exchanges_ns = _near(np.arange(_BEGIN_NS, frames_ns[-1] + _EXCHANGE_NS, _EXCHANGE_NS), frames_ns).tolist()
    stated = [Record(RecordKind.START, 0, _BEGIN_NS - 1, encode(Start(
        _SESSION, 0, tuple(StartEntry(node.node_id, 1, 0) for node in rig.nodes))))]
    for node, film, times in zip(rig.nodes, films, times_ns, strict=True):
        for sequence, t_ns in enumerate(exchanges_ns):
            stated += _exchange(node, sequence, t_ns)
        lens = node.intrinsics
        for number, t_ns in enumerate(times.tolist()):
            head = node.node_id, _SESSION, number, t_ns, t_ns, 0, 0, 0, lens.width, lens.height, number
            stated.append(Record(RecordKind.DATAGRAM, node.node_id, t_ns, encode(message(node, film, number, head))))
    try:
        with replacing(path) as file:
            file.writelines(encode_log(rig, {**begun_now(_BEGIN_NS), "created_t_master_ns": None, **(about or {})},
                                       sorted(stated, key=lambda record: record.t_master_ns)))
    except OSError as exc:
        raise RecordingError(f"{path}: cannot be written ({exc.strerror}). Choose another --out.") from exc
    return sum(len(times) for times in times_ns)


def _near(times_ns: Times, frames_ns: Times) -> Times:
    """Those of the times that lie as shortly before or after a frame as the first ones do before the first: in a pause
    no clock is asked."""
    place = np.searchsorted(frames_ns, times_ns)
    until = frames_ns[np.minimum(place, len(frames_ns) - 1)] - times_ns
    since = times_ns - frames_ns[np.maximum(place - 1, 0)]
    return np.asarray(times_ns[(np.abs(until) <= _LEAD_NS) | (np.abs(since) <= _LEAD_NS)])


def _exchange(node: RigNode, sequence: int, t_ns: int) -> list[Record]:
    """A clock exchange of one clock, whose way takes as long as its times are uncertain."""
    request = ClockRequest(node.node_id, _SESSION, sequence, t_ns)
    heard_ns = t_ns + _BOUND_NS
    reply = ClockReply(node.node_id, _SESSION, sequence, t_ns, heard_ns, heard_ns, 1, NodeState.STREAMING)
    return [Record(RecordKind.CLOCK_REQUEST, node.node_id, t_ns, encode(request)),
            Record(RecordKind.CLOCK_REPLY, node.node_id, t_ns + 2 * _BOUND_NS, encode(reply))]


def _observations(node: RigNode, order: list[int], table: LandmarkTable, number: int) -> tuple[MarkerObservation, ...]:
    lens, out = node.intrinsics, []
    variance = float(table.sigma_px[number]) ** 2
    for index, landmark in enumerate(order):
        x, y = table.pixels[number, landmark] if landmark >= 0 else (math.nan, math.nan)
        if -0.5 <= x <= lens.width - 0.5 and -0.5 <= y <= lens.height - 0.5:
            out.append(MarkerObservation(index, float(x), float(y), DIAMETER_PX, variance, 0.0, variance,
                                         float(table.scores[number])))
        else:
            out.append(MarkerObservation(index, math.nan, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0, MarkerFlag.LOST))
    return tuple(out)
