"""Sights that are said to be exact: a covariance of zero is allowed on the wire, and made by whoever feeds by hand."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from modelled_hand import model_rig, moving, observations_of, states_of
from synthetic_rig import Viewing

from rhot_app.project import TrackerSettings
from rhot_app.state import Condition


@pytest.mark.parametrize("kind", ["classic", "estimator"])
def test_a_hand_whose_sights_are_said_to_be_exact_is_found_and_followed(kind):
    rig = msgspec.structs.replace(model_rig(), tracker=TrackerSettings(kind=kind))
    frames = [replace(frame, covariances=np.zeros_like(frame.covariances))
              for frame in observations_of(rig, moving("grasp"), 1.0, Viewing(noise_px=0.0, phases=(0.0, 0.37)))]
    states = states_of(rig, frames)[10:]
    assert all(state.condition in (Condition.TRACKING, Condition.PARTIAL) for state in states)
    assert np.mean([np.isfinite(state.marker_raw_positions).all() for state in states]) > 0.95
    assert all(np.isfinite(state.marker_positions).all() for state in states)
