"""All outputs of a rig: made, changed and asked together."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Final

from rhot_app.errors import OutputError
from rhot_app.outputs.joints import JointConverter, Sample
from rhot_app.outputs.output import Output, OutputStatus, Sink
from rhot_app.outputs.spec import as_run
from rhot_app.project import OutputSettings, Rig
from rhot_app.state import HandState
from rhot_node.errors import PluginError
from rhot_node.plugins import about_plugin, load_plugin, plugin_names
from rhot_node.threads import FOREIGN

# -- outputs from other packages ---------------------------------------------------------------------------------------
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


# -- the outputs of a rig ----------------------------------------------------------------------------------------------

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
