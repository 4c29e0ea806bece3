"""OSC byte by byte, and as an independent library reads it."""

from __future__ import annotations

import select
import socket
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from patience import PATIENCE_S
from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_message import OscMessage
from pythonosc.parsing.osc_types import IMMEDIATELY
from streams import palm_before_cameras, state_of, unknown

from rhot_app.hand.model import neutral_pose
from rhot_app.hand.skeleton import JOINTS
from rhot_app.outputs.joints import JointConverter
from rhot_app.outputs.openxr import OPENXR_JOINTS
from rhot_app.outputs.osc import DATAGRAM_MAX, OscSink, bundles, osc_message
from rhot_app.outputs.vmc import VmcSink
from rhot_app.project import OutputSettings, Rig


@pytest.fixture
def receiver() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("127.0.0.1", 0))
        sock.settimeout(PATIENCE_S)
        yield sock


def received(sink: OscSink | VmcSink, receiver: socket.socket, sample: object) -> list[OscMessage]:
    """The messages of one state, as python-osc reads them."""
    sink.open()
    sink.write(sample)  # type: ignore[arg-type]
    sink.close()
    messages: list[OscMessage] = []
    receiver.settimeout(0.3)
    try:
        while True:
            datagram = receiver.recv(65536)
            assert len(datagram) <= DATAGRAM_MAX
            messages += list(OscBundle(datagram))
    except TimeoutError:
        return messages


def target(receiver: socket.socket) -> str:
    return f"127.0.0.1:{receiver.getsockname()[1]}"


def test_golden_bytes() -> None:
    assert osc_message("/rhot/right/hand", 7, "LOST", -1.0) == (
        b"/rhot/right/hand\0\0\0\0,isf\0\0\0\0\0\0\0\x07LOST\0\0\0\0\xbf\x80\0\0")
    assert osc_message("/a", 0.5, "abc") == b"/a\0\0,fs\0\x3f\0\0\0abc\0"
    (bundle,) = bundles(iter([osc_message("/a", 1)]))
    assert bundle == b"#bundle\0\0\0\0\0\0\0\0\x01\0\0\0\x0c/a\0\0,i\0\0\0\0\0\x01"
    (timed,) = bundles(iter([osc_message("/a", 1)]), 1_500_000_000)  # 1.5 s after 1970
    assert timed == bundle[:8] + b"\x83\xaa\x7e\x81\x80\0\0\0" + bundle[16:]


@pytest.mark.parametrize(("kind", "joints"), [("osc", "own"), ("vmc", "openxr")])
def test_bundles_have_the_wall_clocks_time_of_the_state(rig: Rig, receiver: socket.socket, kind: str,
                                                        joints: str) -> None:
    sink = {"osc": OscSink, "vmc": VmcSink}[kind](OutputSettings(kind, target(receiver), joints))
    state = state_of(rig, neutral_pose(palm_before_cameras()))
    replayed = replace(state, t_master_ns=1)
    for one in (state, replayed):
        sample = JointConverter(rig).sample(one, joints)
        sink.open()
        sink.write(sample)
        sink.close()
        bundle = OscBundle(receiver.recv(65536))
        if one is replayed:
            assert bundle.timestamp == IMMEDIATELY
        else:
            assert bundle.timestamp == pytest.approx(1e-9 * sample.t_unix_ns, abs=1e-5)
        while select.select([receiver], [], [], 0.02)[0]:
            receiver.recv(65536)


def test_a_hand_is_read_by_another_library(rig: Rig, receiver: socket.socket) -> None:
    state = state_of(rig, neutral_pose(palm_before_cameras()), sequence=41)
    sample = JointConverter(rig).sample(state, "own")
    messages = {message.address: message.params
                for message in received(OscSink(OutputSettings("osc", target(receiver))), receiver, sample)}
    assert len(messages) == 2 + 21
    sequence, condition, age_s = messages["/rhot/right/hand"]
    assert (sequence, condition) == (41, "TRACKING") and 0.0 <= age_s < 5.0
    np.testing.assert_allclose(messages["/rhot/right/palm"][:3], palm_before_cameras()[:3, 3], atol=1e-6)
    for name, place in zip(JOINTS, state.joint_positions, strict=True):
        *position, knowledge = messages[f"/rhot/right/joint/{name}"]
        np.testing.assert_allclose(position, place, atol=1e-6)
        assert knowledge == 0


def test_openxr_joints_have_all_they_need(rig: Rig, receiver: socket.socket) -> None:
    sample = JointConverter(rig).sample(state_of(rig, neutral_pose(palm_before_cameras())), "openxr")
    messages = {message.address: message.params
                for message in received(OscSink(OutputSettings("osc", target(receiver))), receiver, sample)}
    hand = sample.hands[0]
    assert hand.orientations is not None and hand.radii is not None
    for row, name in enumerate(OPENXR_JOINTS):
        values = messages[f"/rhot/right/joint/{name}"]
        np.testing.assert_allclose(values[:3], hand.positions[row], atol=1e-6)
        np.testing.assert_allclose(values[3:7], hand.orientations[row], atol=1e-6)
        assert values[7] == pytest.approx(hand.radii[row]) and len(values) == 9


def test_a_lost_hand_is_said_without_joints(rig: Rig, receiver: socket.socket) -> None:
    sample = JointConverter(rig).sample(unknown(state_of(rig, neutral_pose())), "openxr")
    (message,) = received(OscSink(OutputSettings("osc", target(receiver))), receiver, sample)
    assert message.address == "/rhot/right/hand" and message.params[1] == "LOST"


def test_two_hands_have_two_addresses(two_hands: Rig, receiver: socket.socket) -> None:
    state = state_of(two_hands, neutral_pose())
    sample = JointConverter(two_hands).sample(replace(state, other=state), "own")
    messages = received(OscSink(OutputSettings("osc", target(receiver))), receiver, sample)
    addresses = [message.address for message in messages]
    assert "/rhot/right/joint/index_tip" in addresses and "/rhot/left/joint/index_tip" in addresses


def test_bones_of_an_avatar(rig: Rig, receiver: socket.socket) -> None:
    sample = JointConverter(rig).sample(state_of(rig, neutral_pose(palm_before_cameras())), "openxr")
    messages = received(VmcSink(OutputSettings("vmc", target(receiver), "openxr")), receiver, sample)
    assert [message.address for message in messages[:2]] == ["/VMC/Ext/OK", "/VMC/Ext/T"]
    bones = {message.params[0]: message.params[1:] for message in messages if message.address == "/VMC/Ext/Bone/Pos"}
    assert len(bones) == 16 and "RightHand" in bones and "RightLittleDistal" in bones
    assert all(len(values) == 7 and abs(np.linalg.norm(values[3:]) - 1.0) < 1e-5 for values in bones.values())
    # The rig frame's (x right, y down, z away) in Unity's (x right, y up, z forward).
    np.testing.assert_allclose(bones["RightHand"][:3], (0.04, -0.06, 0.6), atol=1e-6)
    first = np.linalg.norm(bones["RightIndexIntermediate"][:3])
    assert first == pytest.approx(1e-3 * rig.hand.fingers["index"].bones_mm[0], abs=1e-5)
