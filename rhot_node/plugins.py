"""Plug-ins: entry points that installed packages declare. Found by name, loaded only when they are asked for."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points
from typing import Any

from rhot_node.errors import PluginError
from rhot_node.threads import FOREIGN

PREFIX = "plug:"
"""Begins the name of a plug-in where a node's settings or ``--camera`` name one."""


def plugin_names(group: str) -> tuple[str, ...]:
    """The plug-ins of a group, such as ``rhot.cameras``, in alphabetical order."""
    return tuple(sorted({point.name for point in _points(group)}))


def load_plugin(group: str, name: str) -> Any:
    """What the plug-in's entry point names. Raises PluginError when there is none, or when it cannot be loaded."""
    points = [point for point in _points(group) if point.name == name]
    if not points:
        names = ", ".join(plugin_names(group))
        raise PluginError(f"there is no plug-in {name!r} of the kind {group}; installed: {names or 'none'}.")
    try:
        return points[0].load()
    except FOREIGN as exc:  # it is somebody else's program
        raise PluginError(f"{about_plugin(group, name)} cannot be loaded ({type(exc).__name__}: {exc}). Repair or "
                          "remove it.") from exc


def about_plugin(group: str, name: str) -> str:
    """The plug-in with its package and version, to begin a sentence with."""
    point = next((point for point in _points(group) if point.name == name), None)
    package = None if point is None or point.dist is None else f"{point.dist.name} {point.dist.version}"
    return f"the plug-in {name!r}" + (f" of {package}" if package else "")


def _points(group: str) -> tuple[EntryPoint, ...]:
    try:
        return tuple(entry_points(group=group))
    except Exception as exc:  # one broken installation spoils the list of all
        raise PluginError(f"the installed packages cannot be listed ({type(exc).__name__}: {exc}); `pip check` may "
                          "tell which is broken.") from exc
