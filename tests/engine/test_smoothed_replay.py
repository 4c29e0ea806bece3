"""A smoothed replay gives the states of its log as the frames come again, in any number of passes."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot_app.engine.offline.replay_summary import SmoothedReplay, replay_states
from rhot_app.engine.pipeline import warm_up
from rhot_app.errors import EngineError, RecordingError
from rhot_app.evaluation.data_sets import LOG_NAME, Order, data_set
from rhot_app.project import with_tracker
from rhot_app.recording.raw_log import LogReader, encode_header
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.scene import make_tracker


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """1.8 s of grasping."""
    order = Order(make_scene(twin_defaults(), 1), "grasp", 1.8, sketched=True)
    return data_set(order, tmp_path_factory.mktemp("takes")).folder / LOG_NAME


def test_every_pass_gives_the_smoothed_states(log):
    rig = with_tracker(LogReader(log).rig, "estimator")
    expected = list(replay_states(LogReader(log), LogValidator(rig), make_tracker(rig, smooth=True)))
    tracker = SmoothedReplay(log, rig).for_rig(rig)
    warm_up(tracker, rig)
    for first in (0, len(expected)):
        states = list(replay_states(LogReader(log), LogValidator(rig), tracker))
        assert [state.t_master_ns for state in states] == [state.t_master_ns for state in expected]
        assert [state.sequence for state in states] == list(range(first, first + len(states)))
        np.testing.assert_array_equal([state.fingertip_positions for state in states],
                                      [state.fingertip_positions for state in expected])
        assert all(frame is not None for frame in tracker.newest_frames())
        tracker.reset()


def test_another_rig_is_refused_and_an_empty_log_too(log, tmp_path):
    rig = with_tracker(LogReader(log).rig, "estimator")
    with pytest.raises(EngineError, match="keeps its rig"):
        SmoothedReplay(log, rig).for_rig(msgspec.structs.replace(rig, name="another"))
    (tmp_path / "empty.rhotlog").write_bytes(encode_header(rig, {}))
    with pytest.raises(RecordingError, match="nothing in it can be tracked"):
        SmoothedReplay(tmp_path / "empty.rhotlog", rig)
