"""Where samples leave for other programs: the outputs of a rig, made, changed and asked together.

A sink (`Sink`) only opens, writes and closes; each kind has a file of its own, or a plug-in. `Output` gives it a queue
and a thread, so that one that is slow or stuck delays nobody: when its queue is full, the oldest state is dropped.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Final, Protocol, runtime_checkable

from rhot_app.errors import OutputError
from rhot_app.outputs.joints import JointConverter, Sample
from rhot_app.outputs.spec import OutputStatus, OutputWord, as_run
from rhot_app.project import OutputSettings, Rig
from rhot_app.state import HandState
from rhot_node.errors import PluginError
from rhot_node.plugins import about_plugin, load_plugin, plugin_names
from rhot_node.threads import FOREIGN, Worker

log = logging.getLogger(__name__)

QUEUE: Final = 8  # states that may wait: 0.1 s at the rate of two cameras of 40 Hz
REOPEN_S: Final = 3.0  # between tries to open an output that failed
STUCK_S: Final = 2.0  # a write that takes longer is worth a sentence
END_S: Final = 2.0  # how long an output may take to close; it is left to itself then


class Sink(Protocol):
    """One way out. Called by one thread. Raise OutputError with a sentence on what to do; it is then closed, and
    opened again after a while."""

    def open(self) -> None:
        """Connect or listen. May take its time."""
        ...

    def write(self, sample: Sample) -> None:
        """Send one sample. May block: states are dropped meanwhile."""
        ...

    def close(self) -> None:
        """Release everything. May be called twice, and without `open`."""
        ...


@runtime_checkable
class Serving(Protocol):
    """A sink that clients connect to."""

    @property
    def clients(self) -> int | None:
        """How many are connected. Any thread may ask."""
        ...

    @property
    def url(self) -> str:
        """Where they connect; empty before `open`. Any thread may ask."""
        ...


class Output:
    """A sink with its queue and its thread. `send` never blocks and never raises."""

    def __init__(self, settings: OutputSettings, sink: Sink, converter: JointConverter) -> None:
        self.settings = settings
        self._sink = sink
        self._converter = converter
        self._queue: deque[HandState] = deque(maxlen=QUEUE)
        self._wake = threading.Event()
        self._word: OutputWord = "starting"
        self._message = ""
        self._sent = self._dropped = 0
        self._period_ns = 0 if settings.rate_hz is None else round(1e9 / settings.rate_hz)
        self._due_ns = 0
        self._since_s: tuple[str, float] | None = None  # what the sink does, and since when
        self._worker = Worker(f"serves the output {settings.spec}", self._turn, hang_s=None)

    def start(self) -> None:
        """Open the sink, in the output's thread."""
        self._worker.start()

    def send(self, state: HandState) -> None:
        """Queue one state; the oldest gives way when the queue is full. For one thread at a time."""
        if self._period_ns:
            now_ns = time.monotonic_ns()
            if now_ns < self._due_ns:
                return
            # On average the rate that was asked for, whatever that of the states.
            self._due_ns = max(self._due_ns + self._period_ns, now_ns)
        if len(self._queue) == QUEUE:
            self._dropped += 1
        self._queue.append(state)
        self._wake.set()

    def convert_by(self, converter: JointConverter) -> None:
        """Go on with the hands of another rig."""
        self._converter = converter

    def stop(self) -> None:
        """Close the sink; whatever does not end within `END_S` is left to itself."""
        self._worker.ending.set()
        self._wake.set()
        self._worker.close(END_S)
        self._word = "stopped"

    def status(self) -> OutputStatus:
        """How it goes, now."""
        message, since = self._message, self._since_s
        if since is not None and (lasts_s := time.monotonic() - since[1]) > STUCK_S:
            message = f"it has not {since[0]} for {lasts_s:.0f} s; states are dropped."
        serving = self._sink if isinstance(self._sink, Serving) else None
        return OutputStatus(self.settings.spec, self.settings.kind, self._word, message, self._sent, self._dropped,
                            None if serving is None else serving.clients, "" if serving is None else serving.url)

    def _turn(self) -> None:
        try:
            self._timed("opened", self._sink.open)
            self._word, self._message = "running", ""
            self._write_all()
        except OutputError as exc:
            self._fail(str(exc))
        except FOREIGN as exc:  # a plug-in may raise anything
            log.debug("output %s failed", self.settings.spec, exc_info=True)
            self._fail(f"it failed ({type(exc).__name__}: {exc}).")
        finally:
            with contextlib.suppress(*FOREIGN):
                self._sink.close()
        self._worker.ending.wait(REOPEN_S)
        self._queue.clear()  # nobody wants what is as old as that

    def _timed(self, what: str, work: Callable[[], None]) -> None:
        """Have the sink do something that may take too long."""
        self._since_s = what, time.monotonic()
        try:
            work()
        finally:
            self._since_s = None

    def _write_all(self) -> None:
        """Write what comes, until the end."""
        while True:
            self._wake.wait()
            self._wake.clear()
            while self._queue and not self._worker.ending.is_set():
                sample = self._converter.sample(self._queue.popleft(), self.settings.joints)
                self._timed("taken a state", functools.partial(self._sink.write, sample))
                self._sent += 1
            if self._worker.ending.is_set():
                return

    def _fail(self, message: str) -> None:
        if self._message != message:
            log.warning("rhot: output %s: %s Tracking goes on.", self.settings.spec, message)
        self._word, self._message = "failed", message


# Entry points of the group ``rhot.outputs`` (docs/plugins.md).

GROUP: Final = "rhot.outputs"
"""An entry point names a callable that makes a `Sink` of an `OutputSettings`."""

_MUST: Final = ("open", "write", "close")


def output_plugins() -> tuple[str, ...]:
    """Names of the installed output plug-ins; none when the installed packages cannot be listed."""
    try:
        return plugin_names(GROUP)
    except PluginError:
        return ()


class PluginSink:
    """The sink that a plug-in makes. All of its code runs in the output's own thread, its import and its constructor
    too: it is made anew whenever it is opened."""

    def __init__(self, settings: OutputSettings) -> None:
        self._settings = settings
        self._sink: Sink | None = None

    @property
    def clients(self) -> int | None:
        """How many are connected; None when the plug-in does not say."""
        return getattr(self._sink, "clients", None)

    @property
    def url(self) -> str:
        """Where they connect; empty when the plug-in does not say."""
        return str(getattr(self._sink, "url", ""))

    def open(self) -> None:
        """Make the sink and open it. Raises OutputError when the plug-in is broken or refuses the settings."""
        about = about_plugin(GROUP, self._settings.kind)
        try:
            sink: Sink = load_plugin(GROUP, self._settings.kind)(self._settings)
        except (OutputError, PluginError) as exc:
            raise OutputError(str(exc)) from exc
        except FOREIGN as exc:
            raise OutputError(f"{about} failed to begin ({type(exc).__name__}: {exc}).") from exc
        missing = [name for name in _MUST if not callable(getattr(sink, name, None))]
        if missing:
            raise OutputError(f"{about} has no {' and no '.join(missing)}(); see docs/plugins.md.")
        self._sink = sink
        sink.open()

    def write(self, sample: Sample) -> None:
        """See `Sink`."""
        assert self._sink is not None
        self._sink.write(sample)

    def close(self) -> None:
        """See `Sink`."""
        sink, self._sink = self._sink, None
        if sink is not None:
            sink.close()


MakeSink = Callable[[OutputSettings], Sink]

_KINDS: Final = {"osc": ("osc", "OscSink"), "vmc": ("vmc", "VmcSink"), "ws": ("ws", "WebSocketSink"),
                 "lsl": ("lsl", "LslSink"), "zenoh": ("zenoh", "ZenohSink"), "web": ("web_view", "WebViewSink")}


def make_sink(settings: OutputSettings) -> Sink:
    """The sink of an output's kind; nothing is opened yet. Raises OutputError when there is no such kind or its target
    makes no sense; a plug-in that is broken becomes a sink that says so."""
    place = _KINDS.get(settings.kind)
    if place is None:
        _check_plugin(settings)
        return PluginSink(settings)
    module, name = place
    try:
        make: MakeSink = getattr(importlib.import_module(f"rhot_app.outputs.{module}"), name)  # only where it is used
    except ImportError as exc:
        package = (exc.name or "").partition(".")[0]
        raise OutputError(f"output {settings.spec!r}: it needs the package {package}, of RHOT's extra app: "
                          f"`.venv/bin/python -m pip install {package}`.") from exc
    return make(settings)


def check_output(settings: OutputSettings) -> None:
    """Raises OutputError where `make_sink` does. No plug-in's code runs here."""
    if settings.kind in _KINDS:
        make_sink(settings)
    else:
        _check_plugin(settings)


def _check_plugin(settings: OutputSettings) -> None:
    names = output_plugins()
    if settings.kind not in names:
        plugins = f"the plug-ins {', '.join(names)}" if names else "no plug-in is installed"
        raise OutputError(f"output {settings.spec!r}: there is no output {settings.kind!r}; there are "
                          f"{', '.join(_KINDS)}, and {plugins}.")


class Outputs:
    """The outputs that run. `send` is for one thread at a time, everything else for another one."""

    def __init__(self) -> None:
        self._running: tuple[Output, ...] = ()

    def configure(self, rig: Rig) -> None:
        """Open what the rig asks for and close what it does not; what stays goes on with the rig's hands.

        Raises OutputError for an output that cannot be; everything then stays as it was. One that only fails to open
        says so in its status.
        """
        wanted = tuple(dict.fromkeys(as_run(settings) for settings in rig.outputs if settings.enabled))
        if not wanted and not self._running:
            return
        converter = JointConverter(rig)
        kept = {output.settings: output for output in self._running if output.settings in wanted}
        made = {settings: Output(settings, make_sink(settings), converter)
                for settings in wanted if settings not in kept}
        if any(settings.joints == "openxr" for settings in made):
            converter.warm_up()
        for output in self._running:  # ports of those that go are free for those that come
            if output.settings not in kept:
                output.stop()
            output.convert_by(converter)
        for output in made.values():
            output.start()
        self._running = tuple((kept | made)[settings] for settings in wanted)

    def send(self, state: HandState) -> None:
        """Hand one state to every output. Never blocks, never raises."""
        for output in self._running:
            output.send(state)

    def status(self) -> tuple[OutputStatus, ...]:
        """How each goes, now."""
        return tuple(output.status() for output in self._running)

    def close(self) -> None:
        """Close all. May be called twice."""
        running, self._running = self._running, ()
        for output in running:
            output.stop()
