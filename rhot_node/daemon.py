"""The node itself: reads a frame, finds the markers, sends them. States and their changes live here."""

from __future__ import annotations

import dataclasses
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rhot_node.capture.camera import FIRST_FRAME_S, READ_S, Camera, EndOfRecording, Frame, Rewindable, report_of
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings, NodeSettings
from rhot_node.detect.image import Detector
from rhot_node.errors import CameraError
from rhot_node.foreground_store import ForegroundStore
from rhot_node.frame_search import FrameMessages, Sender
from rhot_node.health.camera import RateMeter, brightness, camera_troubles
from rhot_node.health.checks import BLACK_PICTURE, Check, is_black
from rhot_node.landmark_search import LandmarkSearch
from rhot_node.network.pictures import PictureBox
from rhot_node.network.requests import SettingsStore
from rhot_node.network.session import Sessions
from rhot_node.slice_search import SliceSearch
from rhot_node.tag_search import TagSearch
from rhot_node.threads import Watch, complaints
from rhot_node.wire.messages import NodeState, Observations

log = logging.getLogger(__name__)

REOPEN_S = 1.0  # between tries to open a lost camera
_LIGHT_PERIOD_S = 1.0
_OPENING_S = 2.0 * FIRST_FRAME_S
_READS = "reads the camera"
_SENDS = "sends what was found"

OpenCamera = Callable[[CameraSettings], Camera]
MakeDetector = Callable[[NodeSettings], Detector]


@dataclass
class Counters:
    """What the daemon has counted since it started."""

    frames: int = 0
    skipped_frames: int = 0  # gaps in the camera's numbers
    over_budget: int = 0  # frames whose processing took longer than the budget
    late_dropped: int = 0  # of these, those that were not sent because of it
    faults: int = 0


class NodeDaemon:
    """One node. `step` handles one frame; everything it works with is passed in. One thread, but `state`, `report`
    and `count` may be asked by any."""

    def __init__(self, store: SettingsStore, clock: NodeClock, open_camera: OpenCamera, make_detector: MakeDetector,
                 *, camera_takes_settings: bool = True, loop: bool = False,
                 troubles: Callable[[], list[Check]] = list, video: Callable[[Frame], object] | None = None,
                 foreground: ForegroundStore | None = None) -> None:
        """`loop`: a recording that ends begins again. `troubles`: what is wrong with the machine; called by whoever
        asks for a report. `video` is given every frame, after its observations are sent. `foreground`: what
        was learnt of background and skin; nothing by default. Nothing is opened before `prepare`."""
        self.sessions = Sessions()
        self.counters = Counters()
        self._store = store
        self._settings = store.current
        self._clock = clock
        self._open_camera = open_camera
        self._make_detector = make_detector
        self._camera_takes_settings = camera_takes_settings
        self._loop = loop
        self._troubles = troubles
        self._video = video
        self._tags = TagSearch(store.current, clock)
        self._landmarks = LandmarkSearch(store.current, clock)
        self.foreground = ForegroundStore(None) if foreground is None else foreground
        self.slices = SliceSearch(store.current.node_id, clock, self.foreground)
        self._searches = self._tags, self._landmarks, self.slices
        self._messages = FrameMessages(store.current.node_id, clock)
        self._frames, self._opening = Watch(_SENDS), Watch("opens the camera", _OPENING_S)
        self._camera: Camera | None = None
        self._detector: Detector | None = None
        self._prepared = False
        self._message = ""  # why the node is in fault
        self._size = (0, 0)
        self._shown_state = NodeState.STARTING
        self._retry_s = 0.0
        self._last_frame: tuple[int, int] | None = None  # number and time of the frame before
        self._black, self._luma = False, 0.0
        self._rate = RateMeter()
        self._light_due_s = 0.0

    @property
    def state(self) -> NodeState:
        """What the node does now."""
        if not self._prepared:
            return NodeState.STARTING
        if self._camera is None or self._hangs():
            return NodeState.FAULT
        return NodeState.STREAMING if self.sessions.current else NodeState.READY

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), px, of the camera's images."""
        return self._size

    def report(self) -> dict[str, Any]:
        """State, for the control channel."""
        stream, camera = self.sessions.current, self._camera
        said = {} if camera is None else report_of(camera)
        return {**self.introduce(), "message": self._hangs() or self._message,
                "session": stream.session if stream else 0,
                "width": self._size[0], "height": self._size[1], "detector": self._settings.detector,
                "tags": list(self._settings.tags.sought),
                "foreground": self.foreground.report(*self._size),
                "marker_checksum": self._settings.markers.checksum, "t_node_ns": self._clock.now_ns(),
                "camera": said,
                "health": [*self._troubles(), *self._landmarks.troubles(), *self._camera_troubles(said),
                           *(Check("threads", "error", text) for text in complaints())]}

    def _camera_troubles(self, said: dict[str, Any]) -> list[Check]:
        """What its pictures say against the camera; `said`: what it says of itself."""
        return [BLACK_PICTURE] if self._black else camera_troubles(said, self._rate.rate_hz, self._luma)

    def introduce(self) -> dict[str, Any]:
        """What anybody may know, paired or not."""
        return {"node_id": self._settings.node_id, "name": self._settings.name, "state": self.state.name.lower()}

    def count(self) -> dict[str, Any]:
        """Counters, for the control channel."""
        counted = {**dataclasses.asdict(self.counters), "sent": self._messages.sent,
                   "not_sent": self._messages.not_sent}
        for search in self._searches:
            counted |= search.count()
        return counted

    def spare_landmarks(self) -> None:
        """Search no landmarks for a while, whose camera serves nobody. Any thread may ask."""
        self._landmarks.spare()

    def prepare(self) -> None:
        """Make the detector and open the camera: the node is then ready. Raises CameraError."""
        self._detector = self._make_detector(self._settings)
        for search in self._searches:
            search.prepare()
        self._open()
        self._prepared = True
        self._show_state()

    def close(self) -> None:
        """Close the camera and end the searches beside that for markers."""
        self._frames.dismiss()
        self._opening.dismiss()
        for search in self._searches:
            search.close()
        self.foreground.close()
        self._close_camera()

    def _close_camera(self) -> None:
        if self._camera is not None:
            self._camera.close()
            self._camera = None

    def step(self, sender: Sender, pictures: PictureBox) -> bool:
        """Handle one frame, or wait for one a moment. False when the recording is over and the node with it."""
        with self._frames.timed():
            return self._step(sender, pictures)

    def _step(self, sender: Sender, pictures: PictureBox) -> bool:
        self.sessions.expire(time.monotonic())
        if self._store.current is not self._settings:
            self._take_settings(self._store.current, pictures)
        self._show_state()
        if self._camera is None or self._detector is None:
            self._wait_to_reopen()
            return True
        try:
            self._frames.what = _READS
            frame = self._camera.read(READ_S)
        except EndOfRecording:
            return self._begin_again(self._camera)
        except CameraError as exc:
            self._fail(exc)
            return True
        if frame is None:
            return True
        self._look_at_light(frame)
        self._rate.add(frame.number, frame.t_node_ns)
        self._frames.what = f"finds markers by the detector {self._settings.detector}"
        markers = self._detector.detect(frame.image)
        self._frames.what = _SENDS
        late = self._count_frame(frame)
        stream, searched = self.sessions.current, True
        if stream is not None and frame.t_node_ns >= stream.t_start_node_ns:
            if late and self._settings.late_frames == "drop":
                self.counters.late_dropped += 1
            elif not self._by_networks_alone():
                self._messages.send(Observations(*self._messages.head(frame, stream, Observations),
                                                 self._settings.markers.checksum, markers), stream, sender)
            searched = self.slices.offer(frame, stream, sender)
            self._tags.offer(frame, stream, sender)
            self._landmarks.offer(frame, stream, sender)
        pictures.offer(frame, searched=searched)
        if self._video is not None:
            self._video(frame)
        return True

    def _by_networks_alone(self) -> bool:
        """Whether all markers are landmarks that the hand networks find: messages of markers would say nothing."""
        return (self._landmarks.wanted
                and all(marker.shape == "landmark" for marker in self._settings.markers.markers))

    def _look_at_light(self, frame: Frame) -> None:
        """Once a second, because the image is gone by the time that somebody asks."""
        now_s = time.monotonic()
        if now_s >= self._light_due_s:
            self._light_due_s = now_s + _LIGHT_PERIOD_S
            self._black, self._luma = is_black(frame.image.y), brightness(frame.image.y)

    def _count_frame(self, frame: Frame) -> bool:
        """Count the frame; says whether its processing took longer than the budget."""
        self.counters.frames += 1
        budget_ms = self._settings.budget_ms
        budget_ns = None if budget_ms is None else round(1e6 * budget_ms)
        if self._last_frame is not None:
            step = frame.number - self._last_frame[0]
            self.counters.skipped_frames += max(step - 1, 0)
            if budget_ns is None:
                budget_ns = (frame.t_node_ns - self._last_frame[1]) // max(step, 1)
        self._last_frame = frame.number, frame.t_node_ns
        late = budget_ns is not None and self._clock.now_ns() - frame.t_available_node_ns > budget_ns
        self.counters.over_budget += late
        return late

    def _open(self) -> None:
        self._last_frame = None
        self._black, self._rate = False, RateMeter()
        with self._opening.timed():
            self._camera = self._open_camera(self._settings.camera)
        self._size = self._camera.size
        self._message = ""

    def _hangs(self) -> str:
        """What of the frame loop does not come back, as a sentence; empty when all does."""
        now_s = time.monotonic()
        return self._opening.complaint(now_s) or ("" if self._camera is None else self._frames.complaint(now_s))

    def _fail(self, error: CameraError) -> None:
        self.counters.faults += 1
        self._message = str(error)
        self._close_camera()
        self._retry_s = time.monotonic() + REOPEN_S
        self._show_state()

    def _wait_to_reopen(self) -> None:
        """Try to open the lost camera once a second."""
        wait_s = self._retry_s - time.monotonic()
        if wait_s > 0:
            time.sleep(min(wait_s, READ_S))
        else:
            self._reopen()

    def _reopen(self) -> None:
        """Open the camera again; a session goes on where it was."""
        try:
            self._open()
        except CameraError as exc:
            self._message = str(exc)
            self._retry_s = time.monotonic() + REOPEN_S
        else:
            if self._detector is not None:
                self._detector.reset()
        self._show_state()

    def _begin_again(self, camera: Camera) -> bool:
        if self._loop and isinstance(camera, Rewindable):
            camera.rewind()
            return True
        log.info("the recording is over")
        return False

    def _take_settings(self, settings: NodeSettings, pictures: PictureBox) -> None:
        """Apply changed settings as far as a running node can."""
        old, self._settings = self._settings, settings
        pictures.preview_hz = settings.preview_hz
        for search in self._searches:
            search.configure(settings)
        if (settings.detector, settings.markers) != (old.detector, old.markers):
            self._detector = self._make_detector(settings)
        if settings.camera != old.camera and self._camera_takes_settings and self._camera is not None:
            self._close_camera()
            self._message = "the camera is being opened again with new settings"
            self._reopen()

    def _show_state(self) -> None:
        state = self.state
        if state is not self._shown_state:
            level = logging.ERROR if state is NodeState.FAULT else logging.INFO
            log.log(level, "%s -> %s%s", self._shown_state.name.lower(), state.name.lower(),
                    f": {self._message}" if self._message else "")
            self._shown_state = state
