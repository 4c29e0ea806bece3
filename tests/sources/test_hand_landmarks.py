"""Hand landmarks of a node: which of the rig's markers they are, in master time, and which hand."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from shipped_markers import LANDMARKS21
from test_door import NODE_CLOCK, NOW_NS, SESSION, known_clock

from rhot_app.project import OTHER_HAND, Rig
from rhot_app.simulator.nodes.synthetic_node import synthetic_rig
from rhot_app.sources.validation import DatagramValidator
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.markers import MarkerSet
from rhot_node.wire.codec import encode
from rhot_node.wire.messages import HandLandmarks, LandmarkedHand, MarkerFlag


def landmark_rig() -> Rig:
    """Of a right hand, with the landmarks behind two painted markers."""
    rig = synthetic_rig()
    return msgspec.structs.replace(rig, markers=MarkerSet((*rig.markers.markers[:2], *LANDMARKS21.markers)))


def two_handed_rig() -> Rig:
    rig = synthetic_rig()
    others = tuple(msgspec.structs.replace(marker, id=f"{OTHER_HAND}{marker.id}", role=f"{OTHER_HAND}{marker.role}")
                   for marker in LANDMARKS21.markers)
    return msgspec.structs.replace(rig, markers=MarkerSet((*LANDMARKS21.markers, *others)),
                                   other_hand=msgspec.structs.replace(rig.hand, side="left"))


def hand(x: float, right: float, absent: int = -1) -> LandmarkedHand:
    return LandmarkedHand(0.875, right, tuple(
        (x + k, 50.0 + 2.0 * k, 4.0, 1.0, 2.0) if k != absent else (0.0,) * 5 for k in range(21)))


def admitted(rig: Rig, *hands: LandmarkedHand, door: DatagramValidator | None = None) -> CameraObservations | None:
    if door is None:
        door = DatagramValidator(rig, 1, known_clock())
        door.expect_session(SESSION)
    frame = door.admit(encode(HandLandmarks(
        rig.nodes[1].node_id, SESSION, 0, NODE_CLOCK.from_host_ns(NOW_NS - 20_000_000),
        NODE_CLOCK.from_host_ns(NOW_NS - 200_000), 15_000_000, 4_000_000, 48_000, 640, 480, 0, hands)), NOW_NS)
    assert frame is None or isinstance(frame, CameraObservations)
    return frame


def test_landmarks_are_observations_in_the_rigs_order_and_master_time() -> None:
    frame = admitted(landmark_rig(), hand(100.0, 0.9, absent=4))
    assert frame is not None and frame.camera == 1
    assert abs(frame.t_row0_master_ns - (NOW_NS - 20_000_000)) <= 1e9 * frame.clock_bound_s
    assert (frame.detect_s, frame.row_time_ns) == (pytest.approx(15e-3), 48_000)
    assert frame.network_s == pytest.approx(200e-6, abs=frame.clock_bound_s)
    lost = frame.flags == MarkerFlag.LOST
    assert np.flatnonzero(lost).tolist() == [0, 1, 6] and np.isnan(frame.pixels[lost]).all()
    np.testing.assert_allclose(frame.pixels[22], [120.0, 90.0])
    np.testing.assert_allclose(frame.covariances[22], [[4.0, 1.0], [1.0, 2.0]])
    assert frame.qualities[22] == 0.875 and frame.further is None


def shown(frame: CameraObservations | None) -> list[float]:
    """x of each wrist that is there, of the rig's hand and of the other one."""
    assert frame is not None
    return [float(frame.pixels[k, 0]) for k in range(0, len(frame.pixels), 21)]


@pytest.mark.parametrize(("hands", "expected"), [
    ([], [np.nan, np.nan]),
    ([hand(100.0, 0.9)], [100.0, np.nan]),
    ([hand(100.0, 0.1)], [np.nan, 100.0]),
    ([hand(100.0, 0.2), hand(300.0, 0.7)], [300.0, 100.0]),
    ([hand(100.0, 0.9), hand(300.0, 0.6)], [100.0, np.nan]),  # two right hands: the likelier one
    ([hand(100.0, 0.6), hand(300.0, 0.9), hand(400.0, 0.2)], [300.0, 400.0]),
])
def test_hands_are_told_by_their_sides(hands: list[LandmarkedHand], expected: list[float]) -> None:
    np.testing.assert_array_equal(shown(admitted(two_handed_rig(), *hands)), expected)


def test_a_hand_of_the_other_side_is_not_the_rigs() -> None:
    rig = msgspec.structs.replace(landmark_rig(), markers=LANDMARKS21)
    assert np.isnan(shown(admitted(rig, hand(100.0, 0.3))))[0]
    assert shown(admitted(rig, hand(100.0, 0.3), hand(300.0, 0.6))) == [300.0]


def test_a_rig_without_landmarks_takes_none() -> None:
    rig = synthetic_rig()
    door = DatagramValidator(rig, 1, known_clock())
    door.expect_session(SESSION)
    assert admitted(rig, hand(100.0, 0.9), door=door) is None
    assert (door.dropped, door.accepted) == ({"no_landmarks": 1}, 0)
