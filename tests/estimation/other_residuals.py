"""Observation kinds that the tracker does not have: image lines, joint landmarks and contacts with planes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hand_states import world_of

from rhot_app.estimation.residual import GAUSSIAN, Kernel, Rows, student
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import forward_arrays, jacobian_arrays
from rhot_app.hand.motion.hand_state import POSE, STATE, tangent_size

HEAVY_TAILED = student(4.0)


def points_and_slopes(dh, state):
    """(P, 3) m and (P, 3, 27) of the table's points."""
    frames, points = np.empty((len(dh.parent), 3, 4)), np.empty((len(dh.point_row), 3))
    slopes = np.empty((len(points), 3, POSE))
    forward_arrays(dh, world_of(state), state[STATE.angles], frames, points)
    jacobian_arrays(dh, world_of(state), frames, points, slopes)
    return points, slopes


def padded(rows, state):
    """(K, n) of rows (K, 27) that the pose alone changes."""
    return np.hstack([rows, np.zeros((len(rows), tangent_size(state) - POSE))])


@dataclass
class Pinhole:
    camera_from_world: np.ndarray  # (3, 4), m
    focal: float = 530.0

    def project(self, points):
        """(P, 2) px of points (P, 3) and their slopes (P, 2, 3) px/m."""
        rotation = self.camera_from_world[:, :3]
        local = points @ rotation.T + self.camera_from_world[:, 3]
        pixels = self.focal * local[:, :2] / local[:, 2:]
        slopes = (self.focal * rotation[None, :2] - pixels[:, :, None] * rotation[None, 2:]) / local[:, 2, None, None]
        return pixels, slopes


@dataclass
class ImageLine:
    """A phalanx seen as the line normal . pixel = offset: the distances of its two joints' images from it, px."""

    dh: DhArrays
    camera: Pinhole
    ends: tuple[int, int]
    normal: np.ndarray  # (2,), of length 1
    offset: float
    sd_px: float

    @classmethod
    def through(cls, pixels, dh, camera, ends, sd_px):
        """The line through two pixels (2, 2)."""
        along = (pixels[1] - pixels[0]) / np.linalg.norm(pixels[1] - pixels[0])
        normal = np.array([-along[1], along[0]])
        return cls(dh, camera, ends, normal, normal @ pixels[0], sd_px)

    def linearise(self, state):
        points, moves = points_and_slopes(self.dh, state)
        pixels, slopes = self.camera.project(points[list(self.ends)])
        jacobian = np.einsum("i,pij,pjk->pk", self.normal, slopes, moves[list(self.ends)])
        return Rows(self.offset - pixels @ self.normal, padded(jacobian, state), np.full(2, self.sd_px**2))


@dataclass
class Landmark:
    """A detected 3-D joint position, with a full covariance and heavy tails."""

    dh: DhArrays
    joint: int
    place: np.ndarray  # (3,) m
    covariance: np.ndarray  # (3, 3) m^2
    kernel: Kernel = HEAVY_TAILED

    def linearise(self, state):
        points, moves = points_and_slopes(self.dh, state)
        return Rows(self.place - points[self.joint], padded(moves[self.joint], state), self.covariance, self.kernel,
                    np.array([0]))


@dataclass
class Contact:
    """A point of the hand lies on the plane normal . x = offset."""

    dh: DhArrays
    point: int
    normal: np.ndarray  # (3,), of length 1
    offset: float
    sd_m: float

    def linearise(self, state):
        points, moves = points_and_slopes(self.dh, state)
        return Rows(np.array([self.offset - self.normal @ points[self.point]]),
                    padded(self.normal[None] @ moves[self.point], state), np.array([self.sd_m**2]), GAUSSIAN)
