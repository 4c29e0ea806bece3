"""Live nodes over real sockets: start, clocks of their own, restarts, silence, faults, other masters."""

import socket
import time
from collections.abc import Iterator

import msgspec
import numpy as np
import pytest
from patience import eventually, settled
from synthetic_node import SyntheticNode, hand_markers, synthetic_rig

from rhot_app.project import Rig
from rhot_app.sources.links import UdpNodes, new_session
from rhot_app.sources.node_link import SILENT_NS
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.clock import NodeClock
from rhot_node.wire.codec import encode
from rhot_node.wire.messages import NodeState, Start, StartEntry

SILENCE_NOTICED_S, JOINED_S = 1e-9 * SILENT_NS + 0.2, 2.0
CLOCKS = (NodeClock(7 * 3600 * 10**9, 40.0, 0), NodeClock(-(10**13), -40.0, 0))


@pytest.fixture
def rig() -> Rig:
    return synthetic_rig()


@pytest.fixture
def source(rig: Rig) -> Iterator[UdpNodes]:
    source = UdpNodes(rig)
    yield source
    source.close()


@pytest.fixture
def nodes(rig: Rig) -> Iterator[list[SyntheticNode]]:
    nodes = [SyntheticNode(rig, camera, rate_hz=100.0, clock=CLOCKS[camera]) for camera in (0, 1)]
    for node in nodes:
        node.start()
    yield nodes
    for node in nodes:
        node.close()


def ready(source: UdpNodes) -> bool:
    return all(link.state is not None and link.clock.offset_s is not None for link in source.links)


def test_frames_of_both_cameras_in_master_time(rig: Rig, source: UdpNodes, nodes: list[SyntheticNode]) -> None:
    frames: list[CameraObservations] = []
    source.deliver_to(frames.extend)
    eventually(lambda: ready(source))
    source.start(new_session())
    eventually(lambda: min(link.door.accepted for link in source.links) > 40)
    source.stop()
    assert {frame.camera for frame in frames} == {0, 1}
    # A busy machine delivers late, never early; the quickest frame shows the true age.
    ages_ns = [frame.t_receive_ns - frame.t_row0_master_ns for frame in frames]
    bound_ns = 1e9 * max(frame.clock_bound_s for frame in frames)
    assert abs(min(ages_ns) - 6_000_000) < 3_000_000 + bound_ns
    # What a busy machine sends too late is refused by name; nothing else is missing.
    assert all(link.door.sequence.lost <= sum(link.door.dropped.values()) for link in source.links)
    assert np.isfinite(hand_markers(rig)).all()
    eventually(lambda: all(node.state is NodeState.READY for node in nodes))


@pytest.mark.parametrize("address", ["a" * 70, "nobody.invalid", "a..b"])
def test_an_address_that_is_not_found_is_named_and_found_as_soon_as_it_can_be(
        rig: Rig, nodes: list[SyntheticNode], address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rhot_app.sources.links._RESOLVE_S", 0.02)
    known: dict[str, str] = {}
    real = socket.gethostbyname
    monkeypatch.setattr(socket, "gethostbyname", lambda name: known.get(name) or real(name))
    left = msgspec.structs.replace(rig.nodes[0], address=address)
    source = UdpNodes(msgspec.structs.replace(rig, nodes=(left, rig.nodes[1])))
    try:
        eventually(lambda: source.links[0].address_problem and ready_one(source, 1))
        assert address in source.links[0].address_problem and not source.links[1].address_problem
        known[address] = "127.0.0.1"
        eventually(lambda: ready_one(source, 0))
        assert not source.links[0].address_problem
    finally:
        source.close()


def ready_one(source: UdpNodes, camera: int) -> bool:
    link = source.links[camera]
    return link.state is not None and link.clock.offset_s is not None


def test_restarted_node_streams_again_within_two_seconds(rig: Rig, source: UdpNodes,
                                                         nodes: list[SyntheticNode]) -> None:
    eventually(lambda: ready(source))
    source.start(new_session())
    link = source.links[1]
    noticed_s, joined_s = [], []
    for boot_id in range(2, 7):  # the quickest of a few counts: the machine has other things to do
        eventually(lambda: link.door.accepted > 10)
        nodes[1].close()
        noticed_s.append(eventually(lambda: link.silent(time.monotonic_ns())))
        accepted, changes = link.door.accepted, source.changes
        nodes[1] = SyntheticNode(rig, 1, clock=NodeClock(123456, 10.0, 0), boot_id=boot_id)
        nodes[1].start()
        joined_s.append(eventually(lambda accepted=accepted: link.door.accepted > accepted + 5))
        assert source.changes > changes  # the tracker must forget
        if noticed_s[-1] < SILENCE_NOTICED_S and joined_s[-1] < JOINED_S:
            break
    assert min(noticed_s) < SILENCE_NOTICED_S and min(joined_s) < JOINED_S


def test_node_that_lost_its_start_gets_another(source: UdpNodes, nodes: list[SyntheticNode]) -> None:
    source.start(new_session())  # before anybody has answered
    eventually(lambda: all(link.door.accepted > 5 for link in source.links))
    assert all(node.state is NodeState.STREAMING for node in nodes)


def test_other_masters_session_is_left_alone(rig: Rig, source: UdpNodes, nodes: list[SyntheticNode]) -> None:
    eventually(lambda: ready(source))
    source.start(new_session())
    eventually(lambda: all(link.session == link.wanted for link in source.links))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(encode(Start(99, 1, (StartEntry(1, 9, 0),))), ("127.0.0.1", rig.nodes[0].udp_port))
        eventually(lambda: source.links[0].streams_elsewhere)
        assert settled(lambda: nodes[0].session == 99, 0.6)
        source.start(new_session())
        eventually(lambda: not source.links[0].streams_elsewhere and nodes[0].session != 99)


def test_fault_is_seen(rig: Rig, source: UdpNodes) -> None:
    node = SyntheticNode(rig, 0, state=NodeState.FAULT)
    node.start()
    eventually(lambda: source.links[0].state is NodeState.FAULT)
    assert not source.links[0].silent(time.monotonic_ns())
    node.close()


def test_text_node_needs_no_start_message(rig: Rig) -> None:
    text = msgspec.structs.replace(rig.nodes[0], text_datagrams=True)
    source = UdpNodes(msgspec.structs.replace(rig, nodes=(text, rig.nodes[1])))
    frames: list[CameraObservations] = []
    source.deliver_to(frames.extend)
    source.start(new_session())
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as typed:
        typed.sendto(b"1,2;3,4;5,6;7,8;9,10;11,12\n", ("127.0.0.1", source.receivers[0].port))
    eventually(lambda: len(frames) == 1)
    assert frames[0].camera == 0
    assert frames[0].pixels[5].tolist() == [11.0, 12.0]
    source.close()
