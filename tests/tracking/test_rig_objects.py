"""Objects with colour markers beside the hand: both trackers, the hand's own markers, contacts, refusals, a check."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import count
from logging import LogRecord
from pathlib import Path

import msgspec
import numpy as np
import pytest
from shipped_rig import TWO_PIS

from rhot_app.calibration.check.camera_calibration import CalibrationAccuracy
from rhot_app.calibration.check.checks import check_rig
from rhot_app.engine.pipeline import warm_up
from rhot_app.errors import RigError
from rhot_app.estimation.se3 import exp_so3, log_so3
from rhot_app.geometry.camera import CameraModel
from rhot_app.geometry.transforms import rigid
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model, neutral_pose
from rhot_app.objects.object_file import ObjectMarker, ObjectModel, SphereShape, plate, save_object
from rhot_app.objects.state import Validity
from rhot_app.outputs.joints import JointConverter, json_message
from rhot_app.outputs.osc import object_messages
from rhot_app.project import Rig, with_object, with_tracker
from rhot_app.state import Condition, HandState, Knowledge
from rhot_app.tracking.extrapolation import Extrapolator
from rhot_app.tracking.markers.estimator import Estimator
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraObservations

PALM = np.array([[0.0, 1.0, 0.0, 0.04], [-1.0, 0.0, 0.0, 0.07], [0.0, 0.0, 1.0, 0.6], [0.0, 0.0, 0.0, 1.0]])
OBJECT = rigid(exp_so3([0.2, 0.1, 0.0]), [-0.1, 0.0, 0.55])
PLACES_MM = ((30.0, 0.0, 0.0), (0.0, 40.0, 0.0), (0.0, 0.0, -30.0))
BALL = ObjectModel("ball", markers=tuple(ObjectMarker(f"ball{k}", place) for k, place in enumerate(PLACES_MM)),
                   shape=SphereShape(80.0))
PERIOD_NS = 25_000_000


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    own = TWO_PIS.markers.markers
    extra = tuple(msgspec.structs.replace(own[0], id=f"ball{k}", role=None, shape="blob")
                  for k in range(3))
    mixed = (*own[:2], extra[0], *own[2:], *extra[1:])  # not at the end
    save_object(tmp_path / "ball.json", BALL)
    markers = msgspec.structs.replace(TWO_PIS.markers, markers=mixed)
    return with_object(msgspec.structs.replace(TWO_PIS, markers=markers), tmp_path / "ball.json")


def frames(rig: Rig, count: int) -> list[CameraObservations]:
    points = forward(build_model(rig.hand), neutral_pose(PALM))
    hand = iter(np.vstack([points.marker_centres, points.joints[:1]]))
    ball = iter(1e-3 * np.array(PLACES_MM) @ OBJECT[:3, :3].T + OBJECT[:3, 3])
    world = np.array([next(ball) if marker.role is None else next(hand) for marker in rig.markers.markers])
    found, size = [], len(world)
    for number in range(count):
        for camera, node in enumerate(rig.nodes):
            t_ns = 10**9 + number * PERIOD_NS
            pixels = CameraModel.from_rig(node.intrinsics, node.pose).project(world)
            found.append(CameraObservations(
                camera, t_ns, 0, 1e-5, t_ns + 5_000_000, 1e-3, 1e-3, pixels, np.tile(0.01 * np.eye(2), (size, 1, 1)),
                np.full(size, 16.0), np.ones(size), np.zeros(size, np.uint16)))
    return found


def published(rig: Rig, error: CalibrationAccuracy | None = None) -> tuple[HandState, HandState]:
    """The last state as the tracker has it, and as it is published."""
    tracker, state = make_tracker(rig), None
    tracker.by_calibration = error or tracker.by_calibration
    for frame in frames(rig, 30):
        tracker.ingest(frame)
        state = tracker.solve() or state
    assert state is not None
    return state, tracker.published(state)


def depth_sd_m(state: HandState) -> float:
    return float(np.sqrt(state.objects[0].covariance[2, 2]))


def test_an_object_of_markers_has_the_calibrations_error_once(rig: Rig) -> None:
    own, shown = published(rig, CalibrationAccuracy(5e-3, 0.6, np.array([one.pose.translation_m for one in rig.nodes])))
    assert depth_sd_m(shown) == pytest.approx(np.hypot(depth_sd_m(own), 5e-3 * (0.55 / 0.6) ** 2), rel=0.1)


def test_turns_of_the_hands_estimate_are_not_added_to_an_object_that_has_its_own(rig: Rig) -> None:
    own, shown = published(msgspec.structs.replace(with_tracker(rig, "estimator"), calibration=None))
    assert depth_sd_m(shown) == depth_sd_m(own)
    assert shown.fingertip_covariances[1, 2, 2] > own.fingertip_covariances[1, 2, 2]


def last_state(rig: Rig, count: int = 30) -> HandState:
    tracker, state = make_tracker(rig), None
    warm_up(tracker, rig)
    for frame in frames(rig, count):
        tracker.ingest(frame)
        state = tracker.solve() or state
    assert state is not None
    return state


@pytest.mark.parametrize("kind", ["classic", "estimator"])
def test_an_object_of_markers_is_tracked_beside_the_hand(rig: Rig, kind: str) -> None:
    state = last_state(with_tracker(rig, kind))  # type: ignore[arg-type]
    assert state.condition is Condition.TRACKING
    assert state.marker_ids == rig.markers.ids and state.marker_positions.shape == (len(rig.markers.ids), 3)
    assert state.camera_pixels.shape == (2, len(rig.markers.ids), 2)
    one = state.objects[0]
    assert (one.name, one.validity, one.t_master_ns) == ("ball", Validity.TRACKED, state.t_master_ns)
    assert np.linalg.norm(one.world_from_object[:3, 3] - OBJECT[:3, 3]) < 1e-3
    assert np.linalg.norm(log_so3(one.world_from_object[:3, :3] @ OBJECT[:3, :3].T)) < np.radians(1.0)
    ball = rig.markers.ids.index("ball1")
    assert state.marker_knowledge[ball] < Knowledge.UNKNOWN
    expected = OBJECT[:3, :3] @ (1e-3 * np.array(PLACES_MM[1])) + OBJECT[:3, 3]
    assert np.linalg.norm(state.marker_positions[ball] - expected) < 2e-3
    assert np.isfinite(one.distances).all() and not one.contacts.any() and (one.distances > 0.0).all()
    assert np.isfinite(one.distance_sd).all() == (kind == "estimator")


@pytest.mark.parametrize("smoothed", [False, True])
def test_objects_are_there_without_a_hand_that_is_failed_over(rig: Rig, smoothed: bool,
                                                              monkeypatch: pytest.MonkeyPatch,
                                                              tracker_may_fail: list[LogRecord]) -> None:
    rig = with_tracker(rig, "estimator")
    seen, solve, calls = frames(rig, 40), Estimator.solve, count()

    def fail(estimator: Estimator) -> HandState | None:
        state = solve(estimator)
        if next(calls) in range(30, 33):
            raise FloatingPointError("overflow")
        return state
    monkeypatch.setattr(Estimator, "solve", fail)
    tracker, states = make_tracker(rig, smooth=smoothed), list[HandState]()
    for frame in seen:
        tracker.ingest(frame)
        states += tracker.states()
    states += tracker.finish()
    assert [state.sequence for state in states] == list(range(len(states)))
    lost = [state for state in states[20:] if state.condition is Condition.LOST]
    assert len(lost) == (0 if smoothed else 3) and len(states) == len(seen)
    assert all(state.objects[0].validity is Validity.TRACKED for state in states[20:])
    assert all(state.marker_ids == rig.markers.ids for state in states)
    fault, = tracker.diagnostics.all()
    assert fault.count == 3 and "overflow" in fault.sentence and len(tracker_may_fail) == 1


def test_the_window_and_the_outputs_get_objects_too(rig: Rig) -> None:
    rig = with_tracker(rig, "estimator")
    state = last_state(rig)
    moved = replace(state, objects=(replace(state.objects[0], velocity=np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])),))
    later = Extrapolator(rig).at(moved, state.t_master_ns + 10_000_000)
    assert later is not None
    step = later.objects[0].world_from_object[:3, 3] - state.objects[0].world_from_object[:3, 3]
    np.testing.assert_allclose(step, [0.01, 0.0, 0.0], atol=1e-6)
    assert later.objects[0].covariance[0, 0] > state.objects[0].covariance[0, 0]
    sample = JointConverter(rig).sample(state, "own")
    document = json.loads(json_message(sample))["objects"][0]
    assert document["name"] == "ball" and document["validity"] == "tracked"
    np.testing.assert_allclose(document["position"], OBJECT[:3, 3], atol=1e-3)
    addresses = [message.split(b"\0")[0].decode() for message in object_messages(sample)]
    assert addresses == ["/rhot/object/ball/validity", "/rhot/object/ball/pose", "/rhot/object/ball/fingertips"]


def test_rigs_and_objects_that_do_not_go_together_are_refused(rig: Rig, tmp_path: Path) -> None:
    with pytest.raises(RigError, match=r"as is that of|cannot be told apart"):
        with_object(rig, tmp_path / "ball.json")
    with pytest.raises(RigError, match="cannot be told apart"):
        with_object(rig, tmp_path / "ball.json", name="another")
    save_object(tmp_path / "odd.json", msgspec.structs.replace(BALL, name="odd", markers=tuple(
        ObjectMarker(name, place) for name, place in zip(("index", "no", "wrist"), PLACES_MM, strict=True))))
    with pytest.raises(RigError, match=r"has the role 'index_tip' on the hand"):
        with_object(rig, tmp_path / "odd.json")


def test_a_tag_that_is_too_small_for_the_cameras_is_found_by_the_check(rig: Rig, tmp_path: Path) -> None:
    assert "small_tag" not in check_rig(rig).verdict.codes
    save_object(tmp_path / "small.json", plate("small", 1, 1, 10.0, 0.0, "DICT_4X4_50"))
    report = check_rig(with_object(rig, tmp_path / "small.json"))
    sentence = next(found.sentence for found in report.verdict.findings if found.code == "small_tag")
    assert "10 mm wide" in sentence and "small.json" in sentence
