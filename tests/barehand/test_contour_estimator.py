"""The bare hand live, with nodes that search drawn images: found, tracked, lost, replayed, and with landmarks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import pytest
from bare_scenes import DISTANCE_M, ShownNodes, model_and_surface, near, poses, rig_of, scene
from pictures import look_at, picture, taken, wall
from scipy.spatial.transform import Rotation
from scipy.stats import chi2
from shipped_markers import RHOT6
from shipped_rig import RIGHT_MODEL

from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame, SliceRequest
from rhot_app.errors import RigError
from rhot_app.evaluation.contour_tracker import FIRST_NS, PERIOD_NS
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.kinematics import forward
from rhot_app.hand.skeleton import FLEXIONS, JOINTS, HandPose
from rhot_app.project import Rig, TrackerSettings, with_tracker
from rhot_app.state import Condition, HandState, Knowledge
from rhot_app.tracking.contours.finder import Finder
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraFrame
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

TIMES = tuple(k / 30.0 for k in range(14))
INDEX_TIP = JOINTS.index("index_tip")
STILL = 4  # pictures of the hand before it moves


@pytest.fixture(scope="module")
def film() -> list[tuple[list, list, list]]:
    return [scene(pose, k) for k, pose in enumerate(poses("grasp", TIMES))]


def bare_rig(cameras: list[CameraModel], observe: str = "contours", markers: str = "rhot6",
             shown: HandPose | None = None) -> Rig:
    rig = msgspec.structs.replace(rig_of(cameras, shown=[shown or near(poses("grasp", TIMES)[0])]),
                                  markers=load_markers(resource_path("markers", f"{markers}.json")))
    return msgspec.structs.replace(rig, tracker=msgspec.structs.replace(rig.tracker, kind="estimator",
                                                                        observe=observe))


def shown_nodes(film: list[tuple[list, list, list]], observe: str = "contours", markers: str = "rhot6",
                shown: HandPose | None = None, **options: Any) -> ShownNodes:
    return ShownNodes(bare_rig(film[0][0], observe, markers, shown), film[0][2], **options)


def curled(pose: HandPose) -> HandPose:
    """The same with a bent index finger."""
    angles = pose.angles.copy()
    angles[list(FLEXIONS[1])] = 1.6, 1.8, 1.4
    return HandPose(pose.world_from_palm, angles)


def error_mm(state: HandState, pose: HandPose) -> float:
    truth = forward(model_and_surface()[0], pose).joints
    return 1e3 * float(np.median(np.linalg.norm(state.joint_positions - truth, axis=1)))


def follow(nodes: ShownNodes, film: list[tuple[list, list, list]]) -> None:
    """An empty scene, a hand that holds the pose that is shown until it is followed, then the whole motion."""
    nodes.show(film[0][2], 3)
    assert nodes.states and not any(state.tracked for state in nodes.states)
    nodes.show_until_tracked(film[0][1], 37)
    for _, images, _ in film:
        nodes.show(images)


@dataclass(frozen=True)
class Run:
    """Of a hand that takes its start pose, moves, is seen by one camera only for eight frames, and goes."""

    waiting: list

    followed: HandState
    drawn: list
    asked: list[SliceRequest]
    alone: list[HandState]
    drawn_at_last: list
    lost: HandState


@pytest.fixture(scope="module", params=[False, True], ids=["live", "from a log"])
def run(film, request) -> Run:
    nodes = shown_nodes(film, forget=request.param)
    nodes.show(film[0][2], 3)
    waiting = nodes.tracker.seen()
    follow(nodes, film)
    followed, drawn, asked, before = nodes.states[-1], nodes.tracker.seen(), list(nodes.asked), len(nodes.states)
    nodes.show([film[-1][1][0], None], 8)
    alone = nodes.states[before:]
    nodes.show(film[0][2], 20)
    return Run(waiting, followed, drawn, asked, alone, nodes.tracker.seen(), nodes.states[-1])


def test_the_start_pose_is_shown_while_there_is_no_hand(film, run: Run) -> None:
    joints = forward(model_and_surface()[0], poses("grasp", TIMES)[0]).joints
    for seen, camera in zip(run.waiting, film[0][0], strict=True):
        assert seen.shown and not len(seen.slices) and not len(seen.edges)
        apart = np.linalg.norm(seen.contour.mean(axis=0) - camera.project(joints).mean(axis=0))
        assert len(seen.contour) > 50 and apart < 60.0
    assert all(seen.shown for seen in run.drawn_at_last) and not any(seen.shown for seen in run.drawn)


def test_a_hand_is_found_tracked_and_lost(film, run: Run) -> None:
    last, pose = run.followed, poses("grasp", TIMES)[-1]
    assert last.tracked and error_mm(last, pose) < 5.0
    assert last.t_receive_ns - last.t_master_ns == pytest.approx(9_000_000, abs=1000)
    for seen, camera in zip(run.drawn, film[0][0], strict=True):
        assert len(seen.contour) == len(seen.outline) == len(seen.slices) > 50
        assert len(seen.edges) == len(seen.of_hand) and 0.3 < np.mean(seen.of_hand) <= 1.0
        apart = np.linalg.norm(seen.edges[seen.of_hand][:, None] - seen.contour[None], axis=2).min(axis=1)
        assert np.median(apart) < 2.0 and (seen.edges < [camera.width, camera.height]).all()
    assert last.marker_ids == RHOT6.ids and np.isnan(last.marker_positions).all()
    assert run.lost.condition is Condition.LOST and np.isnan(run.lost.joint_positions).all()


class EdgesLast(ShownNodes):
    """The last camera's edges come after its map."""

    def give(self, frame: CameraFrame) -> None:
        last = len(self.foreground) - 1
        if isinstance(frame, EdgeFrame) and frame.camera == last:
            self.held = frame
            return
        super().give(frame)
        if isinstance(frame, ForegroundFrame) and frame.camera == last and self.held is not None:
            held, self.held = self.held, None
            super().give(held)

    held: EdgeFrame | None = None


def test_maps_that_come_before_the_last_edges_confirm_the_hand(film) -> None:
    nodes = EdgesLast(bare_rig(film[0][0]), film[0][2])
    follow(nodes, film[:4])
    assert error_mm(nodes.states[-1], poses("grasp", TIMES)[3]) < 5.0


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours")
def test_a_hand_is_found_and_tracked_by_slow_cameras(film) -> None:
    """Of a hand that is found after the first camera's frame, the second one's edges come first."""
    nodes = shown_nodes(film)
    for number in range(16):
        nodes.step(number, film[0][1 if number >= 3 else 2], times_ns=[FIRST_NS + 4 * number * PERIOD_NS] * 2)
    assert nodes.states[-1].tracked and error_mm(nodes.states[-1], poses("grasp", TIMES)[0]) < 5.0
    assert nodes.states[-1].t_master_ns == FIRST_NS + 4 * number * PERIOD_NS, "no camera's edges wait for a frame"


@pytest.mark.parametrize(("periods", "sure"), [(1, True), (4, False)])
def test_fingers_that_may_be_taken_for_each_other_are_called_guessed(film, periods: int, sure: bool) -> None:
    """Between two pictures of slow cameras a finger may move by more than a finger's breadth."""
    nodes = shown_nodes(film)
    for number in range(18):
        nodes.step(number, film[0][1 if number >= 3 else 2], times_ns=[FIRST_NS + periods * number * PERIOD_NS] * 2)
    last = nodes.states[-1]
    assert last.tracked and (last.condition is Condition.TRACKING) == sure
    assert (last.joint_knowledge[1:] == Knowledge.MEASURED).mean() > 0.8 if sure else (
        last.joint_knowledge[1:] == Knowledge.GUESSED).all()


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours")
@pytest.mark.parametrize("apart_ms", [2, 10])
def test_a_camera_with_a_wrong_pose_gives_a_resting_hand_no_velocity(film, apart_ms: int) -> None:
    """A camera that is turned by a fifth of a degree shows it 2 mm elsewhere, milliseconds later: that is no speed."""
    rig = bare_rig(film[0][0])
    turned = Rotation.from_quat(rig.nodes[1].pose.rotation_wxyz, scalar_first=True) * Rotation.from_rotvec(
        [0.2, 0.0, 0.0], degrees=True)
    pose = msgspec.structs.replace(rig.nodes[1].pose,
                                   rotation_wxyz=tuple(turned.as_quat(scalar_first=True).tolist()))
    rig = msgspec.structs.replace(rig, nodes=(rig.nodes[0], msgspec.structs.replace(rig.nodes[1], pose=pose)))
    nodes = ShownNodes(rig, film[0][2])
    for number in range(30):
        t_ns = FIRST_NS + 3 * number * PERIOD_NS
        nodes.step(number, film[0][1 if number >= 3 else 2], times_ns=[t_ns, t_ns + 1_000_000 * apart_ms])
    assert nodes.states[-1].tracked and error_mm(nodes.states[-1], poses("grasp", TIMES)[0]) < 5.0
    speeds = [np.linalg.norm(state.velocity[:3]) for state in nodes.states[-5:]]
    assert np.median(speeds) < 0.1  # m/s


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours")
def test_a_confused_finger_is_relocalised(film) -> None:
    """The hand takes the shown pose but for one finger."""
    pose = poses("grasp", TIMES)[0]
    nodes = shown_nodes(film, shown=curled(pose))
    nodes.show_until_tracked(film[0][1])
    nodes.show(film[0][1], 20)
    tip = forward(model_and_surface()[0], pose).joints[INDEX_TIP]
    assert np.linalg.norm(nodes.states[-1].joint_positions[INDEX_TIP] - tip) < 0.01


def test_a_hand_that_is_lost_is_followed_again_from_its_start_pose_only(film) -> None:
    nodes = shown_nodes(film)
    follow(nodes, film)
    nodes.show(film[0][2], 20)
    assert nodes.states[-1].condition is Condition.LOST
    aside = poses("grasp", TIMES)[0]
    world = aside.world_from_palm.copy()
    world[:3, 3] += 0.08 * world[:3, 1]
    nodes.show(scene(HandPose(world, aside.angles))[1], 20)
    assert nodes.states[-1].condition is Condition.LOST, "it does not take the pose"
    nodes.show_until_tracked(film[0][1])
    assert error_mm(nodes.states[-1], aside) < 5.0


def test_requested_slices_cross_the_contour_of_the_next_frame(film, run: Run) -> None:
    _, images, _ = film[-1]
    for camera, request in enumerate(run.asked):
        assert len(request.slices) > 50
        assert (request.slices[:, 4] < 30.0).all()
        difference = np.abs(film[-1][2][camera].astype(float) - images[camera]).max(axis=2)
        inner, outer = (difference[tuple(np.clip(np.round(end[:, ::-1]).astype(int), 0, [[479, 639]]).T)] > 15.0
                        for end in (request.slices[:, :2] + side * request.slices[:, 2:4] for side in (-5.0, 5.0)))
        assert np.mean(inner) > 0.9, "normals point from the hand outwards"
        assert 0.4 < np.mean(~outer) < 0.95, "most contours are outlines, some lie within the hand"


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours")
@pytest.mark.parametrize("which", ["followed", "looked for"])
def test_a_recording_that_restarts_is_a_new_session(film, which: str) -> None:
    nodes = shown_nodes(film)
    if which == "followed":
        follow(nodes, film)
    else:
        nodes.show_until(lambda: len(nodes.states) >= 8, film[0][1], 40)
    nodes.states.clear()
    nodes.number = first = nodes.number - 100  # three seconds earlier
    nodes.show_until_tracked(film[0][1])
    assert nodes.number - first > 2, "of what was before, nothing is reported"
    times_ns = [state.t_master_ns for state in nodes.states]
    assert times_ns == sorted(times_ns) and times_ns[-1] <= FIRST_NS + nodes.number * PERIOD_NS
    assert error_mm(nodes.states[-1], poses("grasp", TIMES)[0]) < 5.0


def test_one_camera_continues_the_track_alone(run: Run) -> None:
    assert len(run.alone) > 3 and run.alone[-1].tracked


OUT_M = 0.22  # so far to the right, the second camera of `leaving` does not see the hand


def leaving(frames: int, out: int) -> tuple[list[CameraModel], list[HandPose], list[list[np.ndarray]], list]:
    """Two cameras, a grasping hand that goes to the right in `frames` frames, out of the picture of the second one,
    stays there for `out` frames and comes back: its poses and pictures, and those of the empty scene."""
    middle = np.array([0.0, 0.0, DISTANCE_M])
    cameras = [look_at(np.array([-0.125, 0.0, 0.0]), middle), look_at(np.array([0.125, 0.0, 0.0]),
                                                                      middle - [0.15, 0.0, 0.0])]
    way = np.linspace(0.0, 1.0, frames)
    away_m = OUT_M * np.concatenate([3.0 * way**2 - 2.0 * way**3, np.ones(out), 1.0 - 3.0 * way**2 + 2.0 * way**3])
    moved = []
    for pose, x_m in zip(poses("grasp", tuple(k / 30.0 for k in range(len(away_m)))), away_m, strict=True):
        world = pose.world_from_palm.copy()
        world[0, 3] += x_m
        moved.append(HandPose(world, pose.angles))
    walls = [wall(camera, 10 * k + 1, False) for k, camera in enumerate(cameras)]
    images = [[picture(model_and_surface()[1], pose.world_from_palm, pose.angles, camera, walls[c], k)
               for c, camera in enumerate(cameras)] for k, pose in enumerate(moved)]
    return cameras, moved, images, [taken(one, 0) for one in walls]


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours")
def test_a_hand_outside_one_cameras_image_is_tracked_by_the_other() -> None:
    frames, out = 24, 60
    cameras, moved, images, empty = leaving(frames, out)
    joints = [forward(model_and_surface()[0], pose).joints for pose in moved]
    assert all((cameras[1].project(one)[:, 0] > cameras[1].width).all() for one in joints[frames:frames + out])
    nodes = ShownNodes(bare_rig(cameras, shown=near(moved[0])), empty)
    nodes.show_until_tracked(images[0], 20)
    outside = []  # squared Mahalanobis distances of the joints while one camera shows them
    for k, one in enumerate(images):
        before = len(nodes.states)
        nodes.show(one)
        assert all(state.tracked for state in nodes.states[before:]), f"lost in frame {k}"
        if frames <= k < frames + out:
            assert len(nodes.states) > before, "the camera that shows it is weighed without waiting for the other"
            error = nodes.states[-1].joint_positions - joints[k]
            outside.append(np.einsum("ij,ijk,ik->i", error, np.linalg.inv(nodes.states[-1].joint_covariances), error))
    assert np.mean(np.array(outside) < chi2.ppf(0.997, 3)) > 0.9, "it says how uncertain it is"
    assert error_mm(nodes.states[-1], moved[-1]) < 5.0
    nodes.show(empty, 20)
    assert nodes.states[-1].condition is Condition.LOST, "both should show it, and do not"


def landmarks(film: list[tuple[list, list, list]], pose: HandPose) -> list[np.ndarray]:
    joints = forward(model_and_surface()[0], pose).joints
    return [camera.project(joints) for camera in film[0][0]]


def show_landmarks_until_tracked(nodes: ShownNodes, film: list[tuple[list, list, list]], which: int) -> None:
    """Landmarks show at once where a hand at rest is."""
    pose = poses("grasp", TIMES)[which]
    nodes.show_until_tracked(film[which][1], round(0.5e9 / PERIOD_NS), landmarks(film, pose))
    assert error_mm(nodes.states[-1], pose) < 5.0


def test_landmarks_start_a_track_that_contours_continue_and_start_it_again_after_a_loss(film, monkeypatch) -> None:
    monkeypatch.setattr(Finder, "look", lambda *_: None)  # it would start at the start pose, too
    nodes = shown_nodes(film, "landmarks_and_contours", "landmarks21")
    show_landmarks_until_tracked(nodes, film, 0)
    for _, images, _ in film:
        nodes.show(images)  # its detector has lost it
    assert nodes.states[-1].tracked and error_mm(nodes.states[-1], poses("grasp", TIMES)[-1]) < 6.0
    nodes.show(film[0][2], 20)
    assert nodes.states[-1].condition is Condition.LOST
    show_landmarks_until_tracked(nodes, film, 5)


def test_landmarks_correct_a_confused_finger(film, monkeypatch) -> None:
    pose = poses("grasp", TIMES)[0]
    nodes = shown_nodes(film, "landmarks_and_contours", "landmarks21")
    monkeypatch.setattr(Finder, "relocalise", lambda *_, **__: None)  # it would correct the finger, too
    with monkeypatch.context() as patched:
        patched.setattr(Finder, "found", lambda _: (curled(pose), FIRST_NS))
        nodes.show_until_tracked(film[0][1], 20)
    tip = forward(model_and_surface()[0], pose).joints[INDEX_TIP]
    assert np.linalg.norm(nodes.states[-1].joint_positions[INDEX_TIP] - tip) > 0.02, "it is wrong"
    for _ in range(30):
        nodes.show(film[0][1], 1, landmarks(film, pose))
        assert nodes.tracked
    assert np.linalg.norm(nodes.states[-1].joint_positions[INDEX_TIP] - tip) < 0.003


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours")
def test_a_fingertip_that_contradicts_the_contours_moves_no_finger(film) -> None:
    """An object of the index finger's colour lies 6 cm from it. The rest of the hand is bare."""
    two = msgspec.structs.replace(RHOT6, markers=tuple(one for one in RHOT6.markers
                                                       if one.role in ("thumb_tip", "index_tip")))
    rig = msgspec.structs.replace(bare_rig(film[0][0], "both"), markers=two)
    nodes, pose = ShownNodes(rig, film[0][2]), poses("grasp", TIMES)[0]
    tips = np.argsort([one.role != "thumb_tip" for one in two.markers])
    marked = forward(RIGHT_MODEL, pose).marker_centres[:2][tips]
    nodes.show(film[0][2], 3)
    pixels = [camera.project(marked) for camera in film[0][0]]
    nodes.show_until(lambda: len(nodes.states) >= 60, film[0][1], 200, pixels)
    assert nodes.states[-1].tracked and error_mm(nodes.states[-1], pose) < 3.0
    true, wrong = marked.copy(), marked.copy()
    wrong[int(np.flatnonzero(tips == 1)[0])] += [0.06, 0.0, 0.0]
    for places in (wrong, true):
        for _ in range(20):
            nodes.show(film[0][1], 1, [camera.project(places) for camera in film[0][0]])
            assert nodes.tracked
        tip = forward(model_and_surface()[0], pose).joints[INDEX_TIP]
        assert np.linalg.norm(nodes.states[-1].joint_positions[INDEX_TIP] - tip) < 0.003
        assert error_mm(nodes.states[-1], pose) < 3.0


@pytest.mark.parametrize(("change", "sentence"), [
    (lambda rig: with_tracker(rig, "classic"), ""),
    (lambda rig: msgspec.structs.replace(rig, depth=msgspec.structs.replace(rig.depth, mode="disparity")),
     "needs calibrated cameras"),
    (lambda rig: msgspec.structs.replace(rig, tracker=TrackerSettings("estimator", observe="landmarks_and_contours")),
     "RHOT six.*has none. Give the rig a set with landmarks"),
])
def test_an_invalid_rig_raises_an_error_with_a_sentence(film, change: Callable[[Rig], Rig], sentence: str) -> None:
    rig = change(bare_rig(film[0][0]))
    if sentence:
        with pytest.raises(RigError, match=sentence):
            make_tracker(rig)
    else:
        assert rig.tracker.observe == "markers", "the classic tracker knows markers only"
    with pytest.raises(ValueError, match="knows markers only"):
        TrackerSettings("classic", observe="both")
