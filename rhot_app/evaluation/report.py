"""What `rhot evaluate` says: figures as one JSON object or as a table for people."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rhot_app.errors import SimulatorError
from rhot_app.evaluation.run import EvaluationRun
from rhot_app.evaluation.score import TrueSamples, score
from rhot_app.simulator.nodes.film import TRUTH_NAME
from rhot_app.simulator.truth.truth import load_truth

SETTLE_S = 1.0
"""What happens before this scene time is not judged."""

COLUMNS = (
    ("fingertip_rms_mm", "fingertip mm", "{:.2f}"), ("marker_rms_mm", "marker mm", "{:.2f}"),
    ("wrist_rms_mm", "wrist mm", "{:.2f}"), ("joint_rms_deg", "joints deg", "{:.1f}"),
    ("measured_fraction", "measured", "{:.3f}"), ("swaps", "swaps", "{:d}"), ("state_rate_hz", "states/s", "{:.1f}"),
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
        cells = [_cell(figures[key], form) for key, _, form in COLUMNS]
        cells += [_cell(figures["state_age_ms"]["p50"], "{:.1f}"),
                  _cell(figures["latency_ms"]["receive_to_state"]["p99"], "{:.2f}")]
        aligned = [cell.rjust(len(head)) for cell, head in zip(cells, heads, strict=True)]
        lines.append("  ".join([name.ljust(width), *aligned]))
    return "\n".join(lines)


def details(figures: dict[str, Any]) -> str:
    """Per-marker errors and latency by stage, for people."""
    lines = ["marker     error mm  unfiltered jitter mm"]
    for name, error in figures["marker_rms_mm_each"].items():
        jitter = figures["marker_jitter_unfiltered_mm_each"][name]
        lines.append(f"{name:<10} {_cell(error, '{:.2f}'):>8}  {_cell(jitter, '{:.3f}'):>20}")
    lines += ["", "latency            p50 ms    p99 ms"]
    for stage, value in figures["latency_ms"].items():
        lines.append(f"{stage:<17} {_cell(value['p50'], '{:.3f}'):>7}  {_cell(value['p99'], '{:.3f}'):>8}")
    return "\n".join(lines)


def _cell(value: float | None, form: str) -> str:
    return "-" if value is None else form.format(value)
