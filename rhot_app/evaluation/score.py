"""Figures of merit: published states against the truth at the states' own times, without any alignment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.filters.jitter import scatter
from rhot_app.hand.skeleton import ANGLES, TIP_ROLES, WRIST_ROLE
from rhot_app.latency import latency_row, p50_p99
from rhot_app.state import LATENCY_STAGES, HandState, Knowledge

Array = NDArray[np.float64]

SWAP_FRAMES = 3
"""A marker nearer to another's truth than to its own for this many states in a row is a swap."""

DEGREE = float(np.degrees(1.0))
"""Degrees in a radian."""

VISIBLE_FRACTION = 0.9
"""A marker counts as truly visible to a camera when at least this part of its outline is not hidden."""


@dataclass(frozen=True, slots=True)
class TrueSamples:
    """Truth at the times of N states. World frame = rig frame.

    `markers` (N, M, 3) m in the rig's marker order, `angles` (N, 21) rad, `visible` (N, M) the smallest visible
    fraction over all cameras, 0..1.
    """

    markers: Array
    angles: Array
    visible: Array


def rms(values: Array) -> float | None:
    """Root mean square over all finite values; None when there are none."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else None


def count_swaps(positions: Array, truth: Array) -> int:
    """Number of times a marker's position (N, M, 3) is nearer to another marker's truth for SWAP_FRAMES states.

    States without a position neither count nor break a run.
    """
    swaps = 0
    for marker in range(positions.shape[1]):
        known = np.isfinite(positions[:, marker]).all(axis=1)
        distances = np.linalg.norm(positions[known, marker, None, :] - truth[known], axis=2)
        run = 0
        for wrong in distances.argmin(axis=1) != marker:
            run = run + 1 if wrong else 0
            swaps += run == SWAP_FRAMES
    return swaps


def _summary(values: Array) -> dict[str, float | None]:
    """Median and 99th percentile; None without values."""
    return dict(zip(("p50", "p99"), (float(one) if np.isfinite(one) else None for one in p50_p99(values)), strict=True))


def scaled(value: float | None, factor: float) -> float | None:
    """In another unit; None stays."""
    return None if value is None else factor * value


def cell(value: float | None, form: str) -> str:
    """A figure, or a dash where there is none."""
    return "-" if value is None or value != value else format(value, form)


def score(states: Sequence[HandState], truth: TrueSamples, roles: Sequence[str | None]) -> dict[str, Any]:
    """All figures of one run. `roles` (M,) are the hand roles of the rig's markers. Keys end in their unit."""
    positions = np.array([state.marker_positions for state in states])
    raw = np.array([state.marker_raw_positions for state in states])
    measured = np.array([state.marker_knowledge for state in states]) == Knowledge.MEASURED
    measured &= np.isfinite(positions).all(axis=2)
    error = np.linalg.norm(positions - truth.markers, axis=2)
    raw_error = raw - truth.markers
    visible = truth.visible >= VISIBLE_FRACTION
    ids = states[0].marker_ids

    tips = [(finger, roles.index(role)) for finger, role in enumerate(TIP_ROLES) if role in roles]
    effectors = np.array([state.fingertip_positions for state in states])
    tip_error = np.full((len(states), len(tips)), np.nan)
    for column, (finger, marker) in enumerate(tips):
        distance = np.linalg.norm(effectors[:, finger] - truth.markers[:, marker], axis=1)
        tip_error[:, column] = np.where(measured[:, marker], distance, np.nan)
    wrist = error[:, roles.index(WRIST_ROLE)] if WRIST_ROLE in roles else np.full(len(states), np.nan)
    wrist_seen = measured[:, roles.index(WRIST_ROLE)] if WRIST_ROLE in roles else np.zeros(len(states), bool)

    angle_error = np.array([state.angles for state in states]) - truth.angles
    span_s = (states[-1].t_master_ns - states[0].t_master_ns) * 1e-9
    return {
        "states": len(states),
        "fingertip_rms_mm": scaled(rms(tip_error), 1e3),
        "fingertip_rms_mm_each": {ids[marker]: scaled(rms(tip_error[:, column]), 1e3)
                                  for column, (_, marker) in enumerate(tips)},
        "marker_rms_mm": scaled(rms(np.where(measured, error, np.nan)), 1e3),
        "marker_rms_mm_each": {name: scaled(rms(np.where(measured[:, k], error[:, k], np.nan)), 1e3)
                               for k, name in enumerate(ids)},
        "marker_unfiltered_rms_mm": scaled(rms(np.where(measured, np.linalg.norm(raw_error, axis=2), np.nan)), 1e3),
        "marker_jitter_unfiltered_mm_each": {
            name: scaled(scatter(np.where(measured[:, k, None], raw_error[:, k], np.nan)), 1e3)
            for k, name in enumerate(ids)},
        "wrist_rms_mm": scaled(rms(np.where(wrist_seen, wrist, np.nan)), 1e3),
        "joint_rms_deg": scaled(rms(angle_error), DEGREE),
        "joint_rms_deg_each": {name: scaled(rms(angle_error[:, k]), DEGREE) for k, name in enumerate(ANGLES)},
        "measured_fraction": float(measured[visible].mean()) if visible.any() else None,
        "visible_samples": int(visible.sum()),
        "swaps": count_swaps(positions, truth.markers),
        "state_rate_hz": (len(states) - 1) / span_s if span_s > 0 else None,
        "state_age_ms": _summary(1e3 * state_ages(states)),
        "latency_ms": {stage: _summary(column) for stage, column in zip(
            LATENCY_STAGES, 1e3 * np.array([latency_row(state) for state in states]).T, strict=True)},
    }


def state_ages(states: Sequence[HandState]) -> Array:
    """Age of each state when it left the engine, s: from the instant it describes. The last one's is unknown (NaN)."""
    leave = [following.latency_s.get("receive_to_state", np.nan) for following in states[1:]]
    waits = np.array([(state.t_receive_ns - state.t_master_ns) * 1e-9 for state in states])
    return waits + np.array([*leave, np.nan])
