"""The receiving socket: kernel times, bursts, ports in use."""

import socket
import time

import pytest
from patience import quickest
from streaming_node import Records
from synthetic_node import synthetic_rig

from rhot_app.errors import SourceError
from rhot_app.recording.raw_log import RecordKind
from rhot_app.sources.clock import NodeClockModel
from rhot_app.sources.node_link import NodeLink
from rhot_app.sources.receiver import (
    FRESH_NS,
    NEWEST,
    RECEIVE_BUFFER,
    DatagramSink,
    NodeReceiver,
    granted_buffer,
    open_data_socket,
)
from rhot_app.sources.validation import DatagramValidator
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.clock import ANCILLARY_SIZE, KernelTime, ask_for_times
from rhot_node.wire.codec import encode
from rhot_node.wire.messages import MarkerObservation, Observations

SESSION = 3


@pytest.fixture(scope="module", autouse=True)
def stamping():
    """A kernel stamps datagrams from some time after the first socket has asked for it: have it do so all the time."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("127.0.0.1", 0))
        ask_for_times(sock)
        kernel_time = KernelTime()
        for _ in range(200):
            sock.sendto(b"?", sock.getsockname())
            sent_ns = time.monotonic_ns()
            time.sleep(0.01)
            _, ancillary, _, _ = sock.recvmsg(16, ANCILLARY_SIZE)
            if kernel_time.receive_time_ns(ancillary)[0] < sent_ns + 5_000_000:
                break
        yield


def make_receiver() -> tuple[NodeReceiver, list[CameraObservations], socket.socket]:
    rig = synthetic_rig()
    clock = NodeClockModel()
    now = time.monotonic_ns()
    for k in range(4):
        t = now - (4 - k) * 10**8
        clock.add(t, t + 20_000_000, t + 20_000_000, t + 40_000_000, 1)  # a wide bound: this machine may be busy
    door = DatagramValidator(rig, 0, clock)
    door.expect_session(SESSION)
    frames: list[CameraObservations] = []
    receiver = NodeReceiver(open_data_socket(0, "left"), door, "left")
    receiver.deliver = frames.extend
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.connect(("127.0.0.1", receiver.port))
    return receiver, frames, sender


def datagram(sequence: int, checksum: int) -> bytes:
    now = time.monotonic_ns()
    markers = tuple(MarkerObservation(k, 5.0 + k, 6.0, 10.0, 0.1, 0.0, 0.1, 1.0) for k in range(6))
    return encode(Observations(1, SESSION, sequence, now - 10**7, now, 10**6, 10**6, 10**4, 640, 480, sequence,
                               checksum, markers))


def test_receive_time_is_the_kernels() -> None:
    receiver, frames, sender = make_receiver()
    sent = time.monotonic_ns()
    sender.send(datagram(0, synthetic_rig().markers.checksum))
    arrived = time.monotonic_ns()
    time.sleep(0.05)  # the program is late; the time must not be
    assert receiver.step() == 1
    (frame,) = frames
    assert sent - 200_000 <= frame.t_receive_ns <= arrived + 200_000
    receiver.close()


def test_a_burst_is_counted_whole_and_only_its_newest_tracked() -> None:
    receiver, frames, sender = make_receiver()
    checksum = synthetic_rig().markers.checksum
    records = Records()
    link = NodeLink(synthetic_rig(), 0)
    link.door = receiver.door
    receiver.sink = DatagramSink(records, link)
    for k in range(100):
        sender.send(datagram(k, checksum))
    sender.send(b"junk")
    time.sleep(1e-9 * FRESH_NS)  # the program is late
    assert receiver.step() == 101
    assert (receiver.door.received, receiver.door.accepted, receiver.door.sequence.lost) == (101, 100, 0)
    assert receiver.door.dropped == {"length": 1}
    assert len(frames) == NEWEST
    assert receiver.skipped == 100 - NEWEST
    assert len(records.of(RecordKind.DATAGRAM)) == 100
    assert records.of(RecordKind.REFUSED) == [b'{"length":1}']
    receiver.close()


def test_a_flood_waits_in_the_buffer_and_nothing_is_lost() -> None:
    receiver, frames, sender = make_receiver()
    if receiver.buffer_bytes < RECEIVE_BUFFER:
        pytest.skip(f"the system grants {receiver.buffer_bytes} bytes of receive buffer only")
    checksum = synthetic_rig().markers.checksum
    for k in range(4000):  # nobody reads meanwhile
        sender.send(datagram(k, checksum))
    while receiver.door.received < 4000:
        receiver.step()
    assert NEWEST <= len(frames) < 400
    # A sender that is interrupted between reading the clock and sending looks late; that is told, and nothing is lost.
    late = receiver.door.dropped.get("time", 0) + receiver.door.dropped.get("clock_in_doubt", 0)
    assert late < 400
    assert (receiver.door.accepted, receiver.overflowed) == (4000 - late, 0)
    assert receiver.door.sequence.lost <= late  # none of them, if they were the first or the last
    receiver.close()


def test_a_silent_socket_returns_soon_and_the_thread_ends() -> None:
    receiver, _, _ = make_receiver()
    assert quickest(lambda: receiver.step() == 0 or pytest.fail("something came"), 1.0) < 1.0
    receiver.start()
    receiver.close()
    receiver.close()


def test_port_in_use_names_node_and_remedy() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("", 0))
        port = taken.getsockname()[1]
        with pytest.raises(SourceError, match=f"node left.*{port}.*data_port"):
            open_data_socket(port, "left")


def test_buffer_is_asked_for() -> None:
    with open_data_socket(0, "left") as sock:
        assert granted_buffer(sock) >= 100_000


def test_a_datagram_on_time_is_handed_on_before_the_next_is_read() -> None:
    receiver, frames, sender = make_receiver()
    checksum = synthetic_rig().markers.checksum
    at_once = 0
    for k in range(0, 40, 2):
        for sequence in (k, k + 1):
            sender.send(datagram(sequence, checksum))
        before = len(frames)
        at_once += receiver.step() == 1 and len(frames) == before + 1  # a machine in a hurry may be late sometimes
        while len(frames) < k + 2:
            receiver.step()
    assert at_once > 5
    assert len(frames) == 40
    receiver.close()
