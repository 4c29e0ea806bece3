"""Fitting a hand by anchors and contours: what is dragged gets there, limits hold, lengths are as good as is said."""

import dataclasses

import msgspec
import numpy as np
import pytest
from bare_scenes import rig_of
from fit_scenes import another_hand, begun, drawn, seen
from pictures import capsules_of
from shipped_rig import RIGHT_HAND, RIGHT_MODEL

from rhot_app.barehand.surface import FOREARM_TURN, LENGTH, RADIUS, surface_of
from rhot_app.errors import CalibrationError
from rhot_app.hand.anatomy import load_hand, save_hand
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.motion.hand_state import SHAPE
from rhot_app.hand.skeleton import JOINTS
from rhot_app.handfit.hand_shape import ROOTS, SHAPE_LIMIT, SHAPE_SD, SIZE, Shapes, anatomy_of
from rhot_app.handfit.session import HandFit, warm_up
from rhot_app.handfit.state import OWN, Anchor, FitState
from rhot_app.project import CameraCalibration
from rhot_app.simulator.scene.motion_file import load_motion
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_node.errors import KeypointError
from rhot_node.landmarks.networks import DetectedHand

WRIST, INDEX_MCP, INDEX_TIP, LITTLE_MCP = (JOINTS.index(name) for name in ("wrist", "index_mcp", "index_tip",
                                                                          "little_mcp"))


def number(fit, group, name):
    return next(one for one in fit.numbers if (one.group, one.name) == (group, name))


def errors_m(fit, hand, pose):
    """(21,) m: the fit's joints against those of `hand` in `pose`."""
    places, _ = fit.solver.places(fit.state.shape, fit.instant)
    return np.linalg.norm(places - forward(build_model(hand), pose).joints, axis=1)


def with_pinned_palm():
    fit = begun(true_pose=True)
    for camera in range(2):
        for joint in (WRIST, INDEX_MCP, LITTLE_MCP):
            fit.anchor(camera, joint, tuple(fit.joints(camera)[joint]))
    return fit


# -- drags -------------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("freedom", ["pose", "lengths", "roots"])
@pytest.mark.parametrize(("joint", "by"), [("index_tip", (12.0, 25.0)), ("thumb_tip", (-20.0, 8.0)),
                                           ("wrist", (40.0, -60.0)), ("ring_pip", (5.0, -9.0))])
def test_a_dragged_joint_is_seen_at_the_pointer(freedom, joint, by):
    fit = begun(true_pose=True)
    fit.freedom = freedom
    joint = JOINTS.index(joint)
    target = tuple(fit.joints(0)[joint] + by)
    fit.anchor(0, joint, target)
    assert fit.joints(0)[joint] == pytest.approx(target, abs=0.5)


def test_a_dragged_fingertip_bends_its_finger_and_moves_the_palm_little():
    fit = begun(true_pose=True)
    before = fit.joints(0)
    fit.anchor(0, INDEX_TIP, tuple(before[INDEX_TIP] + (0.0, 25.0)))
    moved = np.linalg.norm(fit.joints(0) - before, axis=1)
    assert moved[INDEX_TIP] == pytest.approx(25.0, abs=0.5)
    assert moved[WRIST] < 0.3 * moved[INDEX_TIP] and moved[JOINTS.index("little_tip")] < 0.4 * moved[INDEX_TIP]


def test_anchors_in_both_cameras_hold_while_another_joint_is_dragged():
    fit = with_pinned_palm()
    fit.anchor(0, INDEX_TIP, tuple(fit.joints(0)[INDEX_TIP] + (3.0, 18.0)))
    assert len(fit.errors_px()) == 7 and max(fit.errors_px().values()) < 0.5


def test_beyond_its_limits_a_joint_goes_as_far_as_it_can():
    """The palm is pinned, so the fingertip reaches only where the finger can bend; every limit holds exactly."""
    fit = with_pinned_palm()
    start = fit.joints(0)[INDEX_TIP]
    target = fit.joints(0)[WRIST] + (-250.0, 0.0)
    fit.anchor(0, INDEX_TIP, tuple(target))
    angles, limits = fit.instant.pose.angles, fit.solver.limits
    assert np.all(angles >= limits[:, 0]) and np.all(angles <= limits[:, 1])
    at_limit = (angles[5:9] - limits[5:9, 0] < 1e-6) | (limits[5:9, 1] - angles[5:9] < 1e-6)
    assert at_limit.any(), "a finger that is pulled away is at a limit"
    left = np.linalg.norm(target - fit.joints(0)[INDEX_TIP])
    assert left > 20.0 and left < np.linalg.norm(target - start) - 20.0, "nearer, and still away"
    best = left
    for k in range(5, 9):  # no single angle brings it nearer
        for step in (-0.02, 0.02):
            moved = angles.copy()
            moved[k] = np.clip(moved[k] + step, *limits[k])
            pose = dataclasses.replace(fit.instant.pose, angles=moved)
            tip = fit.cameras[0].project(forward(fit.model, pose).joints[INDEX_TIP:INDEX_TIP + 1])[0]
            best = min(best, float(np.linalg.norm(target - tip)))
    assert best > left - 1.0


def test_a_shape_stays_among_those_that_people_have():
    fit = begun(true_pose=True)
    fit.freedom = "lengths"
    for joint, place in enumerate(fit.joints(0)):
        fit.anchor(0, joint, tuple(place))
    fit.anchor(0, INDEX_TIP, tuple(fit.joints(0)[INDEX_TIP] + (0.0, -150.0)))
    assert np.all(np.abs(fit.state.shape) <= SHAPE_LIMIT)


def test_an_anchor_outside_the_picture_is_refused_in_a_sentence_and_changes_nothing():
    fit = begun()
    fit.grab(1, INDEX_TIP)
    before = fit.state
    with pytest.raises(CalibrationError, match=r"outside the picture of camera 2, which has 640 x 480"):
        fit.drag((700.0, 20.0))
    assert fit.state is before


def test_an_anchor_is_removed_and_the_joint_is_free_again():
    fit = begun(true_pose=True)
    fit.anchor(0, INDEX_TIP, tuple(fit.joints(0)[INDEX_TIP] + (0.0, 10.0)))
    fit.remove_anchor(0, INDEX_TIP)
    assert fit.errors_px() == {} and fit.undoable == "removing the anchor of index tip"
    fit.remove_anchor(0, INDEX_TIP)
    assert fit.undoable == "removing the anchor of index tip", "nothing was there to remove"


# -- the history -------------------------------------------------------------------------------------------------------

def test_undo_and_redo_restore_every_state_exactly():
    fit = begun()
    states = [fit.state]
    fit.anchor(0, WRIST, (330.0, 400.0))
    states.append(fit.state)
    fit.freedom = "lengths"
    fit.anchor(1, INDEX_TIP, (300.0, 150.0))
    states.append(fit.state)
    fit.set_number(number(fit, "Lengths", "middle medial"), 31.0)
    states.append(fit.state)
    fit.fit_to_anchors()
    states.append(fit.state)
    fit.reset()
    states.append(fit.state)
    for back in reversed(states[:-1]):
        fit.undo()
        assert fit.state is back
    for forward_again in states[1:]:
        fit.redo()
        assert fit.state is forward_again
    assert not fit.redoable
    fit.undo()
    fit.set_number(number(fit, "Palm", "x"), 12.0)
    assert not fit.redoable, "another change takes the place of what was undone"


def test_nothing_to_undo_changes_nothing():
    fit = begun()
    fit.begin()
    before = fit.state
    assert fit.undoable == "" and fit.redoable == ""
    fit.undo()
    fit.redo()
    assert fit.state is before


def test_a_whole_drag_is_one_step():
    fit = begun(true_pose=True)
    before = fit.state
    fit.grab(0, INDEX_TIP)
    start = fit.joints(0)[INDEX_TIP]
    for part in np.linspace(0.1, 1.0, 10):
        fit.drag(tuple(start + part * np.array((5.0, 20.0))))
    fit.drag(tuple(np.add(start, (5.0, 20.0))), last=True)
    fit.release()
    assert fit.undoable == "moving index tip in camera 1"
    fit.undo()
    assert fit.state is before


def test_a_whole_movement_of_a_slider_is_one_step():
    fit = begun()
    before, flexion = fit.state, number(fit, "Index", "PIP flexion")
    for step, value in enumerate((20.0, 30.0, 40.0)):
        fit.set_number(flexion, value, goes_on=step > 0)
    assert fit.value(flexion) == pytest.approx(40.0)
    fit.undo()
    assert fit.state is before


def test_reset_is_where_it_began():
    fit = begun()
    first = fit.state.instants[0].pose
    fit.anchor(0, WRIST, (330.0, 400.0))
    fit.set_number(number(fit, "Sizes", "whole hand"), 110.0)
    fit.reset()
    assert fit.hand == anatomy_of(RIGHT_HAND, np.zeros(SIZE)) and fit.errors_px() == {}
    assert np.array_equal(fit.instant.pose.world_from_palm, first.world_from_palm)


# -- numbers -----------------------------------------------------------------------------------------------------------

def test_every_number_goes_where_it_is_moved_and_moves_nothing_else_of_its_kind():
    fit = begun(true_pose=True)
    for one in fit.numbers:
        before = {other.key: fit.value(other) for other in fit.numbers if other.kind == one.kind}
        low, high = (0.0, 30.0) if one.kind == "place" else (one.low, one.high)
        value = 0.6 * low + 0.4 * high
        fit.set_number(one, value)
        assert fit.value(one) == pytest.approx(value, abs=1e-3), one
        for other in fit.numbers:
            if other.kind == one.kind and other != one:
                assert fit.value(other) == pytest.approx(before[other.key], abs=1e-3), (one, other)
        fit.undo()


def test_angles_and_sizes_stop_at_their_limits():
    fit = begun()
    for group, name, far in (("Index", "PIP flexion", 400.0), ("Sizes", "whole hand", 500.0),
                             ("Lengths", "index medial", 300.0)):
        one = number(fit, group, name)
        fit.set_number(one, far)
        assert fit.value(one) == pytest.approx(one.high, rel=1e-6)
        fit.undo()


def test_standard_deviations_shrink_where_anchors_are():
    fit = begun(true_pose=True)
    bend = number(fit, "Index", "MCP flexion")
    before = fit.sd(bend)
    rig, _, _ = drawn()
    for camera, places in enumerate(seen(rig.hand, fit.instant.pose, fit.cameras)):
        for joint in (WRIST, INDEX_MCP, INDEX_MCP + 1, INDEX_TIP, LITTLE_MCP):
            fit.anchor(camera, joint, tuple(places[joint]))
    assert fit.sd(bend) < 0.5 * before
    fit.anchor_sd_px = 1.0
    exact = fit.sd(bend)
    fit.anchor_sd_px = 6.0
    assert exact < fit.sd(bend)


# -- fits --------------------------------------------------------------------------------------------------------------

def anchor_all(fit, hand, pose):
    """Anchors at all joints of this hand in both cameras, exact ones."""
    for camera, places in enumerate(seen(hand, pose, fit.cameras)):
        for joint, place in enumerate(places):
            fit.anchor(camera, joint, tuple(place))
    fit.anchor_sd_px = 0.5


@pytest.mark.parametrize(("side", "freedom", "kind", "field", "changed", "most_sd"), [
    ("right", "lengths", "length", "bones_mm", slice(0, RADIUS), 1.0),
    ("left", "lengths", "length", "bones_mm", slice(0, RADIUS), 1.0),
    ("right", "roots", "root", "base_mm", slice(ROOTS, SIZE), 2.0)])
def test_a_hand_comes_from_anchors_at_true_joints_in_two_cameras(side, freedom, kind, field, changed, most_sd):
    """Without noise every number is well within its standard deviation, from a pose of which nothing was known."""
    fit = begun(side=side)
    rig, pose, _ = drawn(side=side)
    hand = another_hand(rig.hand, 3 if kind == "length" else 5, only=changed)
    anchor_all(fit, hand, pose)
    fit.freedom = freedom
    fit.fit_to_anchors()
    truth = [one for finger in hand.fingers.values() for one in getattr(finger, field)]
    numbers = [one for one in fit.numbers if one.kind == kind]
    assert max(abs(fit.value(one) - true) / fit.sd(one) for one, true in zip(numbers, truth, strict=True)) < most_sd
    assert kind == "root" or max(fit.sd(one) for one in numbers) < 1.2, "mm: two cameras tell every bone"
    assert errors_m(fit, hand, pose).max() < 1e-3


def test_joints_dragged_one_by_one_never_lead_behind_a_camera():
    """The palm faces the cameras and the fit begins with its back to them, so the first anchors contradict the pose."""
    for person in (3, 8):
        scene, noise = make_scene(twin_defaults(), seed=person + 1), np.random.default_rng(person)
        hand = another_hand(scene.hand, person, only=slice(0, RADIUS))
        pose = load_motion("rest", build_model(hand), scene.centre, person + 1).pose(0.3)
        cameras = [scene.camera(camera) for camera in range(2)]
        fit = HandFit(msgspec.structs.replace(rig_of(cameras, scene.hand), calibration=CameraCalibration("exact")))
        fit.add_pictures({camera: np.zeros((model.height, model.width, 3), np.uint8)
                          for camera, model in enumerate(cameras)})
        for camera, places in enumerate(seen(hand, pose, cameras)):
            for joint in (WRIST, INDEX_MCP, LITTLE_MCP, *range(4, 21, 4)):
                x, y = places[joint] + 2.0 * noise.standard_normal(2)
                fit.anchor(camera, joint, (x, y))
                assert np.isfinite([fit.joints(other) for other in range(2)]).all()
        fit.freedom = "lengths"
        fit.fit_to_anchors()
        assert max(fit.errors_px().values()) < 20.0


def test_lengths_scatter_as_their_standard_deviations_say():
    """Anchors with noise on hands that vary as people's do: the normalised squared errors have the mean 1."""
    squares = []
    rig, pose, _ = drawn()
    for seed in range(12):
        fit, noise = begun(true_pose=True), np.random.default_rng(100 + seed)
        hand = another_hand(rig.hand, seed, only=slice(0, RADIUS))
        for camera, places in enumerate(seen(hand, pose, fit.cameras)):
            for joint, place in enumerate(places):
                state = fit.state
                anchor = tuple(place + 1.5 * noise.standard_normal(2))
                fit.take(state.change(0, state.instants[0].with_anchor(Anchor(camera, joint, anchor))), "an anchor")
        fit.freedom, fit.anchor_sd_px = "lengths", 1.5
        fit.fit_to_anchors()
        truth = [bone for finger in hand.fingers.values() for bone in finger.bones_mm]
        lengths = [one for one in fit.numbers if one.kind == "length"]
        squares += [((fit.value(one) - true) / fit.sd(one)) ** 2 for one, true in zip(lengths, truth, strict=True)]
    assert 0.6 < np.mean(squares) < 1.5


def test_two_instants_share_the_lengths_and_have_their_own_poses():
    fit = begun()
    rig, bent, images = drawn("grasp", 1.2)
    fit.add_pictures(dict(enumerate(images)))
    hand = another_hand(rig.hand, 7, only=slice(LENGTH, RADIUS))
    true_poses = (drawn()[1], bent)
    for k, pose in enumerate(true_poses):
        fit.current = k
        anchor_all(fit, hand, pose)
    fit.freedom = "lengths"
    fit.fit_to_anchors()
    for k, pose in enumerate(true_poses):
        fit.current = k
        assert errors_m(fit, hand, pose).max() < 1e-3
    both = [fit.sd(one) for one in fit.numbers if one.kind == "length"]
    fit.remove_instant()
    one = [fit.sd(one) for one in fit.numbers if one.kind == "length"]
    assert np.mean(both) < 0.95 * np.mean(one), "a bent and a straight hand tell more than one of them"


def test_fitting_without_anchors_or_pictures_says_what_to_do():
    fit = begun()
    with pytest.raises(CalibrationError, match="Drag a joint"):
        fit.fit_to_anchors()
    fit.remove_instant()
    with pytest.raises(CalibrationError, match="Take pictures"):
        fit.fitted_to_contours()


def test_contours_tell_lengths():
    """They show where fingertips end: the lengths are then better known than from people's hands."""
    _, pose, images = drawn()
    fit = begun()
    fit.undo()
    fit.add_pictures(dict(enumerate(images)), pose)
    fit.freedom = "lengths"
    lengths = [one for one in fit.numbers if one.kind == "length"]
    before = np.array([fit.sd(one) for one in lengths])
    fit.take(fit.fitted_to_contours(), "fitting to contours")
    after = np.array([fit.sd(one) for one in lengths])
    assert np.all(after <= before) and np.median(after) < 0.9 * np.median(before)


def test_contours_bring_a_hand_to_its_place():
    rig, pose, images = drawn()
    fit = begun()
    near = dataclasses.replace(pose, world_from_palm=pose.world_from_palm.copy())
    near.world_from_palm[:3, 3] += (0.004, -0.003, 0.005)
    fit.undo()
    fit.add_pictures(dict(enumerate(images)), near)
    before = errors_m(fit, rig.hand, pose)
    index, sd = number(fit, "Index", "MCP flexion"), fit.sd(number(fit, "Index", "MCP flexion"))
    fit.take(fit.fitted_to_contours(), "fitting to contours")
    after = errors_m(fit, rig.hand, pose)
    assert after.mean() < 0.5 * before.mean() and fit.instant.contour.found > 0.85
    assert fit.sd(index) < 0.2 * sd, "the contours count in the standard deviations"
    fit.set_number(index, 10.0)
    assert fit.instant.contour is None, "a hand moved by hand is not where the contours were"


class ShownHands:
    """Networks that find a right or left hand in the first pictures that they are given, where its joints are."""

    def __init__(self, places, right=1.0):
        self.places, self.right = list(places), right

    def find(self, picture):
        if not self.places:
            return ()
        return (DetectedHand(self.places.pop(0), np.zeros((21, 3)), 0.9, self.right, None),)


@pytest.mark.parametrize("cameras", [2, 1])
def test_a_hand_is_found_by_its_landmarks(monkeypatch, cameras):
    rig, pose, _ = drawn()
    fit = begun()
    joints = forward(build_model(rig.hand), pose).joints
    networks = ShownHands(camera.project(joints) for camera in fit.cameras[:cameras])
    monkeypatch.setattr("rhot_app.handfit.picture_search.open_hand_networks", lambda: networks)
    fit.take(fit.with_found_hand(lambda text, part: None), "finding the hand")
    assert np.median(errors_m(fit, rig.hand, pose)) < (3e-3 if cameras == 2 else 2e-2)
    assert len(fit.instant.anchors) == 21 * cameras
    fit.undo()
    assert not fit.instant.anchors


def test_only_finding_the_hand_needs_networks(monkeypatch):
    def missing():
        raise KeypointError("the hand networks are not installed.")

    monkeypatch.setattr("rhot_app.handfit.picture_search.open_hand_networks", missing)
    rig, _, _ = drawn()
    warm_up(rig, contours=True)
    with pytest.raises(KeypointError, match="not installed"):
        begun().with_found_hand(lambda text, part: None)


def test_no_hand_of_the_rigs_side_is_said_and_changes_nothing(monkeypatch):
    fit = begun()
    before = fit.state
    joints = [camera.project(fit.solver.places(before.shape, fit.instant)[0]) for camera in fit.cameras]
    monkeypatch.setattr("rhot_app.handfit.picture_search.open_hand_networks", lambda: ShownHands(joints, 0.1))
    with pytest.raises(CalibrationError, match="No right hand"):
        fit.with_found_hand(lambda text, part: None)
    assert fit.state is before


# -- derivatives and the hand file -------------------------------------------------------------------------------------

@pytest.mark.parametrize("side", ["right", "left"])
def test_the_joints_follow_every_number_as_their_derivative_says(side):
    fit = begun(side=side, true_pose=True)
    shape = 0.5 * SHAPE_SD * np.random.default_rng(2).standard_normal(SIZE)
    state = FitState(shape, fit.state.instants)
    _, slopes = fit.solver.places(shape, state.instants[0])
    free, step = np.full((21, 2), (-9.0, 9.0)), 1e-4
    for k in range(SIZE + OWN):
        move = np.zeros(state.size)
        move[k] = step
        ends = [state.moved(sign * move, free) for sign in (1.0, -1.0)]
        numeric = np.subtract(*(fit.solver.places(end.shape, end.instants[0])[0] for end in ends)) / (2.0 * step)
        assert slopes[:, :, k] == pytest.approx(numeric, abs=3e-5), k


def test_the_hand_file_says_what_was_fitted(tmp_path):
    """Sizes, lengths and forearm come back exactly as a surface; unequal radii meet at the joints between them."""
    rng = np.random.default_rng(4)
    shape = SHAPE_SD * rng.standard_normal(SIZE)
    shape[RADIUS:RADIUS + 15] = 0.0
    shape[ROOTS:] = 0.0
    hand = anatomy_of(RIGHT_HAND, shape)
    save_hand(tmp_path / "hand.json", hand)
    read = load_hand(tmp_path / "hand.json")
    assert read == hand
    _, pose, _ = drawn()
    bare = np.zeros(SHAPE)
    bare[:FOREARM_TURN] = shape[:FOREARM_TURN]
    base = surface_of(RIGHT_MODEL)
    centres, radii = capsules_of(base, pose.world_from_palm, pose.angles, bare)
    of_file, file_radii = capsules_of(surface_of(build_model(read)), pose.world_from_palm, pose.angles)
    own = base.group < 5
    assert of_file[own] == pytest.approx(centres[own], abs=1.5e-3) and file_radii == pytest.approx(radii, abs=1e-6)
    joints = Shapes(RIGHT_HAND).model(shape)
    assert forward(joints, pose).joints == pytest.approx(forward(build_model(read), pose).joints, abs=1e-9)
