"""One trial: filmed frames played in real time to real node daemons, UDP, a real engine, and what it publishes."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from rhot_app.engine.client import EngineClient
from rhot_app.engine.process import ensure_engine, stop_engine
from rhot_app.engine.status import EngineStatus
from rhot_app.errors import EngineError, SimulatorError
from rhot_app.evaluation.score import TrueSamples, cell, score
from rhot_app.progress import ProgressLine
from rhot_app.project import Rig, save_rig
from rhot_app.simulator.film.film import TRUTH_NAME, film
from rhot_app.simulator.film.shot import make_shot, read_shot
from rhot_app.simulator.film.truth import load_truth
from rhot_app.simulator.nodes.proxy import Impairment, UdpProxy
from rhot_app.simulator.scene.scene import Scene, build_rig, node_settings
from rhot_app.sources.local_nodes import NodePorts, NodeSupervisor
from rhot_app.state import HandState
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
        nodes = stack.enter_context(contextlib.closing(NodeSupervisor(work / "nodes", settings, cameras)))
        ports = tuple(nodes.wait_ready())
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


SETTLE_S = 1.0
"""What happens before this scene time is not judged."""

COLUMNS = (
    ("fingertip_rms_mm", "fingertip mm", ".2f"), ("marker_rms_mm", "marker mm", ".2f"),
    ("wrist_rms_mm", "wrist mm", ".2f"), ("joint_rms_deg", "joints deg", ".1f"),
    ("measured_fraction", "measured", ".3f"), ("swaps", "swaps", "d"), ("state_rate_hz", "states/s", ".1f"),
)


def figures_of(trial: EvaluationRun, frames: Path) -> dict[str, Any]:
    """All figures of a trial on the shot in `frames`. Raises SimulatorError when there is nothing to judge."""
    truth = load_truth(frames / TRUTH_NAME)
    states = [state for state in trial.states if (state.t_master_ns - trial.t0_ns) * 1e-9 >= SETTLE_S]
    if len(states) < 2:
        raise SimulatorError(f"the engine published {len(states)} states after the first second; nothing to judge. "
                             + " ".join(advice.text for advice in trial.status.advice))
    times = np.array([(state.t_master_ns - trial.t0_ns) * 1e-9 for state in states])
    samples = TrueSamples(truth.markers_at(times), truth.angles_at(times), truth.visible_at(times))
    figures = score(states, samples, [marker.role for marker in trial.rig.markers.markers])
    figures["nodes"] = {node.name: {"received": node.received, "lost": node.lost, "dropped": node.dropped,
                                    "clock_bound_ms": None if node.clock_bound_s is None else 1e3 * node.clock_bound_s}
                        for node in trial.status.nodes}
    return figures


def table(rows: Sequence[tuple[str, dict[str, Any]]]) -> str:
    """One line per run: its name and the chief figures, latency included."""
    width = max(len(name) for name, _ in rows)
    heads = [head for _, head, _ in COLUMNS] + ["age p50 ms", "receive-state p99 ms"]
    lines = ["  ".join([" " * width, *heads])]
    for name, figures in rows:
        cells = [cell(figures[key], form) for key, _, form in COLUMNS]
        cells += [cell(figures["state_age_ms"]["p50"], ".1f"),
                  cell(figures["latency_ms"]["receive_to_state"]["p99"], ".2f")]
        aligned = [cell.rjust(len(head)) for cell, head in zip(cells, heads, strict=True)]
        lines.append("  ".join([name.ljust(width), *aligned]))
    return "\n".join(lines)


def details(figures: dict[str, Any]) -> str:
    """Per-marker errors and latency by stage, for people."""
    lines = ["marker     error mm  unfiltered jitter mm"]
    for name, error in figures["marker_rms_mm_each"].items():
        jitter = figures["marker_jitter_unfiltered_mm_each"][name]
        lines.append(f"{name:<10} {cell(error, '.2f'):>8}  {cell(jitter, '.3f'):>20}")
    lines += ["", "latency            p50 ms    p99 ms"]
    for stage, value in figures["latency_ms"].items():
        lines.append(f"{stage:<17} {cell(value['p50'], '.3f'):>7}  {cell(value['p99'], '.3f'):>8}")
    return "\n".join(lines)


Detector = Literal["fast", "reference"]


def evaluate(scene: Scene, motion: str, seconds: float, work: Path, *, loss: float = 0.0,
             detector: Detector = "fast") -> dict[str, Any]:
    """Figures of a motion filmed in `scene`; `work` is an empty folder. Raises RhotError."""
    shot = make_shot(scene, motion, seconds)
    line = ProgressLine(f"rendering {seconds:g} s of {shot.scene_object.name}")
    film(shot, work / "frames", line)
    line.finish()
    return evaluate_frames(work / "frames", work, loss=loss, detector=detector)


def evaluate_frames(frames: Path, work: Path, *, loss: float = 0.0, detector: Detector = "fast") -> dict[str, Any]:
    """Figures of the shot in folder `frames`, played in real time. Raises RhotError."""
    shot, scene = read_shot(frames)
    line = ProgressLine(f"playing {shot.seconds:g} s of {shot.motion}")
    place = work / "run"
    place.mkdir()
    trial = evaluation_run(frames, scene, shot.seconds, place, loss=loss, detector=detector, progress=line)
    line.finish()
    return {"motion": shot.motion, "seconds": shot.seconds, "seed": shot.seed, "preset": scene.settings.preset,
            "distance_m": scene.settings.distance_m, "loss": loss, "detector": detector,
            **figures_of(trial, frames)}
