"""``rhot mouse run|measure``: a 3-D cursor and two buttons controlled by the tracked hand, live, of a recording or on
the twin; and its accuracy, measured there."""

from __future__ import annotations

import argparse
import contextlib
import json
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.errors import (
    EngineError,
    OutputError,
    RecordingError,
    SimulatorError,
    count,
    input_file,
    positive_number,
    whole,
)
from rhot_app.options import (
    add_directory_argument,
    add_json_argument,
    add_rig_argument,
    add_seconds_argument,
    add_seed_argument,
)
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.engine.client import EngineClient
    from rhot_app.mouse.pointer import MouseSettings, MouseState

PATIENCE_S = 5.0
"""s: without a message for this long there is no engine, which publishes its status ten times a second."""

LINE_S = 0.1
"""s: interval of the lines in text output."""

MAX_AGES = 10_000
"""Number of last states whose ages are summarised at the end: a minute and a half at 120 states/s."""

LEAST_HZ = 5.0
"""states/s: with fewer, the half second of a hand's rest holds two of them at most."""

PLACES = 20
MOTION = "mouse"
"""Name in resources/motions: the hand carries the balls of the app's mouse window."""

BACKGROUND_S = 2.0
"""s: time for which the nodes learn the empty scene, the same as in the app's wizard."""

COMMAND_S = 30.0
"""s: time limit of a request to a node, for a busy machine."""

REST_S = 10.0
"""s: period of the simulated hand's motion at rest."""

NOTE_S = 15.0
"""s: interval of the notes while the hand is not tracked."""

TRACKED_S = 360.0
"""s: time limit of the search. The very first start compiles the numerical code, which takes minutes on a slow
machine."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot mouse`` and of its two commands."""
    commands = parser.add_subparsers(dest="mouse", metavar="COMMAND", title="commands", required=True)
    _add_run(commands.add_parser("run", help="work the mouse by the running engine, a recording or a simulated rig",
                                 description="Work the mouse: print its cursor and buttons, and send them on."))
    _add_measure(commands.add_parser("measure", help="measure the mouse on the twin",
                                     description="Print speed, coupling, resolution, buttons, latency, target test and "
                                                 "pick-and-place on the twin. Takes minutes, a bare hand an hour."))
    add_examples(parser, "rhot mouse run --pointer", "rhot mouse measure --pictures")


def _add_run(parser: argparse.ArgumentParser) -> None:
    add_directory_argument(parser)
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--simulated", action="store_true",
                        help="start a simulated rig whose hand works the mouse, and end it afterwards")
    source.add_argument("--log", type=input_file, metavar="LOG",
                        help="print the mouse's states of this raw log, and end; of a bare hand with its "
                             "recorded slices")
    add_rig_argument(parser, "track the --log with this rig instead of the one it was recorded with", exists=False)
    _add_simulated(parser, "with --simulated: ")
    add_seconds_argument(parser, "end after so long", None)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE",
                        help="gain=G: metres of the cursor per metre of the palm (3); height_gain=G: of its height per "
                             "metre of the finger (6); height_from=palm: the palm sets the height instead of the index "
                             "fingertip above it; on_table=true: the palm slides on the plane, and a camera that is "
                             "covered costs less; repeatable")
    parser.add_argument("--osc", metavar="HOST:PORT", help="send cursor and buttons there as OSC messages, too")
    parser.add_argument("--pointer", action="store_true",
                        help="move the system's pointer, too (Linux; needs write permission on /dev/uinput)")
    add_json_argument(parser, "print one JSON object for each state")
    add_examples(parser, "rhot mouse run --pointer",
                 "rhot mouse run --simulated --seconds 20 --osc 127.0.0.1:9000")


def _add_measure(parser: argparse.ArgumentParser) -> None:
    _add_simulated(parser, "beside markers and two cameras: ")
    parser.add_argument("--places", type=count, default=PLACES, metavar="N",
                        help=f"how often it picks and places (default {PLACES})")
    parser.add_argument("--pictures", action="store_true",
                        help="render all images of markers; else only those of the speeds are rendered")
    add_json_argument(parser)
    add_examples(parser, "rhot mouse measure --pictures", "rhot mouse measure --bare --json")


def _add_simulated(parser: argparse.ArgumentParser, when: str) -> None:
    """The simulated rig: its hand, its cameras, its seed."""
    parser.add_argument("--bare", action="store_true", help=f"{when}a hand without markers, tracked by its contours")
    parser.add_argument("--cameras", type=whole, choices=(1, 2), default=2, metavar="N",
                        help=f"{when}1 leaves one camera, and the palm on a known plane (default 2)")
    add_seed_argument(parser, "the simulated rig")


def run(args: argparse.Namespace) -> int:
    """Measure, or run until interrupted, or for --seconds. Raises RhotError."""
    if args.mouse == "measure":
        return _measure(args)
    _check(args)
    from rhot_app.engine.client import EngineClient

    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with contextlib.ExitStack() as stack:
        outputs = _Outputs(args, stack)
        if args.log is not None:
            _replay(args, outputs)
            outputs.close()
            return 0
        directory, begin = args.directory, None
        if args.simulated:
            directory, begin = stack.enter_context(simulated_hand(args.seed, bare=args.bare, cameras=args.cameras))
        client = stack.enter_context(EngineClient(directory))
        with contextlib.suppress(KeyboardInterrupt):
            _live(args, client, outputs, begin)
        outputs.close()
    return 0


def _check(args: argparse.Namespace) -> None:
    """Raises OutputError when options contradict each other."""
    if args.log is not None and (args.seconds is not None or args.directory is not None):
        raise OutputError("--log reads a recording to its end; leave "
                          f"--{'directory' if args.seconds is None else 'seconds'} out.")
    if args.log is not None and (args.pointer or args.osc is not None):
        raise OutputError("--log is read as fast as it can be, too fast for --pointer and --osc; leave them out.")
    if args.rig is not None and args.log is None:
        raise OutputError("--rig is for a --log; a running engine has its own rig.")
    if (args.bare or args.cameras == 1) and not args.simulated:
        raise OutputError("--bare and --cameras are for --simulated and `rhot mouse measure`. A rig's tracker says "
                          "itself what it observes and where the palm slides (Calibrate, Tracker).")
    _settings(args)


def _replay(args: argparse.Namespace, outputs: _Outputs) -> None:
    """Write the mouse states of a recording. Raises RecordingError, RigError."""
    from rhot_app.engine.offline.replay_summary import replay_states
    from rhot_app.mouse.model import up_of
    from rhot_app.mouse.pointer import Mouse
    from rhot_app.project import load_rig
    from rhot_app.recording.raw_log import LogReader
    from rhot_app.sources.replay import LogValidator
    from rhot_app.tracking.scene import make_tracker
    from rhot_node.compiled import announce_compilation

    with contextlib.closing(LogReader(args.log)) as reader:
        rig = load_rig(args.rig) if args.rig is not None else reader.rig
        announce_compilation()
        mouse, count = Mouse(_settings(args), up_of(rig)), 0
        for state in replay_states(reader, LogValidator(rig), make_tracker(rig)):
            outputs.write(mouse.feed(state), every=True)
            count += 1
    if not count:
        raise RecordingError(f"{args.log}: the tracker makes no state of it, so there is no mouse. `rhot replay "
                             f"{args.log} --json` says what it holds.")


def _settings(args: argparse.Namespace) -> MouseSettings:
    """The settings that `--set` chooses. Raises OutputError."""
    from rhot_app.mouse.pointer import MouseSettings

    chosen: dict[str, Any] = {}
    for text in args.set:
        name, _, value = text.partition("=")
        read = _SETTINGS.get(name)
        if read is None:
            raise OutputError(f"--set {text}: write NAME=VALUE; the names are {', '.join(_SETTINGS)}.")
        try:
            chosen[name] = read(value)
        except (ValueError, argparse.ArgumentTypeError) as exc:
            raise OutputError(f"--set {text}: {exc}.") from exc
    return MouseSettings(**chosen)


def _one_of(*words: str) -> Callable[[str], str]:
    def read(text: str) -> str:
        if text not in words:
            raise ValueError(f"it is {' or '.join(words)}, not {text!r}")
        return text
    return read


_SETTINGS: dict[str, Callable[[str], Any]] = {
    "gain": positive_number, "height_gain": positive_number, "height_from": _one_of("index", "palm"),
    "on_table": lambda text: _one_of("true", "false")(text) == "true"}
"""The settings of the mouse that `--set` chooses, and what reads each."""


def _live(args: argparse.Namespace, client: EngineClient, outputs: _Outputs,
          begin: Callable[[], object] | None) -> None:
    """Until --seconds after the first message, and after a simulated hand may `begin` to move: once the mouse has its
    origin."""
    from rhot_app.mouse.model import up_of
    from rhot_app.mouse.pointer import Mouse
    from rhot_app.state import HandState

    mouse: Mouse | None = None
    message_s, end = time.monotonic(), float("inf")
    while time.monotonic() < end:
        messages, now = client.poll(0.1), time.monotonic()
        message_s = now if messages else message_s
        if now - message_s > PATIENCE_S:
            raise EngineError(f"no engine is heard in {client.directory.path}. Start it with `rhot engine --rig FILE "
                              "--start`, or let `rhot mouse run --simulated` start a simulated one.")
        if mouse is None and messages:
            mouse = Mouse(_settings(args), up_of(client.rig()))
            end = now + (args.seconds or float("inf"))
        for message in messages:
            if isinstance(message, HandState) and mouse is not None:
                state = mouse.feed(message)
                outputs.write(state)
                if begin is not None and state.cursor is not None:
                    begin()
                    begin, end = None, time.monotonic() + (args.seconds or float("inf"))


class _Outputs:
    """The outputs of mouse states: standard output, OSC and the system's pointer."""

    def __init__(self, args: argparse.Namespace, stack: contextlib.ExitStack) -> None:
        """Raises OutputError."""
        from rhot_app.outputs.joints import LIVE_S

        self._json, self._next_s, self._live_ms = args.json, 0.0, 1e3 * LIVE_S
        self._ages_ms: deque[float] = deque(maxlen=MAX_AGES)
        self._came_s: deque[float] = deque(maxlen=MAX_AGES)
        self._pointer = self._osc = None
        if args.pointer:
            from rhot_app.mouse.system_pointer import SystemPointer

            self._pointer = stack.enter_context(contextlib.closing(SystemPointer()))
        if args.osc is not None:
            from rhot_app.outputs.osc import UdpSink
            from rhot_app.outputs.spec import parse_output

            self._osc = stack.enter_context(contextlib.closing(UdpSink(parse_output(f"osc:{args.osc}"))))
            self._osc.open()

    def write(self, mouse: MouseState, *, every: bool = False) -> None:
        """Write one state to all outputs. Text has one line per LINE_S, or `every` state."""
        age_ms = 1e-6 * (time.monotonic_ns() - mouse.t_master_ns)
        live = 0.0 <= age_ms < self._live_ms  # otherwise from a replayed log
        self._ages_ms.extend([age_ms] if live else [])
        self._came_s.extend([time.monotonic()] if live else [])
        if self._osc is not None:
            from rhot_app.outputs.osc import bundles, mouse_messages

            t_unix_ns = time.time_ns() - round(1e6 * age_ms) if live else None
            for datagram in bundles(mouse_messages(mouse.cursor, mouse.pressed), t_unix_ns):
                self._osc.send(datagram)
        if self._pointer is not None:
            self._pointer.write(mouse)
        if self._json:
            cursor = None if mouse.cursor is None else [round(float(value), 5) for value in mouse.cursor]
            print(json.dumps({"t_master_ns": mouse.t_master_ns, "condition": mouse.condition.value,
                              "cursor_m": cursor, "pressed": sorted(mouse.pressed),
                              "age_ms": round(age_ms, 2) if live else None, "needs": mouse.needs}),
                  flush=True)
        elif every:
            print(f"{1e-9 * mouse.t_master_ns:14.3f} s {line_of(mouse)}")
        elif time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + LINE_S
            print(line_of(mouse), flush=True)

    def close(self) -> None:
        """Print the latency of the states, and how many came a second."""
        if len(self._ages_ms) > 1:
            import numpy as np

            from rhot_app.latency import p50_p99

            p50, p99 = p50_p99(np.array(self._ages_ms))
            rate = (len(self._came_s) - 1) / max(self._came_s[-1] - self._came_s[0], 1e-9)
            slow = (f" The mouse needs {LEAST_HZ:g} or more: this computer is too slow or too busy. Close other "
                    "programs; markers need less time than a bare hand." if rate < LEAST_HZ else "")
            _note(f"the last {len(self._ages_ms)} states: {rate:.1f} a second; from the hand to the cursor "
                  f"{p50:.0f} ms (p50), {p99:.0f} ms (p99).{slow}")


def line_of(mouse: MouseState) -> str:
    """One state as text: right, forward and height in mm, the buttons, the state, and what is missing."""
    place = "        -       -       -" if mouse.cursor is None else "".join(f"{1e3 * v:8.1f}" for v in mouse.cursor)
    buttons = "  ".join(f"{name} {'DOWN' if mouse.is_pressed(name) else 'up':<4}" for name in ("thumb", "little"))
    return f"{place} mm  {buttons}  {mouse.condition.value:<9} {' '.join(mouse.needs)}".rstrip()


@contextlib.contextmanager
def simulated_hand(seed: int, *, bare: bool = False, cameras: int = 2) -> Iterator[tuple[Path, Callable[[], object]]]:
    """A simulated rig whose hand lies at rest, and an engine that tracks it. Yields the engine's directory and a
    function that makes the hand carry balls. Both processes end with the context.

    `bare`: the hand has no markers, and its nodes learn the background first. With one of `cameras` the engine has the
    palm's plane and the mouse's hand model. Progress goes to standard error. Raises SimulatorError, EngineError.
    """
    import tempfile

    from rhot_app.engine.client import EngineClient
    from rhot_app.engine.process import ensure_engine, stop_engine
    from rhot_app.mouse.play import SetUp, tracked_rig, twin_scene
    from rhot_app.mouse.pointer import MouseSettings
    from rhot_app.mouse.script import motion_file, resting
    from rhot_app.project import load_rig, save_rig
    from rhot_app.simulator.nodes.remote import TwinRemote
    from rhot_app.simulator.scene.motion import Sway
    from rhot_app.simulator.scene.scene_description import BareHandShow, EmptyShow, HandShow
    from rhot_node.files import write_document

    show = BareHandShow if bare else HandShow
    set_up = SetUp("contours", cameras, facing="back") if bare else SetUp("markers", cameras)
    with tempfile.TemporaryDirectory(prefix="rhot-mouse-") as name, contextlib.ExitStack() as stack:
        _note("a simulated rig and an engine start.")
        place = Path(name)
        rig, rest, scene = place / "rig.json", place / "rest.json", twin_scene(set_up, seed)
        write_document(rest, motion_file(resting(REST_S), scene.hand, MouseSettings(), Sway(), facing=set_up.facing))
        shown = ["--show", "bare-hand", "--set", "facing=back"] if bare else []
        twin = subprocess.Popen([sys.executable, "-m", "rhot_app.simulator.nodes.live", "--motion", str(rest), *shown,
                                 "--seed", str(seed), "--directory", str(place), "--rig", str(rig)],
                                stdout=subprocess.PIPE)
        stack.callback(twin.wait)
        stack.callback(twin.terminate)
        assert twin.stdout is not None
        if not twin.stdout.readline():
            raise SimulatorError("the simulated rig did not start; its own words stand above.")
        save_rig(rig, tracked_rig(load_rig(rig), set_up, scene))
        stack.callback(stop_engine, place / "engine")
        ensure_engine(rig, place / "engine", start=True)
        remote = stack.enter_context(TwinRemote(place))
        with EngineClient(place / "engine") as client:
            begun = time.monotonic()
            deadline, note_s = begun + TRACKED_S, begun + NOTE_S
            if bare:
                _note("the cameras learn the empty scene.")
                remote.show(EmptyShow())
                _learn_backgrounds(client, deadline)
                remote.show(show(str(rest)))
            _note("waiting until the hand is tracked.")
            while client.state is None or not client.state.tracked:
                client.poll(0.1)
                now = time.monotonic()
                if now > note_s:
                    note_s += NOTE_S
                    condition = "no state yet" if client.state is None else client.state.condition.value
                    _note(f"not tracked after {now - begun:.0f} s ({condition}); giving up after {TRACKED_S:.0f} s.")
                if now > deadline:
                    raise SimulatorError(f"the simulated hand was not tracked within {TRACKED_S:.0f} s. Is this "
                                         "computer busy? Try again.")
        _note("the hand is tracked, and moves as soon as the mouse has its origin.")
        yield place / "engine", lambda: remote.show(show(MOTION))  # its first pose is the present one


def _note(text: str) -> None:
    print(f"rhot: {text}", file=sys.stderr, flush=True)


def _learn_backgrounds(client: EngineClient, deadline: float) -> None:
    """Have all nodes learn the empty scene. Raises SimulatorError, EngineError."""
    def ask(node_id: int, request: dict[str, Any]) -> dict[str, Any]:
        answer: dict[str, Any] = client.command("node", node_id=node_id, request=request, timeout_s=COMMAND_S)["answer"]
        return answer

    nodes = [node.node_id for node in client.rig().nodes]
    for node_id in nodes:
        while True:  # until the node streams
            try:
                ask(node_id, {"request": "learn_background", "seconds": BACKGROUND_S})
                break
            except EngineError:
                if time.monotonic() > deadline:
                    raise
                time.sleep(0.5)
    while not all((model := ask(node_id, {"request": "state"})["foreground"])["background"] and not model["learning_s"]
                  for node_id in nodes):
        if time.monotonic() > deadline:
            raise SimulatorError("the simulated nodes did not learn the background in time. Is this computer busy? Try "
                                 "again.")
        time.sleep(0.1)


def _measure(args: argparse.Namespace) -> int:
    from rhot_app.mouse.measure import measures, report
    from rhot_app.mouse.play import SetUp
    from rhot_app.progress import ProgressLine

    chosen = SetUp("contours", args.cameras, args.pictures, "back") if args.bare else SetUp(
        "markers", args.cameras, args.pictures)
    figures = [measures(args.seed, args.places, set_up=one, watch=lambda title: ProgressLine(f"rendering {title}"))
               for one in dict.fromkeys((SetUp(pictures=args.pictures), chosen))]
    print(json.dumps(figures) if args.json else report(figures))
    return 0
