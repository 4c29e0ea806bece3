"""Detects a stale alignment: a chi-squared test of the innovations of the last seconds."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from rhot_app.estimation.least_squares import fit_linear
from rhot_app.estimation.quantiles import chi_squared_isf
from rhot_app.estimation.se3 import skew
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.alignment.alignment_file import Alignment
from rhot_app.objects.alignment.fit import (
    GAP_S,
    KERNEL,
    LASTING_M,
    LASTING_S,
    OFFSET,
    POINT,
    ROTATION,
    TRANSLATION,
    UNKNOWNS,
)
from rhot_app.objects.alignment.motion_stream import SAMPLES, MotionStream

Array = NDArray[np.float64]

WINDOW_S = 10.0
"""s: the innovations that are tested together. With LASTING_S they count as five independent ones, so that drifts of a
millimetre show."""

FALSE_ALARM = 1e-6
"""Probability of a test to call a true alignment stale: with one test a second, once in twelve days."""

_DRIFT = np.r_[TRANSLATION, ROTATION, OFFSET]  # what may drift: rig_from_foreign and the time offset


@dataclass(frozen=True, slots=True)
class Drift:
    """A test: `stale`; the `statistic` and its `limit`; `distance_m`, rms over the window, by which positions are off;
    `offset_s`, the part of the clocks; and a `sentence`, empty unless stale."""

    stale: bool
    statistic: float
    limit: float
    distance_m: float
    offset_s: float
    sentence: str


class DriftMonitor:
    """Takes pairs of the rig's position and the other tracker's pose at the same instants, in ascending time."""

    def __init__(self, alignment: Alignment, window_s: float = WINDOW_S) -> None:
        self._alignment, self._window_s = alignment, window_s
        self._pairs: deque[tuple[float, Array, Array]] = deque()

    def add(self, rig_s: float, position: Array, foreign_from_tracker: Array) -> None:
        """Take `position` (3,) m of the rig at `rig_s` and the pose (4, 4) of the other tracker at that instant, which
        is at `rig_s - alignment.time_offset_s` of its clock. A pair with unknown values, or that is not later than the
        one before, is left out."""
        known = np.isfinite(position).all() and np.isfinite(foreign_from_tracker).all()
        if not known or (self._pairs and not rig_s > self._pairs[-1][0]):
            return
        self._pairs.append((rig_s, np.asarray(position, float), np.asarray(foreign_from_tracker, float)))
        while rig_s - self._pairs[0][0] > self._window_s:
            self._pairs.popleft()

    def test(self) -> Drift | None:
        """Test the window; None while it holds less than half of its time or too few pairs.

        It is a score test (Rao 1948) of a change of rig_from_foreign and of the time offset. The innovations have white
        noise, a lasting error of LASTING_M, and the covariance of the alignment.
        """
        duration_s = self._pairs[-1][0] - self._pairs[0][0] if self._pairs else 0.0
        if len(self._pairs) < SAMPLES or duration_s < 0.5 * self._window_s:
            return None
        innovation, jacobian = self._innovations()
        drift = jacobian[:, :, _DRIFT]
        weights, step = _robust(innovation, drift, self._alignment.noise_m)
        # a stationary error of correlation time T is white noise of spectral density 2 T s^2 to a long window
        variance = self._alignment.noise_m**2 + 2.0 * LASTING_S * LASTING_M**2 * len(innovation) / duration_s
        score = np.einsum("n,nij,ni->j", weights, drift, innovation) / variance
        cross = np.einsum("n,nij,nik->jk", weights, drift, jacobian) / variance
        size = jacobian.shape[2]
        covariance = cross[:, _DRIFT] + cross @ np.array(self._alignment.covariance)[:size, :size] @ cross.T
        scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
        used = values > 1e-9
        statistic = float(np.sum((vectors.T @ (score / scale))[used] ** 2 / values[used]))
        limit = float(chi_squared_isf(FALSE_ALARM, int(used.sum())))
        moved = drift @ step
        distance_m = float(np.sqrt(np.mean(np.sum(moved**2, axis=1))))
        stale = statistic > limit
        clock_m = float(np.sqrt(np.mean(np.sum((drift[:, :, -1] * step[-1]) ** 2, axis=1))))
        sentence = _sentence(distance_m, float(step[-1]), clock_m, duration_s) if stale else ""
        return Drift(stale, statistic, limit, distance_m, float(step[-1]), sentence)

    @classmethod
    def test_streams(cls, alignment: Alignment, foreign: MotionStream, rig: MotionStream) -> Drift | None:
        """Test two recorded streams of one motion, window by window: the first test that is stale, else the last one.
        None where they have no window in common."""
        monitor, found = cls(alignment), None
        foreign, rig = foreign.without_outliers(), rig.without_outliers()
        asked = rig.times_s - alignment.time_offset_s
        usable = foreign.covers(asked, GAP_S)
        places, _, turns, _ = foreign.at(asked[usable])
        due_s = -np.inf
        for rig_s, position, place, turn in zip(rig.times_s[usable], rig.positions[usable], places, turns, strict=True):
            monitor.add(float(rig_s), position, rigid(turn, place))
            if rig_s >= due_s and (test := monitor.test()) is not None:
                found, due_s = test, rig_s + 0.5 * WINDOW_S
                if test.stale:
                    return test
        return monitor.test() or found

    def _innovations(self) -> tuple[Array, Array]:
        """Observed less predicted positions (N, 3) m, and the prediction's Jacobian (N, 3, 10)."""
        rig, body = self._alignment.rig_from_foreign.matrix, self._alignment.tracker_from_body.matrix
        times, observed, poses = (np.array(column) for column in zip(*self._pairs, strict=True))
        turned = (poses[:, :3, 3] + poses[:, :3, :3] @ body[:3, 3]) @ rig[:3, :3].T
        predicted = turned + rig[:3, 3]
        speed = np.gradient(median_filter(predicted, (5, 1)), times, axis=0)  # outliers would have the largest speeds
        jacobian = np.zeros((len(times), 3, UNKNOWNS))
        jacobian[:, :, TRANSLATION], jacobian[:, :, ROTATION] = np.eye(3), -skew(turned)
        jacobian[:, :, POINT], jacobian[:, :, OFFSET.start] = rig[:3, :3] @ poses[:, :3, :3], -speed
        return observed - predicted, jacobian


def _robust(innovation: Array, drift: Array, noise_m: float) -> tuple[Array, Array]:
    """Weights (N,) of the innovations under the drift (7,) that explains them best, and that drift."""
    size = np.maximum(np.linalg.norm(drift.reshape(-1, drift.shape[2]), axis=0), 1e-12)
    step, weights = fit_linear(drift / size, innovation, KERNEL, rounds=10, rcond=1e-6, least_sd=noise_m)
    return weights, step / size


def _sentence(distance_m: float, offset_s: float, clock_m: float, duration_s: float) -> str:
    off = (f"The alignment is stale: over the last {duration_s:.0f} s positions of the other tracker were "
           f"{1e3 * distance_m:.1f} mm off in the rig.")
    if clock_m > 0.7 * distance_m:
        return f"{off} Its clock has drifted by {1e3 * offset_s:+.1f} ms. Align again."
    return f"{off} A camera, its base station or the tracker on the object was moved. Align again."
