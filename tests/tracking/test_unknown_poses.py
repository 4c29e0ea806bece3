"""Cameras whose poses are not known: no tracker is misled by them, and the others track as if they were alone."""

import msgspec
import numpy as np
import pytest
from landmark_detector import detected_landmarks, landmark_rig, moving_hand
from modelled_hand import states_of

from rhot_app.project import DepthSettings, Rig, TrackerSettings
from rhot_app.tracking.scene import make_tracker

RIG = landmark_rig()


def unplaced(rig: Rig) -> Rig:
    """The rig as it is before its cameras are put together: the second one's pose is the first one's."""
    first, *others = rig.nodes
    return msgspec.structs.replace(rig, nodes=(first, *(
        msgspec.structs.replace(node, pose=first.pose, pose_known=False) for node in others)))


def test_the_first_camera_tracks_as_if_it_were_alone():
    frames = detected_landmarks(RIG, moving_hand(RIG, "grasp", 1.0, 30.0, 1), 1)
    alone = states_of(unplaced(RIG), [frame for frame in frames if frame.camera == 0])
    both = states_of(unplaced(RIG), frames)
    assert any(state.tracked for state in alone) and len(alone) == len(both)
    for one, other in zip(alone, both, strict=True):
        assert one.condition is other.condition
        np.testing.assert_array_equal(one.joint_positions, other.joint_positions)


@pytest.mark.parametrize("tracker", [TrackerSettings("estimator", observe="contours"), TrackerSettings("classic")])
def test_no_tracker_takes_a_frame_of_a_camera_of_unknown_pose(tracker):
    rig = msgspec.structs.replace(unplaced(RIG), tracker=tracker)
    made = make_tracker(rig)
    second = next(frame for frame in detected_landmarks(RIG, moving_hand(RIG, "rest", 0.2, 30.0, 1), 1)
                  if frame.camera == 1)
    made.ingest(second)
    made.solve()
    assert made.newest_frames()[1] is None


def test_disparity_needs_no_poses():
    rig = msgspec.structs.replace(unplaced(RIG), depth=DepthSettings("disparity"))
    assert all(rig.tracked_with) and not all(unplaced(RIG).tracked_with)


def test_a_rig_of_which_no_pose_is_known_is_refused():
    nodes = tuple(msgspec.structs.replace(node, pose_known=False) for node in RIG.nodes)
    with pytest.raises(ValueError, match="pose_known"):
        msgspec.structs.replace(RIG, nodes=nodes)
