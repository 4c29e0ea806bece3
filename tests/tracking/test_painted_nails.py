"""Hands with other paint than whole fingertips: both trackers find markers, fingertips and bends where the paint is."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from shipped_markers import NAILS6
from synthetic_rig import EPOCH_NS, WIDE, Viewing, compare, hand_trajectory, make_rig, observe, run

from rhot_app.hand.model import build_model
from rhot_app.project import FilterSettings, Rig, TrackerSettings
from rhot_app.simulator.scene.motion_file import load_motion
from rhot_app.tracking.rig_arrays import compile_rig
from rhot_app.tracking.scene import make_tracker

SECONDS = 3.0


def nails_rig(**fields: object) -> Rig:
    """The wrist without a body, as the rig's other sights are centres."""
    markers = tuple(msgspec.structs.replace(m, shape="blob", radius_mm=None) if m.role == "wrist"
                    else msgspec.structs.replace(m, **fields) for m in NAILS6.markers)
    return msgspec.structs.replace(make_rig(filters=FilterSettings(enabled=False)),
                                   markers=msgspec.structs.replace(NAILS6, markers=markers))


def bends_off(rig: Rig, states: list) -> float:
    """Root mean square of all angles, degrees, after the first second."""
    motion = load_motion("grasp", build_model(rig.hand), np.array([0.0375, 0.0, 0.6]), 1)
    later = [s for s in states if s.t_master_ns >= EPOCH_NS + 10**9]
    times = np.array([s.t_master_ns - EPOCH_NS for s in later]) * 1e-9
    return float(np.degrees(np.sqrt(np.mean((np.array([s.angles for s in later]) - motion.sample(times)[1]) ** 2))))


@pytest.fixture(scope="module")
def nails() -> tuple[Rig, CubicSpline, list]:
    rig = nails_rig()
    way = hand_trajectory(rig, "grasp", SECONDS)
    return rig, way, observe(rig, WIDE, way, SECONDS, Viewing(noise_px=0.02))


@pytest.mark.parametrize("kind", ["classic", "estimator"])
def test_nails_are_tracked_where_they_are(nails, kind) -> None:
    rig, way, frames = nails
    rig = msgspec.structs.replace(rig, tracker=TrackerSettings(kind=kind))
    states = run(make_tracker(rig), frames)
    errors = compare(rig, states, way)
    assert errors.marker_mm < 0.8 and errors.fingertip_mm < 1.0
    bones = msgspec.structs.replace(rig, markers=msgspec.structs.replace(rig.markers, markers=tuple(
        msgspec.structs.replace(m, patch="segment") for m in rig.markers.markers)))
    mistaken = run(make_tracker(bones), frames)
    if kind == "classic":
        assert bends_off(rig, states) < 0.75 * bends_off(bones, mistaken), "nails taken for segments bend the fingers"
    else:
        assert errors.marker_mm < 0.5 * compare(bones, mistaken, way).marker_mm, "they are inside the fingers"


def test_a_flat_patch_is_not_set_back_even_with_a_radius() -> None:
    arrays = compile_rig(nails_rig(radius_mm=6.0))
    assert not arrays.shapes[:5].any()
    ring = msgspec.structs.replace(NAILS6.markers[1], patch="ring", shape="band", radius_mm=8.0)
    rig = msgspec.structs.replace(nails_rig(), markers=msgspec.structs.replace(NAILS6, markers=(ring,)))
    assert compile_rig(rig).shapes[0] == pytest.approx(64e-6 * np.eye(3))
