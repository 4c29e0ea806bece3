"""Rigs for the estimator, the hands that it is shown, and how far from the truth it puts them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import msgspec
import numpy as np
from synthetic_rig import WIDE, Trajectory, Viewing, hand_trajectory, make_rig, observe, run, seconds

from rhot_app.hand.anatomy import load_hand
from rhot_app.project import Rig, TrackerSettings
from rhot_app.state import HandState, Knowledge
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

THREE_SIGMA = 3.0


@cache
def model_rig(markers: str = "rhot6", side: str = "right", cameras: int = 2, **settings: Any) -> Rig:
    """Flat markers: sights without images are of their centres."""
    chosen = load_markers(resource_path("markers", f"{markers}.json"))
    flat = tuple(msgspec.structs.replace(marker, radius_mm=None, shape="disc") for marker in chosen.markers)
    return msgspec.structs.replace(
        make_rig(cameras=cameras), markers=msgspec.structs.replace(chosen, markers=flat),
        hand=load_hand(resource_path("hands", f"{side}.json")), tracker=TrackerSettings(kind="estimator", **settings))


@cache
def moving(motion: str = "grasp", seconds: float = 4.0, markers: str = "rhot6", side: str = "right") -> Trajectory:
    """Where the markers of `model_rig(markers, side)` are while the hand moves."""
    return hand_trajectory(model_rig(markers, side), motion, seconds)


def observations_of(rig: Rig, truth: Trajectory, seconds: float,
                    viewing: Viewing | None = None) -> list[CameraObservations]:
    """What the rig's cameras, which take turns, see of the motion."""
    phases = tuple(0.37 * camera % 1.0 for camera in range(len(rig.nodes)))
    return observe(rig, WIDE, truth, seconds, Viewing(phases=phases) if viewing is None else viewing)


def states_of(rig: Rig, frames: list[CameraObservations]) -> list[HandState]:
    """What a new tracker says of the frames."""
    return run(make_tracker(rig), frames)


def after_s(states: list[HandState], begin: float, end: float = np.inf) -> list[HandState]:
    """The states of instants from `begin` to `end`, s."""
    return [state for state in states if begin <= seconds(state) < end]


@dataclass(frozen=True)
class Deviations:
    """Fingertips against the truth. `mm` (N, 5) distances; `normalised` (N, 5) squared errors per degree of freedom by
    the stated covariances; `within` the share of axes of what is called measured that lie within three sigma."""

    mm: np.ndarray
    normalised: np.ndarray
    within: float

    @property
    def rms_mm(self) -> float:
        return float(np.sqrt(np.mean(self.mm**2)))


def deviations(states: list[HandState], truth: Trajectory) -> Deviations:
    """How far the states' fingertips are from the first five markers of `truth`."""
    errors = (np.array([state.fingertip_positions for state in states])
              - truth(np.array([seconds(state) for state in states]))[:, :5])
    covariances = np.array([state.fingertip_covariances for state in states])
    squares = np.einsum("nfi,nfij,nfj->nf", errors, np.linalg.inv(covariances), errors) / 3.0
    sigmas = np.sqrt(np.einsum("nfii->nfi", covariances))
    measured = np.array([state.marker_knowledge[:5] for state in states]) == Knowledge.MEASURED
    within = (np.abs(errors) <= THREE_SIGMA * sigmas)[measured]
    return Deviations(1e3 * np.linalg.norm(errors, axis=2), squares, float(within.mean()) if within.size else np.nan)
