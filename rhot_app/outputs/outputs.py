"""All outputs of an engine: those of the rig file and those of the command line; made, changed and asked together."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterable
from typing import Final

from rhot_app.errors import OutputError
from rhot_app.outputs.joints import JointConverter
from rhot_app.outputs.output import Output, OutputStatus, Sink
from rhot_app.outputs.plugins import output_plugins, plugin_sink
from rhot_app.project import OutputSettings, Rig
from rhot_app.tracking.state import HandState

MakeSink = Callable[[OutputSettings], Sink]

_KINDS: Final = {"osc": ("osc", "OscSink"), "vmc": ("vmc", "VmcSink"), "ws": ("ws", "WebSocketSink"),
                 "lsl": ("lsl", "LslSink"), "zenoh": ("zenoh", "ZenohSink"), "web": ("web_view", "WebViewSink")}
_OPENXR_ONLY: Final = ("vmc", "web")  # whatever is asked: their messages are made of these joints
_SETTLE_S: Final = 2.0


def make_sink(settings: OutputSettings) -> Sink:
    """The sink of an output's kind. Raises OutputError when there is no such kind or its target makes no sense; a
    plug-in that is broken becomes a sink that says so."""
    place = _KINDS.get(settings.kind)
    if place is None:
        names = output_plugins()
        if settings.kind in names:
            return plugin_sink(settings)
        known = ", ".join(_KINDS)
        plugins = f"the plug-ins {', '.join(names)}" if names else "no plug-in is installed"
        raise OutputError(f"output {settings.spec!r}: there is no output {settings.kind!r}; there are {known}, and "
                          f"{plugins}.")
    module, name = place  # imported only where it is used
    make: MakeSink = getattr(importlib.import_module(f"rhot_app.outputs.{module}"), name)
    return make(settings)


class Outputs:
    """The outputs that run. `send` is for the tracking thread; everything else for another one."""

    def __init__(self, fixed: Iterable[OutputSettings] = (), *, follow_rig: bool = True) -> None:
        """`fixed`: those of the command line, which stay whatever the rig says. `follow_rig`: whether the rig's own are
        opened too; a replay leaves them out, because what is old is nothing to send anywhere unasked."""
        self._fixed = tuple(fixed)
        self._follow_rig = follow_rig
        self._running: tuple[Output, ...] = ()

    def check(self, rig: Rig) -> None:
        """Raises OutputError for an output of the rig that cannot be."""
        for settings in self._wanted(rig):
            make_sink(settings)

    def configure(self, rig: Rig) -> None:
        """Open what the rig asks for and close what it does not; what stays goes on with the rig's hands.

        Raises OutputError for an output that cannot be; everything then stays as it was. One that only fails to open
        says so in its status.
        """
        wanted = self._wanted(rig)
        if not wanted and not self._running:
            return
        converter = JointConverter(rig)
        kept = {output.settings: output for output in self._running if output.settings in wanted}
        made = {settings: Output(settings, make_sink(settings), converter)
                for settings in wanted if settings not in kept}
        if any(settings.joints == "openxr" for settings in made):
            converter.rehearse()
        for output in self._running:  # ports of those that go are free for those that come
            if output.settings not in kept:
                output.stop()
            output.convert_by(converter)
        for output in made.values():
            output.start()
        self._running = tuple((kept | made)[settings] for settings in wanted)

    def settle(self) -> None:
        """Wait until each has opened or failed to, but not for long."""
        end_s = time.monotonic() + _SETTLE_S
        while time.monotonic() < end_s and any(output.status().state == "starting" for output in self._running):
            time.sleep(0.01)

    def send(self, state: HandState) -> None:
        """Hand one state to every output. Never blocks, never raises."""
        for output in self._running:
            output.send(state)

    def status(self) -> tuple[OutputStatus, ...]:
        """How each goes, now."""
        return tuple(output.status() for output in self._running)

    def complaints(self) -> list[str]:
        """A sentence for each output that does not do what it should."""
        return [f"Output {status.spec}: {status.message} Tracking goes on." for status in self.status()
                if status.message]

    def close(self) -> None:
        """Close all. May be called twice."""
        running, self._running = self._running, ()
        for output in running:
            output.stop()

    def _wanted(self, rig: Rig) -> tuple[OutputSettings, ...]:
        asked = (*self._fixed, *(rig.outputs if self._follow_rig else ()))
        return tuple(dict.fromkeys(_whole(settings) for settings in asked))


def _whole(settings: OutputSettings) -> OutputSettings:
    """The settings as they are meant."""
    if settings.kind in _OPENXR_ONLY and settings.joints != "openxr":
        return OutputSettings(settings.kind, settings.target, "openxr", settings.rate_hz)
    return settings
