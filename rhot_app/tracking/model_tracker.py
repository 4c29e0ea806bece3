"""The model tracker: one hand estimated from every image position of every camera, each at its own time.

Rehg's idea (1995, chapter 2): one kinematic model, every observation a residual on it. Cameras need no
synchronisation, a marker that one camera sees counts, and what no marker shows is known as well as the hand's own
shape and habits tell, with the covariance that says how well that is.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig
from rhot_app.tracking.association import MarkerAssociation
from rhot_app.tracking.hand_size import HandSize
from rhot_app.tracking.kalman.elbow import bent_backwards, unbend
from rhot_app.tracking.kalman.estimate import ORDINARY_S, copy_estimate, empty_estimate
from rhot_app.tracking.kalman.hand_filter import HandFilter
from rhot_app.tracking.kalman.marker_block import MarkerBlock
from rhot_app.tracking.kalman.motion import predict
from rhot_app.tracking.kalman.rows import Outcome
from rhot_app.tracking.kalman.timeline import TimedBlock, Timeline
from rhot_app.tracking.kalman.wearing import compile_wearing
from rhot_app.tracking.model_output import subject_of
from rhot_app.tracking.model_start import Located, Starter, count_elsewhere
from rhot_app.tracking.model_states import Teller, tell_of_none
from rhot_app.tracking.rig_arrays import compile_rig
from rhot_app.tracking.sights import Sights
from rhot_app.tracking.state import Condition, HandState, Knowledge
from rhot_app.tracking.tracker import CameraObservations

Array = NDArray[np.float64]

LOST_AFTER_NS, LOST_AFTER_PERIODS = 500_000_000, 5.0
"""No sight believed for this long, or for so many frame periods: the hand is lost, and looked for anew."""

WRONG_AFTER_NS, WRONG_AFTER_PERIODS = 100_000_000, 3.0
"""Most sights disbelieved for this long, or for so many frame periods: it is the hand that is wrong, not the sights."""

FARTHEST_AHEAD_S = 0.1
"""Predictions beyond this say little."""

RESTLESS_M_S = 5e-3
"""Hands that are taken to be at rest are not quite: how they drift and tremble, no frame tells beforehand."""

_PENDING = 16
_JUMP_NS = 1_000_000_000
"""A frame this far ahead of the last ones is of another timeline, and so are several this far behind."""

_BEHIND = 5
_APART_MARKERS, _APART_STATES = 3, 3
"""So many markers so far from where all cameras see them, so often in a row, are those of a hand that is elsewhere: two
may have changed names."""

_STRANGEST = 100.0
"""`HandFilter.strangeness` of a hand that is not as it is estimated to be; one that crosses its fingers has 70."""

_AGAIN_NS = 1_000_000_000
"""A hand that is as strange again this soon after it was begun anew for that is so."""

_SOUND_MARKERS, _LEAST_CLEAR = 3, 2
"""With so many markers where all cameras see them a hand is sound; so many set it back. One may be something else."""

_SOUND_NS = 50_000_000
"""A sound hand all of whose markers are measured is not compared again for so long."""

_THUMB_NS = 40_000_000
"""How often a thumb that bends backwards is looked at: before it has gone far the wrong way."""


class Sound(NamedTuple):
    """The hand as it was at `t_ns`, master ns, when its markers were where all cameras saw them."""

    t_ns: int
    pose: HandPose


class ModelTracker:
    """Implements `Tracker`: a state after every frame."""

    def __init__(self, rig: Rig) -> None:
        self._rig, self._wearing = compile_rig(rig), compile_wearing(rig)
        cameras, markers = len(self._rig.camera_names), len(self._rig.marker_ids)
        self._hand = HandFilter(self._wearing.outfit, self._wearing.habits, self._wearing.limits)
        self._size: HandSize | None = None
        if rig.tracker.float_scale:
            self._size = HandSize(self._wearing.worn.dh, self._wearing.limits, self._wearing.natural,
                                  self._wearing.bias_variance)
        self._timeline = Timeline(self._hand)
        self._starter = Starter(self._rig, self._wearing)
        self._sights = Sights(cameras, markers)
        self._association = MarkerAssociation(self._rig)
        self._ahead = empty_estimate(cameras, markers)
        subject, self._told_states = subject_of(self._wearing), 0
        self._told, self._told_ahead = (Teller(self._rig, self._sights, subject, estimate)
                                        for estimate in (self._hand.estimate, self._ahead))
        self.reset()

    def reset(self) -> None:
        """Forget everything but the count of states."""
        self._pending: list[CameraObservations] = []
        self._starter.reset()
        self._sights.reset()
        self._association.reset()
        if self._size is not None:
            self._size.reset()
            self._hand.resize(*self._size.known)
        self._tracking = self._ever = False
        self._believed_ns = self._plausible_ns = self._thumb_ns = self._behind = self._apart = self._strange = 0
        self._anew_ns = -_AGAIN_NS
        self._sound: Sound | None = None

    def ingest(self, observations: CameraObservations) -> None:
        """Take one frame in; it is weighed by the next `solve`."""
        observations = self._association.select(observations)
        if len(self._pending) < _PENDING:
            self._pending.append(observations)
        else:
            self._pending = [*self._pending[1:], observations]

    def newest_frames(self) -> tuple[CameraObservations | None, ...]:
        """Each camera's newest frame, None before its first."""
        return tuple(self._sights.newest)

    def solve(self) -> HandState | None:
        """The state after the frames since the last one, None without any."""
        pending, self._pending = self._pending, []
        begun = time.perf_counter()
        taken = [observations for observations in pending if self._take(observations)]
        if not taken:
            return None
        if self._size is not None:
            self._size.work()
            self._hand.resize(*self._size.follow(taken[-1].t_row0_master_ns))
        return self._state(taken[-1], begun)

    def state_at(self, t_ns: int) -> HandState | None:
        """The hand predicted to (or from the past brought to) master time `t_ns`; None while there is no hand, and when
        nothing of it was seen in the half second before.

        Beyond `FARTHEST_AHEAD_S` the prediction stops there. It has the number of the newest state.
        """
        newest = max((frame for frame in self._sights.newest if frame is not None),
                     key=lambda frame: frame.t_receive_ns, default=None)
        if not self._tracking or newest is None or t_ns - self._timeline.t_ns > LOST_AFTER_NS:
            return None
        copy_estimate(self._hand.estimate, self._ahead)
        ahead = min(max(1e-9 * (t_ns - self._timeline.t_ns), 0.0), FARTHEST_AHEAD_S)
        predict(self._ahead, ahead, self._wearing.worn.part, self._wearing.habits, self._ahead.bias_variance)
        for axis in range(3):
            self._ahead.covariance[axis, axis] += (RESTLESS_M_S * ahead) ** 2
        return self._told_ahead.tell(self._timeline.t_ns + round(1e9 * ahead), self._told_states - 1, newest,
                                     time.perf_counter())

    def observe(self, block: TimedBlock) -> None:
        """Weigh anything that tells about the hand, where it belongs in time; without a hand it is lost.

        Markers come this way, and so may an edge, a template or an object in the hand: the filter sees only rows.
        """
        if not self._tracking:
            return
        for weighed, outcome in self._timeline.add(block):
            if isinstance(weighed, MarkerBlock):
                self._learn(weighed, outcome)

    def _take(self, observations: CameraObservations) -> bool:
        """Weigh one frame; False when it is a double or too late."""
        block = MarkerBlock(self._wearing, observations)
        if self._tracking and self._other_time(block.t_ns):
            self._give_up()
            self._sights.reset()
            self._sound = None
        if not self._sights.enter(block):
            return False
        self._starter.ingest(observations)
        if not self._tracking:
            self._look_for_hand()
            return True
        period_ns = 1e9 * self._pace(observations.camera)
        self.observe(block)
        self._look_at_thumb()
        if (self._timeline.t_ns - self._believed_ns > max(LOST_AFTER_NS, LOST_AFTER_PERIODS * period_ns)
                or self._timeline.t_ns - self._plausible_ns > max(WRONG_AFTER_NS, WRONG_AFTER_PERIODS * period_ns)
                or self._hand.astray):
            self._give_up()
        return True

    def _pace(self, camera: int) -> float:
        """Let the estimate know how fast a camera is; returns the quickest one's frame period, s."""
        periods_s, newest = self._sights.periods_s, self._sights.newest
        self._hand.estimate.pace[camera] = min(ORDINARY_S / periods_s[camera], 1.0)
        return min(period_s for period_s, frame in zip(periods_s, newest, strict=True) if frame is not None)

    def _compare(self, state: HandState) -> None:
        """Begin anew when the estimate's markers stay away from where all cameras together see them, or its fingers
        stay bent as nobody's are."""
        is_strange = self._hand.strangeness > _STRANGEST
        if (self._told.complete and not is_strange and self._sound is not None
                and 0 <= self._timeline.t_ns - self._sound.t_ns < _SOUND_NS):
            self._apart = self._strange = 0
            return
        measured = np.count_nonzero(state.marker_knowledge == Knowledge.MEASURED)
        if self._size is None and not is_strange and measured > len(state.marker_ids) - _APART_MARKERS:
            self._apart = self._strange = 0  # what is measured is where cameras see it: nothing is left to compare
            if measured >= _SOUND_MARKERS:
                self._note_sound()
            return
        located = self._starter.locate()
        if located is None:
            return
        apart = count_elsewhere(located.positions, state.marker_positions, self._hand.estimate.velocity,
                                1e-9 * (self._timeline.t_ns - located.t_ns))
        if self._size is not None and apart == 0:
            self._size.look(located, self._hand.estimate.world, self._hand.estimate.angles)
        if apart == 0 and np.count_nonzero(located.clear) >= _SOUND_MARKERS:
            self._note_sound()
        self._apart = self._apart + 1 if apart >= _APART_MARKERS else 0
        self._strange = self._strange + 1 if is_strange else 0
        is_strange = self._strange >= _APART_STATES and abs(self._timeline.t_ns - self._anew_ns) > _AGAIN_NS
        if (is_strange or self._apart >= _APART_STATES) and self._begin(located) and is_strange:
            self._anew_ns = self._timeline.t_ns

    def _note_sound(self) -> None:
        self._sound = Sound(self._timeline.t_ns, HandPose(self._hand.estimate.world.copy(),
                                                          self._hand.estimate.angles.copy()))

    def _look_at_thumb(self) -> None:
        """A thumb that bends backwards may be one that bends forwards."""
        if self._timeline.t_ns - self._thumb_ns > _THUMB_NS and bent_backwards(self._hand.estimate):
            self._thumb_ns = self._timeline.t_ns
            if unbend(self._hand.estimate, self._wearing):
                self._timeline.begin(self._timeline.t_ns)

    def _other_time(self, t_ns: int) -> bool:
        """Whether frames are of another timeline now: one far ahead, or several far behind; a single one is only late.
        """
        if t_ns >= self._timeline.t_ns - _JUMP_NS:
            self._behind = 0
            return t_ns > self._timeline.t_ns + _JUMP_NS
        self._behind += 1
        return self._behind >= _BEHIND

    def _look_for_hand(self) -> None:
        located = self._starter.locate()
        if located is not None:
            self._begin(located)

    def _begin(self, located: Located) -> bool:
        """Start from what one instant shows, if it is enough, or enough for a hand that was sound a moment ago; returns
        whether it is."""
        scale = 1.0 if self._size is None else self._size.scale
        pose = self._starter.pose_of(located.positions, scale)
        if pose is None and self._sound is not None and np.count_nonzero(located.clear) >= _LEAST_CLEAR:
            clear = np.where(located.clear[:, None], located.positions, np.nan)
            since_ns = located.t_ns - self._sound.t_ns
            if 0 <= since_ns < LOST_AFTER_NS:
                pose = self._starter.pose_near(clear, self._sound.pose, 1e-9 * since_ns, scale)
        if pose is not None:
            self._start(located, pose)
        return pose is not None

    def _start(self, located: Located, pose: HandPose) -> None:
        """Start the filter at a pose and weigh again what was seen since."""
        t_ns = located.t_ns
        if self._size is not None:
            self._size.settle()
            self._size.look(located, pose.world_from_palm, pose.angles)
            self._hand.resize(*self._size.known)
        self._hand.start(pose.world_from_palm, pose.angles)
        self._timeline.begin(t_ns)
        self._tracking = self._ever = True
        self._believed_ns = self._plausible_ns = t_ns
        self._apart = self._strange = 0
        for block in self._sights.recent(t_ns):
            self.observe(block)

    def _give_up(self) -> None:
        self._tracking = False
        self._starter.reset()

    def _learn(self, block: MarkerBlock, outcome: Outcome) -> None:
        """Note what was believed of a frame."""
        believed = self._sights.believe(block, outcome)
        if believed:
            self._believed_ns = max(self._believed_ns, block.t_ns)
        if 2 * believed >= block.sights:
            self._plausible_ns = max(self._plausible_ns, block.t_ns)

    def _state(self, newest: CameraObservations, begun: float) -> HandState:
        number, self._told_states = self._told_states, self._told_states + 1
        if not self._tracking:
            return tell_of_none(self._rig, self._sights, number,
                                Condition.LOST if self._ever else Condition.SEARCHING,
                                None if self._size is None else self._size.known, newest, begun)
        state = self._told.tell(self._timeline.t_ns, number, newest, begun)
        self._association.update(state.t_master_ns, state.marker_positions, state.marker_covariances)
        self._compare(state)
        return state
