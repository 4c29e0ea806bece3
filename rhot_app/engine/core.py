"""The engine: one rig, its source, tracker and log; started, stopped and changed by commands. No sockets to clients.

Frames pass through in the source's threads; everything here is called by another one (the server's).
"""

from __future__ import annotations

import functools
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rhot_app.engine.advice import disk_advice, hands_advice, moved_advice
from rhot_app.engine.observer import NodeBlack, NodeMessage, Observer
from rhot_app.engine.output_process import OutputProcess
from rhot_app.engine.pipeline import AfterState, Pipeline, PublishState, Work, warm_up
from rhot_app.engine.status import Advice, EngineStatus, Preview, advise
from rhot_app.errors import EngineError, RhotError
from rhot_app.project import Rig, is_rig_file
from rhot_app.recording.bookmarks import Bookmark, bookmark_record
from rhot_app.recording.raw_log import CONTINUES, begun_now, next_part
from rhot_app.recording.recorder import Recorder
from rhot_app.rig_history import accept
from rhot_app.sources.links import new_session
from rhot_app.sources.receiver import ObservationSource, same_network
from rhot_app.state import SeenContour
from rhot_app.tracking.tracker import Tracker
from rhot_node.threads import complaints

_REPORT = "If that goes on, start the engine again, and send us a report (`rhot report`)."

PREPARING_S = 1.0
"""A change of the rig that takes longer is told."""

MakeSource = Callable[[Rig], ObservationSource]
MakeTracker = Callable[[Rig], Tracker]


class Engine:
    """Everything between the nodes and the clients."""

    def __init__(self, rig: Rig, rig_path: Path | None, make_source: MakeSource, make_tracker: MakeTracker,
                 publish: PublishState, node_message: NodeMessage = lambda node_id: "",
                 after_state: AfterState = lambda: None, outputs: OutputProcess | None = None,
                 node_black: NodeBlack = lambda node_id: False) -> None:
        """Open the source and warm the tracker up; raises SourceError when a port is taken, OutputError for an output
        that cannot be.

        `publish` and `after_state` are called in the source's threads, by one at a time.
        """
        self.rig = rig
        self.rig_path = rig_path
        self.running = False
        self.session = 0
        self.recorder: Recorder | None = None
        self._video = ""  # what the nodes call the videos of the recording that have them
        self._make_source = make_source
        self._make_tracker = make_tracker
        self._node_message = node_message
        self._node_black = node_black
        self._notice = ""  # why the last recording ended
        self._continued: Advice | None = None  # that this recording continues one of before a crash
        self._moved: dict[int, str] = {}  # where nodes were that have moved since the rig was read or saved
        self._shown: dict[tuple[str, int], int] = {}  # times of the contours that were published last
        self._lock = threading.RLock()
        self._changing = threading.Lock()  # of the rig: one change after the other, while everything else goes on
        self._preparing_s: float | None = None  # since when a new rig's tracker is made
        self._closed = False
        self._outputs = outputs
        if outputs is not None:
            outputs.check(rig)
        self._source = make_source(rig)
        try:
            self._pipeline = Pipeline(self._work(rig, self._tracker(rig)), publish, after_state)
        except BaseException:
            self._source.close()
            raise
        self._listen()
        self._observer = Observer(rig, self._source, self._pipeline)
        if outputs is not None:
            outputs.configure(rig)

    def start(self) -> int:
        """Have the nodes stream in a new session; returns its number. Starting again begins another one."""
        with self._lock:
            self.session = new_session()
            self.running = True
            self._pipeline.restart()
            self._observer.restart()
            self._source.start(self.session)
            return self.session

    def stop(self) -> None:
        """Have the nodes stop."""
        with self._lock:
            self._source.stop()
            self.running = False
            self.session = 0

    @property
    def video(self) -> str:
        """Name of the video that every node is to record now; empty for none."""
        return self._video if self.recorder is not None else ""

    @property
    def live(self) -> bool:
        """Whether its observations come from nodes, not from a recording."""
        return self._source.live

    def record(self, path: Path, *, video: bool = False, continues: Path | None = None) -> None:
        """Write the raw log to `path` from now on, and have every node record its frames if `video`; a replay has none.
        `continues`: the log of the part before.

        Raises RecordingError, EngineError when something is recorded already.
        """
        with self._lock:
            if self.recorder is not None:
                raise EngineError(f"already recording to {self.recorder.path}; stop that recording first.")
            self._notice = ""
            video = video and self._source.live
            name = f"{datetime.now(UTC):%Y%m%dT%H%M%SZ}-{secrets.token_hex(4)}" if video else ""
            about = begun_now(time.monotonic_ns()) | ({"video": name} if video else {})
            if continues is not None:
                about[CONTINUES] = continues.name
            self._continued = None
            recorder = Recorder(path, self.rig, about)
            try:
                self._source.record_to(recorder)
            except BaseException:
                recorder.discard()
                raise
            self._video, self.recorder = name, recorder

    def record_on(self, path: Path, *, video: bool = False) -> None:
        """Continue in a new part the recording that an engine was writing to `path` when it died. The status says so,
        or why it could not be."""
        part = next_part(path)
        try:
            self.record(part, video=video, continues=path)
        except RhotError as exc:
            self._notice = (f"The engine stopped and was started again. The recording was not continued: {exc} What "
                            f"came before is in {path}.")
            return
        self._continued = advise("The engine stopped and was started again. The recording continues in {part}; what "
                                 "came before is in {before}.", level="info", subject="information", part=part.name,
                                 before=path.name)

    def record_stop(self) -> Path | None:
        """Finish the log; returns its path, or None when nothing was recorded."""
        with self._lock:
            recorder, self.recorder = self.recorder, None
            if recorder is None:
                return None
            self._source.record_to(None)
            recorder.close()
            self._notice = recorder.failure
            return recorder.path

    def bookmark(self, text: str, t_master_ns: int | None = None) -> int:
        """Set a bookmark in the log that is being recorded, at `t_master_ns` or now; returns its time, ns.

        Raises RecordingError (the text), EngineError when nothing is recorded.
        """
        with self._lock:
            if self.recorder is None:
                raise EngineError("nothing is being recorded, so there is no log for the bookmark. Start a recording.")
            record = bookmark_record(Bookmark(time.monotonic_ns() if t_master_ns is None else t_master_ns, text))
            self.recorder.put(record.kind, record.node_id, record.t_master_ns, record.data)
            return record.t_master_ns

    def set_rig(self, rig: Rig) -> None:
        """Go on with another rig. Ports and sessions stay when the nodes are reached as before; where only outputs
        differ, tracking is not touched. May take a minute, when the rig's tracker is compiled; everything else goes on
        meanwhile, by other threads.

        Raises SourceError (a port is taken), OutputError (an output cannot be) or what the tracker objects to; the old
        rig then stays.
        """
        with self._changing:
            with self._lock:
                if self._outputs is not None:
                    self._outputs.check(rig)
                if msgspec.structs.replace(rig, outputs=self.rig.outputs) == self.rig:
                    self._change_outputs(rig)
                    return
                self._require_same_nodes_while_recording(rig)
            self._preparing_s = time.monotonic()
            try:
                tracker = self._tracker(rig)
            finally:
                self._preparing_s = None
            with self._lock:
                self._take_up(rig, tracker)

    def _take_up(self, rig: Rig, tracker: Tracker) -> None:
        if self._closed:
            raise EngineError("the engine is ending.")
        self._require_same_nodes_while_recording(rig)
        kept = same_network(self.rig, rig)
        if kept:
            self._source.configure(rig)
        else:
            self._change_source(rig)
        self._pipeline.use(self._work(rig, tracker))
        self._listen()
        self.rig = rig
        if self._outputs is not None:
            self._outputs.configure(rig)
        self._observer = Observer(rig, self._source, self._pipeline)
        if self.running and not kept:
            self.start()

    def _require_same_nodes_while_recording(self, rig: Rig) -> None:
        if self.recorder is not None and not same_network(self.rig, rig):
            raise EngineError("other nodes cannot be used while recording; stop the recording first.")

    def save_rig(self, path: Path | None) -> Path:
        """Write the rig to `path`, by default where it came from; what stood there is kept (`rig_history`).

        Returns the path. Raises EngineError without one, RigError when it cannot be written.
        """
        with self._lock:
            target = path or self.rig_path
            if target is None:
                raise EngineError("this rig came from no file; give a path to save it to.")
            if target.exists() and not is_rig_file(target):
                raise EngineError(f"{target}: is no rig file, so it is not replaced. Choose another name.")
            self._follow_nodes()
            accept(target, self.rig, "saving the engine's rig")
            self.rig_path = target
            self._moved = {}
            return target

    def status(self) -> EngineStatus:
        """How everything goes, now."""
        with self._lock:
            if self.recorder is not None and self.recorder.failure:
                self.record_stop()
            self._follow_nodes()
            extra = [Advice("error", self._notice, subject="recording")] if self._notice else []
            if self.recorder is not None:
                if self.recorder.notice:
                    extra.append(Advice("warning", self.recorder.notice, subject="recording"))
                if self._continued is not None:
                    extra.append(self._continued)
                extra += disk_advice(str(self.recorder.path.parent), self.recorder.disk.seconds_left)
            extra += moved_advice(self.rig, self._moved) + hands_advice(self.rig)
            since_s = self._preparing_s
            if since_s is not None and time.monotonic() - since_s > PREPARING_S:
                extra.append(advise("The new rig is being prepared; the one before is tracked until then.",
                                    level="info", subject="information"))
            extra += [Advice("error", f"{text} {_REPORT}", subject="tracking") for text in complaints()]
            outputs = self._outputs
            extra += [] if outputs is None else [Advice("warning", text) for text in outputs.complaints()]
            status = self._observer.status(str(self.rig_path or ""), self.session, self.running, self.recorder,
                                           self._node_message, extra, self._node_black)
            return status if outputs is None else replace(status, outputs=outputs.status())

    def contours(self) -> list[SeenContour]:
        """What the tracker has seen of a bare hand since this was asked last."""
        found = self._pipeline.work.tracker.seen()
        fresh = [one for one in found if self._shown.get((one.camera, one.hand)) != one.t_master_ns]
        self._shown |= {(one.camera, one.hand): one.t_master_ns for one in fresh}
        return fresh

    def annotated(self, preview: Preview) -> Preview:
        """A node's preview with what was observed in its very frame; as it is while that is not known."""
        camera = next((k for k, node in enumerate(self.rig.nodes) if node.name == preview.camera), None)
        frame = None if camera is None else self._pipeline.frame(camera, preview.t_node_ns)
        return preview if frame is None else replace(preview, t_master_ns=frame.t_row0_master_ns, pixels=frame.pixels,
                                                     flags=frame.flags)

    def refined(self) -> dict[str, Any]:
        """What a moving hand says of the cameras (`RigWatch.refined`)."""
        with self._lock:
            return self._observer.rig_watch.refined(self.rig)

    def adapted(self) -> dict[str, Any]:
        """What a bare hand that moves says of its shape (`HandWatch.adapted`)."""
        with self._lock:
            return self._observer.hand_watch.adapted(self._pipeline.work.tracker, time.monotonic_ns())

    def measured(self) -> dict[str, Any]:
        """The bones that the landmarks of a hand show (`BonesWatch.measured`)."""
        with self._lock:
            return self._observer.bones_watch.measured()

    def close(self) -> None:
        """Stop the nodes, finish the log, close all ports. May be called twice."""
        with self._lock:
            self._closed = True
            if self.running:
                self.stop()
            self.record_stop()
            self._source.close()
            if self._outputs is not None:
                self._outputs.close()

    def _follow_nodes(self) -> None:
        """The rig has every node where the source has found it."""
        nodes = tuple(link.node for link in self._source.links)
        if not self._source.live or nodes == self.rig.nodes:
            return
        for old, new in zip(self.rig.nodes, nodes, strict=True):
            if new.address != old.address:
                self._moved.setdefault(old.node_id, old.address)
        self.rig = self._observer.rig = msgspec.structs.replace(self.rig, nodes=nodes)

    def _change_outputs(self, rig: Rig) -> None:
        """The rig with other outputs: tracker, log and meters go on as they are."""
        self.rig = self._observer.rig = rig
        if self._outputs is not None:
            self._outputs.configure(rig)

    def _listen(self) -> None:
        self._source.deliver_to(functools.partial(self._pipeline.take, self._source))

    def _tracker(self, rig: Rig) -> Tracker:
        """The tracker of a rig, compiled."""
        tracker = self._make_tracker(rig)
        warm_up(tracker, rig)
        return tracker

    def _work(self, rig: Rig, tracker: Tracker) -> Work:
        unseen = np.full((len(rig.nodes), len(rig.markers.markers)), time.monotonic_ns(), dtype=np.int64)
        return Work(self._source, tracker, unseen)

    def _change_source(self, rig: Rig) -> None:
        """Other nodes: the old ports must be closed before the new ones, which may be the same, are opened."""
        old_rig, old_tracker = self.rig, self._pipeline.work.tracker
        if self.running:
            self._source.stop()
        self._source.close()
        try:
            self._source = self._make_source(rig)
        except Exception:
            self._source = self._make_source(old_rig)
            old_tracker.reset()
            self._pipeline.use(self._work(old_rig, old_tracker))
            self._listen()
            self._observer = Observer(old_rig, self._source, self._pipeline)
            if self.running:
                self.start()
            raise
