"""A rig with two hands: every format has both, BVH one a file."""

from __future__ import annotations

from itertools import count
from logging import LogRecord
from pathlib import Path

import bvh
import ezc3d
import msgspec
import numpy as np
import pandas
import pygltflib
import pytest
from log_writing import write_log
from modelled_hand import model_rig, moving, observations_of
from tracked_log import states_of_log

from rhot_app.export.export import export_log
from rhot_app.export.plan import ExportOptions
from rhot_app.export.recording import TrackedLog
from rhot_app.export.states import HandStates, joined
from rhot_app.hand.skeleton import JOINTS
from rhot_app.project import OTHER_HAND, TrackerSettings
from rhot_app.state import HandState
from rhot_app.tracking.markers.estimator import Estimator

ASIDE = np.array([-0.14, 0.0, 0.05])  # where the left hand is, m


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six tenths of a second of a right hand and a left one."""
    right, left = model_rig("rhot8"), model_rig("rhot8", side="left")
    others = tuple(msgspec.structs.replace(marker, id=f"left.{marker.id}", role=f"{OTHER_HAND}{marker.role}")
                   for marker in left.markers.markers)
    rig = msgspec.structs.replace(
        right, markers=msgspec.structs.replace(right.markers, markers=right.markers.markers + others),
        other_hand=left.hand, tracker=TrackerSettings(kind="estimator"))
    own, other = moving("grasp", 0.6, "rhot8"), moving("pinch", 0.6, "rhot8", "left")
    frames = observations_of(rig, lambda times: np.concatenate([own(times), other(times) + ASIDE], axis=1), 0.6)
    return write_log(tmp_path_factory.mktemp("both") / "both.rhotlog", rig, frames)


@pytest.fixture(scope="module")
def states(both: Path) -> HandStates:
    return states_of_log(both, "estimator")


def test_both_are_smoothed(both: Path, states: HandStates) -> None:
    smoothed = states_of_log(both, "estimator", smooth=True)
    assert states.other is not None and smoothed.other is not None
    assert len(smoothed) == pytest.approx(len(states), abs=2)
    assert np.array_equal(smoothed.t_master_ns, smoothed.other.t_master_ns)
    assert (np.diff(smoothed.t_master_ns) > 0).all() and smoothed.marker_ids == states.marker_ids
    for before, after in ((states, smoothed), (states.other, smoothed.other)):
        assert after.tracked.mean() > before.tracked.mean() - 0.05
        spread = [np.nanmedian(np.trace(one.fingertip_covariances, axis1=2, axis2=3)) for one in (before, after)]
        assert spread[1] < 0.9 * spread[0]


@pytest.mark.parametrize("smooth", [False, True])
def test_what_one_hand_is_failed_over_and_warns_of_reaches_the_export(both: Path, smooth: bool,
                                                                      monkeypatch: pytest.MonkeyPatch,
                                                                      tracker_may_fail: list[LogRecord]) -> None:
    solve, hands, calls = Estimator.solve, list[Estimator](), count()

    def failing(hand: Estimator) -> HandState | None:
        hands.extend([] if hand in hands else [hand])
        found = solve(hand)
        if hands.index(hand) == 1:
            hand.diagnostics.warn("its thumb is ambiguous")
        if hand is hands[-1] and len(hands) == 2 and 30 <= next(calls) < 34:
            raise ZeroDivisionError("its length")
        return found
    monkeypatch.setattr(Estimator, "solve", failing)
    with TrackedLog(both, smooth=smooth) as log:
        assert len(joined(list(log.blocks()))) > 10
        loss, = log.losses
        assert log.warnings == ["its thumb is ambiguous"]
    assert "the other hand" in loss and "its length" in loss and "4 frames" in loss and len(tracker_may_fail) == 1


def test_tables_and_points_have_both(both: Path, states: HandStates, tmp_path: Path) -> None:
    assert states.other is not None and states.other.tracked.mean() > 0.5
    table = pandas.read_csv(export_log(both, tmp_path / "a.csv").path)
    place = states.other.joint_positions[:, JOINTS.index("index_tip")]
    assert table["other_joint_index_tip_x_mm"].to_numpy() == pytest.approx(1e3 * place[:, 0], abs=1e-3, nan_ok=True)
    assert list(table["other_condition"]) == list(states.other.conditions)
    assert "marker_left.wrist_x_mm" in table
    with np.load(export_log(both, tmp_path / "a.npz").path) as file:
        assert file["other_angles"] == pytest.approx(states.other.angles, rel=1e-6, nan_ok=True)
    labels = ezc3d.c3d(str(export_log(both, tmp_path / "a.c3d").path))["parameters"]["POINT"]["LABELS"]["value"]
    assert {"index_tip", "other_index_tip", "other_thumb_fingertip", "marker_left.wrist"} <= set(labels)
    assert export_log(both, tmp_path / "a.mcap").states == len(states)


def test_a_gltf_has_two_skins_and_a_bvh_the_hand_that_is_asked_for(both: Path, tmp_path: Path) -> None:
    file = pygltflib.GLTF2().load(str(export_log(both, tmp_path / "a.glb").path))
    assert len(file.skins) == 2 and len(file.animations[0].channels) == 34
    assert {"wrist", "other_wrist"} <= {node.name for node in file.nodes}
    roots = []
    for hand in ("hand", "other_hand"):
        options = ExportOptions(hand="hand" if hand == "hand" else "other_hand")
        done = export_log(both, tmp_path / f"{hand}.bvh", options=options)
        assert any(f"this is the rig's {hand}" in note for note in done.notes)
        found = bvh.Bvh(done.path.read_text())
        roots.append(found.frame_joint_channel(found.nframes - 1, "wrist", "Xposition"))
    assert roots[0] - roots[1] > 0.05, "the other hand is aside"
