"""The objects of a rig that other trackers follow: their poses, in the rig frame, as the engine takes them."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import RhotError
from rhot_app.estimation.se3 import rotation_from_quaternion, skew
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.alignment.alignment_file import Alignment, load_alignment
from rhot_app.objects.observations import MeasuredPose, encode_pose
from rhot_app.objects.pose import Validity
from rhot_app.project import ObjectPoses, Rig
from rhot_app.recording.raw_log import RecordKind, RecordSink
from rhot_app.sources.poses.open_source import open_source
from rhot_app.sources.poses.source import ForeignPose, PoseSource
from rhot_app.sources.receiver import Deliver, to_nobody
from rhot_node.threads import ANSWER_S, FOREIGN, Worker

log = logging.getLogger(__name__)

Array = NDArray[np.float64]
OpenSource = Callable[[str, str], PoseSource]

POLL_S = 4e-3
"""s between two looks: half of the period of a tracker of 125 Hz."""

AGAIN_S = ANSWER_S
"""s after which a source that failed or ended is opened again."""


def in_rig(pose: ForeignPose, name: str, poses: ObjectPoses, alignment: Alignment) -> MeasuredPose:
    """A pose of the tracker as one of the object `name` in the rig; its covariance includes the alignment's noise."""
    turn = alignment.rig_from_foreign.matrix
    tracker_from_object = rigid(rotation_from_quaternion(poses.rotation_wxyz), poses.translation_m)
    jacobian = np.zeros((6, 6))
    jacobian[:3, :3] = jacobian[3:, 3:] = turn[:3, :3]
    arm = pose.world_from_body[:3, :3] @ tracker_from_object[:3, 3]
    jacobian[:3, 3:] = -turn[:3, :3] @ skew(arm)
    covariance = jacobian @ pose.covariance @ jacobian.T
    covariance[range(3), range(3)] += alignment.noise_m**2
    t_ns = pose.t_master_ns + round(1e9 * alignment.time_offset_s)
    return MeasuredPose(name, t_ns, turn @ pose.world_from_body @ tracker_from_object, covariance)


class FollowedObjects:
    """A thread that polls the sources of a rig's objects. A source that fails is opened again; `notices` says why."""

    def __init__(self, rig: Rig, open_named: OpenSource = open_source) -> None:
        """Nothing is opened before `start`."""
        self.deliver: Deliver = to_nobody
        self.tap: RecordSink | None = None
        self._followed = [_Followed(one.model.name, one.poses, open_named) for one in rig.objects
                          if one.model is not None and one.poses is not None]
        self._worker = Worker("listens to other trackers", self._turn, end=self._close_all)

    def start(self) -> None:
        """Begin to poll, if the rig has such objects."""
        if self._followed:
            self._worker.start()

    def notices(self) -> list[str]:
        """What is wrong with the sources now, a sentence each."""
        return [one.notice for one in self._followed if one.notice]

    def close(self) -> None:
        """End the thread and close the sources. May be called twice."""
        self._worker.close()

    def _turn(self) -> None:
        for one in self._followed:
            for pose in one.poll():
                if self.tap is not None:
                    self.tap.put(RecordKind.OBJECT_POSE, 0, pose.t_ns, encode_pose(pose))
                self.deliver([pose])
        self._worker.ending.wait(POLL_S)

    def _close_all(self) -> None:
        for one in self._followed:
            one.close()


class _Followed:
    """One object with its source, which is opened when it is polled."""

    def __init__(self, name: str, poses: ObjectPoses, open_named: OpenSource) -> None:
        self.notice = ""
        self._name, self._poses, self._open = name, poses, open_named
        self._source: PoseSource | None = None
        self._alignment: Alignment | None = None
        self._waits = 0

    def poll(self) -> list[MeasuredPose]:
        """The poses since the last call that were measured, in the rig."""
        if self._waits > 0:
            self._waits -= 1
            return []
        if self._source is None and not self._opened():
            return []
        try:
            return self._poll()
        except FOREIGN as exc:
            log.exception("the source of %s failed", self._name)
            self.notice = self._said(f"its source failed ({type(exc).__name__}: {exc}) and is opened again.")
            self.close()
            return []

    def _poll(self) -> list[MeasuredPose]:
        assert self._source is not None and self._alignment is not None
        found = [in_rig(pose, self._name, self._poses, self._alignment) for pose in self._source.poll()
                 if pose.validity is Validity.TRACKED]
        self.notice = self._said(self._source.notice)
        if self._source.ended:
            self.close()
        return found

    def close(self) -> None:
        """Close the source; the next poll but some opens it again."""
        if self._source is not None:
            with contextlib.suppress(*FOREIGN):
                self._source.close()
        self._source, self._waits = None, round(AGAIN_S / POLL_S)

    def _opened(self) -> bool:
        try:
            self._alignment = load_alignment(Path(self._poses.alignment))
            self._source = self._open(self._poses.source, self._poses.tracker)
        except FOREIGN as exc:
            sentence = str(exc) if isinstance(exc, RhotError) else f"its source cannot be opened ({exc!r})."
            self.notice, self._waits = self._said(sentence), round(AGAIN_S / POLL_S)
            return False
        self.notice = ""
        return True

    def _said(self, sentence: str) -> str:
        return f"{self._name}: {sentence}" if sentence else ""
