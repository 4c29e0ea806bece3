"""Loads every room once, so that a new installation compiles its numerical code now and not at the first frame.

``python -m rhot_app.warm`` does it and fails, with the reason, when an installed package does not work.
"""

from __future__ import annotations

import importlib
import pkgutil
import sys

import rhot_app
import rhot_node

WINDOW_ROOM = "rhot_app.ui"  # needs system libraries that a machine without a screen may lack
COMMANDS = ("__main__",)


def load_rooms() -> list[str]:
    """Import every module but the window's and the commands; returns their names. Raises ImportError."""
    loaded = []
    for package in (rhot_node, rhot_app):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            name = module.name
            if name.startswith(WINDOW_ROOM) or name.rpartition(".")[2] in COMMANDS:
                continue
            importlib.import_module(name)
            loaded.append(name)
    return loaded


def main() -> int:
    """Load all rooms; returns the exit code."""
    print(f"{len(load_rooms())} modules loaded")
    return 0


if __name__ == "__main__":
    sys.exit(main())
