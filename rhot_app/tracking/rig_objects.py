"""The tracked objects of a rig, and their contacts with its hands.

They take fiducial tags, colour markers, poses of other trackers, and pictures.

A state's objects are those at the hand's instant, by everything that has come until then.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rhot_app.diagnostics import Diagnostics
from rhot_app.errors import TrackingError
from rhot_app.estimation.filter import AHEAD_S, FilteredState, smooth
from rhot_app.estimation.layout import pose_matrix
from rhot_app.estimation.track import LOST_NS, PREDICTED_NS
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.model import HandModel, build_model
from rhot_app.objects.contact import ContactMonitor, FingertipPads, fingertip_pads
from rhot_app.objects.motion import TWIST
from rhot_app.objects.observations import MarkerPoints, MeasuredPose, ObjectFrame
from rhot_app.objects.shape import shape_of
from rhot_app.objects.state import ObjectState, Validity, unknown_object
from rhot_app.objects.stream import PoseMeasurement
from rhot_app.objects.track import ObjectTrack, ObjectTracker
from rhot_app.project import Rig
from rhot_app.state import HandState
from rhot_app.tracking.markers.marker_model import scaled_table, turn_sds
from rhot_app.tracking.tracker import CameraObservations

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class RigObjects:
    """The objects of a rig, and the contacts of its hands with them."""

    def __init__(self, rig: Rig, diagnostics: Diagnostics, articulated: Sequence[ObjectTrack] = ()) -> None:
        """`diagnostics` takes what is failed over or ambiguous. `articulated`: tracks of objects that the rig does not
        have, which follow its own. Raises RigError when the mesh of an object cannot be used."""
        cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
        reference = rig.tracked_with.index(True)
        self._tracker = ObjectTracker(rig.models, cameras, diagnostics, [node.name for node in rig.nodes], articulated,
                                      reference, turn_sds(rig, reference))
        ids, self._tracked_with = rig.markers.ids, rig.tracked_with
        worn = [marker.marker for model in rig.models for marker in model.markers]
        self._columns = np.array([ids.index(name) for name in worn], np.intp)
        self._ids = tuple(ids[column] for column in self._columns)
        shapes = [*(shape_of(one.model, one.folder) for one in rig.objects if one.model is not None),
                  *(None for _ in articulated)]
        hands = [build_model(hand) for hand in (rig.hand, rig.other_hand) if hand is not None]
        self._contacts = [_HandContacts(hand, [None if shape is None else ContactMonitor(hand, shape)
                                               for shape in shapes], diagnostics) for hand in hands]

    def reset(self) -> None:
        """Forget everything: a new session, or a node's clock was set."""
        self._tracker.reset()
        for contacts in self._contacts:
            contacts.reset()

    def ingest(self, frame: ObjectFrame) -> None:
        """Take the tags of one frame, a pose of another tracker, or a picture in. Raises TrackingError for a frame of a
        camera that the rig does not have."""
        if isinstance(frame, MeasuredPose):
            self._tracker.take_pose(frame.name, PoseMeasurement(frame.t_ns, frame.world_from_object, frame.covariance))
            return
        if not 0 <= frame.camera < len(self._tracked_with):
            raise TrackingError(f"a frame is of camera {frame.camera}, but the rig has {len(self._tracked_with)}; "
                                "number them from 0")
        if self._tracked_with[frame.camera]:
            self._tracker.take(frame)

    def ingest_markers(self, frame: CameraObservations) -> None:
        """Take the objects' markers of one frame in: the best candidate of each."""
        if len(self._columns) and self._tracked_with[frame.camera]:
            self._tracker.take(MarkerPoints(frame.camera, frame.t_row0_master_ns, frame.row_time_ns, self._ids,
                                            frame.pixels[self._columns], frame.covariances[self._columns]))

    def states(self, t_ns: int) -> list[ObjectState]:
        """The objects at master time `t_ns`, without contacts."""
        return self._tracker.states(t_ns)

    def finish(self) -> None:
        """No frame comes any more."""

    def with_objects(self, state: HandState, objects: list[ObjectState]) -> HandState:
        """The state with the objects and each hand's contacts."""
        other = state.other
        if other is not None and len(self._contacts) > 1:
            other = replace(other, objects=self._contacts[1].update(other, objects))
        return replace(state, objects=self._contacts[0].update(state, objects), other=other)


class _HandContacts:
    """Contacts of one hand with each object; None for one without a shape."""

    def __init__(self, hand: HandModel, monitors: list[ContactMonitor | None], diagnostics: Diagnostics) -> None:
        self._pads, self._monitors, self._diagnostics = fingertip_pads(hand), monitors, diagnostics

    def reset(self) -> None:
        for monitor in self._monitors:
            if monitor is not None:
                monitor.trigger.touching[:] = False

    def update(self, hand: HandState, objects: list[ObjectState]) -> tuple[ObjectState, ...]:
        """The objects with distances and contacts of the hand's fingertips."""
        pads, found = _scaled(self._pads, hand.hand_scale), []
        for monitor, one in zip(self._monitors, objects, strict=True):
            if monitor is None:
                found.append(one)
            elif hand.tracked and one.tracked:
                with self._diagnostics.part(f"contacts with {one.name}", self.reset):
                    pad, sd, touching = monitor.update(hand.world_from_palm, hand.angles, hand.fingertip_covariances,
                                                       one.world_from_object, one.covariance, pads)
                    one = replace(one, distances=pad.distance, distance_sd=sd, contacts=touching)
                found.append(one)
            else:
                monitor.trigger.touching[:] = False
                found.append(one)
        return tuple(found)


def _scaled(pads: FingertipPads, scale: float) -> FingertipPads:
    return pads if scale == 1.0 else FingertipPads(scaled_table(pads.dh, scale), scale * pads.radii)


# -- smoothed objects of a recording -----------------------------------------------------------------------------------

class SmoothedObjects(RigObjects):
    """Takes the frames of a recording; `states` then smooths: it uses later frames as well."""

    def __init__(self, rig: Rig, diagnostics: Diagnostics, articulated: Sequence[ObjectTrack] = ()) -> None:
        """Raises RigError as `RigObjects`."""
        super().__init__(rig, diagnostics, articulated)
        self._diagnostics = diagnostics
        self._histories = [_History(track) for track in self._tracker.tracks]

    def ingest(self, frame: ObjectFrame) -> None:
        """See `RigObjects`."""
        super().ingest(frame)
        self._keep()

    def ingest_markers(self, frame: CameraObservations) -> None:
        """Take the objects' markers of one frame in."""
        super().ingest_markers(frame)
        self._keep()

    def finish(self) -> None:
        """No frame comes any more."""
        for history in self._histories:
            history.over = True

    def states(self, t_ns: int) -> list[ObjectState]:
        """The objects at master time `t_ns`, without contacts. Ask in the order of time."""
        found = []
        for history in self._histories:
            one = unknown_object(history.name, t_ns, Validity.LOST)
            with self._diagnostics.part(f"the smoothing of {history.name}", lambda: None):
                one = history.at(t_ns)
            found.append(one)
        return found

    def _keep(self) -> None:
        for history in self._histories:
            history.add()


class _History:
    """Filtered estimates of one object, and the smoothed ones of those that are final. Times are s since the first."""

    def __init__(self, track: ObjectTrack) -> None:
        self.name, self._track, self.over = track.name, track, False
        self._filtered: list[FilteredState] = []
        self._smoothed: list[FilteredState] = []
        self._final_s = -math.inf
        self._first_ns: int | None = None

    def add(self) -> None:
        """Keep the track's estimate, in place of the last one if that is of the same time."""
        found = self._track.estimate()
        if found is None:
            return
        t_ns, estimate = found
        self._first_ns = t_ns if self._first_ns is None else self._first_ns
        t_s = 1e-9 * (t_ns - self._first_ns)
        if self._filtered and t_s == self._filtered[-1].t_s:  # of a further camera, which has added to it
            self._filtered.pop()
        if not self._filtered or t_s > self._filtered[-1].t_s:
            self._filtered.append(replace(estimate, t_s=t_s))

    def at(self, t_ns: int) -> ObjectState:
        """The state at a time, predicted from the smoothed estimate before it."""
        if self._first_ns is None:
            return unknown_object(self.name, t_ns, Validity.SEARCHING)
        t_s = 1e-9 * (t_ns - self._first_ns)
        if t_s > self._final_s:
            self._smooth(t_s)
        place = bisect_right(self._smoothed, t_s, key=lambda one: one.t_s) - 1
        if place < 0:
            return unknown_object(self.name, t_ns, Validity.SEARCHING)
        here = self._smoothed[place]
        late_ns = round(1e9 * (t_s - here.t_s))
        if late_ns > LOST_NS:
            return unknown_object(self.name, t_ns, Validity.LOST)
        state, covariance = here.process.predict(here.state, here.covariance, t_s - here.t_s)
        return ObjectState(self.name, t_ns, Validity.PREDICTED if late_ns > PREDICTED_NS else Validity.TRACKED,
                           pose_matrix(state), covariance[:TWIST, :TWIST], state[self._track.velocity])

    def _smooth(self, t_s: float) -> None:
        """Smooth what there is, one run of one hypothesis after the other."""
        first = max(bisect_right(self._filtered, t_s, key=lambda one: one.t_s) - 1, 0)
        del self._filtered[:first]
        runs: list[list[FilteredState]] = []
        for one in self._filtered:
            if runs and one.label is runs[-1][-1].label and one.t_s - runs[-1][-1].t_s < 1e-9 * LOST_NS:
                runs[-1].append(one)
            else:
                runs.append([one])
        self._smoothed = [one for run in runs for one in smooth(run)]
        self._final_s = math.inf if self.over or not runs else self._filtered[-1].t_s - AHEAD_S
