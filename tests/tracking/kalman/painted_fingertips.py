"""Painted fingertips, which are capsules, as two cameras see them whole or in part."""

from dataclasses import replace

import msgspec
import numpy as np
from modelled_hand import model_rig, moving, sights
from places import places_of
from scipy.spatial import ConvexHull

from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandPose, neutral_pose
from rhot_app.hand.shape import segments
from rhot_app.hand.skeleton import FINGERS
from rhot_app.simulator.motion import FACING
from rhot_app.tracking.kalman.estimate import empty_estimate
from rhot_app.tracking.kalman.hiding import judge_fingertips
from rhot_app.tracking.kalman.marker_block import MarkerBlock
from rhot_app.tracking.kalman.markers import project_marker
from rhot_app.tracking.kalman.sizes import measure_sizes
from rhot_app.tracking.kalman.wearing import compile_wearing
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

FLAT = model_rig()
RIG = msgspec.structs.replace(FLAT, markers=load_markers(resource_path("markers", "rhot6.json")))
WEARING = compile_wearing(RIG)
COUNT, INDEX, WRIST = 6, 1, 5
DISTANCE_M = 0.6


def hand(bent=0.0):
    estimate = empty_estimate(2, COUNT)
    estimate.world[:3, :3], estimate.world[:3, 3] = FACING, (0.03, 0.08, DISTANCE_M)
    estimate.angles[:] = neutral_pose().angles
    estimate.angles[5:] += bent
    estimate.unseen[:] = 0.0
    return estimate


def placed(estimate):
    return places_of(WEARING.worn, estimate)


def silhouette_m2(estimate, finger, eye):
    """The area that the capsule of a fingertip covers across the line of sight from `eye` (3,)."""
    pose = HandPose(estimate.world, estimate.angles)
    capsules = segments(WEARING.model, pose, forward(WEARING.model, pose))
    part = capsules.names.index(f"{FINGERS[finger]}_distal")
    start, end, radius = capsules.start[part], capsules.end[part], capsules.radius[part]
    sight = 0.5 * (start + end) - eye
    across = np.linalg.svd(sight[None])[2][1:]
    turns = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    rim = radius * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return ConvexHull(np.concatenate([across @ start + rim, across @ end + rim])).volume


def seen(estimate, camera, shares=(), flag=0):
    """What a camera sees of the hand: of some fingertips only these `shares` of their areas, flagged so."""
    points = placed(estimate).points
    eye = -WEARING.cameras.pose[camera, :, :3].T @ WEARING.cameras.pose[camera, :, 3]
    pixels, slope, flags = np.empty((COUNT, 2)), np.empty((2, 3)), np.zeros(COUNT, np.uint16)
    diameters = np.full(COUNT, 50.0)
    for m in range(COUNT):
        project_marker(points[m], estimate.world, WEARING.worn.half_axes[m], WEARING.cameras.pose[camera],
                       WEARING.cameras.intrinsics[camera], pixels[m], slope)
        if m != WRIST:
            share = dict(shares).get(m, 1.0)
            area_px2 = share * silhouette_m2(estimate, m, eye) * np.linalg.norm(np.cross(*slope))
            diameters[m], flags[m] = np.sqrt(4.0 / np.pi * area_px2), flag if share < 1.0 else 0
    frame = sights(FLAT, moving(), 0.1)[camera]
    return MarkerBlock(WEARING, replace(frame, camera=camera, pixels=pixels, row_time_ns=0, flags=flags,
                                        covariances=np.tile(0.05**2 * np.eye(2), (COUNT, 1, 1)), diameters=diameters))


def opened(block, estimate):
    """(M,) m: standard deviations that the frame's biases tend to beyond those of plain view."""
    places = placed(estimate)
    for sight in range(COUNT):
        block.frame.label[sight] = sight
    measure_sizes(WEARING.worn, WEARING.cameras, block.frame, estimate, places)
    judge_fingertips(WEARING.worn, WEARING.cameras, block.frame, estimate, places, WEARING.bias_variance)
    return np.sqrt(np.maximum(estimate.bias_variance - WEARING.bias_variance, 0.0))


def looked_at(bent=0.0):
    """A hand whose fingertips both cameras have seen in plain view."""
    estimate = hand(bent)
    for camera in (0, 1, 0, 1):
        assert opened(seen(estimate, camera), estimate).max() == 0.0
    return estimate
