"""An estimate and a frame for tests of the filter's pieces: a grasping hand as the truth has it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
from modelled_hand import model_rig, moving, sights
from places import places_of
from scipy.spatial.transform import Rotation

from rhot_app.hand.model import neutral_pose
from rhot_app.simulator.motion import FACING
from rhot_app.tracking.kalman.estimate import (
    ACCELERATION,
    ANGLES,
    BIAS,
    POSE,
    ROTATION,
    SCALE,
    VELOCITY,
    Estimate,
    copy_estimate,
    displace,
)
from rhot_app.tracking.kalman.hand_filter import HandFilter
from rhot_app.tracking.kalman.marker_block import MarkerBlock
from rhot_app.tracking.kalman.motion import predict
from rhot_app.tracking.kalman.rows import Rows, empty_rows
from rhot_app.tracking.kalman.wearing import compile_wearing
from rhot_app.tracking.tracker import CameraObservations

RIG = model_rig()
WEARING = compile_wearing(RIG)
MARKERS = len(WEARING.roles)
SIZE = BIAS + 3 * MARKERS


def filter_of_hand() -> HandFilter:
    return HandFilter(WEARING.outfit, WEARING.habits, WEARING.limits)


def placed(estimate: Estimate) -> tuple[np.ndarray, np.ndarray]:
    """(M, 3) m and (M, 3, 27): its markers' places, and what they are per pose number."""
    places = places_of(WEARING.worn, estimate)
    return places.points, places.jacobian


def empty() -> Estimate:
    return filter_of_hand().estimate


def moving_estimate(seed: int = 1) -> Estimate:
    """A hand before the cameras, with every part of its mean and covariance in use."""
    rng = np.random.default_rng(seed)
    estimate = empty()
    estimate.world[:3, :3], estimate.world[:3, 3] = FACING, (0.03, 0.08, 0.6)
    estimate.angles[:] = neutral_pose().angles
    estimate.velocity[:] = 0.3 * rng.normal(size=POSE)
    estimate.acceleration[:] = 3.0 * rng.normal(size=POSE)
    estimate.log_scale[0] = 0.05
    estimate.bias[:] = 1e-3 * rng.normal(size=(MARKERS, 3))
    mixing = rng.normal(size=(SIZE, SIZE)) * 1e-3
    estimate.covariance[:] = mixing @ mixing.T + 1e-4 * np.eye(SIZE)
    return estimate


def twin(estimate: Estimate) -> Estimate:
    other = empty()
    copy_estimate(estimate, other)
    return other


def moved(estimate: Estimate, step: np.ndarray) -> Estimate:
    other = twin(estimate)
    displace(estimate, step, other)
    return other


def difference(a: Estimate, b: Estimate) -> np.ndarray:
    """(N,) the step that leads from `b` to `a`."""
    step = np.zeros(SIZE)
    step[:3] = a.world[:3, 3] - b.world[:3, 3]
    step[ROTATION:ANGLES] = Rotation.from_matrix(a.world[:3, :3] @ b.world[:3, :3].T).as_rotvec()
    step[ANGLES:POSE] = a.angles - b.angles
    step[VELOCITY:ACCELERATION] = a.velocity - b.velocity
    step[ACCELERATION:SCALE] = a.acceleration - b.acceleration
    step[SCALE] = a.log_scale[0] - b.log_scale[0]
    step[BIAS:] = (a.bias - b.bias).ravel()
    return step


def sighting(*seen: tuple[int, int], part: np.ndarray = WEARING.worn.part) -> Rows:
    """Rows of an update in which each `seen` (camera, marker) was observed; they say nothing but that."""
    rows = empty_rows(SIZE)
    for k, (camera, marker) in enumerate(seen):
        rows.source[k] = camera, 0, marker
        rows.part[k] = -1 if marker < 0 else part[marker]
        rows.first[k + 1] = 2 * k + 2
    rows.used[:] = 2 * len(seen), len(seen)
    return rows


@cache
def _frames() -> list[CameraObservations]:
    return sights(RIG, moving(), 1.3)


def blocks() -> list[MarkerBlock]:
    """What two cameras see of a grasping hand, in the order of time."""
    return sorted((MarkerBlock(WEARING, replace(frame, pixels=frame.pixels.copy())) for frame in _frames()),
                  key=lambda block: block.t_ns)


SETTLED = 80


@cache
def settled() -> tuple[Estimate, MarkerBlock]:
    """What a filter believes that has followed the grasping hand for a second, and the last frame it saw."""
    hand, frames, truth = filter_of_hand(), blocks()[:SETTLED], moving_estimate()
    hand.start(truth.world, truth.angles)
    for before, block in pairwise([frames[0], *frames]):
        hand.update(1e-9 * (block.t_ns - before.t_ns), [block])
    return hand.estimate, frames[-1]


def next_frame() -> tuple[Estimate, MarkerBlock]:
    """The settled hand, carried to the instant of the frame that comes next, and that frame."""
    (estimate, last), frame = settled(), blocks()[SETTLED]
    estimate = twin(estimate)
    predict(estimate, 1e-9 * (frame.t_ns - last.t_ns), WEARING.worn.part, WEARING.habits, WEARING.bias_variance)
    return estimate, frame
