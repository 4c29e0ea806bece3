"""A fit with its history: move numbers, drag anchors, fit, undo and redo. Everything a window needs, without one."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.contours import INNER, contour_points
from rhot_app.errors import CalibrationError
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.model import HandModel, neutral_pose
from rhot_app.hand.skeleton import ANGLE_SLICES, JOINT_SLICES, JOINTS, HandPose
from rhot_app.handfit.hand_shape import SIZE, Shapes
from rhot_app.handfit.picture_search import fit_to_contours, landmark_anchors, poses_of
from rhot_app.handfit.pictures import require_calibrated, require_size
from rhot_app.handfit.quantities import Number, numbers_of, sd_of, value_of, with_value
from rhot_app.handfit.solve import (
    ANCHOR_SD_PX,
    DRAG_SD,
    DRAG_STEPS,
    FREE_SD,
    LAST_STEPS,
    PIN_SD_PX,
    Evidence,
    Freedom,
    Solver,
    free_numbers,
)
from rhot_app.handfit.state import Anchor, FitState, History, Image, Instant, bare_state
from rhot_app.progress import Progress
from rhot_app.project import CameraCalibration, Rig

Array = NDArray[np.float64]

AWAY_M = 0.5
"""m: where a hand of which nothing is known is put before the first camera that has a picture."""

GAP_M = 0.01
"""m: contour points that are farther apart are not joined: two steps between them, and some."""


_DRAGGING = "moving an anchor"  # until the pointer is released


class Outline(NamedTuple):
    """A piece of the hand's contour in one camera: `points` (N, 2) px; `inner`: another part of the hand is behind."""

    points: Array
    inner: bool


class HandFit:
    """The fit of one hand to pictures of the cameras of `rig`; its hand, or `hand`, is the base.

    Every change is one step of the history, except those that go on with the step before. Raises CalibrationError when
    no camera is calibrated.
    """

    def __init__(self, rig: Rig, hand: HandAnatomy | None = None) -> None:
        self.warning = require_calibrated(rig)
        self.rig = rig
        self.names = tuple(node.name for node in rig.nodes)
        self.cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
        self.shapes = Shapes(hand or rig.hand)
        self.solver = Solver(self.shapes, self.cameras)
        self.numbers = numbers_of(self.shapes.base)
        self.freedom: Freedom = "pose"
        self.anchor_sd_px = ANCHOR_SD_PX
        self._history = History(FitState(np.zeros(SIZE), ()))
        self._current = 0
        self._grabbed: tuple[int, int, FitState] | None = None
        self._spread: tuple[FitState, float, Array] | None = None
        self._saved = self.state

    # -- what there is ---------------------------------------------------------------------------------------------

    @property
    def state(self) -> FitState:
        """The newest state."""
        return self._history.state

    @property
    def current(self) -> int:
        """The instant in work."""
        return min(self._current, max(len(self.state.instants) - 1, 0))

    @current.setter
    def current(self, number: int) -> None:
        self._current = number

    @property
    def instant(self) -> Instant | None:
        """The instant in work, None before there are pictures."""
        return self.state.instants[self.current] if self.state.instants else None

    @property
    def hand(self) -> HandAnatomy:
        """The hand file as it would be saved."""
        return self.shapes.anatomy(self.state.shape)

    @property
    def model(self) -> HandModel:
        """The kinematic model of that hand."""
        return self.shapes.model(self.state.shape)

    @property
    def reshaped(self) -> bool:
        """Whether the shape is another one than the base hand's."""
        return bool(self.state.shape.any())

    @property
    def unsaved(self) -> bool:
        """Whether the shape is another one than when it was saved last."""
        return not np.array_equal(self.state.shape, self._saved.shape)

    def note_saved(self) -> None:
        """The hand was saved as it is now."""
        self._saved = self.state

    def value(self, number: Number) -> float:
        """A number in its unit."""
        return value_of(self._with_pictures, self.current, self.hand, number)

    def sd(self, number: Number) -> float:
        """Its standard deviation, by anchors, contours and priors."""
        state = self._with_pictures
        if self._spread is None or self._spread[0] is not state or self._spread[1] != self.anchor_sd_px:
            evidence = Evidence(state, FREE_SD, self.anchor_sd_px, [one.contour for one in state.instants])
            self._spread = state, self.anchor_sd_px, self.solver.covariance(state, evidence)
        return sd_of(state, self.current, self.hand, number, self._spread[2])

    def joints(self, camera: int) -> Array:
        """(21, 2) px where a camera sees the joints; NaN for one that it cannot see."""
        if self.instant is None:
            return np.full((len(JOINTS), 2), np.nan)
        places, _ = self.solver.places(self.state.shape, self.instant)
        return self.cameras[camera].project(places)

    def outline(self, camera: int) -> list[Outline]:
        """The visible contour of the hand in one camera, in pieces."""
        one, model = self.instant, self.cameras[camera]
        if one is None:
            return []
        points = contour_points(self.shapes.surface(self.state.shape), bare_state(one), model.record)
        kind = 8 * points.capsule + 2 * points.kind + (points.behind == INNER)
        apart = np.linalg.norm(np.diff(points.pixel, axis=0), axis=1) > GAP_M * points.scale[1:]
        starts = np.flatnonzero((np.diff(kind) != 0) | apart) + 1
        return [Outline(points.pixel[piece], bool(points.behind[piece[0]] == INNER))
                for piece in np.split(np.arange(len(kind)), starts) if len(piece)]

    def errors_px(self) -> dict[Anchor, float]:
        """How far from each anchor of the instant its joint is seen."""
        if self.instant is None:
            return {}
        seen = {camera: self.joints(camera) for camera in {anchor.camera for anchor in self.instant.anchors}}
        return {anchor: float(np.linalg.norm(seen[anchor.camera][anchor.joint] - anchor.pixel))
                for anchor in self.instant.anchors}

    # -- the history -----------------------------------------------------------------------------------------------

    @property
    def undoable(self) -> str:
        """What undo would take back, "" for nothing."""
        return self._history.undoable

    @property
    def redoable(self) -> str:
        """What redo would bring back, "" for nothing."""
        return self._history.redoable

    def undo(self) -> None:
        """One step back; nothing when there is none."""
        self._grabbed = None
        self._history.undo()

    def redo(self) -> None:
        """One step forward again; nothing when there is none."""
        self._grabbed = None
        self._history.redo()

    def take(self, state: FitState, done: str, *, goes_on: bool = False) -> None:
        """A new state, after something was `done` (`History.take`)."""
        self._history.take(state, done, goes_on=goes_on)

    def begin(self) -> None:
        """Forget how the state came about: what there is now is the beginning."""
        self._history = History(self.state)

    # -- pictures --------------------------------------------------------------------------------------------------

    def add_pictures(self, images: Mapping[int, Image], pose: HandPose | None = None) -> None:
        """Another instant: pictures (H, W, 3) RGB by the camera's number, and the hand's pose if it is known. Raises
        CalibrationError for a picture that has not its lens' size."""
        if not images:
            raise CalibrationError("No camera gave a picture. Look at the Nodes panel: its sentence says why.")
        for camera, image in images.items():
            require_size(image, self.rig.nodes[camera], f"the picture of {self.names[camera]}")
        if pose is None:
            pose = self.instant.pose if self.instant is not None else self._before(self.cameras[min(images)])
        limits = self.solver.limits
        pose = HandPose(pose.world_from_palm.copy(), np.clip(pose.angles, limits[:, 0], limits[:, 1]))
        taken = [int(one.name.split()[-1]) for state in (*self._history.past, self.state) for one in state.instants]
        one = Instant(f"Instant {max(taken, default=0) + 1}", dict(images), pose, np.zeros(2))
        self.take(replace(self.state, instants=(*self.state.instants, one)), f"taking {one.name.lower()}")
        self._current = len(self.state.instants) - 1

    def remove_instant(self) -> None:
        """Without the instant in work."""
        if self.instant is not None:
            state, k = self.state, self.current
            self.take(replace(state, instants=(*state.instants[:k], *state.instants[k + 1:])),
                      f"removing {self.instant.name.lower()}")

    def _before(self, camera: CameraModel) -> HandPose:
        """An open hand in the middle of a camera's picture, fingers up, its back to the camera."""
        world = np.eye(4)
        middle = 0.5 * self.shapes.model(self.state.shape).base[2, 0]
        world[:3, :3] = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # columns: palm x, y and z
        world[:3, 3] = [0.0, middle, AWAY_M]
        return neutral_pose(camera.world_from_camera @ world)

    # -- changes ---------------------------------------------------------------------------------------------------

    def set_number(self, number: Number, value: float, *, goes_on: bool = False) -> None:
        """Move one number, as near to `value` as its limits allow."""
        if self.instant is not None:
            state = with_value(self._bare(), self.current, self.hand, number, value)
            self.take(state, f"{number.group.lower()}, {number.name}", goes_on=goes_on)

    def grab(self, camera: int, joint: int) -> None:
        """A drag of a joint begins; what undetermined numbers stay near is the state now."""
        self._grabbed = (camera, joint, self._bare())

    def drag(self, pixel: tuple[float, float], *, last: bool = False) -> None:
        """The joint in hand is to be seen at `pixel` (2,) of its camera; all anchors hold. `last`: the pointer has
        stopped there. Raises CalibrationError outside the picture."""
        if self._grabbed is None:
            return
        camera, joint, reference = self._grabbed
        self._require_inside(camera, pixel)
        k = self.current
        start = self.state if self.undoable == _DRAGGING else reference
        state = start.change(k, start.instants[k].with_anchor(Anchor(camera, joint, pixel)))
        others = [] if self.freedom == "pose" else [j for j, one in enumerate(state.instants) if one.anchors and j != k]
        free = free_numbers(state, [k, *others], self.freedom, own_lengths=True)
        state = self.solver.solve(state, Evidence(reference, DRAG_SD, PIN_SD_PX), free,
                                  LAST_STEPS if last else DRAG_STEPS)
        self.take(state, _DRAGGING, goes_on=start is not reference)

    def release(self) -> None:
        """The drag ends; the next one is a step of its own."""
        if self._grabbed is not None and self.undoable == _DRAGGING:
            camera, joint, _ = self._grabbed
            self._history.rename(f"moving {self._named(joint)} in {self.names[camera]}")
        self._grabbed = None

    def anchor(self, camera: int, joint: int, pixel: tuple[float, float]) -> None:
        """Drag a joint there at once."""
        self.grab(camera, joint)
        self.drag(pixel, last=True)
        self.release()

    def remove_anchor(self, camera: int, joint: int) -> None:
        """The joint is free again in this camera."""
        one = self.instant
        if one is not None and any((a.camera, a.joint) == (camera, joint) for a in one.anchors):
            self.take(self._bare().change(self.current, replace(one.without_anchor(camera, joint), contour=None)),
                      f"removing the anchor of {self._named(joint)}")

    def remove_anchors(self) -> None:
        """All joints of the instant are free again."""
        one = self.instant
        if one is not None and one.anchors:
            self.take(self._bare().change(self.current, replace(one, anchors=(), contour=None)), "removing all anchors")

    def reset(self) -> None:
        """The base hand, with the first pose of every instant and no anchors. Undo brings everything back."""
        first: dict[str, Instant] = {}
        for state in self._history.past:
            for one in state.instants:
                first.setdefault(one.name, one)
        instants = tuple(replace(first[one.name], images=one.images) for one in self.state.instants)
        self.take(FitState(np.zeros(SIZE), instants), "resetting the hand")

    def fitted_to_anchors(self) -> FitState:
        """The most probable state by the anchors; with lengths free, of all instants that have any. A finger without
        anchors stays as it is. Raises CalibrationError without anchors."""
        state = self._bare()
        wanted = [k for k in self._wanted() if state.instants[k].anchors]
        if not wanted:
            raise CalibrationError("There is no anchor to fit to. Drag a joint to its place in a picture first.")
        free = free_numbers(state, wanted, self.freedom)
        for k in wanted:
            for finger, angles in enumerate(ANGLE_SLICES):
                if not any(JOINT_SLICES[finger].start < one.joint < JOINT_SLICES[finger].stop
                           for one in state.instants[k].anchors):
                    first = state.own(k).start + 6
                    free[first + angles.start:first + angles.stop] = False
        return self.solver.solve(state, Evidence(self.solver.with_mean_angles(state), FREE_SD, self.anchor_sd_px), free)

    def fitted_to_contours(self) -> FitState:
        """The state fitted to the edges in the pictures; with lengths free, of all instants. Raises CalibrationError,
        and may take seconds."""
        return fit_to_contours(self.solver, self.rig, self._bare(), self._wanted(), self.freedom, self.anchor_sd_px)

    def with_found_hand(self, progress: Progress) -> FitState:
        """The state with the joints anchored where the landmark networks see them, and the pose fitted to these
        anchors. Raises CalibrationError without a hand of the rig's side, KeypointError without networks."""
        state, k = self._bare(), self.current
        one = state.instants[k]
        anchors = landmark_anchors(one, self.hand.side == "right", progress)
        if not anchors:
            raise CalibrationError(f"No {self.hand.side} hand was found in {one.name}. Drag the wrist, the knuckles "
                                   "and the fingertips to their places instead.")
        free, best = free_numbers(state, [k], "pose"), None
        for pose in poses_of(anchors, self.shapes.model(state.shape), self.cameras):
            begun = state.change(k, replace(one, pose=pose, anchors=anchors))
            try:
                found = self.solver.solve(begun, Evidence(begun, FREE_SD, self.anchor_sd_px), free)
            except CalibrationError:  # turned so, a joint is behind a camera
                continue
            misses = [np.linalg.norm(self.cameras[a.camera].project(self.solver.places(
                found.shape, found.instants[k])[0][a.joint])[0] - a.pixel) for a in anchors]
            if best is None or np.mean(misses) < best[0]:
                best = float(np.mean(misses)), found
        if best is None:
            raise CalibrationError(f"The hand in {one.name} fits no pose before the cameras. Are the pictures of the "
                                   "rig's cameras, in their order?")
        return best[1]

    def fit_to_anchors(self) -> None:
        """Take what `fitted_to_anchors` says."""
        self.take(self.fitted_to_anchors(), "fitting to anchors")

    def renamed(self, name: str) -> HandAnatomy:
        """The hand file under a name."""
        return msgspec.structs.replace(self.hand, name=name)

    # -- parts -----------------------------------------------------------------------------------------------------

    @property
    def _with_pictures(self) -> FitState:
        if not self.state.instants:
            raise CalibrationError("There is no picture yet. Take pictures, or open picture files.")
        return self.state

    def _bare(self) -> FitState:
        """The state without contours: what changes by hand is not what they were searched about."""
        state = self._with_pictures
        return replace(state, instants=tuple(replace(one, contour=None) for one in state.instants))

    def _wanted(self) -> list[int]:
        """The instant in work; with lengths free all, because they share the lengths."""
        return [self.current] if self.freedom == "pose" else list(range(len(self._with_pictures.instants)))

    def _require_inside(self, camera: int, pixel: tuple[float, float]) -> None:
        model = self.cameras[camera]
        if not (-0.5 <= pixel[0] <= model.width - 0.5 and -0.5 <= pixel[1] <= model.height - 0.5):
            raise CalibrationError(f"({pixel[0]:.0f}, {pixel[1]:.0f}) px is outside the picture of "
                                   f"{self.names[camera]}, which has {model.width} x {model.height} px; an anchor is "
                                   "in the picture.")

    @staticmethod
    def _named(joint: int) -> str:
        return JOINTS[joint].replace("_", " ")


def warm_up(rig: Rig, *, contours: bool = False) -> None:
    """Compile what a drag calls, so that the first one is as quick as the others; with `contours` also what searches
    them."""
    exact = CameraCalibration("exact")
    fit = HandFit(msgspec.structs.replace(rig, calibration=exact, depth=type(rig.depth)()))
    lens = rig.nodes[0].intrinsics
    fit.add_pictures({0: np.zeros((lens.height, lens.width, 3), np.uint8)})
    fit.anchor(0, 0, (0.5 * lens.width, 0.5 * lens.height))
    fit.outline(0)
    fit.sd(fit.numbers[0])
    if contours:
        with suppress(CalibrationError):  # there is nothing to find
            fit.fitted_to_contours()
