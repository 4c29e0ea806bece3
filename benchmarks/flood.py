"""A flood of datagrams through a real node receiver: all received, verified and counted?

    python benchmarks/flood.py [--rate 10000] [--seconds 10] [--json FILE]

The sender is a process of its own on the same machine; the receiver's thread feeds a tracker, with the engine's process
settings. Prints a table; exits with 1 when a datagram was lost, refused or not counted.
"""

from __future__ import annotations

import multiprocessing
import resource
import socket
import sys
import time
from dataclasses import replace
from pathlib import Path

from tables import arguments, publish, table

from rhot_app.engine.pipeline import warm_up
from rhot_app.engine.serve import prepare_process
from rhot_app.project import Rig
from rhot_app.sources.clock import NodeClockModel
from rhot_app.sources.receiver import NodeReceiver, open_data_socket
from rhot_app.sources.validation import DatagramValidator
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.codec import encode
from rhot_node.wire.messages import MarkerObservation, Observations

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from synthetic_node import synthetic_rig

SESSION = 11
_TICK_S = 0.002


def send(port: int, rate: int, seconds: float) -> None:
    """Send `rate * seconds` datagrams evenly; only the sequence number and the times are written for each."""
    rig = synthetic_rig()
    markers = tuple(MarkerObservation(k, 100.0 + k, 200.0, 16.0, 0.01, 0.0, 0.01, 0.9) for k in range(6))
    template = Observations(1, SESSION, 0, 0, 0, 10**6, 10**6, 10**4, 640, 480, 0, rig.markers.checksum, markers)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.connect(("127.0.0.1", port))
        begun, sent, total = time.monotonic(), 0, round(rate * seconds)
        while sent < total:
            due = min(total, int((time.monotonic() - begun) * rate) + 1)
            now_ns = time.monotonic_ns()
            stamped = replace(template, t_frame_node_ns=now_ns - 5_000_000, t_send_node_ns=now_ns)
            datagram = bytearray(encode(stamped))
            while sent < due:
                datagram[20:24] = sent.to_bytes(4, "little")
                sock.send(datagram)
                sent += 1
            time.sleep(_TICK_S)


def run(rate: int, seconds: float) -> dict[str, object]:
    """Flood one receiver and read its counters."""
    clock = NodeClockModel()
    now_ns = time.monotonic_ns()
    for k in range(10):
        t = now_ns - k * 1000
        clock.add(t, t + 20_000, t + 20_000, t + 40_000, 1)
    rig = synthetic_rig()
    door = DatagramValidator(rig, 0, clock)
    door.expect_session(SESSION)
    receiver = NodeReceiver(open_data_socket(0, "left"), door, "left")
    consumer = Consumer(rig)
    receiver.deliver = consumer.take
    prepare_process()
    receiver.start()
    sender = multiprocessing.get_context("spawn").Process(target=send, args=(receiver.port, rate, seconds))
    before = resource.getrusage(resource.RUSAGE_SELF)
    sender.start()
    sender.join()
    time.sleep(0.5)
    after = resource.getrusage(resource.RUSAGE_SELF)
    receiver.close()
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"rate_hz": rate, "seconds": seconds, "sent": round(rate * seconds), "received": door.received,
            "verified": door.accepted, "dropped": door.dropped, "sequence_lost": door.sequence.lost,
            "kernel_overflow": receiver.overflowed, "handed_to_tracker": consumer.count, "skipped": receiver.skipped,
            "cpu_us_per_datagram": 1e6 * cpu_s / max(1, door.received), "buffer_bytes": receiver.buffer_bytes}


class Consumer:
    """The tracker, as the engine feeds it."""

    def __init__(self, rig: Rig) -> None:
        self.count = 0
        self._tracker = make_tracker(rig)
        warm_up(self._tracker, rig)

    def take(self, frames: list[CameraObservations]) -> None:
        """Take what the receiver hands on."""
        self.count += len(frames)
        for frame in frames:
            self._tracker.ingest(frame)
        self._tracker.solve()


def main() -> int:
    """Run and print."""
    parser = arguments(__doc__)
    parser.add_argument("--rate", type=int, default=10_000, help="datagrams per second")
    parser.add_argument("--seconds", type=float, default=10.0)
    args = parser.parse_args()
    figures = run(args.rate, args.seconds)
    shown = ("sent", "received", "verified", "sequence_lost", "kernel_overflow", "handed_to_tracker",
             "cpu_us_per_datagram")
    publish(args, figures, table([f"{args.rate} datagrams/s for {args.seconds:g} s", "count"],
                                 [[name.replace("_", " ").replace("cpu us", "processor time, µs,"), figures[name]]
                                  for name in shown]))
    return 0 if figures["verified"] == figures["sent"] and not figures["sequence_lost"] else 1


if __name__ == "__main__":
    sys.exit(main())
