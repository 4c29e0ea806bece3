"""Self-calibration by a moving hand: turns are noticed and mended, what cannot be known is said to be unknown."""

from __future__ import annotations

import contextlib
import math
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from knocked_rig import filmed, moved, rig_of, scene_of, volume_motion
from landmark_detector import landmark_rig
from synthetic_rig import WIDE, Viewing, hand_trajectory, make_rig, observe

from rhot_app.geometry.camera import CameraModel
from rhot_app.project import CameraCalibration, DepthSettings, Rig
from rhot_app.recording.raw_log import LogReader
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.refinement.pair_observations import CAPACITY, PairStore, linearise
from rhot_app.tracking.refinement.refined_rig import Refinement, Scale, refined_rig, stale_sentence, usable, verdict_of
from rhot_app.tracking.refinement.rig_refinement import RigRefiner
from rhot_app.tracking.tracker import CameraObservations

CASE = Path(__file__).resolve().parents[3] / "shared" / "cases" / "camera_moved_alarm" / "grasp6min.rhotlog"
SCENE = scene_of(1)
RIG = rig_of(SCENE)
SECONDS = 45.0


def turn(*degrees: float) -> np.ndarray:
    return np.concatenate([np.radians(degrees), np.zeros(3)])


def refined(frames: list[CameraObservations], rig: Rig = RIG) -> Refinement:
    refiner = RigRefiner(rig)
    for frame in frames:
        refiner.take(frame)
    found = refiner.step()
    assert found is not None
    return found


@pytest.fixture(scope="module")
def still() -> list[CameraObservations]:
    return filmed(SCENE, volume_motion(1), SECONDS)


def with_focal_length(rig: Rig, factor: float) -> Rig:
    node = rig.nodes[1]
    lens = msgspec.structs.replace(node.intrinsics, fx=factor * node.intrinsics.fx, fy=factor * node.intrinsics.fy)
    return msgspec.structs.replace(rig, nodes=(rig.nodes[0], msgspec.structs.replace(node, intrinsics=lens)))


def with_pose(rig: Rig, correction: np.ndarray) -> Rig:
    node = msgspec.structs.replace(rig.nodes[1], pose=moved(rig.nodes[1].pose, correction))
    return msgspec.structs.replace(rig, nodes=(rig.nodes[0], node))


def test_jacobians_are_those_of_finite_differences(still: list[CameraObservations]) -> None:
    refiner = RigRefiner(RIG)
    for frame in still[:1200]:
        refiner.take(frame)
    rows, focal = refiner.gather().rows, np.array([[n.intrinsics.fx, n.intrinsics.fy] for n in RIG.nodes])

    def errors(correction: np.ndarray) -> np.ndarray:
        nodes = with_pose(RIG, correction).nodes
        return linearise(rows, np.array([CameraModel.from_rig(n.intrinsics, n.pose).world_from_camera
                                         for n in nodes]), focal).error_px
    poses = np.array([CameraModel.from_rig(n.intrinsics, n.pose).world_from_camera for n in RIG.nodes])
    jacobian = linearise(rows, poses, focal).jacobian
    for k, step in enumerate([1e-4] * 3 + [1e-5] * 3):
        way = step * np.eye(6)[k]
        numeric = (errors(way) - errors(-way)) / (2.0 * step)
        assert jacobian[:, k] == pytest.approx(numeric, abs=0.5 + 2e-3 * np.abs(numeric).max())


def test_a_rig_that_nobody_touched_holds(still: list[CameraObservations]) -> None:
    found = refined(still)
    assert found.holds and found.knocked_s is None and stale_sentence(RIG, found) == ""
    assert not usable(found) and verdict_of(found, "left").codes == {"holds"}
    assert found.dispersion < 1.5


def test_rays_that_no_poses_bring_together_are_no_calibration_that_holds(still: list[CameraObservations]) -> None:
    refocused = verdict_of(refined(still, with_focal_length(RIG, 1.3)), "left")
    assert "misfit" in refocused.codes and "holds" not in refocused.codes and not refocused.acceptable
    late = verdict_of(refined([delayed(frame, 100_000_000) for frame in still]), "left")
    assert "misfit" in late.codes and "holds" not in late.codes


def test_poses_that_leave_the_rays_apart_are_not_offered(still: list[CameraObservations]) -> None:
    rng = np.random.default_rng(0)
    noisy = [replace(frame, pixels=frame.pixels + rng.normal(0.0, 2.0, frame.pixels.shape)) for frame in still]
    found = refined(noisy, with_pose(RIG, turn(-3.0, 0.0, 0.0)))
    assert not found.holds and not usable(found) and "misfit" in verdict_of(found, "left").codes


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_camera_that_turned_before_the_start_is_mended(axis: int, still: list[CameraObservations]) -> None:
    wrong = with_pose(RIG, turn(*(-0.3 * np.eye(3)[axis])))  # stands otherwise than its file says
    found = refined(still, wrong)
    (camera,) = found.cameras
    assert not found.holds and found.knocked_s == math.inf and usable(found)
    assert np.degrees(camera.turn) == pytest.approx(0.3 * np.eye(3)[axis], abs=0.03)
    assert found.after_px < 0.05 and math.degrees(camera.angle[1]) < 0.03
    mended = refined_rig(wrong, found)
    assert refined(still, mended).holds
    assert mended.nodes[0] == wrong.nodes[0] and mended.nodes[1].intrinsics == wrong.nodes[1].intrinsics
    assert "right camera is turned by 0." in stale_sentence(wrong, found)
    assert "use the refined calibration" in stale_sentence(wrong, found)


def test_a_knock_while_tracking_is_noticed_within_a_minute_and_the_time_before_does_not_pull() -> None:
    frames = filmed(SCENE, volume_motion(2), 70.0, turn(0.15, 0.2, -0.15), 40.0)
    refiner, noticed_s, due_s = RigRefiner(RIG), None, 10.0
    for frame in frames:
        refiner.take(frame)
        now_s = 1e-9 * (frame.t_row0_master_ns - frames[0].t_row0_master_ns)
        if now_s >= due_s:
            due_s += 10.0
            found = refiner.step()
            if found is not None and not found.holds:
                noticed_s = noticed_s or now_s
    assert noticed_s is not None and 40.0 < noticed_s <= 70.1
    assert found is not None and found.knocked_s == pytest.approx(30.0, abs=10.1)
    assert np.degrees(found.cameras[0].turn) == pytest.approx([0.15, 0.2, -0.15], abs=0.06)


def test_a_camera_that_moved_across_the_baseline_is_mended(still: list[CameraObservations]) -> None:
    found = refined(still, with_pose(RIG, np.array([0.0, 0.0, 0.0, 0.0, -2e-3, 0.0])))
    offset, sd = found.cameras[0].offset
    assert not found.holds and offset == pytest.approx(2e-3, abs=1e-4) and sd < 3e-4
    assert "moved by 2.0" in stale_sentence(RIG, found)
    assert np.linalg.norm(found.poses[1, :3, 3] - found.poses[0, :3, 3]) == pytest.approx(
        np.linalg.norm([0.075, 2e-3]), abs=1e-9), "as long as in the file"


def test_along_the_baseline_nothing_is_seen_or_changed(still: list[CameraObservations]) -> None:
    along = refined(still, with_pose(RIG, np.array([0.0, 0.0, 0.0, 2e-3, 0.0, 0.0])))
    assert along.holds
    assert np.linalg.norm(along.poses[1, :3, 3] - along.poses[0, :3, 3]) == pytest.approx(0.077, abs=1e-9)


def test_what_a_still_hand_does_not_determine_is_not_offered() -> None:
    found = refined(filmed(SCENE, "rest", SECONDS), with_pose(RIG, turn(-0.3, 0.0, 0.0)))
    assert not found.holds and "y" in found.cameras[0].undetermined
    assert not usable(found) and "undetermined" in verdict_of(found, "left").codes
    assert "Move the hand" in stale_sentence(RIG, found)


def test_biased_centroids_are_no_turned_camera(still: list[CameraObservations]) -> None:
    bias_px = np.random.default_rng(5).normal(0.0, 0.05, (2, len(RIG.markers.ids), 2))
    frames = [replace(frame, pixels=frame.pixels + bias_px[frame.camera]) for frame in still]
    assert refined(frames).holds
    found = refined(frames, with_pose(RIG, turn(-0.3, 0.0, 0.0)))
    assert np.degrees(found.cameras[0].turn) == pytest.approx([0.3, 0.0, 0.0], abs=0.03)


def test_what_predicts_no_held_back_rays_better_is_not_offered(still: list[CameraObservations]) -> None:
    found = refined(still, with_pose(RIG, turn(0.3, 0.0, 0.0)))
    assert not found.holds and usable(found) and found.held_out > 1000.0 and found.before_px > 50.0 * found.after_px
    for worse in (replace(found, held_out=10.0), replace(found, before_px=found.after_px)):
        assert worse.holds and not usable(worse) and stale_sentence(RIG, worse) == ""
        assert "held back" in verdict_of(worse, "left").findings[0].sentence
    assert refined(still[:800], with_pose(RIG, turn(0.3, 0.0, 0.0))).holds, "ten seconds predict nothing else"


@pytest.mark.skipif(not CASE.exists(), reason="../shared/cases/camera_moved_alarm is not there")
def test_a_rendered_hand_before_the_exact_rig_raises_no_alarm() -> None:
    with contextlib.closing(LogReader(CASE)) as reader:
        validator, refiner = LogValidator(reader.rig), RigRefiner(reader.rig)
        for record in reader:
            frame = validator.feed(record)
            if isinstance(frame, CameraObservations):
                refiner.take(frame)
            if refiner.gather().now_s > 75.0:
                break
    found = refiner.step()
    assert found is not None and found.probability < 1e-6, "a turn explains the biased observations in it"
    assert found.held_out < 5.0, "and predicts nothing"
    assert found.holds and stale_sentence(reader.rig, found) == ""


def test_a_camera_is_named_where_its_movement_stands_out(still: list[CameraObservations]) -> None:
    found = refined(still, with_pose(RIG, turn(0.0, 0.0, 0.3)))
    assert "right" in stale_sentence(RIG, found)
    vague = replace(found, cameras=tuple(replace(one, covariance=1e4 * one.covariance) for one in found.cameras))
    assert not found.holds and not any(name in stale_sentence(RIG, vague) for name in ("left", "right"))
    assert "cameras" in stale_sentence(RIG, vague)


def test_outliers_do_not_pull(still: list[CameraObservations]) -> None:
    rng, frames = np.random.default_rng(6), []
    for frame in still:
        wild = (rng.random(len(frame.pixels)) < 0.1)[:, None]
        frames.append(replace(frame, pixels=frame.pixels + wild * rng.uniform(-30.0, 30.0, frame.pixels.shape)))
    found = refined(frames, with_pose(RIG, turn(-0.3, 0.0, 0.0)))
    assert np.degrees(found.cameras[0].turn) == pytest.approx([0.3, 0.0, 0.0], abs=0.06)


def test_a_late_camera_is_no_turned_one() -> None:
    rig = make_rig()
    frames = observe(rig, WIDE, hand_trajectory(rig, "wave", SECONDS), SECONDS, Viewing(noise_px=0.05))
    late = [delayed(frame, 2_000_000) for frame in frames]
    assert refined(frames, rig).holds
    found = refined(late, rig)
    assert found.holds or math.degrees(found.cameras[0].angle[0]) < 0.1


def delayed(frame: CameraObservations, by_ns: int) -> CameraObservations:
    return replace(frame, t_row0_master_ns=frame.t_row0_master_ns - by_ns) if frame.camera else frame


def test_memory_is_bounded_and_spread_over_the_volume() -> None:
    store = PairStore()
    for k in range(CAPACITY):
        store.add(0.01 * k, (0, 1), 0, np.zeros((2, 2)), np.zeros((2, 2, 2)), np.array([0.0, 0.0, 0.6]))
    for k in range(200):
        store.add(30.0 + 0.01 * k, (0, 1), 1, np.zeros((2, 2)), np.zeros((2, 2, 2)), np.array([0.1, 0.0, 0.6]))
    rows = store.recent(32.0)
    assert store.count == len(rows["t_s"]) == CAPACITY and np.count_nonzero(rows["marker"] == 1) == 200
    assert np.all(np.diff(rows["t_s"]) >= 0.0) and rows["t_s"].min() == pytest.approx(2.0)


def test_rigs_that_cannot_be_refined_say_nothing() -> None:
    for rig in (msgspec.structs.replace(RIG, depth=DepthSettings("disparity")),
                msgspec.structs.replace(RIG, nodes=RIG.nodes[:1]),
                msgspec.structs.replace(RIG, nodes=(RIG.nodes[0], msgspec.structs.replace(
                    RIG.nodes[1], text_datagrams=True))), landmark_rig()):
        refiner = RigRefiner(rig)
        assert not refiner.active and refiner.step() is None


def test_landmarks_do_not_turn_the_cameras() -> None:
    """Their errors last: of a rig with both, paint alone is looked at."""
    rig = msgspec.structs.replace(RIG, markers=msgspec.structs.replace(RIG.markers, markers=(
        *RIG.markers.markers, *(msgspec.structs.replace(one, id=f"landmark_{one.id}")
                                for one in landmark_rig().markers.markers))))
    refiner, count = RigRefiner(rig), len(rig.markers.ids)
    pixels = np.full((2, count, 2), np.nan)
    pixels[:] = np.array([[300.0, 240.0], [250.0, 246.0]])[:, None]  # six pixels off each other's epipolar lines
    for number in range(40):
        for camera in range(2):
            refiner.take(CameraObservations(
                camera, number * 25_000_000, 0, 1e-5, number * 25_000_000, 0.0, 0.0, pixels[camera],
                np.tile(0.01 * np.eye(2), (count, 1, 1)), np.full(count, 10.0), np.ones(count),
                np.zeros(count, np.uint16)))
    assert set(refiner.gather().rows["marker"].tolist()) <= set(range(len(RIG.markers.ids)))


def test_a_second_timeline_begins_anew(still: list[CameraObservations]) -> None:
    refiner = RigRefiner(RIG)
    for frame in [*still, *still[:400]]:
        refiner.take(frame)
    assert refiner.gather().now_s < 10.0


def test_the_scale_is_told_and_never_applied(still: list[CameraObservations]) -> None:
    found = refined(still, with_pose(RIG, turn(0.0, 0.0, 0.3)))
    verdict = verdict_of(found, "left", Scale(1.06, 0.015))
    assert verdict.acceptable and "scale" in verdict.codes and "left as it is" in verdict.findings[0].sentence
    assert "scale" in verdict_of(found, "left", Scale(1.01, 0.015)).codes


def test_a_stated_error_of_places_grows(still: list[CameraObservations]) -> None:
    stated = msgspec.structs.replace(RIG, calibration=CameraCalibration("board", "ruler", 1e-3))
    record = refined_rig(stated, refined(still, with_pose(stated, turn(0.3, 0.0, 0.0)))).calibration
    assert record is not None and record.method == "refined" and record.lengths == "ruler"
    assert record.error_m is not None and 1e-3 < record.error_m < 2e-3
