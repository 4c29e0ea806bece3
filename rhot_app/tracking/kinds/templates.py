"""Templates of articulated objects: pictures of files, compared by layers in visibility order (Rehg 1995, 4.4.1).

At every picture: predict; sort the links by visibility before its camera; compare the templates with it, smoothed first
more and then less; estimate. What is then seen from a new side becomes a further template.

The object moves with constant velocity, with white acceleration of its root and its angles. A state of an object with A
angles has 12 + A + 6 + A numbers: world_from_root (3, 4) row by row, the angles, rad, and the velocities of the tangent
space. The tangent space has the root's translation, m, and rotation, rad, along world axes, the angles, and the
velocities of all these. What the file does not set free never moves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.articulated.bodies import ANGLES, CAPSULE, ROOT_POSE, Bodies, Placed, camera_rays, frame_of, place
from rhot_app.articulated.layered import LayeredFrame, chain_rows
from rhot_app.articulated.outline import outline_of
from rhot_app.articulated.templates import LEAST_POINTS, Filtered, Image, ImageFilter, TemplateSet, filtered
from rhot_app.articulated.visibility import segment, visibility
from rhot_app.barehand.contour_residual import SHAPE_SD_M, JointLimits
from rhot_app.errors import TrackingError
from rhot_app.estimation.filter import Estimate, refined
from rhot_app.estimation.gauss_markov import white_acceleration
from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.quantiles import chi_squared
from rhot_app.estimation.residual import Process, Residual
from rhot_app.estimation.se3 import PoseState, retract
from rhot_app.estimation.track import GATE, NEVER
from rhot_app.geometry.camera import CameraModel, CameraRecord
from rhot_app.hand.articulated_model import STATE_ROOT, ArticulatedModel, forward_state
from rhot_app.objects.observations import FrameOfObjects, PictureFrame
from rhot_app.objects.pose import Mode
from rhot_app.objects.track import REJECTIONS, Gated, ObjectTrack
from rhot_app.project import Rig
from rhot_app.tracking.kinds.kind import FrameTimes, Kind
from rhot_node.detect.edges import noise_of

Array = NDArray[np.float64]

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
        step = np.zeros(self.size)
        step[:self.pose] = dt_s * state[ANGLES + self.pose - ROOT_POSE:]
        along = self.transition(state, dt_s)
        return retract(state, step), along @ covariance @ along.T + white_acceleration(self.density, dt_s)

    def transition(self, state: Array, dt_s: float) -> Array:
        """See `Process`. The turn within a step is small: its effect on the axes of later turns is left out."""
        out = np.eye(self.size)
        out[:self.pose, self.pose:] = dt_s * np.eye(self.pose)
        return out


def free_of(model: ArticulatedModel) -> NDArray[np.bool_]:
    """(6 + A,) what the object's file sets free."""
    root = model.document.root.free
    return np.array([root != "none"] * 3 + [root == "pose"] * 3 + [angle.free for angle in model.document.angles])


def rest_of(model: ArticulatedModel) -> tuple[Array, Array]:
    """world_from_root (4, 4) and angles (A,) rad of the object at rest, as its file shows it."""
    return forward_state(model, model.rest).root, model.rest[STATE_ROOT:].copy()


class Picture(NamedTuple):
    """What a file has in place of a node's message: an `image` (H, W, 3) RGB."""

    image: Image


def _is_picture(image: Any, size: tuple[int, int]) -> bool:
    """Whether it is (H, W, 3) bytes of this height and width."""
    return isinstance(image, np.ndarray) and image.dtype == np.uint8 and image.shape == (*size, 3)


class TemplateKind(Kind):
    """See `Kind`. Their residual is `articulated.layered.LayeredFrame`, on the state of a `LayeredTrack`."""

    name = "templates"
    messages = (Picture,)

    def configure(self, rig: Rig, camera: int) -> None:
        """See `Kind`."""
        super().configure(rig, camera)
        lens = rig.nodes[camera].intrinsics
        self._size = lens.height, lens.width

    def refusal(self, message: Any) -> str | None:
        """A picture of another size, or not of RGB bytes."""
        return None if _is_picture(message.image, self._size) else "image_size"

    def observe(self, collected: Any, times: FrameTimes) -> PictureFrame:
        """See `Kind`."""
        return PictureFrame(self.camera, times.t_row0_ns, collected.image)


@dataclass(eq=False, slots=True)
class View:
    """One camera of a track. `background`: the filtered scene without the object, by smoothing; None: unknown.
    `frame`: the last picture, of master time `newest_ns`."""

    camera: CameraRecord
    rays: Array
    background: list[Filtered] | None = None
    noise: float = 0.0
    frame: LayeredFrame | None = None
    newest_ns: int = NEVER


class LayeredTrack(ObjectTrack):
    """The track of one articulated object by its templates. It begins where somebody says; templates show no start."""

    poses = False

    def __init__(self, name: str, bodies: Bodies, limits: Array, process: Process, cameras: Sequence[CameraModel], *,
                 kind: ImageFilter = "raw", layered: bool = True, outline: bool = True,
                 backgrounds: Sequence[Image] | None = None) -> None:
        """`limits` (A, 2) rad. `process`: a state begins with world_from_root (3, 4), the angles and the root's
        velocity, its tangent space with the root's translation, rotation and the angles. `kind`: how images are
        filtered; outlines need ``raw``. `layered` False: every template is taken for visible. `backgrounds`: each
        camera's image (H, W, 3) RGB without the object. Raises TrackingError when one is missing, or of another size
        than the camera's."""
        self.bodies, self.layered, self.outline = bodies, layered, outline and kind == "raw"
        self.templates = TemplateSet(kind)
        self.views = [View(camera.record, camera_rays(camera)) for camera in cameras]
        if backgrounds is not None and len(backgrounds) != len(cameras):
            raise TrackingError(f"there are {len(backgrounds)} backgrounds of {len(cameras)} cameras; give one of each")
        for number, (view, background) in enumerate(zip(self.views, backgrounds or (), strict=False)):
            if not _is_picture(background, view.rays.shape[:2]):
                raise TrackingError(f"background {number} has another size than its camera's pictures, or is not "
                                    "(H, W, 3) RGB bytes; give one that the camera took")
            view.background = self.templates.images(background)
        self._limits, self._pose = JointLimits(limits), ROOT_POSE + len(limits)
        moving = ANGLES + len(limits)
        super().__init__(name, process, slice(moving, moving + ROOT_POSE))

    def start(self, state: Array, covariance: Array, t_ns: int) -> None:
        """Begin anew in a state that is known with this covariance at master time `t_ns`, with the first picture from
        then on; from all pictures of its instant the first templates are taken."""
        self.reset()
        self.templates.templates.clear()
        self.templates.refused.clear()
        self._known: tuple[int, Mode] | None = t_ns, Mode(state, covariance, 0.0, 0, 0.0)

    def reset(self) -> None:
        """Forget everything but the templates."""
        super().reset()
        self._known = None
        for view in self.views:
            view.noise, view.frame, view.newest_ns = 0.0, None, NEVER

    def ingest(self, frame: FrameOfObjects) -> None:
        """See `ObjectTrack`."""
        if not isinstance(frame, PictureFrame):
            return
        t_ns, view = frame.t_row0_master_ns, self.views[frame.camera]
        if t_ns > view.newest_ns > NEVER:
            gap_ns = t_ns - view.newest_ns
            self._period_ns = min(self._period_ns, gap_ns) if self._period_ns else gap_ns
        view.newest_ns, view.frame = max(view.newest_ns, t_ns), None
        known = self._known_at(t_ns)
        begun = known and self.estimate() is not None
        if begun or self.take(_Comparison(t_ns, known, partial(self.gate, frame))):
            found = self.estimate()
            if known:
                self.learn(frame, known[0].state, known[0].covariance, True)
            elif found is not None and found[0] == t_ns:  # a late picture shows the object where it was before
                self.learn(frame, found[1].state, found[1].covariance, False)
        elif view.frame is None or view.frame.used.sum() < LEAST_POINTS:  # it says nothing
            self._rejected = max(self._rejected - 1, 0)
        elif self._rejected >= REJECTIONS and self._life.wrong(t_ns, self._period_ns):
            self._hypotheses.clear()  # it is elsewhere, and shows no start

    def _known_at(self, t_ns: int) -> list[Mode]:
        """The state at an instant if somebody knows it: that of the start, which the first picture from then on has."""
        if self._known is None or t_ns < self._known[0]:
            return []
        start_ns, mode = self._known
        if not self._life.ever and t_ns > start_ns:
            state, covariance = self._process.predict(mode.state, mode.covariance, 1e-9 * (t_ns - start_ns))
            self._known = t_ns, replace(mode, state=state, covariance=covariance)
        return [self._known[1]] if self._known[0] == t_ns else []

    def _expected(self, frame: PictureFrame, covariance: Array, level: int, state: Array) -> LayeredFrame:
        """What the templates should be compared with in one picture, for an object near `state`, known with
        `covariance` before the first of the smoothings, of which this is number `level`."""
        view, sigma_px = self._view(frame), self.templates.sigmas_px[level]
        placed = self._placed(state)
        chosen = [one for layer in range(len(self.bodies.layer_row))
                  if (one := self.templates.choose(layer, self._direction(view, placed, layer))) is not None]
        order = visibility(self.bodies, placed, view.camera).order if self.layered else np.empty(0, np.int64)
        return LayeredFrame(
            self.bodies, order, view.camera, filtered(frame.image, self.templates.kind, sigma_px), chosen,
            self.templates.kind, sigma_px, level, view.noise,
            self._of_pose(covariance) * 0.25**level,
            outline_of(self.bodies, placed, order, view.camera) if self.outline else None,
            None if view.background is None else view.background[level])

    def gate(self, frame: PictureFrame, state: Array, covariance: Array) -> Gated:
        """The picture with the last smoothing, about the state by those before, unless that contradicts the prediction
        or what is compared."""
        try:
            return self._compared(frame, state, covariance)
        except np.linalg.LinAlgError:  # the estimate contradicts itself
            return Gated(None, 0.0)

    def _compared(self, frame: PictureFrame, state: Array, covariance: Array) -> Gated:
        def observe(level: int, about: Array, _: Estimate) -> list[Residual]:
            return [self._expected(frame, covariance, level, about), self._limits]

        last = len(self.templates.sigmas_px) - 1
        about, _ = refined(self._process, 0.0, (state, covariance), last, observe)
        found = self._expected(frame, covariance, last, about)
        fitted = replace(found, spread=np.zeros_like(found.spread))
        fitted.linearise(about)
        held, used = fitted.held.sum(), fitted.used.sum()
        free = np.flatnonzero(np.diag(covariance)[:self._pose])
        moved = self._process.difference(about, state)[free]
        near = moved @ np.linalg.solve(covariance[np.ix_(free, free)], moved) < chi_squared(GATE, len(free))
        accepted = near and held >= LEAST_POINTS and held > HELD * used
        self.views[frame.camera].frame = found if accepted else fitted
        return Gated(found if accepted else None, 0.0, [self._limits], about)

    def _view(self, frame: PictureFrame) -> View:
        view = self.views[frame.camera]
        view.noise = view.noise or noise_of(frame.image)
        return view

    def _of_pose(self, covariance: Array) -> Array:
        return np.ascontiguousarray(covariance[:self._pose, :self._pose])

    def _placed(self, state: Array) -> Placed:
        return place(self.bodies, pose_matrix(state), state[ANGLES:ANGLES + self._pose - ROOT_POSE])

    def _direction(self, view: View, placed: Placed, layer: int) -> Array:
        """(3,) unit, from the layer's frame to the camera, in that frame."""
        base = frame_of(placed, self.bodies.layer_row[layer])
        away = base[:3, :3].T @ (view.camera.centre - base[:3, 3])
        return np.asarray(away / np.linalg.norm(away))

    def _held(self) -> NDArray[np.bool_]:
        """(L,) whether the last pictures agree with the templates of each layer."""
        counts = [(view.frame.used, view.frame.held) for view in self.views if view.frame is not None]
        used, held = np.sum(counts, axis=0) if counts else np.zeros((2, len(self.bodies.layer_row)))
        return (held >= LEAST_POINTS) & (held > HELD * used)

    def _sd_m(self, covariance: Array, placed: Placed, layer: int) -> float:
        """m: standard deviation of the far end of a layer."""
        body = int(np.flatnonzero(self.bodies.layer == layer)[-1])
        end = placed.ends[body, 1] if self.bodies.kind[body] == CAPSULE else placed.box[body, :, 3]
        rows = chain_rows(self.bodies.dh, placed.root, placed.frames, np.full(3, self.bodies.layer_row[layer]),
                          np.tile(end, (3, 1)), np.eye(3))
        return float(np.sqrt(np.sum((rows @ self._of_pose(covariance)) * rows)))

    def learn(self, frame: PictureFrame, state: Array, covariance: Array, anchor: bool) -> None:
        """Take templates of the layers that are seen from a new side. What is known worse than the surface itself, or
        not held by the templates that it has, is left alone, unless it is to be the `anchor`."""
        placed, view, held = self._placed(state), self._view(frame), self._held()
        wanted = [layer for layer in range(len(held))
                  if (anchor or (held[layer] and self._sd_m(covariance, placed, layer) < SHAPE_SD_M))
                  and self.templates.wants(layer, self._direction(view, placed, layer))]
        if not wanted:
            return
        order = visibility(self.bodies, placed, view.camera).order
        labels, smooth = segment(self.bodies, placed, order, view.camera, view.rays), self.templates.images(frame.image)
        for layer in wanted:
            self.templates.take(layer, smooth, labels, self.bodies, placed, view.camera, view.rays, view.noise, anchor)


def picture_frames(rig: Rig, images: Sequence[Image | None], t_ns: Sequence[int]) -> list[PictureFrame]:
    """A picture of each camera, None where it has none, of master times `t_ns` (C,), as a scene takes them. Raises
    TrackingError when their number is not that of the cameras, or one is not as the rig says."""
    found = []
    if not len(images) == len(t_ns) == len(rig.nodes):
        raise TrackingError(f"there are {len(images)} pictures and {len(t_ns)} times of {len(rig.nodes)} cameras; give "
                            "one of each, None where there is none")
    for camera, (image, t) in enumerate(zip(images, t_ns, strict=True)):
        if image is not None:
            kind = TemplateKind()
            kind.configure(rig, camera)
            if kind.refusal(Picture(image)) is not None:
                raise TrackingError(f"the picture of {rig.nodes[camera].name} has another size than the rig says, or "
                                    "is not (H, W, 3) RGB bytes; give the one that the camera took")
            found.append(kind.observe(Picture(image), FrameTimes(t, t, t, 0.0)))
    return found


@dataclass(frozen=True, slots=True)
class _Comparison:
    """One picture; implements `objects.track.Measurement`. `known`: the state at its instant, if somebody knows it."""

    t_ns: int
    known: list[Mode]
    gate: Callable[[Array, Array], Gated]

    def modes(self) -> list[Mode]:
        """Templates alone begin nothing."""
        return self.known

    def pair(self, state: Array, prediction: Estimate) -> None:
        """Templates tell the sides of a link apart."""
        return
