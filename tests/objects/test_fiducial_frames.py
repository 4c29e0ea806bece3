"""From rendered images over the wire to a state, and datagrams as arrays."""

from __future__ import annotations

import numpy as np
from object_scenes import CUBE, PERIOD_NS, hand_poses, taken, wide_cameras
from tag_pictures import render

from rhot_app.estimation.se3 import log_so3
from rhot_app.objects.observations import fiducial_frame
from rhot_app.objects.state import Validity
from rhot_app.objects.track import ObjectTracker
from rhot_node.detect.tags import TagDetector
from rhot_node.wire.codec import decode, encode
from rhot_node.wire.messages import Fiducial, Fiducials


def message(found: list[Fiducial], row_time_ns: int = 0) -> Fiducials:
    return Fiducials(1, 1, 0, 10**9, 10**9, 0, 0, row_time_ns, 640, 480, 0, tuple(found))


def test_a_datagram_becomes_arrays() -> None:
    corners, covariances = tuple(float(n) for n in range(8)), (1.0, 0.25, 2.0) * 3 + (4.0, -0.5, 8.0)
    received = decode(encode(message([Fiducial(20, 7, corners, covariances)], 48_000)))
    assert isinstance(received, Fiducials)
    frame = fiducial_frame(received, 1, 123)
    assert (frame.camera, frame.t_row0_master_ns, frame.row_time_ns) == (1, 123, 48_000)
    assert frame.keys.tolist() == [[20, 7]]
    assert frame.corners.tolist() == [[[0.0, 1.0], [2.0, 3.0], [4.0, 5.0], [6.0, 7.0]]]
    assert frame.covariances[0, 0].tolist() == [[1.0, 0.25], [0.25, 2.0]]
    assert frame.covariances[0, 3].tolist() == [[4.0, -0.5], [-0.5, 8.0]]
    empty = fiducial_frame(message([]), 0, 0)
    assert empty.corners.shape == (0, 4, 2) and empty.keys.shape == (0, 2)


def test_rendered_images_are_tracked() -> None:
    rng, cameras, errors, squares = np.random.default_rng(1), wide_cameras(), [], []
    tracker, detector = ObjectTracker([CUBE], cameras), TagDetector([CUBE.fiducials[0].family])
    for number in range(40):
        camera, t_ns = number % 2, number * PERIOD_NS // 2
        true = hand_poses("grasp", np.array([1e-9 * t_ns]))[0]
        received = decode(encode(message(detector.detect(render(CUBE, true, cameras[camera], rng)))))
        assert isinstance(received, Fiducials)
        state = taken(tracker, fiducial_frame(received, camera, t_ns))[0]
        assert state.validity is Validity.TRACKED
        errors.append(np.concatenate([state.world_from_object[:3, 3] - true[:3, 3],
                                      log_so3(state.world_from_object[:3, :3] @ true[:3, :3].T)]))
        squares.append(errors[-1] @ np.linalg.solve(state.covariance, errors[-1]) / 6.0)
    rms = np.sqrt(np.mean(np.square(errors).reshape(-1, 2, 3).sum(axis=2), axis=0))
    assert rms[0] < 1e-3 and np.degrees(rms[1]) < 0.5
    assert np.mean(squares) < 3.0
