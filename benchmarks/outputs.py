"""What outputs cost the engine: its latency without any, with clients that read, and with clients that have stopped.

    python benchmarks/outputs.py [--runs 5] [--seconds 6] [--rate 120] [--json FILE]

Runs are alternated. Outputs are OSC, VMC and WebSocket with OpenXR's joints, every state. A stopped client has
connected, read a second of states and was then suspended (SIGSTOP). Prints the median of the runs' p50 and p99 of the
time from the datagram's receipt in the kernel to the published state, and the ratio to that without outputs.
"""

from __future__ import annotations

import argparse
import os
import signal
import socket
import sys
import time

import numpy as np
from latency import measure
from tables import arguments, publish, table
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from rhot_app.project import OutputSettings

ARMS = {"none": "none, no streams", "reading": "read", "stopped": "suspended after a second"}
STAGE = "receive_to_state"
BEFORE_STOP_S = 1.0


def free_ports(count: int) -> list[int]:
    """Ports that are free for TCP at this moment."""
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def read(port: int, udp_ports: list[int], stops: bool) -> None:
    """A client of all outputs; it suspends itself after a while, or reads on."""
    receivers = []
    for udp_port in udp_ports:
        receivers.append(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        receivers[-1].bind(("127.0.0.1", udp_port))
        receivers[-1].setblocking(False)
    while True:
        try:
            with connect(f"ws://127.0.0.1:{port}") as stream:
                begun_s: float | None = None
                for _ in stream:
                    begun_s = begun_s or time.monotonic()
                    for receiver in receivers:
                        drain(receiver)
                    if stops and time.monotonic() - begun_s > BEFORE_STOP_S:
                        os.kill(os.getpid(), signal.SIGSTOP)
        except (OSError, WebSocketException):
            time.sleep(0.1)


def drain(receiver: socket.socket) -> None:
    """Read whatever waits."""
    try:
        while True:
            receiver.recv(65536)
    except BlockingIOError:
        return


def run(arm: str, rate_hz: float, seconds: float) -> dict[str, object]:
    """One run of one arm."""
    if arm == "none":
        return measure(rate_hz, seconds, None)
    port, *udp_ports = free_ports(3)
    targets = {"ws": str(port), "osc": f"127.0.0.1:{udp_ports[0]}", "vmc": f"127.0.0.1:{udp_ports[1]}"}
    outputs = tuple(OutputSettings(kind, target, "openxr") for kind, target in targets.items())
    client = f"{sys.executable} {__file__} --client {port} {udp_ports[0]} {udp_ports[1]}"
    client += " --stops" * (arm == "stopped")
    return measure(rate_hz, seconds, client, outputs)


def main() -> int:
    """Run and print."""
    parser = arguments(__doc__)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--rate", type=float, default=120.0, help="datagrams per second and node")
    parser.add_argument("--client", type=int, nargs=3, help=argparse.SUPPRESS)
    parser.add_argument("--stops", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.client:
        read(args.client[0], args.client[1:], args.stops)
    found: dict[str, list[dict[str, float]]] = {arm: [] for arm in ARMS}
    arms = list(ARMS)
    for number in range(args.runs):
        for arm in (arms[number % 3:] + arms[:number % 3]):
            found[arm].append(run(arm, args.rate, args.seconds)["latency_ms"][STAGE])  # type: ignore[index]
    medians = {arm: {key: float(np.median([one[key] for one in found[arm]])) for key in ("p50", "p99")} for arm in ARMS}
    publish(args, {"stage": STAGE, "medians_ms": medians, "runs_ms": found},
            table(["clients of the streams", "p50, ms", "p99, ms", "p99 against none"],
                  [[ARMS[arm], medians[arm]["p50"], medians[arm]["p99"], medians[arm]["p99"] / medians["none"]["p99"]]
                   for arm in ARMS]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
