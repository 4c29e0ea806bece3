"""Live pictures in full size, pulled from the nodes through the engine's `still` command. Threads, no Qt.

No setting of a node is touched. Two questions per camera are under way at a time: one picture is compressed while the
last travels (measured on two cores beside engine and twin: half as many pictures again as with one at a time).
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import EngineError, RhotError
from rhot_app.state import HandState
from rhot_app.ui.backend.contract import CommandClient, Connect, Listener
from rhot_app.ui.backend.reader import END_S, Reader
from rhot_app.ui.language import tr
from rhot_node.errors import PictureError
from rhot_node.pictures import decode_picture

Image = NDArray[np.uint8]

RATE_HZ = 15.0
"""Pictures per second and camera; more would only warm the machine."""

_IN_FLIGHT = 2
_RETRY_S = 0.3
_KEPT = 6
_OVERTAKEN_NS = 1_000_000_000
_STALE_NS = 1_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One frame: `bgr` (H, W, 3) uint8, read only. `t_node_ns` by the node's clock, `received_ns` monotonic here."""

    camera: str
    bgr: Image
    number: int
    t_node_ns: int
    received_ns: int


class LiveFeed(Reader):
    """Newest pictures of some cameras, from any thread."""

    def __init__(self, cameras: Mapping[str, int], connect: Connect, rate_hz: float = RATE_HZ) -> None:
        """`cameras` are node ids by name; `connect` makes a client for each thread."""
        super().__init__([(name,) for name in cameras for _ in range(_IN_FLIGHT)])
        self.cameras = tuple(cameras)
        self._node_ids = dict(cameras)
        self._connect = connect
        self._period_s = 1.0 / rate_hz
        self._lock = threading.Lock()
        self._pictures: dict[str, deque[Picture]] = {name: deque(maxlen=_KEPT) for name in cameras}
        self._due_s = dict.fromkeys(cameras, 0.0)
        self._problems = dict.fromkeys(cameras, "")
        self._resumed = threading.Event()
        self._resumed.set()

    def stop(self, timeout_s: float = END_S) -> bool:
        """End for good, from a pause, too."""
        self._ending.set()
        self._resumed.set()
        return super().stop(timeout_s)

    def pause(self, paused: bool) -> None:
        """Ask for nothing while nobody looks."""
        if paused:
            self._resumed.clear()
        else:
            self._resumed.set()

    def newest(self, camera: str) -> Picture | None:
        """The last picture of a camera."""
        with self._lock:
            pictures = self._pictures[camera]
            return pictures[-1] if pictures else None

    def together(self, cameras: tuple[str, ...]) -> dict[str, Picture]:
        """One recent picture of each camera, all received as nearly at the same time as can be had.

        Cameras without a picture of the last second are left out.
        """
        oldest_ns = time.monotonic_ns() - _STALE_NS
        with self._lock:
            recent = {name: list(self._pictures[name]) for name in cameras
                      if self._pictures[name] and self._pictures[name][-1].received_ns > oldest_ns}
        if not recent:
            return {}
        anchor_ns = min(pictures[-1].received_ns for pictures in recent.values())
        return {name: min(pictures, key=lambda picture: abs(picture.received_ns - anchor_ns))
                for name, pictures in recent.items()}

    def problem(self, camera: str) -> str:
        """Why there are no pictures of a camera, "" while they come."""
        with self._lock:
            return self._problems[camera]

    def _run(self, camera: str) -> None:
        with contextlib.closing(self._connect()) as client:
            while not self._ending.is_set():
                self._resumed.wait()
                if self._ending.wait(self._wait_s(camera)):
                    break
                self.step(camera, client)

    def _wait_s(self, camera: str) -> float:
        """Take the next turn of this camera; how long until then."""
        now = time.monotonic()
        with self._lock:
            turn = max(now, self._due_s[camera])
            self._due_s[camera] = turn + self._period_s
        return turn - now

    def step(self, camera: str, client: CommandClient) -> None:
        """Ask for one picture and keep it; a failure becomes the camera's problem."""
        try:
            picture = ask_picture(client.command, camera, self._node_ids[camera])
        except RhotError as exc:
            with self._lock:
                self._problems[camera] = str(exc)
            self._ending.wait(_RETRY_S)
            return
        with self._lock:
            self._problems[camera] = ""
            kept = self._pictures[camera]
            if not kept or not _overtaken(picture, kept[-1]):
                kept.append(picture)


def _overtaken(picture: Picture, newest: Picture) -> bool:
    """Whether a newer picture, or this very one, is there already; a node that was started again counts from 0."""
    return picture.number <= newest.number and newest.t_node_ns - picture.t_node_ns < _OVERTAKEN_NS


def ask_picture(command: Callable[..., dict[str, Any]], camera: str, node_id: int) -> Picture:
    """One still of one node by the engine's `command`; raises EngineError when the node or the engine gives none."""
    answer = command("still", node_id=node_id, format="jpeg")
    received_ns = time.monotonic_ns()
    jpeg, about = answer.get("jpeg"), answer.get("answer", {})
    try:
        bgr = decode_picture(jpeg if isinstance(jpeg, bytes) else b"")
    except PictureError as exc:
        raise EngineError(tr("camera {camera} gave a picture that cannot be read; restart its node.",
                             camera=camera)) from exc
    bgr.setflags(write=False)
    return Picture(camera, bgr, int(about.get("number", 0)),
                   int(about.get("t_node_ns", 0)), received_ns)


# -- The hand's states of the last seconds -----------------------------------------------------------------------------

KEPT_S = 4.0
_PERIOD_S = 0.02
_AGAIN_S = 0.5


class StateFeed(Reader):
    """Hears the engine's states and keeps the last ones, for any thread."""

    def __init__(self, listen: Callable[[], Listener], clock: Callable[[], float] = time.monotonic) -> None:
        """`listen` makes the client, in the feed's own thread; `clock` gives seconds."""
        super().__init__()
        self._listen, self._clock = listen, clock
        self._states: deque[tuple[float, HandState]] = deque()
        self._lock = threading.Lock()

    def recent(self, seconds: float = KEPT_S) -> list[HandState]:
        """The states that came within the last seconds, oldest first."""
        since = self._clock() - seconds
        with self._lock:
            return [state for came, state in self._states if came >= since]

    def add(self, state: HandState) -> None:
        """Take a state in, as if it had been heard now."""
        now = self._clock()
        with self._lock:
            self._states.append((now, state))
            while now - self._states[0][0] > KEPT_S:
                self._states.popleft()

    def _run(self) -> None:
        with contextlib.closing(self._listen()) as client:
            while not self._ending.wait(_PERIOD_S):
                try:
                    for message in client.poll():
                        if isinstance(message, HandState):
                            self.add(message)
                except RhotError:  # an engine of another version: what is shown stays empty until it is this one
                    self._ending.wait(_AGAIN_S)
