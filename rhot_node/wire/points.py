"""The payloads of points in one frame: markers, corners of fiducial tags, landmarks of hands. docs/wire.md.

The markers of a datagram are a table over its bytes: checked, and read into arrays, in one compiled call each.
"""

from __future__ import annotations

import math
from struct import Struct

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rhot_node.errors import WireError
from rhot_node.wire.fields import (
    COVARIANCE_MAX,
    FLAG_TRUNCATED,
    FRAME,
    FRAME_ROOM,
    IMAGE_MARGIN,
    Table,
    begin,
    expect_length,
    expect_point,
    expect_zeros,
)
from rhot_node.wire.messages import (
    CANDIDATES_MAX,
    FAMILIES,
    FLAGS,
    LANDMARKS,
    Fiducial,
    Fiducials,
    FrameHead,
    HandLandmarks,
    LandmarkedHand,
    MarkerFlag,
    MarkerObservation,
    Observations,
)

VERSION = 2
"""Of observations. Their version 1, one record for every marker and no further candidates, is still read."""

MARKERS_MAX = 64

_HEAD = Struct("<IB3s")
_MARKER = Struct("<HHfffffff")
_RECORDS_AT = FRAME.size + _HEAD.size
_FIT = (FRAME_ROOM - _HEAD.size) // _MARKER.size

_LOST = int(MarkerFlag.LOST)
_KNOWN_FLAGS = len(FLAGS)
_SOUND, _INDEX, _UNKNOWN_FLAGS, _LOST_WITH_VALUES, _IMPLAUSIBLE, _TOO_MANY = range(6)

_TAGS = Struct("<BB2s")
_TAG = Struct("<BBH8f12f")
_HANDS = Struct("<B3s")
_HAND = Struct(f"<ff{5 * LANDMARKS}f")
_TAGS_FIT = (FRAME_ROOM - _TAGS.size) // _TAG.size
_HANDS_FIT = (FRAME_ROOM - _HANDS.size) // _HAND.size

Array = NDArray[np.float64]
Words = NDArray[np.uint16]  # (M, 16), of which the first two are index and flags
Values = NDArray[np.float32]  # (M, 8), of which the first is index and flags


class MarkerTable(Table[MarkerObservation]):
    """The markers of a datagram, in the order of `Observations.markers`. `marker_count`: number of markers of the set.
    """

    __slots__ = ("_values", "marker_count")

    def __init__(self, words: Words, values: Values, marker_count: int) -> None:
        """`words` (N, 16) and `values` (N, 8): two views of the same checked records."""
        super().__init__(words)
        self._values, self.marker_count = values, marker_count

    def _record(self, item: int) -> MarkerObservation:
        index, bits = self._records[item, :2].tolist()
        x, y, diameter, xx, xy, yy, quality = self._values[item, 1:].tolist()
        if bits & _LOST:
            x = y = math.nan  # one NaN object, so that equal markers compare equal
        return MarkerObservation(index, x, y, diameter, xx, xy, yy, quality, FLAGS[bits])

    def columns(self) -> tuple[Array, Array, Array, Array, NDArray[np.uint16]]:
        """Pixels (N, 2), NaN when lost, covariances (N, 2, 2) px^2, diameters (N,) px, qualities and flags (N,)."""
        count = len(self)
        numbers, flags = np.empty(8 * count), np.empty(count, np.uint16)
        _read(self._records, self._values, numbers, flags)
        return (numbers[:2 * count].reshape(count, 2), numbers[2 * count:6 * count].reshape(count, 2, 2),
                numbers[6 * count:7 * count], numbers[7 * count:], flags)

    def indices(self) -> NDArray[np.intp]:
        """(N,) the index of each row's marker."""
        return self._records[:, 0].astype(np.intp)


def encode_observations(message: Observations) -> bytes:
    """The payload with as many candidates as fit, without lost markers. Raises struct.error when a value does not fit
    its field."""
    found = [mark for mark in message.markers if not mark.flags.value & _LOST]
    kept = found[:_FIT]
    truncated = message.truncated or len(found) > len(kept)
    parts = [_HEAD.pack(message.marker_checksum, message.marker_count,
                        bytes((len(kept), FLAG_TRUNCATED if truncated else 0, 0)))]
    parts.extend([_MARKER.pack(m.index, m.flags.value, m.x, m.y, m.diameter, m.cov_xx, m.cov_xy, m.cov_yy, m.quality)
                  for m in kept])
    return b"".join(parts)


def decode_observations(payload: memoryview, head: FrameHead, version: int) -> Observations:
    """`payload`: with the frame's head. Raises WireError: length, count, reserved, flags, and as `marker_table`."""
    if len(payload) < _RECORDS_AT:
        raise WireError("length", f"payload of {len(payload)} bytes, observations begin with {_RECORDS_AT}")
    checksum, count, reserved = _HEAD.unpack_from(payload, FRAME.size)
    if count > MARKERS_MAX:
        raise WireError("count", f"{count} markers, at most {MARKERS_MAX}")
    candidates, flags = count, 0
    if version == VERSION:
        candidates, flags, reserved = reserved[0], reserved[1], reserved[2:]
    expect_length(payload, _RECORDS_AT + candidates * _MARKER.size)
    expect_zeros(reserved)
    if flags & ~FLAG_TRUNCATED:
        raise WireError("flags", f"unknown flags of observations {flags:#04x}")
    read = candidate_table if version == VERSION else marker_table
    markers = read(bytes(payload[_RECORDS_AT:]), count, *head[8:10])
    return Observations(*head, checksum, markers, bool(flags & FLAG_TRUNCATED))


def marker_table(records: bytes, count: int, width: int, height: int) -> MarkerTable:
    """Read observations of version 1, one record for every marker, lost or not.

    `records`: of `count` markers, of an image of `width` x `height` px. Raises WireError (index, flags or marker) when
    a record is not plausible.
    """
    words, values = _checked(records, count, width, height, False)
    return MarkerTable(words, values, count)


def candidate_table(records: bytes, count: int, width: int, height: int) -> MarkerTable:
    """Read observations of version 2, up to CANDIDATES_MAX records of each of `count` markers, the best first.

    A lost marker has no record. `records`, `width`, `height` and errors as in `marker_table`.
    """
    words, values = _checked(records, count, width, height, True)
    both = np.empty((count + len(words), 16), "<u2")
    rows = both.view("<f4")
    size = _place_candidates(words, values, count, both, rows)
    return MarkerTable(both[:size], rows[:size], count)


def _checked(records: bytes, count: int, width: int, height: int, found_only: bool) -> tuple[Words, Values]:
    words: Words = np.frombuffer(records, "<u2").reshape(-1, 16)
    values: Values = np.frombuffer(records, "<f4").reshape(-1, 8)
    row, fault = _first_fault(words, values, count, width, height, found_only)
    if fault == _SOUND:
        return words, values
    index, bits = words[row, :2].tolist()
    if fault == _INDEX:
        raise WireError("index", f"marker {index} at position {row}, of a set of {count}")
    if fault == _UNKNOWN_FLAGS:
        raise WireError("flags", f"unknown marker flags {bits:#06x}")
    if fault == _LOST_WITH_VALUES:
        raise WireError("marker", f"marker {index} is lost and yet has values")
    if fault == _TOO_MANY:
        raise WireError("marker", f"more than {CANDIDATES_MAX} candidates of marker {index}")
    raise WireError("marker", f"marker {index} is not plausible: {tuple(values[row, 1:].tolist())}")


@njit(cache=True)
def _place_candidates(words: Words, values: Values, count: int, out_words: Words, out_values: Values) -> int:
    """Write the first record of every marker to its row, a lost one where it has none, and the others behind these.

    Returns the number of rows.
    """
    for index in range(count):
        out_values[index, :] = 0.0
        out_values[index, 1] = out_values[index, 2] = math.nan
        out_words[index, 0], out_words[index, 1] = index, _LOST
    size = count
    for row in range(words.shape[0]):
        index = int(words[row, 0])
        if out_words[index, 1] & _LOST:
            out_words[index] = words[row]
        else:
            out_words[size] = words[row]
            size += 1
    return size


@njit(cache=True)
def _first_fault(words: Words, values: Values, count: int, width: int, height: int, found_only: bool,
                 ) -> tuple[int, int]:
    """Row and kind of the first fault, (0, _SOUND) without one.

    `found_only`: candidates of `count` markers (version 2); else one record of each marker (version 1).
    """
    candidates = np.zeros(count, np.int64)
    x_max, y_max = width - 1 + IMAGE_MARGIN, height - 1 + IMAGE_MARGIN
    diameter_max = 2.0 * max(width, height)
    for row in range(words.shape[0]):
        x, y, diameter = float(values[row, 1]), float(values[row, 2]), float(values[row, 3])
        xx, xy, yy = float(values[row, 4]), float(values[row, 5]), float(values[row, 6])
        quality = float(values[row, 7])
        if (words[row, 0] >= count) if found_only else (words[row, 0] != row):
            return row, _INDEX
        if words[row, 1] >= _KNOWN_FLAGS:
            return row, _UNKNOWN_FLAGS
        candidates[words[row, 0]] += 1
        if candidates[words[row, 0]] > CANDIDATES_MAX:
            return row, _TOO_MANY
        if words[row, 1] & _LOST:
            if found_only:
                return row, _LOST_WITH_VALUES
            silent = diameter == 0.0 and xx == 0.0 and xy == 0.0 and yy == 0.0 and quality == 0.0
            if not (math.isnan(x) and math.isnan(y) and silent):
                return row, _LOST_WITH_VALUES
        elif not (-IMAGE_MARGIN <= x <= x_max and -IMAGE_MARGIN <= y <= y_max
                  and 0.0 < diameter <= diameter_max and 0.0 <= quality <= 1.0
                  and 0.0 <= xx <= COVARIANCE_MAX and 0.0 <= yy <= COVARIANCE_MAX
                  and xy * xy <= xx * yy * (1.0 + 1e-6) + 1e-30):  # room for rounding to single precision
            return row, _IMPLAUSIBLE
    return 0, _SOUND


@njit(cache=True)
def _read(words: Words, values: Values, numbers: Array, flags: NDArray[np.uint16]) -> None:
    """Fill `numbers` (8 M,), as `MarkerTable.columns` cuts it, and `flags` (M,)."""
    count = words.shape[0]
    for row in range(count):
        numbers[2 * row], numbers[2 * row + 1] = values[row, 1], values[row, 2]
        place = 2 * count + 4 * row
        numbers[place], numbers[place + 3] = values[row, 4], values[row, 6]
        numbers[place + 1] = numbers[place + 2] = values[row, 5]
        numbers[6 * count + row], numbers[7 * count + row] = values[row, 3], values[row, 7]
        flags[row] = words[row, 1]


# -- tags and landmarks ------------------------------------------------------------------------------------------------

def encode_fiducials(message: Fiducials) -> bytes:
    """The payload with the first fiducials, as many as fit. Raises struct.error when a value does not fit its field."""
    kept = message.fiducials[:_TAGS_FIT]
    truncated = message.truncated or len(kept) < len(message.fiducials)
    return b"".join((_TAGS.pack(len(kept), FLAG_TRUNCATED if truncated else 0, b"\0\0"), *(
        _TAG.pack(one.family, 0, one.number, *one.corners, *one.covariances) for one in kept)))


def decode_fiducials(payload: memoryview, head: FrameHead) -> Fiducials:
    """Raises WireError: length, reserved, flags, index (an unknown family), marker (implausible corners)."""
    count, flags, reserved = begin(payload, _TAGS)
    expect_length(payload, _TAGS.size + count * _TAG.size)
    expect_zeros(reserved)
    if flags & ~FLAG_TRUNCATED:
        raise WireError("flags", f"unknown flags of fiducials {flags:#04x}")
    found = tuple(_fiducial(record, head) for record in _TAG.iter_unpack(payload[_TAGS.size:]))
    return Fiducials(*head, found, bool(flags & FLAG_TRUNCATED))


def _fiducial(record: tuple[float, ...], head: FrameHead) -> Fiducial:
    family, zero, number = (int(value) for value in record[:3])
    if zero:
        raise WireError("reserved", "reserved byte of a fiducial is not zero")
    if family >= len(FAMILIES):
        raise WireError("index", f"family {family}, of {len(FAMILIES)}")
    corners, covariances = record[3:11], record[11:]
    for place, covariance in zip(_parts(corners, 2), _parts(covariances, 3), strict=True):
        expect_point(f"fiducial {number}", place, covariance, *head[8:10])
    return Fiducial(family, number, corners, covariances)


def encode_hand_landmarks(message: HandLandmarks) -> bytes:
    """The payload. Raises WireError 'count' for too many hands, struct.error when a value does not fit its field."""
    if len(message.hands) > _HANDS_FIT:
        raise WireError("count", f"{len(message.hands)} hands, at most {_HANDS_FIT} in a datagram")
    return b"".join((_HANDS.pack(len(message.hands), b"\0\0\0"), *(
        _HAND.pack(hand.presence, hand.right, *(value for point in hand.points for value in point))
        for hand in message.hands)))


def decode_hand_landmarks(payload: memoryview, head: FrameHead) -> HandLandmarks:
    """Raises WireError: length, reserved, range (a probability), marker (an implausible landmark)."""
    count, reserved = begin(payload, _HANDS)
    expect_length(payload, _HANDS.size + count * _HAND.size)
    expect_zeros(reserved)
    return HandLandmarks(*head, tuple(_hand(record, head) for record in _HAND.iter_unpack(payload[_HANDS.size:])))


def _hand(record: tuple[float, ...], head: FrameHead) -> LandmarkedHand:
    presence, right = record[:2]
    if not (0.0 <= presence <= 1.0 and 0.0 <= right <= 1.0):
        raise WireError("range", f"probabilities of a hand {(presence, right)}")
    points = _parts(record[2:], 5)
    for point in points:
        if point != (0.0, 0.0, 0.0, 0.0, 0.0):
            expect_point("a landmark", point[:2], point[2:], *head[8:10])
    return LandmarkedHand(presence, right, points)


def _parts(values: tuple[float, ...], size: int) -> tuple[tuple[float, ...], ...]:
    return tuple(values[at:at + size] for at in range(0, len(values), size))
