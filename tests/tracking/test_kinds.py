"""A kind of observations that the product does not have, added by one class: a fiducial tag on the hand's wrist."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from modelled_hand import model_rig, moving, observations_of
from synthetic_rig import EPOCH_NS, LOST

from rhot_app.diagnostics import diagnostics_of
from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.residual import Residual, Rows, student
from rhot_app.estimation.se3 import retract
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.motion.hand_state import TANGENT, tangent_size
from rhot_app.objects.observations import FiducialFrame
from rhot_app.project import Rig, TrackerSettings
from rhot_app.sources.clock import NodeClockModel
from rhot_app.sources.validation import DatagramValidator
from rhot_app.state import HandState
from rhot_app.tracking.kinds import registry
from rhot_app.tracking.kinds.kind import FrameTimes, Kind
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import HandFrame
from rhot_node.wire.codec import encode
from rhot_node.wire.messages import Fiducial, Fiducials

PLACE = np.array([0.05, 0.0, 0.01])
WRIST_TAG, NOISE_PX, SESSION, BLIND_NS = 42, 0.5, 7, EPOCH_NS + 600_000_000


# -- the plug-in -------------------------------------------------------------------------------------------------------

class WristTagResidual:
    """The centre of a tag at PLACE on the hand is seen at a pixel (2,)."""

    def __init__(self, camera: CameraModel, pixel: np.ndarray) -> None:
        self.camera, self.pixel = camera, pixel

    def linearise(self, state: np.ndarray) -> Rows:
        jacobian, steps = np.zeros((2, tangent_size(state))), 1e-5 * np.eye(tangent_size(state))
        for column in range(TANGENT.palm.stop):
            jacobian[:, column] = (seen(self.camera, pose_matrix(retract(state, steps[column])))
                                   - seen(self.camera, pose_matrix(retract(state, -steps[column])))) / 2e-5
        return Rows(self.pixel - seen(self.camera, pose_matrix(state)), jacobian, np.full(2, NOISE_PX**2), student(4.0))


def seen(camera: CameraModel, world_from_palm: np.ndarray) -> np.ndarray:
    return np.asarray(camera.project(world_from_palm[:3, :3] @ PLACE + world_from_palm[:3, 3])).ravel()


class WristTagFrame(HandFrame):
    def __init__(self, camera: int, t_ns: int, model: CameraModel, pixel: np.ndarray) -> None:
        super().__init__(camera, t_ns)
        self.model, self.pixel = model, pixel

    def residuals(self, state: np.ndarray) -> Sequence[Residual]:
        return [WristTagResidual(self.model, self.pixel)]


class WristTagKind(Kind):
    name, messages = "wrist tags", (Fiducials,)

    def configure(self, rig: Rig, camera: int) -> None:
        super().configure(rig, camera)
        self.model = CameraModel.from_rig(rig.nodes[camera].intrinsics, rig.nodes[camera].pose)

    def accepts(self, message: Any) -> bool:
        return any(one.number == WRIST_TAG for one in message.fiducials)

    def observe(self, collected: Any, times: FrameTimes) -> HandFrame:
        tag = next(one for one in collected.fiducials if one.number == WRIST_TAG)
        return WristTagFrame(self.camera, times.t_row0_ns, self.model, np.reshape(tag.corners, (4, 2)).mean(axis=0))


# -- what it does ------------------------------------------------------------------------------------------------------

@pytest.fixture
def registered() -> Iterator[None]:
    registry.register(WristTagKind)
    yield
    registry.KINDS.remove(WristTagKind)


def clock() -> NodeClockModel:
    """Of a node whose clock is the master's."""
    model = NodeClockModel()
    for k in range(5):
        t_ns = EPOCH_NS + (k - 5) * 10**8
        model.add(t_ns, t_ns + 10_000, t_ns + 10_000, t_ns + 20_000, 1)
    return model


def datagram(rig: Rig, number: int, t_ns: int, pixel: np.ndarray, tag: int = WRIST_TAG) -> bytes:
    node = rig.nodes[1]
    corners = (pixel + 4.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])).ravel()
    return encode(Fiducials(node.node_id, SESSION, number, t_ns, t_ns + 10**6, 10**6, 10**6, 0, node.intrinsics.width,
                            node.intrinsics.height, number,
                            (Fiducial(16, tag, tuple(map(float, corners)), (1.0, 0.0, 1.0) * 4),)))


def states_of(rig: Rig, tags: bool, smooth: bool = False) -> list[HandState]:
    """The hand before two cameras, of which the second one sees no marker since BLIND_NS; with its `tags`, the
    wrist's tag."""
    truth, tracker, found = moving("grasp", 2.0), make_tracker(rig, smooth=smooth), list[HandState]()
    model = CameraModel.from_rig(rig.nodes[1].intrinsics, rig.nodes[1].pose)
    door = DatagramValidator(rig, 1, clock())
    door.expect_session(SESSION)
    exact = {state.t_master_ns: state for state in _undisturbed(rig)}
    for number, frame in enumerate(observations_of(rig, truth, 1.0)):
        if frame.camera == 1 and frame.t_row0_master_ns > BLIND_NS:
            state = exact.get(frame.t_row0_master_ns)
            frame = replace(frame, pixels=np.full_like(frame.pixels, np.nan), flags=np.full_like(frame.flags, LOST))
            if tags and state is not None:
                t_ns = frame.t_row0_master_ns
                observed = door.admit(datagram(rig, number, t_ns, seen(model, state.world_from_palm)),
                                      t_ns + 2 * 10**6)
                assert isinstance(observed, HandFrame), door.dropped
                tracker.ingest(observed)
        tracker.ingest(frame)
        found += tracker.states()
    return [*found, *tracker.finish()]


def _undisturbed(rig: Rig) -> list[HandState]:
    tracker, found = make_tracker(rig), []
    for frame in observations_of(rig, moving("grasp", 2.0), 1.0):
        tracker.ingest(frame)
        if (state := tracker.solve()) is not None:
            found.append(replace(state, t_master_ns=frame.t_row0_master_ns))
    return found


def test_a_kind_is_added_by_one_class(registered: None) -> None:
    rig = model_rig()
    without, with_tags, truth = states_of(rig, False)[-1], states_of(rig, True)[-1], _undisturbed(rig)[-1]
    off = [np.linalg.norm(one.world_from_palm[:3, 3] - truth.world_from_palm[:3, 3]) for one in (without, with_tags)]
    sd = [np.sqrt(np.trace(one.palm_covariance[:3, :3])) for one in (without, with_tags)]
    assert sd[1] < 0.7 * sd[0] and off[1] < max(off[0], 2e-3)


def test_recordings_are_smoothed_with_it(registered: None) -> None:
    rig, sd = model_rig(), []
    for tags in (False, True):
        blind = [state for state in states_of(rig, tags, smooth=True) if state.t_master_ns > BLIND_NS + 10**8]
        sd.append(np.mean([np.sqrt(np.trace(state.palm_covariance[:3, :3])) for state in blind]))
    assert sd[1] < 0.8 * sd[0]


def test_what_contradicts_the_hand_is_outside_the_gate() -> None:
    rig = model_rig()
    model, found = CameraModel.from_rig(rig.nodes[1].intrinsics, rig.nodes[1].pose), []
    for wrong_px in (None, 60.0):
        tracker, states = make_tracker(rig), list[HandState]()
        for frame in observations_of(rig, moving("grasp", 2.0), 1.0):
            if wrong_px is not None and states and states[-1].tracked:
                tracker.ingest(WristTagFrame(1, states[-1].t_master_ns, model,
                                             seen(model, states[-1].world_from_palm) + wrong_px))
            tracker.ingest(frame)
            states += tracker.states()
        found.append(states[-1].joint_positions)
    np.testing.assert_allclose(found[0], found[1], atol=1e-9)


def test_the_classic_tracker_says_that_it_does_not_use_it() -> None:
    rig = model_rig()
    tracker = make_tracker(msgspec.structs.replace(rig, tracker=TrackerSettings()))
    tracker.ingest(WristTagFrame(1, EPOCH_NS, CameraModel.from_rig(rig.nodes[1].intrinsics, rig.nodes[1].pose),
                                 np.zeros(2)))
    warning, = diagnostics_of(tracker).all()
    assert warning.level == "warning" and "estimator" in warning.sentence


def test_it_takes_only_what_is_its_own(registered: None) -> None:
    rig = model_rig()
    door = DatagramValidator(rig, 1, clock())
    door.expect_session(SESSION)
    frame = door.admit(datagram(rig, 0, EPOCH_NS, np.array([300.0, 200.0]), tag=3), EPOCH_NS + 2 * 10**6)
    assert isinstance(frame, FiducialFrame) and door.frames == {"tags": 1}
    door.admit(datagram(rig, 1, EPOCH_NS + 10**7, np.array([300.0, 200.0])), EPOCH_NS + 12 * 10**6)
    assert door.frames == {"tags": 1, "wrist tags": 1}


def test_without_it_all_is_as_before() -> None:
    assert WristTagKind not in registry.KINDS


class BrokenKind(WristTagKind):
    """A plug-in with a fault in one place."""

    def collect(self, message: Any, times: FrameTimes) -> Any:
        if message.sequence == 1:
            raise KeyError("collect")
        return super().collect(message, times)

    def observe(self, collected: Any, times: FrameTimes) -> HandFrame:
        if collected.sequence == 2:
            raise ZeroDivisionError("observe")
        return super().observe(collected, times)


def test_a_fault_in_a_kind_costs_its_datagrams_only(caplog: pytest.LogCaptureFixture) -> None:
    registry.register(BrokenKind)
    try:
        rig = model_rig()
        door = DatagramValidator(rig, 1, clock())
        door.expect_session(SESSION)
        frames = [door.admit(datagram(rig, number, EPOCH_NS, np.array([300.0, 200.0])), EPOCH_NS + 2 * 10**6)
                  for number in (1, 2, 3)]
    finally:
        registry.KINDS.remove(BrokenKind)
    assert frames[:2] == [None, None] and isinstance(frames[2], HandFrame)
    assert door.dropped == {"failed": 2} and door.frames.total() == 1 and door.received == 3
    assert [record.exc_info[0] for record in caplog.records if record.exc_info] == [KeyError]


def test_a_kind_without_a_name_is_refused() -> None:
    class Nameless(Kind):
        messages = (Fiducials,)

    with pytest.raises(TypeError, match="name"):
        registry.register(Nameless)
    assert Nameless not in registry.KINDS
