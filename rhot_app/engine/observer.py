"""Looks at a running pipeline a few times a second and says how it goes: the status that clients get."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rhot_app.calibration.check.health import HealthMonitor, HealthSample
from rhot_app.calibration.verdict import Grade
from rhot_app.diagnostics import Diagnostic
from rhot_app.engine.advice import (
    NodeFacts,
    calibration_advice,
    no_marker_advice,
    node_advice,
    one_camera_advice,
    start_pose_advice,
    times_advice,
)
from rhot_app.engine.node_meter import RECENT_NS, NodeMeter
from rhot_app.engine.pipeline import Pipeline
from rhot_app.engine.rig_watch import BonesWatch, HandWatch, RigWatch
from rhot_app.engine.status import Advice, EngineStatus, LatencySummary, NodeStatus, most_urgent_first
from rhot_app.project import Rig
from rhot_app.recording.recorder import Recorder
from rhot_app.sources.receiver import RECEIVE_BUFFER, ObservationSource
from rhot_app.state import Condition, HandState, Knowledge
from rhot_app.tracking.tracker import Tracker

_SUMMARY_NS = 500_000_000  # sorting the latencies is the dearest part of a status

NodeMessage = Callable[[int], str]
"""``message(node_id)``: what the node itself says about its fault."""

NodeBlack = Callable[[int], bool]
"""``black(node_id)``: whether the node says that its camera's picture is black."""


class Observer:
    """Watches one source and pipeline. Replaced together with the source."""

    def __init__(self, rig: Rig, source: ObservationSource, pipeline: Pipeline) -> None:
        self.rig = rig
        self._source = source
        self._pipeline = pipeline
        receivers = source.receivers or (None,) * len(source.links)
        self._meters = [NodeMeter(link, receiver) for link, receiver in zip(source.links, receivers, strict=True)]
        self._latency: dict[str, LatencySummary] = {}
        self._summarised_ns = 0
        self._ever_tracked = False
        self._health = HealthWatch(rig)
        self.rig_watch, self.hand_watch, self.bones_watch = RigWatch(rig), HandWatch(rig), BonesWatch(rig)

    def restart(self) -> None:
        """A new run begins."""
        self._ever_tracked = False
        self._health.restart()
        self.rig_watch.restart()
        self.hand_watch.restart()
        self.bones_watch.restart()

    def status(self, rig_path: str, session: int, running: bool, recorder: Recorder | None,
               message: NodeMessage, extra: list[Advice],
               black: NodeBlack = lambda node_id: False) -> EngineStatus:
        """The engine's status now, with the `extra` advice."""
        now_ns = time.monotonic_ns()
        for meter in self._meters:
            meter.sample(now_ns)
        nodes = tuple(meter.status(now_ns, message(meter.link.node.node_id)) for meter in self._meters)
        if now_ns - self._summarised_ns >= _SUMMARY_NS:
            self._latency, self._summarised_ns = self._pipeline.latency.summary(), now_ns
        return EngineStatus(
            t_master_ns=now_ns, pid=os.getpid(), session=session, running=running,
            condition=self._condition(running, nodes, now_ns).value, rig_name=self.rig.name, rig_path=rig_path,
            state_rate_hz=self._pipeline.states.rate_hz(now_ns), nodes=nodes,
            advice=tuple(most_urgent_first((*extra, *self._advice(nodes, running, now_ns, black)))),
            latency=self._latency,
            log_path="" if recorder is None else str(recorder.path),
            log_bytes=0 if recorder is None else recorder.bytes_written,
            log_seconds=0.0 if recorder is None else recorder.seconds, replaying=self._source.log_path)

    def _condition(self, running: bool, nodes: tuple[NodeStatus, ...], now_ns: int) -> Condition:
        if not running:
            return Condition.IDLE
        if any(one.level == "error" for one in self._diagnosed(now_ns)) or any(node.state == "fault" for node in nodes):
            return Condition.FAULT
        state, rate_hz = self._pipeline.last_state, self._pipeline.states.rate_hz(now_ns)
        if state is None or rate_hz == 0.0:
            return Condition.LOST if self._ever_tracked else Condition.SEARCHING
        condition = condition_of(state)
        self._ever_tracked |= condition in (Condition.TRACKING, Condition.PARTIAL)
        return condition

    def _diagnosed(self, now_ns: int) -> list[Diagnostic]:
        """What the tracker has failed over or warned of within the last two seconds."""
        return self._pipeline.diagnostics.since(now_ns - RECENT_NS)

    def _advice(self, nodes: tuple[NodeStatus, ...], running: bool, now_ns: int, black: NodeBlack) -> list[Advice]:
        facts = [replace(self._facts(camera, status, now_ns), black=black(status.node_id))
                 for camera, status in enumerate(nodes)]
        bare = self.rig.tracker.observe == "contours"  # nobody wears the markers
        nowhere = (no_marker_advice(facts, running, self.rig.painted, f"{self.rig.hand.side} hand") if not bare
                   else start_pose_advice(self._pipeline.last_state) if running else [])
        marker_ids = self.rig.markers.ids
        visibility = not (nowhere or bare)
        found = [advice for one, used in zip(facts, self.rig.tracked_with, strict=True)
                 for advice in node_advice(one, marker_ids, running, visibility=visibility and used)]
        if running:
            self.rig_watch.take(self._pipeline.recent)
            stale = self.rig_watch.advice(now_ns)
            health = self._health.advice(self._pipeline.last_state, self._pipeline.work.tracker, now_ns)
            found += self.hand_watch.advice(self._pipeline.work.tracker, now_ns)
            found += self.bones_watch.advice(self._pipeline.last_state, now_ns)
            found += [*stale, *(one for one in health if not (stale and one.mender == "stereo"))]
        found += [Advice(one.level, one.sentence, subject="tracking" if one.level == "error" else "sight")
                  for one in self._diagnosed(now_ns)]
        notices = [Advice("info", text, subject="information") for text in self._source.notices()]
        return [*found, *nowhere, *calibration_advice(self.rig), *one_camera_advice(self.rig),
                *times_advice(self.rig, [node.rate_hz for node in nodes]), *notices]

    def _facts(self, camera: int, status: NodeStatus, now_ns: int) -> NodeFacts:
        meter = self._meters[camera]
        node, link, receiver = self.rig.nodes[camera], meter.link, meter.receiver
        unseen_s = 1e-9 * (now_ns - self._pipeline.work.last_seen_ns[camera])
        return NodeFacts(
            status=status, recent=meter.recent(), address=node.address, udp_port=node.udp_port,
            expected_size=(node.intrinsics.width, node.intrinsics.height), sent_size=link.door.image_size,
            buffer_bytes=None if receiver is None else receiver.buffer_bytes, wanted_buffer_bytes=RECEIVE_BUFFER,
            unseen_s=unseen_s.tolist(), streams_elsewhere=link.streams_elsewhere,
            not_started_s=link.not_started_s(now_ns))


def condition_of(state: HandState) -> Condition:
    """One word for a state of one hand or two: partial when only one of two hands is there."""
    if state.other is None or state.other.condition is state.condition:
        return state.condition
    both = {state.condition, state.other.condition}
    return Condition.PARTIAL if both & {Condition.TRACKING, Condition.PARTIAL} else Condition.LOST


# Outside the frames' own thread.

LOOK_NS = 95_000_000  # the status comes every 100 ms
JUDGE_NS = 2_000_000_000


class HealthWatch:
    """One rig's health. `advice` is called with every status and mostly returns what it said before."""

    def __init__(self, rig: Rig) -> None:
        self._monitor = HealthMonitor(rig)
        self._advice: list[Advice] = []
        self._looked_ns = self._judged_ns = 0
        self._sequence = -1

    def restart(self) -> None:
        """A new run begins."""
        self._monitor.reset()
        self._advice = []
        self._sequence = -1

    def advice(self, state: HandState | None, tracker: Tracker, now_ns: int) -> list[Advice]:
        """Look at the newest state if a tenth of a second is over, judge every other second."""
        if state is not None and state.sequence != self._sequence and now_ns - self._looked_ns >= LOOK_NS:
            self._looked_ns, self._sequence = now_ns, state.sequence
            self._look(state, tracker)
        if now_ns - self._judged_ns >= JUDGE_NS:
            self._judged_ns = now_ns
            self._advice = [Advice("error" if found.finding.grade is Grade.POOR else "warning", found.finding.sentence,
                                   found.mender, subject="calibration")
                            for found in self._monitor.findings()]
        return self._advice

    def _look(self, state: HandState, tracker: Tracker) -> None:
        frames = [frame for frame in tracker.newest_frames() if frame is not None]
        if len(frames) < len(state.camera_names):
            return
        self._monitor.feed(HealthSample(
            t_ns=state.t_master_ns, positions=state.marker_raw_positions,
            measured=state.marker_knowledge == Knowledge.MEASURED, errors_px=state.epipolar_error_px,
            qualities=np.array([frame.qualities for frame in frames]),
            flags=np.array([frame.flags for frame in frames])))
