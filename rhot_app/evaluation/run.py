"""One trial: filmed frames played in real time to real node daemons, UDP, a real engine, and what it publishes."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rhot_app.engine.client import EngineClient
from rhot_app.engine.process import ensure_engine, stop_engine
from rhot_app.engine.status import EngineStatus
from rhot_app.errors import EngineError
from rhot_app.project import Rig, save_rig
from rhot_app.simulator.nodes.impairment import Impairment
from rhot_app.simulator.nodes.nodes import NodePorts, TwinNodes
from rhot_app.simulator.nodes.proxy import UdpProxy
from rhot_app.simulator.scene.scene import Scene, build_rig, node_settings
from rhot_app.tracking.state import HandState
from rhot_node.files import write_atomically

Progress = Callable[[int, int], None]

_STREAMING_TIMEOUT_S = 20.0
_LEAD_S = 0.5  # from everything streaming to scene time 0
_TAIL_S = 0.3  # after the last frame, for the last states
_POLL_S = 0.02


@dataclass(frozen=True, slots=True)
class EvaluationRun:
    """What came of a trial. `t0_ns`: master monotonic time of scene time 0."""

    rig: Rig
    states: tuple[HandState, ...]
    status: EngineStatus
    t0_ns: int


def evaluation_run(frames: Path, scene: Scene, seconds: float, work: Path, *, loss: float = 0.0,
              detector: Literal["fast", "reference"] = "fast", progress: Progress | None = None) -> EvaluationRun:
    """Play the shot in folder `frames`; `work` is an empty folder with a short path for files and sockets.

    `loss`: probability that a datagram of observations is lost. All processes started are ended. Raises
    SimulatorError, EngineError.
    """
    start_file = work / "start"
    cameras = [f"yuv:{frames / name}?start={start_file}" for name in scene.names]
    # The lossy network rewrites start messages, which no paired node would stand for.
    trust: Literal["paired", "open"] = "open" if loss > 0.0 else "paired"
    settings = [node_settings(scene, index, detector=detector, trust=trust) for index in range(len(cameras))]
    engine_directory = work / "engine"
    with contextlib.ExitStack() as stack:
        nodes = stack.enter_context(TwinNodes(work / "nodes", settings, cameras))
        ports = tuple(nodes.ports)
        if loss > 0.0:
            ports = tuple(_lossy(stack, index, port, loss, scene.seed) for index, port in enumerate(ports))
        rig = build_rig(scene, ports)
        save_rig(work / "rig.json", rig)
        stack.callback(stop_engine, engine_directory)
        ensure_engine(work / "rig.json", engine_directory, start=True)
        client = stack.enter_context(EngineClient(engine_directory))
        _wait_streaming(client)
        t0_ns = time.monotonic_ns() + round(_LEAD_S * 1e9)
        write_atomically(start_file, str(t0_ns).encode())
        states = _collect(client, t0_ns, seconds, progress)
        if client.status is None:
            raise EngineError(f"the engine in {engine_directory} published no status during the trial.")
        return EvaluationRun(rig, states, client.status, t0_ns)


def _lossy(stack: contextlib.ExitStack, index: int, port: NodePorts, loss: float, seed: int) -> NodePorts:
    proxy = UdpProxy(index + 1, port.udp_port, Impairment(loss=loss), seed=seed)
    stack.callback(proxy.close)
    proxy.start()
    return NodePorts(proxy.command_port, port.control_port, port.preview_port, port.pairing_port)


def _wait_streaming(client: EngineClient) -> None:
    deadline = time.monotonic() + _STREAMING_TIMEOUT_S
    while time.monotonic() < deadline:
        client.poll(_POLL_S)
        status = client.status
        if status is not None and all(node.state == "streaming" and node.clock_bound_s is not None and node.received
                                      for node in status.nodes):
            return
    said = "" if client.status is None else " ".join(advice.text for advice in client.status.advice)
    raise EngineError(f"the simulated nodes did not stream within {_STREAMING_TIMEOUT_S:g} s. {said}".rstrip())


def _collect(client: EngineClient, t0_ns: int, seconds: float, progress: Progress | None) -> tuple[HandState, ...]:
    """All states that describe scene times from 0 to `seconds`."""
    states: list[HandState] = []
    end_ns = t0_ns + round(seconds * 1e9)
    while (now := time.monotonic_ns()) < end_ns + round(_TAIL_S * 1e9):
        states += [message for message in client.poll(_POLL_S) if isinstance(message, HandState)]
        if progress is not None:
            progress(max(0, min(now, end_ns) - t0_ns), end_ns - t0_ns)
    return tuple(state for state in states if t0_ns <= state.t_master_ns <= end_ns)
