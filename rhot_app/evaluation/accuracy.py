"""Figures of one track against the truth, and of several runs together. Keys end in their unit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rhot_app.evaluation.consistency import axes_within
from rhot_app.evaluation.deviations import Deviations, WornMarkers, distances
from rhot_app.evaluation.score import count_swaps, rms
from rhot_app.evaluation.track import DISPLAY_HZ, Track
from rhot_app.simulator.truth.truth import Truth

Array = NDArray[np.float64]
Figures = dict[str, float | None]

_ADDED = ("swaps",)  # over runs these add up; everything else is averaged, root mean square or plain
_PLAIN = ("states_per_s", "measured_share", "predicted_3_sd_share")


def accuracy(track: Track, off: Deviations, truth: Truth, worn: WornMarkers) -> Figures:
    """The figures of one run.

    `tip_visible`: fingertips whose marker both cameras truly see, whatever the tracker says of them; `tip_measured`:
    those that it calls measured; `tip_all`: every state; `tip_display`: of the newest state at each tick of a display,
    against the truth at the tick; `tip_predicted`: of what the tracker predicts at the tick, and which part of
    its axes is within three of its stated standard deviations. `angles`: of the fingers that wear a marker.
    """
    tips = distances(off.tips)
    ahead, stated = predicted(track, truth, worn)
    within, judged = axes_within(ahead, stated, np.ones(ahead.shape[:2], np.bool_))
    span_s = float(track.times_s[-1] - track.times_s[0])
    return {
        "tip_visible_mm": _scaled(rms(tips[off.visible[:, worn.tips]]), 1e3),
        "tip_measured_mm": _scaled(rms(tips[off.measured[:, worn.tips]]), 1e3),
        "tip_all_mm": _scaled(rms(tips), 1e3),
        "tip_display_mm": _scaled(rms(display_error(track, truth, worn)), 1e3),
        "tip_predicted_mm": _scaled(rms(distances(ahead)), 1e3),
        "predicted_3_sd_share": within / judged if judged else None,
        "marker_mm": _scaled(rms(distances(off.markers)[off.visible]), 1e3),
        "angles_deg": _scaled(rms(off.angles[:, worn.angles]), float(np.degrees(1.0))),
        "palm_turn_deg": _scaled(rms(distances(off.palm[:, 3:])), float(np.degrees(1.0))),
        "swaps": float(count_swaps(track.marker_positions, truth.markers_at(track.times_s))),
        "measured_share": float(off.measured[off.visible].mean()) if off.visible.any() else None,
        "states_per_s": (len(track.times_s) - 1) / span_s if span_s > 0.0 else None,
    }


def display_error(track: Track, truth: Truth, worn: WornMarkers) -> Array:
    """(D, T) m: at each tick of a display, how far the fingertips of the newest state received are from where they are
    now. No prediction: what the state says of its own instant is shown."""
    ticks = np.arange(track.receive_s[0], track.receive_s[-1], 1.0 / DISPLAY_HZ)
    newest = np.searchsorted(track.receive_s, ticks, side="right") - 1
    shown = track.fingertip_positions[newest][:, worn.tip_fingers]
    return distances(shown - truth.markers_at(ticks)[:, worn.tips])


def predicted(track: Track, truth: Truth, worn: WornMarkers) -> tuple[Array, Array]:
    """What the tracker, asked at each tick of a display, says of the tick: how far off fingertips are, (K, T, 3) m, and
    their covariances (K, T, 3, 3) m^2. K is 0 when it predicts nothing."""
    if track.predicted is None:
        return np.empty((0, len(worn.tips), 3)), np.empty((0, len(worn.tips), 3, 3))
    ticks = track.predicted.times_s
    asked = (ticks >= track.receive_s[0]) & (ticks <= track.receive_s[-1])
    shown = track.predicted.fingertip_positions[asked][:, worn.tip_fingers]
    return (shown - truth.markers_at(ticks[asked])[:, worn.tips],
            track.predicted.fingertip_covariances[asked][:, worn.tip_fingers])


def pooled(runs: Sequence[Figures]) -> Figures:
    """One set of figures for several runs of equal length: errors root mean square, swaps added up, rates averaged."""
    return {name: _pool(name, [figures[name] for figures in runs]) for name in runs[0]}


def ratio(figure: float | None, reference: float | None) -> float | None:
    """How many times the reference the figure is; None where one is missing or the reference is zero."""
    return None if figure is None or not reference else figure / reference


def _pool(name: str, values: Sequence[float | None]) -> float | None:
    known = np.array([value for value in values if value is not None])
    if not known.size:
        return None
    if name in _ADDED:
        return float(known.sum())
    return float(known.mean()) if name in _PLAIN else rms(known)


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value
