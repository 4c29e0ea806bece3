"""Outputs from other packages: entry points of the group ``rhot.outputs`` (docs/plugins.md)."""

from __future__ import annotations

from typing import Final

from rhot_app.errors import OutputError
from rhot_app.outputs.joints import Sample
from rhot_app.outputs.output import Sink
from rhot_app.project import OutputSettings
from rhot_node.errors import PluginError
from rhot_node.plugins import about_plugin, load_plugin, plugin_names

GROUP: Final = "rhot.outputs"
"""An entry point names a callable that makes a `Sink` of an `OutputSettings`."""

_MUST: Final = ("open", "write", "close")


def output_plugins() -> tuple[str, ...]:
    """Names of the installed output plug-ins; none when the installed packages cannot be listed."""
    try:
        return plugin_names(GROUP)
    except PluginError:
        return ()


def plugin_sink(settings: OutputSettings) -> Sink:
    """The sink that the plug-in makes; one that refuses the settings, or is broken, becomes a sink that says so
    whenever it is opened."""
    try:
        sink: Sink = load_plugin(GROUP, settings.kind)(settings)
    except (OutputError, PluginError) as exc:
        return _BrokenSink(str(exc))
    except Exception as exc:
        return _BrokenSink(f"{about_plugin(GROUP, settings.kind)} failed to begin ({type(exc).__name__}: {exc}).")
    missing = [name for name in _MUST if not callable(getattr(sink, name, None))]
    if missing:
        return _BrokenSink(f"{about_plugin(GROUP, settings.kind)} has no {' and no '.join(missing)}(); see "
                           "docs/plugins.md.")
    return sink


class _BrokenSink:
    """Stands in for a plug-in that cannot work."""

    def __init__(self, complaint: str) -> None:
        self._complaint = complaint

    def open(self) -> None:
        """Say why; always raises OutputError."""
        raise OutputError(self._complaint)

    def write(self, sample: Sample) -> None:
        """Never called."""

    def close(self) -> None:
        """Nothing to release."""
