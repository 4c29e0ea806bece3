"""From kernel receive time to the published state: two synthetic nodes against a real engine process.

    python benchmarks/latency.py [--rate 120] [--seconds 20] [--beside COMMAND] [--json FILE]

The nodes run in a process of their own, the engine in its own, this program listens. `--beside` starts one more
command for the time of the run (for example the app: ``--beside "rhot --directory {directory}"``) and reads the
figures with it. Prints p50, p99 and maximum of every stage.
"""

from __future__ import annotations

import multiprocessing
import multiprocessing.synchronize
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import msgspec
import numpy as np
from tables import arguments, publish, table

from rhot_app.engine.client import EngineClient
from rhot_app.engine.process import StartedProcess, end_processes, ensure_engine, start_ticks, stop_engine
from rhot_app.project import OutputSettings, Rig, load_rig, save_rig
from rhot_app.state import LATENCY_STAGES, HandState
from rhot_node.clock import NodeClock

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from synthetic_node import SyntheticNode, synthetic_rig

SETTLE_S = 2.0


def serve_nodes(rig_path: Path, rate_hz: float, ending: multiprocessing.synchronize.Event) -> None:
    """All nodes of the rig, each with a clock of its own."""
    rig: Rig = load_rig(rig_path)
    nodes = [SyntheticNode(rig, camera, rate_hz=rate_hz, clock=NodeClock((camera + 1) * 10**13, 30.0 * camera, 0))
             for camera in range(len(rig.nodes))]
    for node in nodes:
        node.start()
    ending.wait()
    for node in nodes:
        node.close()


def measure(rate_hz: float, seconds: float, beside: str | None,
            outputs: tuple[OutputSettings, ...] = ()) -> dict[str, object]:
    """One run with these outputs; latencies in ms by stage."""
    with tempfile.TemporaryDirectory(prefix="rhot-latency-") as folder:
        directory, rig_path = Path(folder, "engine"), Path(folder, "rig.json")
        save_rig(rig_path, msgspec.structs.replace(synthetic_rig(), outputs=outputs))
        spawn = multiprocessing.get_context("spawn")
        ending = spawn.Event()
        nodes = spawn.Process(target=serve_nodes, args=(rig_path, rate_hz, ending))
        nodes.start()
        try:
            ensure_engine(rig_path, directory)
            return _listen(directory, seconds, beside)
        finally:
            stop_engine(directory)
            ending.set()
            nodes.join()


def _listen(directory: Path, seconds: float, beside: str | None) -> dict[str, object]:
    companion = subprocess.Popen(shlex.split(beside.format(directory=directory))) if beside else None
    try:
        with EngineClient(directory) as client:
            client.command("start")
            states = _collect(client, SETTLE_S + seconds)
            status = client.status
    finally:
        if companion is not None:
            ticks = start_ticks(companion.pid)
            end_processes([] if ticks is None else [StartedProcess(companion.pid, ticks, "companion")])
    states = [state for state in states if state.t_receive_ns > states[0].t_receive_ns + 1e9 * SETTLE_S]
    duration_s = 1e-9 * (states[-1].t_master_ns - states[0].t_master_ns)
    return {
        "states": len(states), "state_rate_hz": (len(states) - 1) / duration_s,
        "lost": sum(node.lost for node in status.nodes) if status else None,
        "latency_ms": {stage: _summary([state.latency_s.get(stage, np.nan) for state in states])
                       for stage in LATENCY_STAGES},
    }


def _collect(client: EngineClient, seconds: float) -> list[HandState]:
    states: list[HandState] = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        states += [message for message in client.poll(0.1) if isinstance(message, HandState)]
        time.sleep(0.05)  # as a screen would: the listener shall not compete with the engine for every state
    return states


def _summary(values_s: list[float]) -> dict[str, float]:
    values = 1e3 * np.array(values_s)
    values = values[np.isfinite(values)]
    if not len(values):
        return {}
    return {"p50": float(np.percentile(values, 50)), "p99": float(np.percentile(values, 99)),
            "max": float(values.max())}


def main() -> int:
    """Run and print."""
    parser = arguments(__doc__)
    parser.add_argument("--rate", type=float, default=120.0, help="datagrams per second and node")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--beside", metavar="COMMAND", help="run this too; {directory} is the engine's directory")
    args = parser.parse_args()
    figures = measure(args.rate, args.seconds, args.beside)
    latency = figures["latency_ms"]
    assert isinstance(latency, dict)
    publish(args, figures,
            table(["stage", "p50, ms", "p99, ms", "max, ms"],
                  [[stage.replace("_", " "), *summary.values()] for stage, summary in latency.items() if summary]),
            f"{figures['state_rate_hz']:.1f} states/s; {figures['lost']} datagrams lost.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
