"""How large in metres what a camera sees is, wherever it is in the picture and however it moves."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from modelled_hand import model_rig, moving, sights
from places import places_of

from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.model import neutral_pose
from rhot_app.simulator.motion import FACING
from rhot_app.tracking.kalman.estimate import empty_estimate
from rhot_app.tracking.kalman.marker_block import MarkerBlock
from rhot_app.tracking.kalman.sizes import measure_sizes
from rhot_app.tracking.kalman.wearing import compile_wearing

RIG = model_rig()
WEARING = compile_wearing(RIG)
COUNT, INDEX = len(RIG.markers.markers), 1
WIDTH_M = 0.016
BARREL = (-0.28, 0.09, 0.0, 0.0, 0.0)
ROW_TIME_NS = 40_000


def seen_by(camera, widths_px, row_time_ns=0):
    frame = sights(RIG, moving(), 0.1)[camera]
    return MarkerBlock(WEARING, replace(frame, camera=camera, row_time_ns=row_time_ns, flags=np.zeros(COUNT, np.uint16),
                                        diameters=np.broadcast_to(widths_px, COUNT).astype(np.float64)))


def hand(place_m):
    """A hand whose index fingertip is there."""
    estimate = empty_estimate(2, COUNT)
    estimate.world[:3, :3] = FACING
    estimate.angles[:] = neutral_pose().angles
    estimate.world[:3, 3] = np.array(place_m) - placed(estimate)[0][INDEX]
    return estimate


def placed(estimate):
    return places_of(WEARING.worn, estimate)


def measured(block, estimate, cameras=WEARING.cameras):
    measure_sizes(WEARING.worn, cameras, block.frame, estimate, placed(estimate))
    return block.frame.sizes


def outline_width_px(model, place_m, velocity_m_s=(0.0, 0.0, 0.0), row_time_s=0.0):
    """The diameter of a disc as large as the picture of a ball is, each point of its outline taken at its own row's
    time, as of the time of its middle."""
    angles = np.linspace(0.0, 2.0 * np.pi, 200)
    sight = (model.camera_from_world @ [*place_m, 1.0])[:3]
    across = np.linalg.svd(sight[None])[2][1:]  # the outline is a circle about the line of sight
    circle = 0.5 * WIDTH_M * np.column_stack([np.cos(angles), np.sin(angles)])
    outline = np.array(place_m) + circle @ across @ model.camera_from_world[:3, :3]
    middle = model.project(np.array([place_m]))[0, 1]
    late = np.zeros((200, 1))
    for _ in range(20):
        x, y = model.project(outline + late * np.array(velocity_m_s)).T
        late = (row_time_s * (y - middle))[:, None]
    area = 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1)))
    return np.sqrt(4.0 * area / np.pi)


@pytest.mark.parametrize("place_m", [(0.0, 0.0, 0.6), (0.3, 0.1, 0.6), (-0.25, -0.15, 0.5)])
def test_a_ball_looks_equally_wide_wherever_it_is_before_any_lens(place_m):
    """Its silhouette grows towards the picture's edge and shrinks with a barrel's distortion."""
    nodes = [msgspec.structs.replace(node, intrinsics=msgspec.structs.replace(node.intrinsics, distortion=BARREL))
             for node in RIG.nodes]
    models = [CameraModel.from_rig(node.intrinsics, node.pose) for node in nodes]
    cameras = WEARING.cameras._replace(intrinsics=np.array([model.intrinsics for model in models]))
    for camera, model in enumerate(models):
        block = seen_by(camera, outline_width_px(model, place_m))
        assert measured(block, hand(place_m), cameras)[INDEX] == pytest.approx(WIDTH_M, rel=0.004)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-2.5, 2.5), min_size=3, max_size=3), st.integers(0, 1))
def test_what_moves_is_not_larger_than_what_stands_still(velocity_m_s, camera):
    place_m = (0.05, 0.02, 0.6)
    model = CameraModel.from_rig(RIG.nodes[camera].intrinsics, RIG.nodes[camera].pose)
    width_px = outline_width_px(model, place_m, velocity_m_s, 1e-9 * ROW_TIME_NS)
    estimate = hand(place_m)
    estimate.velocity[:3] = velocity_m_s
    assert measured(seen_by(camera, width_px, ROW_TIME_NS), estimate)[INDEX] == pytest.approx(WIDTH_M, rel=0.004)
    if abs(velocity_m_s[1]) > 1.0:
        assert width_px != pytest.approx(outline_width_px(model, place_m), rel=0.01)


def test_what_tells_no_width_or_is_behind_the_camera_has_no_size():
    estimate = hand((0.0, 0.0, 0.6))
    block = seen_by(0, np.where(np.arange(COUNT) == INDEX, 0.0, 20.0))
    block.frame.seen[0] = False
    sizes = measured(block, estimate)
    assert sizes[0] == sizes[INDEX] == 0.0 and (np.delete(sizes, (0, INDEX)) > 0.0).all()
    estimate.world[2, 3] = -0.6
    assert not measured(block, estimate).any()
