"""Tracks any articulated object by layered templates, in images of one or more calibrated cameras (Rehg 1995, 4.4.1).

At every instant: predict; sort the links by visibility before each camera; compare the templates with the images,
smoothed first more and then less; estimate. What is then seen from a new side becomes a further template.

The object moves with constant velocity, with white acceleration of its root and its angles. A state of an object with A
angles has 12 + A + 6 + A numbers: world_from_root (3, 4) row by row, the angles, rad, and the velocities of the tangent
space. The tangent space has the root's translation, m, and rotation, rad, along world axes, the angles, and the
velocities of all these. What the file does not set free never moves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.articulated.bodies import (
    ANGLES,
    CAPSULE,
    ROOT_POSE,
    Bodies,
    Placed,
    camera_rays,
    frame_of,
    place,
    root_of,
)
from rhot_app.articulated.layered import LayeredFrame, layer_covariance
from rhot_app.articulated.outline import outline_of
from rhot_app.articulated.templates import LEAST_POINTS, Filtered, Image, Kind, TemplateSet, filtered
from rhot_app.articulated.visibility import Visibility, segment, visibility
from rhot_app.barehand.contour_residual import SHAPE_SD_M, JointLimits
from rhot_app.errors import TrackingError
from rhot_app.estimation.filter import IteratedFilter, Knot, update
from rhot_app.estimation.residual import Process, Residual
from rhot_app.estimation.se3 import PoseState, retract
from rhot_app.geometry.camera import CameraModel, CameraRecord
from rhot_app.hand.articulated_model import STATE_ROOT, ArticulatedModel, root_arrays
from rhot_node.detect.edges import noise_of

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

HELD = 0.8
"""Part of a template's points that agree with the image where its link is: 99.7 % would, but for light and creases."""


AMPLITUDE, PACE_HZ = (0.1, 0.8, 0.9), 1.5
"""m, rad and rad of the root's translation and rotation and of the angles, and 1/s: the harmonic motion that is
expected, whose speeds and accelerations the process has. Chosen: a hand that waves by 0.1 m, turns by 45 degrees and
closes by 50, three times in two seconds."""

START_SD = 1e-3, 0.01, 0.02
"""m, rad and rad: how well a start is known from which templates are taken. They show it no better."""


class ConstantVelocity(PoseState):
    """Implements `estimation.residual.Process`. `free` (6 + A,): what moves. `density` (6 + A,): of the white
    acceleration, squared units of the tangent space per s^3; `speed` (6 + A,): standard deviation of velocities."""

    def __init__(self, free: NDArray[np.bool_], pace_hz: float = PACE_HZ) -> None:
        """`pace_hz`: of the harmonic motion that is expected. Its acceleration lasts a quarter of a period."""
        self.free = free
        self.pose = len(free)
        self.size = 2 * self.pose
        self.speed = 2.0 * np.pi * pace_hz * self._each(AMPLITUDE) / np.sqrt(2.0)
        self.density = (2.0 * np.pi * pace_hz * self.speed) ** 2 / (4.0 * pace_hz)

    def _each(self, values: tuple[float, float, float]) -> Array:
        """(6 + A,): values of translation, rotation and angles, 0 where nothing moves."""
        return np.repeat(values, [3, 3, self.pose - ROOT_POSE]) * self.free

    def start(self, root: Array, angles: Array, sd: tuple[float, float, float] = START_SD) -> tuple[Array, Array]:
        """State and covariance at `root` (4, 4) and `angles` (A,), known to `sd`: m, rad and rad."""
        state = np.concatenate([root[:3].ravel(), angles, np.zeros(self.pose)])
        return state, np.diag(np.concatenate([self._each(sd), self.speed]) ** 2)

    def predict(self, state: Array, covariance: Array, dt_s: float) -> tuple[Array, Array]:
        """See `Process`."""
        if dt_s <= 0.0:
            return state.copy(), covariance.copy()
        step = np.zeros(self.size)
        step[:self.pose] = dt_s * state[ANGLES + self.pose - ROOT_POSE:]
        along = self.transition(state, dt_s)
        out = along @ covariance @ along.T
        pose, velocity = np.arange(self.pose), np.arange(self.pose, self.size)
        out[pose, pose] += self.density * dt_s**3 / 3.0
        out[pose, velocity] += self.density * dt_s**2 / 2.0
        out[velocity, pose] += self.density * dt_s**2 / 2.0
        out[velocity, velocity] += self.density * dt_s
        return retract(state, step), out

    def transition(self, state: Array, dt_s: float) -> Array:
        """See `Process`. The turn within a step is small: its effect on the axes of later turns is left out."""
        out = np.eye(self.size)
        out[np.arange(self.pose), np.arange(self.pose, self.size)] = dt_s
        return out


def free_of(model: ArticulatedModel) -> NDArray[np.bool_]:
    """(6 + A,) what the object's file sets free."""
    root = model.document.root.free
    return np.array([root != "none"] * 3 + [root == "pose"] * 3 + [angle.free for angle in model.document.angles])


def rest_of(model: ArticulatedModel) -> tuple[Array, Array]:
    """world_from_root (4, 4) and angles (A,) rad of the object at rest, as its file shows it."""
    root = np.empty((4, 4))
    root_arrays(model.rest, root)
    return root, model.rest[STATE_ROOT:].copy()


@dataclass(eq=False, slots=True)
class View:
    """One camera of a tracker. `background`: the filtered scene without the object, by smoothing; None: unknown.
    `visibility` of the last image, and its `frame`."""

    camera: CameraRecord
    rays: Array
    background: list[Filtered] | None = None
    noise: float = 0.0
    visibility: Visibility | None = None
    frame: LayeredFrame | None = None


class LayeredTracker:
    """One articulated object before some cameras."""

    def __init__(self, bodies: Bodies, limits: Array, process: Process, cameras: Sequence[CameraModel], *,
                 kind: Kind = "raw", layered: bool = True, outline: bool = True,
                 backgrounds: Sequence[Image] | None = None) -> None:
        """`limits` (A, 2) rad. `process`: a state begins with world_from_root (3, 4) and the angles, its tangent space
        with the root's translation, rotation and the angles. `kind`: how images are filtered; outlines
        need ``raw``. `layered` False: every template is taken for visible. `backgrounds`: each camera's image (H, W, 3)
        RGB without the object."""
        self.bodies, self.process, self.layered = bodies, process, layered
        self.outline = outline and kind == "raw"
        self.templates = TemplateSet(kind)
        self.views = [View(camera.record, camera_rays(camera)) for camera in cameras]
        for view, background in zip(self.views, backgrounds or (), strict=False):
            view.background = self.templates.images(background)
        self.filter = IteratedFilter(process)
        self._limits = JointLimits(limits)
        self._pose, self._epoch_ns = ROOT_POSE + len(limits), 0

    def start(self, state: Array, covariance: Array, images: Mapping[int, Image], t_ns: int) -> None:
        """Begin in a state that is known with this covariance, and take the first templates of what `images` (H, W, 3)
        RGB show, by camera."""
        self._epoch_ns = t_ns
        self.filter.start(0.0, state, covariance)
        self._take(images, self.filter.newest, anchor=True)

    def see(self, images: Mapping[int, Image], t_ns: int, extra: Sequence[Residual] = ()) -> Knot:
        """Weigh the images of some cameras at one instant, and other residuals of the same state.

        Raises TrackingError before `start`."""
        if not self.filter.knots:
            raise TrackingError("the object has no start; give one by start(state, covariance, images, t_ns)")
        t_s = 1e-9 * (t_ns - self._epoch_ns)
        prediction = self.filter.predict(t_s)
        state, initial, residuals = prediction[0], None, list(extra)
        for level, sigma in enumerate(self.templates.sigmas_px):
            frames = [self._frame(self.views[c], filtered(image, self.templates.kind, sigma), image, state,
                                  prediction[1] * 0.25**level, level)
                      for c, image in images.items()]
            residuals = [*frames, self._limits, *extra]
            if level < len(self.templates.sigmas_px) - 1:
                initial = state = update(self.process, t_s, prediction, residuals, initial).state
        knot = self.filter.add(t_s, residuals, prediction, initial)
        self._take(images, knot, anchor=False)
        return knot

    def _frame(self, view: View, smooth: Filtered, image: Image, state: Array, covariance: Array,
               level: int) -> LayeredFrame:
        """What the templates should be compared with in one image, for an object near `state`."""
        if not view.noise:
            view.noise = noise_of(image)
        placed = self._placed(state)
        view.visibility = visibility(self.bodies, placed, view.camera)
        chosen = [one for layer in range(len(self.bodies.layer_row))
                  if (one := self.templates.choose(layer, self._direction(view, placed, layer))) is not None]
        outline, order = None, view.visibility.order if self.layered else np.empty(0, np.int64)
        if self.outline:
            outline = outline_of(self.bodies, placed, order, view.camera)
        view.frame = LayeredFrame(
            self.bodies, order, view.camera, smooth, chosen, self.templates.kind, self.templates.sigmas_px[level],
            level, view.noise, np.ascontiguousarray(covariance[:self._pose, :self._pose]), outline,
            None if view.background is None else view.background[level])
        return view.frame

    def _placed(self, state: Array) -> Placed:
        return place(self.bodies, root_of(state), state[ANGLES:ANGLES + self._pose - ROOT_POSE])

    def _direction(self, view: View, placed: Placed, layer: int) -> Array:
        """(3,) unit, from the layer's frame to the camera, in that frame."""
        base = frame_of(placed, self.bodies.layer_row[layer])
        away = base[:3, :3].T @ (view.camera.centre - base[:3, 3])
        return np.asarray(away / np.linalg.norm(away))

    def _held(self, layer: int) -> bool:
        """Whether the last images agree with the templates of a layer."""
        used, held = np.sum([[view.frame.used[layer], view.frame.held[layer]] for view in self.views
                             if view.frame is not None] or [[0, 0]], axis=0)
        return bool(held >= LEAST_POINTS and held > HELD * used)

    def _sd_m(self, knot: Knot, placed: Placed, layer: int) -> float:
        """m: standard deviation of the far end of a layer."""
        body = int(np.flatnonzero(self.bodies.layer == layer)[-1])
        end = placed.ends[body, 1] if self.bodies.kind[body] == CAPSULE else placed.box[body, :, 3]
        covariance = layer_covariance(self.bodies, placed, layer, end, knot.covariance[:self._pose, :self._pose])
        return float(np.sqrt(np.trace(covariance)))

    def _take(self, images: Mapping[int, Image], knot: Knot, anchor: bool) -> None:
        """Take templates of the layers that are seen from a new side. What is known worse than the surface itself, or
        not held by the templates that it has, is left alone, unless it is to be the `anchor`."""
        placed = self._placed(knot.state)
        known = [anchor or (self._held(layer) and self._sd_m(knot, placed, layer) < SHAPE_SD_M)
                 for layer in range(len(self.bodies.layer_row))]
        for c, image in images.items():
            view = self.views[c]
            wanted = [layer for layer in range(len(self.bodies.layer_row))
                      if known[layer] and self.templates.wants(layer, self._direction(view, placed, layer))]
            if not wanted:
                continue
            if not view.noise:
                view.noise = noise_of(image)
            order = visibility(self.bodies, placed, view.camera).order
            labels = segment(self.bodies, placed, order, view.camera, view.rays)
            smooth = self.templates.images(image)
            for layer in wanted:
                self.templates.take(layer, smooth, labels, self.bodies, placed, view.camera, view.rays, view.noise,
                                    anchor)
