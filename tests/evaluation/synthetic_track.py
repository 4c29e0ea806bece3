"""Tracks and truths by construction: six markers on a hand that follows a given way, states that are off as wanted."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rhot_app.evaluation.accuracy import WornMarkers
from rhot_app.evaluation.track import TrackedStates
from rhot_app.simulator.film.truth import FrameTruth, Truth
from rhot_app.state import Knowledge

WORN = WornMarkers(np.arange(5), np.arange(5), np.arange(21))
PLACES = np.array([[0.02 * k, 0.0, 0.6] for k in range(6)])
LATE_S = 0.03  # from the instant of a state to its datagram

Way = Callable[[np.ndarray], np.ndarray]  # (N,) s -> (N,) m along x


def still(times_s: np.ndarray) -> np.ndarray:
    return np.zeros_like(times_s)


def make_truth(way: Way = still, seconds: float = 4.0, visible: float = 1.0) -> Truth:
    times = np.arange(0.0, seconds, 1e-3)
    shift = np.zeros((len(times), 1, 3))
    shift[:, 0, 0] = way(times)
    palm = np.tile(np.eye(4), (len(times), 1, 1))
    palm[:, :3, 3] = shift[:, 0]
    frames = FrameTruth(times[::25], np.full((len(times[::25]), 6), visible))
    return Truth(times, PLACES + shift, np.zeros((len(times), 21, 3)) + shift, np.zeros((len(times), 21)), palm,
                 (frames, frames))


def make_track(truth: Truth, times_s: np.ndarray, *, off: np.ndarray | float = 0.0, late_s: float = 0.0,
               knowledge: int = Knowledge.MEASURED, covariance: np.ndarray | None = None) -> TrackedStates:
    """States at `times_s` that show the truth of `late_s` ago, off by `off` (N, 1, 3) or a number along x, m."""
    count = len(times_s)
    offset = np.zeros((count, 1, 3))
    if isinstance(off, np.ndarray):
        offset = offset + off
    else:
        offset[:, :, 0] = off
    markers = truth.markers_at(times_s - late_s) + offset
    joints = truth.joints_at(times_s - late_s) + offset
    block = np.full((3, 3), np.nan) if covariance is None else covariance

    def tiled(*shape: int) -> np.ndarray:
        return np.broadcast_to(block, (*shape, 3, 3)).copy()
    return TrackedStates(
        times_s=times_s, receive_s=times_s + LATE_S, marker_positions=markers, marker_raw_positions=markers,
        marker_covariances=tiled(count, 6), marker_knowledge=np.full((count, 6), knowledge, np.uint8),
        joint_positions=joints, joint_covariances=tiled(count, 21),
        joint_knowledge=np.full((count, 21), knowledge, np.uint8), fingertip_positions=markers[:, :5],
        fingertip_covariances=tiled(count, 5), angles=np.full((count, 21), 0.1), angle_sd=np.full((count, 21), np.nan),
        angle_knowledge=np.full((count, 21), knowledge, np.uint8), world_from_palm=truth.palm_at(times_s - late_s),
        palm_covariance=np.full((count, 6, 6), np.nan), hand_scale=np.ones(count), hand_scale_sd=np.full(count, np.nan),
        compute_s=np.empty(0))
