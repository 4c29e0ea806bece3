"""The control channel's requests: what may be asked of a node, as JSON, and the answers. No sockets.

docs/node.md lists them. A request that is wrong in any way is answered with ``{"ok": false, "error": sentence}``.
"""

from __future__ import annotations

import ipaddress
import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from rhot_node.clock import NodeClock
from rhot_node.config import NodeSettings, changed_settings, needs_restart, save_settings
from rhot_node.errors import NodeError, SettingsError
from rhot_node.files import decode_message
from rhot_node.foreground_store import ForegroundStore
from rhot_node.network.pictures import PictureBox, StillFormat, encode_still
from rhot_node.network.session import LinkKeys, Sessions
from rhot_node.video.recorder import READ_MAX, VideoName, VideoRecorder
from rhot_node.wire.messages import U64_MAX

log = logging.getLogger(__name__)

Report = Callable[[], dict[str, Any]]


class _Request(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="request"):
    """Root of all requests; the field "request" tells them apart."""


class StateRequest(_Request, frozen=True, tag="state"):
    """What the node is and does."""


class CountersRequest(_Request, frozen=True, tag="counters"):
    """What the node has counted since it started."""


class SettingsRequest(_Request, frozen=True, tag="settings"):
    """The settings as they are."""


class SetSettingsRequest(_Request, frozen=True, tag="set_settings"):
    """Change some settings: objects are merged field by field, everything else is replaced. `save` False tries them
    out: they are in force until the node ends or other ones are set, and the file stays as it is."""

    settings: dict[str, Any]
    save: bool = True


class StillRequest(_Request, frozen=True, tag="still"):
    """One frame, full size, in a second message part: PNG without loss, or JPEG where many are wanted."""

    format: StillFormat = "png"


class StartRequest(_Request, frozen=True, tag="start"):
    """Stream `session` to UDP `port` of `host`, from node time `t_start_node_ns` on (0: at once)."""

    session: Annotated[int, Meta(ge=1)]
    host: str
    port: Annotated[int, Meta(ge=1, le=65535)]
    t_start_node_ns: int = 0
    link: str = ""  # whose key tags the observations; needed unless the node is open


class LinkRequest(_Request, frozen=True, tag="link"):
    """The key of this master's datagrams; that of the link `name` as long as the node knows it."""

    name: str = ""


class StopRequest(_Request, frozen=True, tag="stop"):
    """Stop `session`, or whatever runs when it is 0."""

    session: Annotated[int, Meta(ge=0)] = 0


class SpareLandmarksRequest(_Request, frozen=True, tag="spare_landmarks"):
    """Search no landmarks of hands: nobody uses those of this camera now. Repeated every few seconds, or it ends."""


class VideoStartRequest(_Request, frozen=True, tag="video_start"):
    """Record the video `name`, or go on with it: repeated every few seconds, or the video ends by itself."""

    name: VideoName


class VideoStopRequest(_Request, frozen=True, tag="video_stop"):
    """End the video `name`, or whichever is recorded."""

    name: str = ""


class VideoListRequest(_Request, frozen=True, tag="video_list"):
    """All videos that the node keeps."""


class VideoReadRequest(_Request, frozen=True, tag="video_read"):
    """Bytes of a finished video, in a second message part."""

    name: VideoName
    offset: Annotated[int, Meta(ge=0, lt=1 << 32)]
    length: Annotated[int, Meta(ge=1, le=READ_MAX)]


class VideoDeleteRequest(_Request, frozen=True, tag="video_delete"):
    """Remove a finished video."""

    name: VideoName


class LearnBackgroundRequest(_Request, frozen=True, tag="learn_background"):
    """Learn the scene as it is during the next `seconds`, without a hand. Answered at once; the state tells when.
    `save` False tries it out, as in `SetSettingsRequest`."""

    seconds: Annotated[float, Meta(ge=0.1, le=60)] = 3.0
    save: bool = True


class LearnSkinRequest(_Request, frozen=True, tag="learn_skin"):
    """Learn the colours of the skin that the next picture shows."""

    save: bool = True


class SaveForegroundRequest(_Request, frozen=True, tag="save_foreground"):
    """Keep background and skin as they are in force."""


class RevertForegroundRequest(_Request, frozen=True, tag="revert_foreground"):
    """Use what is kept again, or with `earlier` what was kept before the last save."""

    earlier: bool = False


class ForgetForegroundRequest(_Request, frozen=True, tag="forget_foreground"):
    """Forget background and skin."""


class ForegroundMaskRequest(_Request, frozen=True, tag="foreground_mask"):
    """The foreground of the next picture in a second message part: a grey PNG of `mask_bytes`, 255 is the hand, then
    this very picture as JPEG."""


Request = (StateRequest | CountersRequest | SettingsRequest | SetSettingsRequest | StillRequest | StartRequest
           | LinkRequest | StopRequest | SpareLandmarksRequest | VideoStartRequest | VideoStopRequest
           | VideoListRequest | VideoReadRequest | VideoDeleteRequest | LearnBackgroundRequest | LearnSkinRequest
           | SaveForegroundRequest | RevertForegroundRequest | ForgetForegroundRequest | ForegroundMaskRequest)

_decoder = msgspec.json.Decoder(Request)


class SettingsStore:
    """The settings in force and their file; changes are saved before they count, unless they are only tried out."""

    def __init__(self, path: Path, settings: NodeSettings) -> None:
        self.path = path
        self.current = settings
        self._at_start = self._saved = settings
        self._lock = threading.Lock()

    def change(self, changes: dict[str, Any], *, save: bool = True) -> list[str]:
        """Validate, save, then take up `changes`; returns what needs a restart. Raises SettingsError, OSError.

        What is saved are the changes and what was saved before, not what is only being tried out.
        """
        with self._lock:
            settings = changed_settings(self.current, changes)
            if save:
                saved = changed_settings(self._saved, changes)
                save_settings(self.path, saved)
                self._saved = saved
            self.current = settings
        log.info("settings changed%s", f" and saved to {self.path}" if save else " to try them out")
        return needs_restart(self._at_start, settings)


@dataclass(slots=True)
class Responder:
    """Answers requests. `state` and `counters` report on the daemon from any thread. `keys` None: the node is open, and
    no datagram is tagged. `spare`: stops the search for landmarks a while."""

    store: SettingsStore
    sessions: Sessions
    pictures: PictureBox
    clock: NodeClock
    state: Report
    counters: Report
    keys: LinkKeys | None
    videos: VideoRecorder
    foreground: ForegroundStore
    spare: Callable[[], None] = lambda: None

    def answer(self, parts: list[bytes], master: str) -> list[bytes]:
        """The reply's message parts to a request's of the master with this public key (empty: the node is open). Never
        raises."""
        try:
            if len(parts) != 1:
                raise NodeError(f"a request is one JSON document in one message part, not {len(parts)} parts.")
            said, attachment = self._perform(decode_message(parts[0], _decoder), master)
            reply = {"ok": True, **said}
        except (msgspec.DecodeError, NodeError) as exc:
            reply, attachment = {"ok": False, "error": str(exc)}, b""
        except OSError as exc:
            sentence = f"{self.store.path}: cannot be written ({exc.strerror}); nothing was changed."
            reply, attachment = {"ok": False, "error": sentence}, b""
        except Exception as exc:  # a request must never end the node; the log has the whole story
            log.exception("a request failed")
            reply, attachment = {"ok": False, "error": f"the node could not do that: {exc!r}. See its log."}, b""
        encoded = msgspec.json.encode(reply)
        return [encoded, attachment] if attachment else [encoded]

    def _perform(self, request: Request, master: str) -> tuple[dict[str, Any], bytes]:
        """What is answered besides that it was done, and what is attached to it."""
        match request:
            case StateRequest():
                return self.state(), b""
            case CountersRequest():
                return {"counters": self.counters()}, b""
            case SettingsRequest():
                return {"settings": self.store.current}, b""
            case SetSettingsRequest():
                return self._set_settings(request), b""
            case StillRequest():
                return self._take_still(request.format)
            case StartRequest():
                return self._start(request, master), b""
            case LinkRequest():
                return self._link(request, master), b""
            case StopRequest():
                return {"stopped": self.sessions.stop(request.session)}, b""
            case SpareLandmarksRequest():
                self.spare()
            case VideoStartRequest():
                return {"video": self.videos.start(request.name)}, b""
            case VideoStopRequest():
                return {"stopped": self.videos.stop(request.name)}, b""
            case VideoListRequest():
                return {"videos": self.videos.videos()}, b""
            case VideoReadRequest():
                data = self.videos.read(request.name, request.offset, request.length)
                return {"offset": request.offset, "length": len(data)}, data
            case VideoDeleteRequest():
                self.videos.delete(request.name)
            case LearnBackgroundRequest():
                self.foreground.learn_background(self.pictures, request.seconds, save=request.save)
            case LearnSkinRequest():
                return {"found": self.foreground.learn_skin(self.pictures, save=request.save)}, b""
            case SaveForegroundRequest():
                self.foreground.save()
            case RevertForegroundRequest():
                self.foreground.revert(earlier=request.earlier)
            case ForgetForegroundRequest():
                self.foreground.forget()
            case ForegroundMaskRequest():
                mask, picture = self.foreground.mask(self.pictures)
                return {"format": "png", "width": mask.width, "height": mask.height, "mask_bytes": len(mask.data),
                        "number": picture.number, "t_node_ns": picture.t_node_ns
                        }, mask.data + encode_still(picture, "jpeg").data
        return {}, b""

    def revoke(self, admits: Callable[[str], bool]) -> None:
        """The masters have changed: forget the keys of those that are not admitted any more, and stop streaming."""
        if self.keys is not None:
            self.keys.forget(admits)
            self.sessions.stop(0)
            self.videos.stop()

    def _set_settings(self, request: SetSettingsRequest) -> dict[str, Any]:
        if request.settings.get("trust", self.store.current.trust) != self.store.current.trust:
            raise SettingsError("trust is changed only in the settings file, on the node itself.")
        return {"restart": self.store.change(request.settings, save=request.save)}

    def _link(self, request: LinkRequest, master: str) -> dict[str, Any]:
        if self.keys is None:
            raise NodeError("this node is open to everybody; its datagrams have no key.")
        link = self.keys.grant(master, request.name)
        return {"name": link.name, "key": link.key.hex()}

    def _take_still(self, kind: StillFormat) -> tuple[dict[str, Any], bytes]:
        picture = self.pictures.still()
        still = encode_still(picture, kind)
        return {"format": kind, "width": still.width, "height": still.height, "number": picture.number,
                "t_node_ns": picture.t_node_ns}, still.data

    def _start(self, request: StartRequest, master: str) -> dict[str, Any]:
        if request.session > U64_MAX:
            raise NodeError(f"session {request.session} does not fit 64 bits.")
        try:
            host = str(ipaddress.IPv4Address(request.host))
        except ValueError as exc:
            raise NodeError(f"host {request.host!r} is not an IPv4 address such as 192.168.1.10.") from exc
        link = None if self.keys is None else self.keys.find(master, request.link)
        if self.keys is not None and link is None:
            raise NodeError(f"there is no link {request.link!r} of yours; ask for one with the request \"link\".")
        verdict = self.sessions.start(request.session, (host, request.port), request.t_start_node_ns,
                                       now_node_ns=self.clock.now_ns(), now_s=time.monotonic(),
                                       seal=None if link is None else link.seal)
        if verdict == "stale":
            raise NodeError(f"session {request.session} is over; every start needs a new session number.")
        return {"verdict": verdict}
