"""Articulated objects followed by templates in a scene: fingers that cross, a box that opens, what is not free."""

import numpy as np
import pytest
from modelled_hand import model_rig, moving, observations_of
from objects import Followed, box_on_hinge, object_of
from painted_object import meshes_of, picture
from pictures import look_at, wall
from synthetic_rig import EPOCH_NS

from rhot_app.articulated.bodies import ANGLES
from rhot_app.calibration.check.camera_calibration import CalibrationAccuracy
from rhot_app.diagnostics import Diagnostics, diagnostics_of
from rhot_app.errors import ObjectError, TrackingError
from rhot_app.geometry.camera import CameraModel
from rhot_app.objects.observations import MeasuredPose, PictureFrame
from rhot_app.objects.state import Validity
from rhot_app.tracking.kinds.templates import ConstantVelocity, LayeredTrack, free_of, picture_frames, rest_of
from rhot_app.tracking.rig_objects import SmoothedObjects
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
    assert Validity.TRACKED not in found[3:]
    assert set(found[4:]) == {Validity.LOST}, "three pictures and 0.1 s of contradiction are enough"
    assert len(track.templates.templates) == last, "nothing is learnt of a scene without the object"
    assert not diagnostics_of(scene.scene).all()


class Box:
    """A box before two cameras, whose track knows where it is at first."""

    def __init__(self, rate_hz=60.0, start_ns=0):
        self.model, self.bodies, _ = box_on_hinge()
        self.cameras = [look_at(np.array([x, -0.28, 0.30]), np.zeros(3), focal=500.0, width=400, height=300)
                        for x in (-0.12, 0.12)]
        self.meshes, self.rate_hz = meshes_of(self.model, 4, 0.2), rate_hz
        self.walls = [wall(camera, k, False) for k, camera in enumerate(self.cameras)]
        self.process = ConstantVelocity(free_of(self.model))
        self.track = LayeredTrack("box", self.bodies, self.model.limits, self.process, self.cameras, outline=False)
        self.scene = Followed(self.track, self.cameras)
        self.track.start(*self.process.start(*opening(0)), start_ns)

    def images(self, k):
        return [picture(self.model, self.meshes, *opening(k), camera, self.walls[c], k)
                for c, camera in enumerate(self.cameras)]

    def t_ns(self, k):
        return round(1e9 * k / self.rate_hz)

    def frames(self, k, images=None):
        return picture_frames(self.scene.rig, self.images(k) if images is None else images, [self.t_ns(k)] * 2)

    def see(self, k, images=None):
        """The validity after one instant's pictures."""
        for frame in self.frames(k, images):
            self.scene.scene.ingest(frame)
        return self.track.state(self.t_ns(k)).validity


def grey(noise, seed):
    rng = np.random.default_rng(seed)
    return np.clip(180 + noise * rng.normal(size=(300, 400, 3)), 0.0, 255.0).astype(np.uint8)


@pytest.mark.parametrize("what", ["plain", "noisy", "patch"])
def test_a_plain_surface_is_not_the_object(what):
    box = Box()
    standing = box.images(0)
    assert [box.see(k, standing) for k in range(4)] == 4 * [Validity.TRACKED]
    found = []
    for k in range(4, 16):
        images = [grey(3.0 * (what == "noisy"), 2 * k + c) for c in range(2)]
        if what == "patch":
            images = [one.copy() for one in standing]
            for one in images:
                one[90:230, 90:310] = 200, 150, 120
        found.append(box.see(k, images))
    assert found[-1] is Validity.LOST
    assert box.track.estimate() is None


def test_smoothed_is_no_worse_than_filtered_by_two_cameras():
    box, filtered = Box(), []
    smoothed = SmoothedObjects(box.scene.rig, Diagnostics(), [box.track])
    for k in range(6):
        for frame in box.frames(k):
            smoothed.ingest(frame)
        filtered.append(box.track.state(box.t_ns(k)))
    smoothed.finish()
    for k, before in enumerate(filtered):
        after = smoothed.states(box.t_ns(k))[-1]
        assert np.all(np.diag(after.covariance) <= 1.001 * np.diag(before.covariance))
    np.testing.assert_allclose(after.world_from_object, before.world_from_object, atol=1e-12)


def test_a_late_picture_teaches_what_it_shows():
    """A second camera's first picture comes after two more of the first: its templates are those of its own time."""
    taken = []
    for late in (False, True):
        box = Box()
        first, *later = (box.frames(k) for k in range(3))
        for frame in [first[0], *(one[0] for one in later), first[1], later[0][1]] if late else first:
            box.scene.scene.ingest(frame)
        taken.append(box.track.templates.templates)
    assert len(taken[0]) == len(taken[1]) > len(box.bodies.layer_row)
    for one, other in zip(*taken, strict=True):
        np.testing.assert_array_equal(one.points, other.points)


def test_a_pose_of_its_name_begins_nothing():
    box = Box()
    box.scene.scene.ingest(MeasuredPose("box", 0, np.eye(4), 1e-6 * np.eye(6)))
    assert box.track.estimate() is None
    assert [box.see(k) for k in range(2)] == 2 * [Validity.TRACKED]
    with pytest.raises(ObjectError, match="box"):
        make_tracker(box.scene.rig, articulated=[box.track, Box().track])


def test_a_slow_film_is_followed_and_begins_with_the_first_picture_after_the_start():
    box = Box(rate_hz=1.0, start_ns=-100)
    standing = box.images(0)
    assert [box.see(k, standing) for k in range(4)] == 4 * [Validity.TRACKED]


def test_another_start_takes_other_templates():
    box = Box()
    box.see(0)
    before = list(box.track.templates.templates)
    box.track.start(*box.process.start(*opening(0)), box.t_ns(1))
    assert before and not box.track.templates.templates
    assert all(view.frame is None and not view.noise for view in box.track.views)


def test_an_estimate_that_contradicts_itself_accepts_nothing():
    box = Box()
    box.see(0)
    state, covariance = box.process.start(*opening(0))
    covariance[0, 0] = -1.0
    assert box.track.gate(box.frames(1)[0], state, covariance).residual is None


def test_what_is_no_picture_of_the_rig_is_refused():
    box = Box()
    good = np.zeros((300, 400, 3), np.uint8)
    for bad in (good[:, :, 0], good.astype(float), np.zeros((300, 400, 4), np.uint8), good[:200]):
        with pytest.raises(TrackingError, match="camera 1"):
            picture_frames(box.scene.rig, [bad, good], [0, 0])
        with pytest.raises(TrackingError):
            LayeredTrack("other", box.bodies, box.model.limits, box.process, box.cameras, backgrounds=[bad, good])
    with pytest.raises(TrackingError):
        LayeredTrack("other", box.bodies, box.model.limits, box.process, box.cameras, backgrounds=[good])
    with pytest.raises(TrackingError):
        picture_frames(box.scene.rig, [good] * 3, [0] * 3)
    with pytest.raises(TrackingError):
        box.scene.scene.ingest(PictureFrame(7, 0, good))


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


def test_its_place_is_published_with_the_error_of_the_calibration():
    rig, (model, bodies, _) = model_rig(), object_of("planar_arm")
    cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    process = ConstantVelocity(free_of(model))
    track = LayeredTrack("arm", bodies, model.limits, process, cameras)
    scene = make_tracker(rig, articulated=[track])
    track.start(*process.start(*rest_of(model)), EPOCH_NS)
    lens = rig.nodes[0].intrinsics
    scene.ingest(*picture_frames(rig, [np.full((lens.height, lens.width, 3), 80, np.uint8), None], [EPOCH_NS] * 2))
    place = rest_of(model)[0][:3, 3]
    error = CalibrationAccuracy(5e-3, 0.6, np.array([node.pose.translation_m for node in rig.nodes]))
    states = []
    for frame in observations_of(rig, moving("grasp", 0.1), 0.1):
        scene.ingest(frame)
        states.append(scene.solve())
    own = next(state for state in states if state is not None and state.objects[-1].tracked)
    scene.by_calibration = error
    more = scene.published(own).objects[-1].covariance - own.objects[-1].covariance
    np.testing.assert_allclose(more[:3, :3], error.covariances(place), rtol=1e-3)
    assert not more[3:, 3:].any()


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
