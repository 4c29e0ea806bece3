"""Articulated objects followed by templates in a scene: fingers that cross, a box that opens, what is not free."""

import numpy as np
import pytest
from modelled_hand import model_rig, moving, observations_of
from objects import Followed, box_on_hinge, object_of
from painted_object import meshes_of, picture
from pictures import look_at, wall
from synthetic_rig import EPOCH_NS

from rhot_app.articulated.bodies import ANGLES
from rhot_app.diagnostics import diagnostics_of
from rhot_app.errors import TrackingError
from rhot_app.geometry.camera import CameraModel
from rhot_app.objects.state import Validity
from rhot_app.tracking.kinds.templates import ConstantVelocity, LayeredTrack, free_of, picture_frames, rest_of
from rhot_app.tracking.scene import make_tracker

PACE_HZ = 0.75


def filmed(model, angles_at, cameras, frames, rate_hz, root=None, seed=0, texture=0.15):
    """Images of every camera and of the empty scene; the object stands still but for its angles, degrees."""
    meshes, walls = meshes_of(model, seed, texture), [wall(camera, seed + k, False) for k, camera in enumerate(cameras)]
    pose = rest_of(model)[0] if root is None else root
    images = [[picture(model, meshes, pose, np.radians(angles_at(k / rate_hz)), camera, walls[c], 100 * seed + k)
               for c, camera in enumerate(cameras)] for k in range(frames)]
    return images, [np.clip(one, 0.0, 255.0).astype(np.uint8) for one in walls]


def crossing(t_s):
    """Two fingers that curl by turns, 15 Hz images: one passes before the other."""
    part = 0.5 - 0.5 * np.cos(np.pi * t_s)
    return np.array([10.0 + 80.0 * part, 10.0 + 90.0 * part, 90.0 - 80.0 * part, 100.0 - 90.0 * part])


def test_fingers_that_cross_are_told_apart_by_layers():
    model, bodies, _ = object_of("two_fingers")
    camera = look_at(np.array([0.10, -0.28, 0.27]), np.array([0.04, 0.0, 0.0]), focal=700.0)
    images, empty = filmed(model, crossing, [camera], 16, 15.0)
    process = ConstantVelocity(free_of(model), pace_hz=PACE_HZ)
    track = LayeredTrack("fingers", bodies, model.limits, process, [camera], backgrounds=empty)
    scene = Followed(track, [camera])
    scene.start(process.start(rest_of(model)[0], np.radians(crossing(0.0))), images[0])
    errors, orders = [], set()
    for k in range(1, 16):
        state = scene.see(images[k], round(1e9 * k / 15.0))
        errors.append(np.degrees(state[ANGLES:ANGLES + 4]) - crossing(k / 15.0))
        orders.add(tuple(track.views[0].frame.order))
        np.testing.assert_array_equal(state[:ANGLES], rest_of(model)[0][:3].ravel())  # the file keeps the root
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 2.0
    assert len(orders) > 1


def opening(k):
    root = np.eye(4)
    root[:3, 3] = [0.002 * k, -0.0015 * k, 0.001 * k]
    return root, np.radians([40.0 + 2.0 * k])


def test_a_box_is_followed_as_it_moves_and_opens_and_lost_when_it_is_gone():
    model, bodies, _ = box_on_hinge()
    cameras = [look_at(np.array([x, -0.28, 0.30]), np.zeros(3), focal=500.0, width=400, height=300)
               for x in (-0.12, 0.12)]
    meshes, walls = meshes_of(model, 4, 0.2), [wall(camera, k, False) for k, camera in enumerate(cameras)]

    def images(k):
        return [picture(model, meshes, *opening(k), camera, walls[c], k) for c, camera in enumerate(cameras)]

    process = ConstantVelocity(free_of(model))
    track = LayeredTrack("box", bodies, model.limits, process, cameras, outline=False)
    scene = Followed(track, cameras)
    scene.start(process.start(*opening(0)), images(0))
    for k in range(1, 9):
        state = scene.see(images(k), round(1e9 * k / 60.0))
    root, angles = opening(8)
    assert np.linalg.norm(state[[3, 7, 11]] - root[:3, 3]) < 5e-4
    assert abs(np.degrees(state[ANGLES] - angles[0])) < 0.5
    seen = track.state(round(8e9 / 60.0))
    assert seen.validity is Validity.TRACKED and np.linalg.norm(seen.world_from_object[:3, 3] - root[:3, 3]) < 5e-4

    empty, last = [np.clip(one, 0.0, 255.0).astype(np.uint8) for one in walls], len(track.templates.templates)
    found = []
    for k in range(9, 45, 3):
        t_ns = round(1e9 * k / 60.0)
        scene.see(empty, t_ns)
        found.append(track.state(t_ns).validity)
    assert found[-1] is Validity.LOST and Validity.TRACKED not in found[3:]
    assert len(track.templates.templates) == last, "nothing is learnt of a scene without the object"
    assert not diagnostics_of(scene.scene).all()


def test_before_a_start_nothing_is_followed():
    model, bodies, _ = object_of("planar_arm")
    camera = look_at(np.array([0.0, 0.0, -0.4]), np.zeros(3), width=64, height=48)
    track = LayeredTrack("arm", bodies, model.limits, ConstantVelocity(free_of(model)), [camera])
    scene = Followed(track, [camera])
    for frame in picture_frames(scene.rig, [np.zeros((48, 64, 3), np.uint8)], [0]):
        scene.scene.ingest(frame)
    assert track.estimate() is None and track.state(0).validity is Validity.SEARCHING


def test_a_picture_of_another_size_is_refused():
    scene_rig = Followed(*_arm()).rig
    with pytest.raises(TrackingError, match="camera 1"):
        picture_frames(scene_rig, [np.zeros((48, 60, 3), np.uint8)], [0])
    assert picture_frames(scene_rig, [None], [0]) == []


def _arm():
    model, bodies, _ = object_of("planar_arm")
    camera = look_at(np.array([0.05, 0.01, -0.4]), np.array([0.05, 0.0, 0.0]), width=160, height=120, focal=150.0)
    return LayeredTrack("arm", bodies, model.limits, ConstantVelocity(free_of(model)), [camera]), [camera]


def test_without_anything_to_see_it_predicts_and_is_lost():
    """Empty pictures at the start: no template is taken, the reasons are kept, the estimate stays finite."""
    model, _, names = object_of("planar_arm")
    track, cameras = _arm()
    scene, empty = Followed(track, cameras), [np.full((120, 160, 3), 80, np.uint8)]
    scene.start(ConstantVelocity(free_of(model)).start(*rest_of(model)), empty)
    assert track.state(0).validity is Validity.TRACKED
    found = []
    for k in range(1, 8):
        scene.see(empty, k * 10**8)
        found.append(track.state(k * 10**8))
    assert found[2].validity is Validity.PREDICTED and np.isfinite(found[2].world_from_object).all()
    assert set(track.templates.refused) == set(range(len(names)))
    assert found[-1].validity is Validity.LOST


@pytest.mark.parametrize("smooth", [False, True])
def test_its_root_is_among_the_objects_of_a_state(smooth):
    rig, (model, bodies, _) = model_rig(), object_of("planar_arm")
    cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    process = ConstantVelocity(free_of(model))
    track = LayeredTrack("arm", bodies, model.limits, process, cameras)
    scene, lens = make_tracker(rig, smooth=smooth, articulated=[track]), rig.nodes[0].intrinsics
    track.start(*process.start(*rest_of(model)), EPOCH_NS)
    scene.ingest(*picture_frames(rig, [np.full((lens.height, lens.width, 3), 80, np.uint8), None], [EPOCH_NS] * 2))
    states = []
    for frame in observations_of(rig, moving("grasp", 0.8), 0.8):
        scene.ingest(frame)
        states += scene.states()
    arms = [state.objects[-1] for state in [*states, *scene.finish()]]
    assert {one.name for one in arms} == {"arm"}
    followed = [one.validity for one in arms if one.validity is not Validity.SEARCHING]
    assert sorted(followed, key=[Validity.TRACKED, Validity.PREDICTED, Validity.LOST].index) == followed
    assert len(set(followed)) == 3
    np.testing.assert_allclose(next(one for one in arms if one.tracked).world_from_object, rest_of(model)[0], atol=1e-9)


def test_a_process_predicts_and_differs_on_its_manifold():
    process = ConstantVelocity(np.ones(8, bool))
    rng = np.random.default_rng(2)
    root = np.eye(4)
    state, covariance = process.start(root, np.array([0.2, -0.1]), (0.01, 0.1, 0.1))
    step = 0.3 * rng.normal(size=16)
    np.testing.assert_allclose(process.difference(process.retract(state, step), state), step, atol=1e-12)
    later, wider = process.predict(process.retract(state, step), covariance, 0.1)
    moved = process.difference(later, process.retract(state, step))
    np.testing.assert_allclose(moved[6:8], 0.1 * step[14:], atol=1e-12)
    assert np.all(np.linalg.eigvalsh(wider) > 0.0)
