"""``rhot mouse``: a 3-D cursor and two buttons worked by the tracked hand, live, on the twin, or measured there."""

from __future__ import annotations

import argparse
import contextlib
import json
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.errors import EngineError, OutputError, SimulatorError

if TYPE_CHECKING:
    from rhot_app.engine.client import EngineClient
    from rhot_app.mouse.pointer import MouseSettings, MouseState

PATIENCE_S = 5.0
"""An engine publishes its status ten times a second; after this long without a message there is none."""

LINE_S = 0.1
"""Between lines for people."""

AGES = 10_000
"""So many states, the last ones, are in the ages that are printed at the end: a minute and a half at 120 states/s."""

PLACES = 20
MOTION = "mouse"
"""Of resources/motions; the hand carries the balls of the app's page about."""

TRACKED_S = 360.0
"""The first start of all compiles the numerical code; on a slow or busy machine that takes minutes."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot mouse``."""
    parser.add_argument("--directory", type=Path, metavar="DIR", help="private directory of the engine's sockets")
    parser.add_argument("--simulated", action="store_true",
                        help="start a simulated rig whose hand works the mouse, and end it afterwards")
    parser.add_argument("--seed", type=_seed, default=1, metavar="N", help="of the simulated rig (default 1)")
    parser.add_argument("--seconds", type=_positive, default=None, metavar="S", help="end after so long")
    parser.add_argument("--gain", type=_positive, default=None, metavar="G",
                        help="metres of the cursor per metre of the palm (default 3)")
    parser.add_argument("--height-gain", type=_positive, default=None, metavar="G",
                        help="metres of the cursor's height per metre of the finger (default 6)")
    parser.add_argument("--height-from", choices=("index", "palm"), default="index",
                        help="what sets the height: the index fingertip above the palm (default), or the palm itself")
    parser.add_argument("--on-table", action="store_true",
                        help="the palm slides on the plane: a camera that is covered costs less")
    parser.add_argument("--osc", metavar="HOST:PORT", help="send cursor and buttons there as OSC messages, too")
    parser.add_argument("--pointer", action="store_true",
                        help="move the system's pointer, too (Linux; needs write permission on /dev/uinput)")
    parser.add_argument("--measure", action="store_true",
                        help="print speed, coupling, resolution, latency, target test and pick-and-place on the twin; "
                             "takes minutes")
    parser.add_argument("--places", type=_seed, default=PLACES, metavar="N",
                        help=f"how often --measure picks and places (default {PLACES})")
    parser.add_argument("--pictures", action="store_true",
                        help="let --measure render all images; else only those of the speeds are rendered")
    parser.add_argument("--json", action="store_true", help="print JSON: a line per state, or all measures")


def run(args: argparse.Namespace) -> int:
    """Run until interrupted, or for --seconds. Raises RhotError."""
    if args.measure:
        return _measure(args)
    from rhot_app.engine.client import EngineClient

    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with contextlib.ExitStack() as stack:
        outputs = _Outputs(args, stack)
        directory = stack.enter_context(simulated_hand(args.seed)) if args.simulated else args.directory
        client = stack.enter_context(EngineClient(directory))
        with contextlib.suppress(KeyboardInterrupt):
            _live(args, client, outputs)
        outputs.close()
    return 0


def _settings(args: argparse.Namespace) -> MouseSettings:
    from rhot_app.mouse.pointer import MouseSettings

    chosen: dict[str, Any] = {"height_from": args.height_from, "on_table": args.on_table}
    if args.gain is not None:
        chosen["gain"] = args.gain
    if args.height_gain is not None:
        chosen["height_gain"] = args.height_gain
    return MouseSettings(**chosen)


def _live(args: argparse.Namespace, client: EngineClient, outputs: _Outputs) -> None:
    from rhot_app.mouse.model import up_of
    from rhot_app.mouse.pointer import Mouse
    from rhot_app.state import HandState

    mouse: Mouse | None = None
    heard, end = time.monotonic(), float("inf")
    while time.monotonic() < end:
        messages, now = client.poll(0.1), time.monotonic()
        heard = now if messages else heard
        if now - heard > PATIENCE_S:
            raise EngineError(f"no engine is heard in {client.directory.path}. Start it with `rhot engine --rig FILE "
                              "--start`, or let `rhot mouse --simulated` start a simulated one.")
        if mouse is None and messages:
            mouse = Mouse(_settings(args), up_of(client.rig()))
            end = now + (args.seconds or float("inf"))
        for message in messages:
            if isinstance(message, HandState) and mouse is not None:
                outputs.write(mouse.feed(message))


class _Outputs:
    """Where the mouse's states go: standard output, and what was asked for besides."""

    def __init__(self, args: argparse.Namespace, stack: contextlib.ExitStack) -> None:
        """Raises OutputError."""
        from rhot_app.outputs.joints import LIVE_S

        self._json, self._next_s, self._live_ms = args.json, 0.0, 1e3 * LIVE_S
        self._ages_ms: deque[float] = deque(maxlen=AGES)
        self._pointer = self._osc = None
        if args.pointer:
            from rhot_app.mouse.system_pointer import SystemPointer

            self._pointer = stack.enter_context(contextlib.closing(SystemPointer()))
        if args.osc is not None:
            from rhot_app.outputs.osc import UdpSink
            from rhot_app.outputs.spec import parse_output

            self._osc = stack.enter_context(contextlib.closing(UdpSink(parse_output(f"osc:{args.osc}"))))
            self._osc.open()

    def write(self, mouse: MouseState) -> None:
        """Give one state to all of them."""
        age_ms = 1e-6 * (time.monotonic_ns() - mouse.t_master_ns)
        live = 0.0 <= age_ms < self._live_ms  # else it is of a replayed log
        self._ages_ms.extend([age_ms] if live else [])
        if self._osc is not None:
            from rhot_app.outputs.osc import bundles, mouse_messages

            for datagram in bundles(mouse_messages(mouse.cursor, mouse.pressed)):
                self._osc.send(datagram)
        if self._pointer is not None:
            self._pointer.write(mouse)
        if self._json:
            cursor = None if mouse.cursor is None else [round(float(value), 5) for value in mouse.cursor]
            print(json.dumps({"t_master_ns": mouse.t_master_ns, "condition": mouse.condition.value,
                              "cursor_m": cursor, "pressed": sorted(mouse.pressed),
                              "age_ms": round(age_ms, 2) if live else None, "needs": mouse.needs}),
                  flush=True)
        elif time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + LINE_S
            print(line_of(mouse), flush=True)

    def close(self) -> None:
        """Say how old the states were."""
        if self._ages_ms:
            import numpy as np

            p50, p99 = np.percentile(self._ages_ms, [50, 99])
            print(f"rhot: the last {len(self._ages_ms)} states: from the hand to the cursor {p50:.0f} ms (p50), "
                  f"{p99:.0f} ms (p99).", file=sys.stderr)


def line_of(mouse: MouseState) -> str:
    """One state for people: right, forward and height in mm, the buttons, the state, and what is missing."""
    place = "        -       -       -" if mouse.cursor is None else "".join(f"{1e3 * v:8.1f}" for v in mouse.cursor)
    buttons = "  ".join(f"{name} {'DOWN' if mouse.is_pressed(name) else 'up':<4}" for name in ("thumb", "little"))
    return f"{place} mm  {buttons}  {mouse.condition.value:<9} {' '.join(mouse.needs)}".rstrip()


@contextlib.contextmanager
def simulated_hand(seed: int) -> Iterator[Path]:
    """A simulated rig whose hand carries balls about, and an engine that tracks it; the engine's directory. Both end
    with the context. Raises SimulatorError, EngineError."""
    import tempfile

    from rhot_app.engine.client import EngineClient
    from rhot_app.engine.process import ensure_engine, stop_engine
    from rhot_app.project import load_rig, save_rig, with_tracker
    from rhot_app.simulator.nodes.remote import TwinRemote
    from rhot_app.simulator.scene.scene_description import HandShow

    with tempfile.TemporaryDirectory(prefix="rhot-mouse-") as name, contextlib.ExitStack() as stack:
        place = Path(name)
        rig = place / "rig.json"
        twin = subprocess.Popen([sys.executable, "-m", "rhot_app.simulator.nodes.live", "--motion", MOTION,
                                 "--seed", str(seed), "--directory", str(place), "--rig", str(rig)],
                                stdout=subprocess.PIPE)
        stack.callback(twin.wait)
        stack.callback(twin.terminate)
        assert twin.stdout is not None
        if not twin.stdout.readline():
            raise SimulatorError("the simulated rig did not start; its own words stand above.")
        save_rig(rig, with_tracker(load_rig(rig), "estimator"))
        stack.callback(stop_engine, place / "engine")
        ensure_engine(rig, place / "engine", start=True)
        with EngineClient(place / "engine") as client, TwinRemote(place) as remote:
            deadline = time.monotonic() + TRACKED_S
            while client.state is None or not client.state.tracked:
                client.poll(0.1)
                if time.monotonic() > deadline:
                    raise SimulatorError(f"the simulated hand was not tracked within {TRACKED_S:.0f} s. Is this "
                                         "computer busy? Try again.")
            remote.show(HandShow(MOTION))  # from its beginning, where it rests
        yield place / "engine"


def _measure(args: argparse.Namespace) -> int:
    if args.simulated or args.osc is not None or args.pointer:
        raise OutputError("--measure runs on the twin by itself; leave --simulated, --osc and --pointer out.")
    from rhot_app.mouse.measure import measures
    from rhot_app.mouse.report import report
    from rhot_app.progress import ProgressLine

    figures = measures(args.seed, args.places, pictures=args.pictures,
                       watch=lambda title: ProgressLine(f"rendering {title}"))
    print(json.dumps(figures) if args.json else report(figures))
    return 0


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < 1e6:
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value


def _seed(text: str) -> int:
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is not a whole number of 0 or more")
    return value
