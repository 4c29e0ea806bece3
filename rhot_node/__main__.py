"""The ``rhot-node`` command: the daemon; the other commands are in `rhot_node.commands`."""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import gc
import json
import logging
import os
import secrets
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from rhot_node.commands import COMMANDS, HELP, run_command
from rhot_node.errors import NodeError, system_sentence
from rhot_node.terminal import add_examples, printable_output

if TYPE_CHECKING:
    from rhot_node.config import NodeSettings
    from rhot_node.keys import NodeTrust
    from rhot_node.network.pairing import OfferFile

PR_SET_PDEATHSIG = 1
ENDING_HELP = """When ready it prints one line of JSON on standard output, with its real ports. It ends with code 0
on SIGTERM, SIGINT or at the end of a recording; with 2 and a sentence on standard error when something is wrong."""
GIL_SWITCH_S = 0.0005  # the link's thread answers clock requests while the main one works; 5 ms is Python's own


class End:
    """When to end: on SIGTERM and SIGINT, and with the starting process if asked. Both interrupt blocking calls."""

    def __init__(self, parent: int | None) -> None:
        """`parent` is the process id of the parent to end with; None: live on."""
        self._parent = parent
        self._asked, self._starting = False, True
        signal.signal(signal.SIGTERM, self._end)
        signal.signal(signal.SIGINT, self._end)
        if parent is not None:
            # The kernel watches the thread that started us, not the process: its signal only makes us look.
            signal.signal(signal.SIGUSR1, self._look)
            ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGUSR1)

    def due(self) -> bool:
        """Whether to end now; an interrupt raised inside a finaliser would be lost without this."""
        return self._asked or (self._parent is not None and os.getppid() != self._parent)

    def started(self) -> None:
        """From now on end in order; until then there is nothing to be put in order."""
        self._starting = False

    def _end(self, _number: int, _frame: FrameType | None) -> None:
        if self._starting:  # the compiler's calls back to Python would swallow an exception, and take many seconds
            os._exit(0)
        if not self._asked:
            self._asked = True
            raise KeyboardInterrupt

    def _look(self, number: int, frame: FrameType | None) -> None:
        if self.due():
            self._end(number, frame)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code: 0 when ended by the user or the recording, 2 after an error."""
    if argv is None:
        _hide_scipy()
    arguments = list(sys.argv[1:] if argv is None else argv)
    with printable_output():
        try:
            if arguments and arguments[0] in COMMANDS:
                return run_command(arguments[0], arguments[1:])
            return _serve(daemon_parser().parse_args(arguments))
        except NodeError as exc:
            print(f"rhot-node: {exc}", file=sys.stderr)
            return 2
        except KeyboardInterrupt:
            return 0
        except (OSError, MemoryError) as exc:
            print(f"rhot-node: {system_sentence(exc)}", file=sys.stderr)
            return 2


def _hide_scipy() -> None:
    """numba imports scipy when it finds it: half a second and 40 MB for functions that no detector calls. A Pi has no
    scipy; this makes a node on any other machine the same."""
    sys.modules["scipy"] = None  # type: ignore[assignment]


def daemon_parser() -> argparse.ArgumentParser:
    """The arguments of the node itself."""
    from rhot_node.capture.open import SPEC_HELP
    parser = argparse.ArgumentParser(
        prog="rhot-node",
        description="A camera node: finds the markers in every frame and streams them to the master by UDP.\n\n"
                    f"{HELP}",
        epilog=f"{SPEC_HELP}\n\n{ENDING_HELP}")
    parser.add_argument("--settings", type=Path, required=True, metavar="FILE",
                        help="settings of this node (JSON, see docs/node.md)")
    parser.add_argument("--camera", required=True, metavar="SPEC", help="where frames come from, see below")
    parser.add_argument("--loop", action="store_true", help="play a file or recording again when it ends")
    parser.add_argument("--exit-with-parent", action="store_true", help="end when the starting process ends")
    parser.add_argument("--log-level", default="info", choices=("debug", "info", "warning", "error"),
                        help="what is written to standard error (default: info)")
    add_examples(parser, "rhot-node --settings left.json --camera pi",
                 "rhot-node --settings left.json --camera hand.mp4?rate=max --loop")
    return parser


def _serve(options: argparse.Namespace) -> int:
    from rhot_node.config import load_settings
    from rhot_node.terminal import log_to_stderr
    end = End(os.getppid() if options.exit_with_parent else None)
    settings = load_settings(options.settings)
    log_to_stderr(options.log_level.upper(), f"%(asctime)s {settings.name} %(levelname)s %(message)s")
    sys.setswitchinterval(GIL_SWITCH_S)
    _run(options, settings, end)
    return 0


def _run(options: argparse.Namespace, settings: NodeSettings, end: End) -> None:
    """Put the parts together and loop until the end."""
    from rhot_node.capture.open import data_set_settings, open_camera
    from rhot_node.daemon import NodeDaemon
    from rhot_node.detectors import DetectorChoice, make_detector
    from rhot_node.foreground_store import ForegroundStore, foreground_path
    from rhot_node.health.checks import HealthMonitor, Machine
    from rhot_node.keys import trust_state
    from rhot_node.network.control import ControlServer
    from rhot_node.network.link import UdpLink
    from rhot_node.network.pairing import OfferFile, Reception, offer_path
    from rhot_node.network.presence import Announcer, Presence
    from rhot_node.network.requests import Responder, SettingsStore
    from rhot_node.network.session import LinkKeys
    from rhot_node.service import ServiceManager
    from rhot_node.video.recorder import VideoRecorder, video_folder
    from rhot_node.wire.messages import U32_MAX

    clock = settings.clock.clock(time.monotonic_ns())
    store = SettingsStore(options.settings, settings)
    offers = OfferFile(offer_path(options.settings))
    trust = _trust(options.settings, settings)
    keys = None if trust is None else LinkKeys()
    choice, health = DetectorChoice(make_detector), HealthMonitor(Machine())
    videos = VideoRecorder(video_folder(options.settings))
    foreground = ForegroundStore(foreground_path(options.settings))
    daemon = NodeDaemon(store, clock, lambda camera: open_camera(options.camera, camera, clock), choice.make,
                        camera_takes_settings=data_set_settings(options.camera), loop=options.loop,
                        troubles=lambda: [*choice.troubles(), *health.troubles()], video=videos.offer,
                        foreground=foreground)
    manager = ServiceManager()
    boot_id = secrets.randbelow(U32_MAX)
    with contextlib.ExitStack() as stack:
        stack.callback(videos.close)
        stack.callback(daemon.close)
        link = UdpLink(settings, clock, daemon.sessions, boot_id, lambda: daemon.state, keys)
        stack.callback(link.close)
        control = ControlServer(settings, trust)
        stack.callback(control.close)
        stack.callback(manager.stopping)
        ports = {"udp_port": link.port, "control_port": control.control_port, "preview_port": control.preview_port,
                 "pairing_port": control.pairing_port}

        def introduce() -> Presence:
            return Presence(settings.node_id, boot_id, store.current.name, **ports, trust=trust_state(trust))
        link.introduce = introduce
        link.take_slices = daemon.slices.take
        link.start()
        control.start(Responder(store, daemon.sessions, control.pictures, clock, daemon.report,
                                lambda: {**daemon.count(), **link.count(), "strangers": control.refused}, keys,
                                videos, foreground, daemon.spare_landmarks),
                      Reception(trust, offers, lambda: {**daemon.introduce(), **ports}))
        daemon.prepare()
        gc.freeze()
        end.started()
        if trust is not None and not trust.masters:  # not before: a code is only for a node that has started
            _invite(settings, offers)
        width, height = daemon.size
        print(json.dumps({"event": "ready", "node_id": settings.node_id, "name": settings.name, **ports,
                          "width": width, "height": height}), flush=True)
        if settings.announce:  # not before: it imports and waits
            announcer = Announcer(introduce, settings.bind_address)
            stack.callback(announcer.close)
            announcer.start()
        manager.ready(f"node {settings.name}, {width} x {height} px")
        while daemon.step(link, control.pictures) and not end.due():
            manager.alive()


def _trust(path: Path, settings: NodeSettings) -> NodeTrust | None:
    """Whom the node trusts, and a word about it on the console; None when it is open. Raises TrustError."""
    from rhot_node.keys import NodeTrust, keys_path
    log = logging.getLogger(__name__)
    if settings.trust == "open":
        log.warning('this node is open ("trust" in its settings): whoever reaches it may see its pictures and steer it')
        return None
    trust = NodeTrust(keys_path(path))
    if trust.masters:
        log.info("paired with %s", ", ".join(repr(master.name) for master in trust.masters))
    return trust


def _invite(settings: NodeSettings, offers: OfferFile) -> None:
    """Show a pairing code on the console. Raises TrustError."""
    from rhot_node.commands.setup_command import invitation
    logging.getLogger(__name__).warning("not paired yet\n%s",
                                        invitation(settings, offers.current() or offers.renew()))


if __name__ == "__main__":
    sys.exit(main())
