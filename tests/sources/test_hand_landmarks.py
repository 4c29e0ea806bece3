"""Hand landmarks of a node: which of the rig's markers they are, in master time, and which hand."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from shipped_markers import LANDMARKS21
from synthetic_node import synthetic_rig
from test_door import NODE_CLOCK, NOW_NS, SESSION, known_clock

from rhot_app.project import OTHER_HAND, Rig
from rhot_app.sources.validation import DatagramValidator
from rhot_app.tracking.kinds.kind import FrameTimes
from rhot_app.tracking.kinds.landmarks import LandmarkKind
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


# -- from frame to frame -----------------------------------------------------------------------------------------------

FPS = 30.0


def followed(rig: Rig, frames: list[list[LandmarkedHand]], fps: float = FPS) -> np.ndarray:
    """(T, H) x of the wrist of each of the rig's hands, NaN without."""
    kind, found = LandmarkKind(), []
    kind.configure(rig, 0)
    for number, hands in enumerate(frames):
        t_ns = NOW_NS + round(1e9 * number / fps)
        message = HandLandmarks(1, SESSION, number, t_ns, t_ns, 0, 0, 0, 640, 480, number, hands)
        found.append(shown(kind.observe(message, FrameTimes(t_ns, t_ns, t_ns, 0.0))))
    return np.array(found)


def test_a_flicker_of_the_side_turns_no_hand_into_the_other() -> None:
    sides = np.full((60, 2), [0.95, 0.05])
    sides[10:14, 0], sides[25:29, 1], sides[40:43] = 0.02, 0.98, [0.02, 0.98]
    found = followed(two_handed_rig(), [[hand(100.0, one), hand(400.0, other)] for one, other in sides])
    np.testing.assert_array_equal(found, np.full((60, 2), [100.0, 400.0]))
    assert (followed(msgspec.structs.replace(landmark_rig(), markers=LANDMARKS21),
                     [[hand(100.0, one)] for one in sides[:, 0]]) == 100.0).all(), "nor is a single one lost"


@pytest.mark.parametrize("fps", [10.0, 30.0])
def test_a_side_that_was_wrong_is_put_right_within_half_a_second(fps: float) -> None:
    begin = round(fps)
    frames = [[hand(100.0, 0.95), hand(400.0, 0.05)]] * begin + [[hand(100.0, 0.05), hand(400.0, 0.95)]] * begin
    found = followed(two_handed_rig(), frames, fps)
    np.testing.assert_array_equal(found[begin + round(0.5 * fps):], np.full((begin - round(0.5 * fps), 2),
                                                                            [400.0, 100.0]))


def test_hands_that_cross_keep_their_names_though_one_is_hidden_and_the_sides_are_doubtful() -> None:
    left, right = 100.0 + 10.0 * np.arange(41), 505.0 - 10.0 * np.arange(41)
    frames = []
    for number, (one, other) in enumerate(zip(left, right, strict=True)):
        near = abs(number - 20) <= 6
        hands = [hand(one, 0.45 if near else 0.95), hand(other, 0.55 if near else 0.05)]
        frames.append(hands[:1] if abs(number - 20) <= 3 else hands[::-1] if number % 2 else hands)
    found = followed(two_handed_rig(), frames)
    np.testing.assert_array_equal(found[:, 0], left)
    there = np.isfinite(found[:, 1])
    np.testing.assert_array_equal(found[there, 1], right[there])
    assert there.sum() == 34


@pytest.mark.parametrize(("apart", "side", "taken"), [(10.0, 0.1, False), (10.0, 0.9, True), (300.0, 0.1, True)])
def test_what_lies_on_another_hand_and_looks_like_that_is_not_the_hand_behind_it(apart, side, taken) -> None:
    """The networks find the left hand twice: in its own region, and in that of the right hand behind it."""
    whole = [hand(100.0, 0.02), hand(100.0 + apart, 0.98)]
    frames = [whole] * 20 + [[whole[0], hand(100.0 + apart, side)]] * 2 + [whole] * 5
    found = followed(two_handed_rig(), frames)
    assert np.isfinite(found[20:22, 0]).all() == taken and np.isfinite(found[20:22, 0]).any() == taken
    np.testing.assert_array_equal(np.delete(found, [20, 21], axis=0), np.full((25, 2), [100.0 + apart, 100.0]))
    assert (found[:, 1] == 100.0).all()


def test_of_two_hands_of_the_rigs_side_the_one_that_was_there_stays() -> None:
    rig = msgspec.structs.replace(landmark_rig(), markers=LANDMARKS21)
    frames = [[hand(100.0, 0.9)]] * 5 + [[hand(400.0, 0.95), hand(100.0, 0.9)]] * 30
    assert (followed(rig, frames) == 100.0).all()


def test_a_hand_that_comes_elsewhere_is_another_one() -> None:
    rig = msgspec.structs.replace(landmark_rig(), markers=LANDMARKS21)
    found = followed(rig, [[hand(100.0, 0.95)]] * 20 + [[hand(400.0, 0.1)]] * 20)
    assert (found[:20] == 100.0).all() and np.isnan(found[20:]).all(), "a left one"
