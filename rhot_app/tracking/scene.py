"""The hands and objects of a rig. Each takes what it has of a frame, and one state has all of them at one instant.

Live and from a recording, smoothed or not, it is the same scene.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame, SliceRequest
from rhot_app.barehand.start import LATERAL_M
from rhot_app.calibration.check.camera_calibration import CalibrationAccuracy, calibration_error
from rhot_app.diagnostics import Diagnostics
from rhot_app.errors import RigError
from rhot_app.estimation.track import NEVER, comes_late
from rhot_app.objects.observations import ObjectFrame
from rhot_app.objects.state import ObjectState
from rhot_app.objects.track import ObjectTrack
from rhot_app.project import Rig, estimator_obstacle, observation_obstacle
from rhot_app.state import Condition, HandState, Knowledge, SeenContour, no_hand
from rhot_app.tracking.classic import ClassicTracker
from rhot_app.tracking.contours.shared_images import SharedImages
from rhot_app.tracking.contours.tracker import ContourEstimator
from rhot_app.tracking.extrapolation import Extrapolator
from rhot_app.tracking.markers.estimator import Estimator
from rhot_app.tracking.rig_arrays import rigs_of_hands
from rhot_app.tracking.rig_objects import RigObjects, SmoothedObjects
from rhot_app.tracking.smoothing import RECENT, Instant, RecordingEstimator
from rhot_app.tracking.tracker import (
    CameraFrame,
    CameraObservations,
    HandFrame,
    Tracker,
    may_be_due,
)
from rhot_node.wire.messages import MarkerFlag

Indices = NDArray[np.intp]

NAMES = "the hand", "the other hand"

_UNKNOWN: dict[str, Any] = {
    "marker_positions": np.nan, "marker_raw_positions": np.nan, "marker_covariances": np.nan,
    "marker_knowledge": int(Knowledge.UNKNOWN), "epipolar_error_px": np.nan}
_OF_HANDS = "triangulate", "filter", "solve"
"""Stages of the latency that run for one hand after the other."""


def make_tracker(rig: Rig, *, smooth: bool = False, articulated: Sequence[ObjectTrack] = ()) -> Tracker:
    """A new tracker for `rig`: its scene, or its only hand. `smooth`: one for recordings, whose states use all frames;
    the rig's tracker must be one that smooths. `articulated`: tracks of objects that the rig does not have. Raises
    RigError when the estimator cannot work with its markers, cameras or nodes, or the mesh of an object cannot be
    used."""
    tracker = _tracker_of(rig, smooth, articulated)
    tracker.by_calibration = calibration_error(rig)
    tracker.objects_on_exact_cameras = frozenset([*(one.name for one in rig.models if one.markers),
                                                  *(one.name for one in articulated)])
    return tracker


def _tracker_of(rig: Rig, smooth: bool, articulated: Sequence[ObjectTrack]) -> Tracker:
    if smooth or rig.tracker.kind != "classic":
        require_estimator(rig)
    alone, hands, images = rigs_of_hands(rig), list[tuple[Tracker, Indices]](), None
    if smooth:
        return SmoothedScene(rig, [(RecordingEstimator(own), columns) for own, columns in alone], articulated)
    if rig.tracker.kind == "classic":  # it locates markers wherever they are
        hands.append((ClassicTracker(rig), np.arange(len(rig.markers.markers))))
    elif not rig.tracker.contours:
        hands += [(Estimator(own), columns) for own, columns in alone]
    else:
        aside = LATERAL_M if len(alone) > 1 else 0.0  # a right palm that faces a camera is to its left
        bare = [ContourEstimator(own, len(alone), -aside if own.hand.side == "right" else aside) for own, _ in alone]
        hands += [(hand, columns) for hand, (_, columns) in zip(bare, alone, strict=True)]
        images = SharedImages(rig, bare) if len(bare) > 1 else None
    if len(hands) == 1 and not rig.objects and not articulated:
        return hands[0][0]
    return Scene(rig, hands, articulated, images)


def require_estimator(rig: Rig) -> None:
    """Raises RigError when the estimator cannot work with the rig's cameras or nodes, or lacks landmarks."""
    obstacle = estimator_obstacle(rig) or observation_obstacle(rig)
    if obstacle is not None:
        raise RigError(f"rig {rig.name!r}: {obstacle.why} {obstacle.remedy}")


class Scene(Tracker):
    """One or two hands, and objects.

    A state's markers are those of the whole rig: a hand's as it knows them, an object's where its pose puts them. Its
    `other`, the state of the other hand, has that hand's markers only. What fails over one of them costs it alone.
    """

    _kept_in: ClassVar[type[RigObjects]] = RigObjects

    def __init__(self, rig: Rig, hands: Sequence[tuple[Tracker, Indices]], articulated: Sequence[ObjectTrack] = (),
                 images: SharedImages | None = None) -> None:
        """`hands`: the tracker of each, and the numbers of its markers in the rig. `articulated`: tracks of objects
        beside the rig's. `images`: what gives two bare hands their parts of images. Raises RigError when the mesh of an
        object cannot be used."""
        self._hands, self._columns = [hand for hand, _ in hands], [columns for _, columns in hands]
        self._images, self.key_frames = images, self._hands[0].key_frames
        self.diagnostics = Diagnostics()
        for hand in self._hands:
            hand.diagnostics = self.diagnostics
        self._ids, self._cameras = rig.markers.ids, tuple(node.name for node in rig.nodes)
        self._of_objects = [(number, self._ids.index(marker.marker), 1e-3 * np.array(marker.position_mm))
                            for number, model in enumerate(rig.models) for marker in model.markers]
        self._extrapolators = [Extrapolator(own) for own, _ in rigs_of_hands(rig)] if len(hands) > 1 else []
        self._objects = (self._kept_in(rig, self.diagnostics, articulated) if rig.objects or articulated
                         else None)
        self._sequence = 0
        self._clear()

    @property
    def hands(self) -> Sequence[Tracker]:
        """The trackers of the rig's hand and of its other hand."""
        return self._hands

    def _clear(self) -> None:
        self._newest: list[CameraObservations | None] = [None] * len(self._cameras)
        self._latest: CameraObservations | None = None
        self._states: list[HandState | None] = [None] * len(self._hands)
        self._published_ns = NEVER

    def reset(self) -> None:
        """Forget everything but the count of states."""
        self._clear()
        for part in (*self._hands, self._objects, self._images):
            if part is not None:
                part.reset()

    # -- frames --------------------------------------------------------------------------------------------------------

    def ingest(self, frame: CameraFrame) -> None:
        """Take one frame in; each hand and object gets its own."""
        if isinstance(frame, CameraObservations):
            self._ingest_markers(frame)
        elif isinstance(frame, EdgeFrame | ForegroundFrame) and self._images is not None:
            self._images.ingest(frame)
        elif isinstance(frame, ObjectFrame):
            if self._objects is not None:
                self._objects.ingest(frame)
        elif isinstance(frame, HandFrame):
            for hand in self._hands[frame.hand:frame.hand + 1]:  # a rig may have no other one
                hand.ingest(frame)
        else:
            self._hands[0].ingest(frame)

    def _ingest_markers(self, frame: CameraObservations) -> None:
        last = self._newest[frame.camera]
        if last is None or not comes_late(frame.t_row0_master_ns, last.t_row0_master_ns):
            self._newest[frame.camera] = frame
        self._latest = frame
        if self._objects is not None:
            self._objects.ingest_markers(frame)
        for hand, columns in zip(self._hands, self._columns, strict=True):
            hand.ingest(frame.of(columns))

    def requests(self) -> list[SliceRequest]:
        """See `Tracker`."""
        return self._hands[0].requests() if self._images is None else self._images.requests()

    def newest_frames(self) -> tuple[CameraObservations | None, ...]:
        """Each camera's newest frame, of all markers, None before its first."""
        return tuple(self._newest)

    def seen(self) -> list[SeenContour]:
        """See `Tracker`."""
        return [replace(contour, hand=number) for number, hand in enumerate(self._hands) for contour in hand.seen()]

    def warm_up(self) -> None:
        """See `Tracker`."""
        for hand in self._hands:
            hand.warm_up()
        if self._images is not None:
            self._images.warm_up()

    def wait(self) -> None:
        """See `Tracker`."""
        for hand in self._hands:
            hand.wait()

    def published_error(self, stated: CalibrationAccuracy) -> CalibrationAccuracy:
        """See `Tracker`."""
        for hand in self._hands:
            stated = hand.published_error(stated)
        return stated

    # -- states --------------------------------------------------------------------------------------------------------

    def solve(self) -> HandState | None:
        """The state that is due: when a tracked hand has a new one, or any while none is tracked."""
        fresh = [self._solve(number) for number in range(len(self._hands))]
        self._states = [before if new is None else new for before, new in zip(self._states, fresh, strict=True)]
        states = [state for state in self._states if state is not None]
        tracked = any(state.tracked for state in states)
        if len(states) < len(self._hands) or not any(new is not None and new.tracked >= tracked for new in fresh):
            return None
        if not all(hand.stands(state) for hand, state in zip(self._hands, states, strict=True)):
            return None  # its track was dropped; its next state says so
        t_ns = max(state.t_master_ns for state in states if state.tracked >= tracked)
        if tracked and None in fresh and comes_late(t_ns, self._published_ns):
            return None
        self._published_ns = t_ns
        if len(states) > 1:
            states = [replace(extrapolator.at(state, t_ns) or state, t_master_ns=t_ns)
                      for state, extrapolator in zip(states, self._extrapolators, strict=True)]
        return self._at(t_ns, states)

    def _solve(self, number: int) -> HandState | None:
        """The next state of a hand; LOST when its tracker fails."""
        hand, state = self._hands[number], None
        with self.diagnostics.part(NAMES[number], hand.reset) as part:
            state = hand.solve()
        return self._failed(number, self._latest) if part.failed and self._latest is not None else state

    def _failed(self, number: int, frame: CameraObservations) -> HandState:
        """The state of a hand whose tracker failed over a frame."""
        return replace(no_hand(frame.t_row0_master_ns, Condition.LOST, self._cameras,
                               markers=tuple(self._ids[marker] for marker in self._columns[number])),
                       t_receive_ns=frame.t_receive_ns)

    def _at(self, t_ns: int, hands: list[HandState]) -> HandState:
        """The next state: of `hands` at `t_ns`, with the objects there."""
        state, self._sequence = replace(self._with_all_markers(hands), sequence=self._sequence), self._sequence + 1
        if len(hands) > 1:
            latency = {stage: sum(hand.latency_s.get(stage, 0.0) for hand in hands) for stage in _OF_HANDS}
            state = replace(state, other=replace(hands[1], sequence=state.sequence),
                            latency_s=state.latency_s | latency, t_receive_ns=max(hand.t_receive_ns for hand in hands))
        if self._objects is None:
            return state
        objects = self._objects.states(t_ns)
        return self._objects.with_objects(self._with_markers_of(objects, state), objects)

    def _with_all_markers(self, hands: list[HandState]) -> HandState:
        """The first hand's state with the markers of the whole rig; those of objects are unknown."""
        if len(hands) == 1 and len(self._columns[0]) == len(self._ids):
            return hands[0]
        count, columns = len(self._ids), dict[str, Any]()
        for name, unknown in _UNKNOWN.items():
            values = getattr(hands[0], name)
            columns[name] = np.full((count, *values.shape[1:]), unknown, values.dtype)
        pixels = np.full((len(self._cameras), count, 2), np.nan)
        flags = np.full(pixels.shape[:2], int(MarkerFlag.LOST), hands[0].camera_flags.dtype)
        for camera, frame in enumerate(self._newest):
            if frame is not None:
                pixels[camera], flags[camera] = frame.pixels, frame.flags
        for hand, own in zip(hands, self._columns, strict=True):
            pixels[:, own], flags[:, own] = hand.camera_pixels, hand.camera_flags
            for name, column in columns.items():
                column[own] = getattr(hand, name)
        return replace(hands[0], marker_ids=self._ids, camera_pixels=pixels, camera_flags=flags, **columns)

    def _with_markers_of(self, objects: list[ObjectState], state: HandState) -> HandState:
        """The state with the objects' markers where their poses put them."""
        positions, knowledge = state.marker_positions.copy(), state.marker_knowledge.copy()
        for number, marker, place in self._of_objects:
            if objects[number].tracked:
                pose = objects[number].world_from_object
                positions[marker], knowledge[marker] = pose[:3, :3] @ place + pose[:3, 3], Knowledge.INFERRED
        return replace(state, marker_positions=positions, marker_knowledge=knowledge)


class SmoothedScene(Scene):
    """A scene for recordings: takes frames in the order of arrival, and gives states, which use all of them, in the
    order of time."""

    smooths, _kept_in = True, SmoothedObjects

    def __init__(self, rig: Rig, hands: list[tuple[RecordingEstimator, Indices]],
                 articulated: Sequence[ObjectTrack] = ()) -> None:
        """Raises RigError as `Scene`."""
        super().__init__(rig, hands, articulated)
        self._recorded = [hand for hand, _ in hands]
        self._waiting: list[dict[int, Instant]] = [{} for _ in hands]  # for the same frame of the other hand

    def reset(self) -> None:
        """End the hands' tracks: a new session, or a clock was set. Objects and states that are not taken yet stay."""
        for hand in self._hands:
            hand.reset()

    def ingest(self, frame: CameraFrame) -> None:
        """Take one frame in."""
        super().ingest(frame)
        for number in range(len(self._hands) if may_be_due(frame) else 0):
            self._solve(number)

    def states(self) -> Iterator[HandState]:
        """The states that have become final."""
        for hand, waiting in zip(self._recorded, self._waiting, strict=True):
            waiting.update((instant.number, instant) for instant in hand.final())
        for number in [number for number in self._waiting[0] if all(number in one for one in self._waiting)]:
            instants = [one.pop(number) for one in self._waiting]
            t_ns = max([instant.t_ns for instant in instants if instant.none is None] or [instants[0].t_ns])
            for waiting in self._waiting:  # what is so far behind has no counterpart
                for late in [late for late in waiting if late < number - RECENT]:
                    del waiting[late]
            if t_ns != self._published_ns and comes_late(t_ns, self._published_ns):
                continue  # a frame without a hand that was late
            with self.diagnostics.part("a smoothed state", lambda: None) as part:
                hands = [replace(hand.describe(instant, t_ns), t_master_ns=t_ns)
                         for hand, instant in zip(self._recorded, instants, strict=True)]
            if not part.failed:
                self._published_ns = t_ns
                yield self.published(self._at(t_ns, hands))

    def finish(self) -> Iterator[HandState]:
        """The rest of the states."""
        for hand in self._recorded:
            hand.conclude()
        if self._objects is not None:
            self._objects.finish()
        yield from self.states()
