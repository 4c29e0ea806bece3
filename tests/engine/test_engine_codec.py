"""What the engine publishes comes back as it was sent."""

import dataclasses
import time

import numpy as np
import pytest
from patience import quickest

from rhot_app.engine import status
from rhot_app.engine.status import Advice, EngineStatus, LatencySummary, NodeStatus, Preview
from rhot_app.errors import EngineError
from rhot_app.state import LATENCY_STAGES, UNESTIMATED, Condition, HandState, Knowledge


def make_state(markers: int = 6, cameras: int = 2) -> HandState:
    rng = np.random.default_rng(1)
    pixels = rng.normal(size=(cameras, markers, 2))
    pixels[0, 0] = np.nan
    return HandState(
        sequence=7, t_master_ns=123456789012, t_receive_ns=123456999999, condition=Condition.PARTIAL,
        marker_ids=tuple(f"m{k}" for k in range(markers)), marker_positions=rng.normal(size=(markers, 3)),
        marker_raw_positions=rng.normal(size=(markers, 3)), marker_covariances=rng.normal(size=(markers, 3, 3)),
        marker_knowledge=np.full(markers, Knowledge.INFERRED, np.uint8),
        camera_names=tuple(f"camera {k}" for k in range(cameras)), camera_pixels=pixels,
        camera_flags=np.ones((cameras, markers), np.uint16), joint_positions=rng.normal(size=(21, 3)),
        joint_knowledge=np.zeros(21, np.uint8), fingertip_positions=rng.normal(size=(5, 3)),
        angles=rng.normal(size=21), angle_knowledge=np.zeros(21, np.uint8), world_from_palm=np.eye(4)[::-1],
        palm_knowledge=Knowledge.GUESSED, epipolar_error_px=np.zeros(markers),
        **UNESTIMATED | {"hand_scale_sd": 0.1},
        latency_s=dict.fromkeys(LATENCY_STAGES, 1e-4))


def assert_same(got: HandState, sent: HandState) -> None:
    for field in dataclasses.fields(HandState):
        a, b = getattr(got, field.name), getattr(sent, field.name)
        if isinstance(b, np.ndarray):
            assert a.dtype == b.dtype, field.name
            np.testing.assert_array_equal(a, b, err_msg=field.name)
        else:
            assert a == b and type(a) is type(b), field.name


@pytest.mark.parametrize(("markers", "cameras"), [(6, 2), (1, 1), (64, 16)])
def test_state_round_trip(markers: int, cameras: int) -> None:
    state = make_state(markers, cameras)
    back = status.decode(status.TOPIC_STATE, status.encode(state))
    assert isinstance(back, HandState)
    assert_same(back, state)


def test_state_encodes_fast() -> None:
    state = make_state()
    assert quickest(lambda: status.encode(state), 120e-6, 300, time.process_time) < 120e-6


def test_status_and_preview_round_trip() -> None:
    node = NodeStatus(1, "left", "streaming", False, 120.0, 10, 1, {"magic": 2}, 1.5, 1e-4, 2e-4)
    sent = EngineStatus(1, 2, 3, True, "TRACKING", "rig", "/rig.json", 118.0, (node,), (Advice("info", "ok"),),
                        {"solve": LatencySummary(1e-4, 2e-4)})
    assert status.decode(status.TOPIC_STATUS, status.encode(sent)) == sent
    preview = Preview("left", 5, 640, 480, b"\xff\xd8", 7, np.array([[1.5, np.nan]]), np.array([1], np.uint16))
    came = status.decode(status.TOPIC_PREVIEW, status.encode(preview))
    assert isinstance(came, Preview)
    for name in ("camera", "t_master_ns", "width", "height", "jpeg", "t_node_ns", "pixels", "flags"):
        np.testing.assert_array_equal(getattr(came, name), getattr(preview, name))


@pytest.mark.parametrize(("topic", "payload"), [
    (b"other", b""), (status.TOPIC_STATE, b""), (status.TOPIC_STATE, b"\x80"), (status.TOPIC_STATUS, b"\xc1"),
    (status.TOPIC_STATE, status.encode(make_state())[:-5]),
])
def test_foreign_bytes_are_refused(topic: bytes, payload: bytes) -> None:
    with pytest.raises(EngineError):
        status.decode(topic, payload)
