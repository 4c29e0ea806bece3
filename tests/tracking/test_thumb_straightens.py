"""A thumb in plain view that bends backwards a little and then forwards: when it is straight the two look alike."""

import numpy as np
import pytest
from modelled_hand import after_s, deviations, model_rig, sights, states_of

from rhot_app.hand.kinematics import empty_frames, forward_arrays
from rhot_app.hand.model import neutral_pose
from rhot_app.hand.skeleton import ANGLE_SLICES
from rhot_app.simulator.motion import FACING
from rhot_app.tracking.kalman import timeline
from rhot_app.tracking.kalman.wearing import compile_wearing

RIG = model_rig()
WEARING = compile_wearing(RIG)
THUMB = ANGLE_SLICES[0]
BACKWARDS, FORWARDS = np.radians([-17, -25, 0, -6, -9]), np.radians([-30, -7, -8, 34, 35])
STRAIGHT = np.radians([0, 4, 5, 3])


def bending(begin_s, lasts_s):
    """Where the markers are of a hand with straight fingers whose thumb goes from one bend to the other."""
    world, angles = np.eye(4), neutral_pose().angles
    world[:3, :3], world[:3, 3] = FACING, (0.03, 0.08, 0.6)
    for finger in ANGLE_SLICES[1:]:
        angles[finger] = STRAIGHT

    def truth(times_s):
        out = np.empty((len(times_s), len(WEARING.roles), 3))
        for points, passed in zip(out, np.clip((times_s - begin_s) / lasts_s, 0.0, 1.0), strict=True):
            share = passed * passed * (3.0 - 2.0 * passed)
            angles[THUMB] = (1.0 - share) * BACKWARDS + share * FORWARDS
            forward_arrays(WEARING.worn.dh, world, angles, empty_frames(WEARING.worn.dh), points)
        return out

    return truth


def off_mm(lasts_s):
    """(N, 5) how far off fingertips are while the thumb bends, in runs in which cameras take their turns otherwise."""
    found = []
    for begin_s in np.arange(1.0, 1.05, 0.01):
        truth = bending(begin_s, lasts_s)
        found.append(deviations(after_s(states_of(RIG, sights(RIG, truth, begin_s + 1.2)), 1.0), truth).mm)
        assert np.median(found[-1]) < 0.6
    return np.concatenate(found)


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


@pytest.mark.parametrize(("lasts_s", "most_mm"), [(0.12, 2.0), (0.35, 0.9)])
def test_a_thumb_that_bends_the_other_way_stays_where_both_cameras_see_it(lasts_s, most_mm):
    assert rms(off_mm(lasts_s)[:, 0]) < most_mm


def test_it_does_so_because_what_turns_the_hand_is_weighed_with_the_frame_before(monkeypatch):
    together = rms(off_mm(0.12))
    monkeypatch.setattr(timeline, "BESIDE_NS", 0)
    assert together < 0.5 * rms(off_mm(0.12))


def test_it_is_told_as_well_known_as_it_is_when_it_turns_out_to_bend_the_other_way():
    truth = bending(1.0, 0.35)
    told = after_s(states_of(RIG, sights(RIG, truth, 2.2)), 0.9)
    sd_mm = [1e3 * np.sqrt(np.trace(state.fingertip_covariances[0])) for state in told]
    assert max(sd_mm) < 5.0
