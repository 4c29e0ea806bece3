"""The import rules of the house as one table, and the reader that checks a file's syntax tree against it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

# What a room may import of this project, besides itself. A name stands for everything beneath it. The longest matching
# name decides, so a row for one file (rhot_node.markers) overrides the row of its package.
NODE_BASE = ("rhot_node.errors", "rhot_node.files", "rhot_node.clock", "rhot_node.markers", "resources")
APP_BASE = ("rhot_node", "resources", "rhot_app.diagnostics", "rhot_app.errors", "rhot_app.progress",
            "rhot_app.project", "rhot_app.rig_history", "rhot_app.keys", "rhot_app.options", "rhot_app.charts",
            "rhot_app.vector_graphics")
MODELS = ("rhot_app.geometry", "rhot_app.filters", "rhot_app.estimation")
SOLVERS = ("rhot_app.calibration", "rhot_app.hand", "rhot_app.objects")
ENGINE_SIDE = ("rhot_app.recording", "rhot_app.sources", "rhot_app.outputs", "rhot_app.simulator")
BELOW_ENGINE = (*APP_BASE, *MODELS, *SOLVERS, "rhot_app.state", "rhot_app.latency", "rhot_app.tracking",
                "rhot_app.barehand", "rhot_app.articulated", "rhot_app.handfit", *ENGINE_SIDE)

MAY_IMPORT: dict[str, tuple[str, ...]] = {
    # the node
    "rhot_node.errors": (),
    "rhot_node.clock": (),
    "rhot_node.files": ("rhot_node.errors", "resources"),
    "rhot_node.markers": ("rhot_node.errors", "rhot_node.files"),
    "rhot_node.wire": NODE_BASE,
    "rhot_node.detect": (*NODE_BASE, "rhot_node.wire"),
    "rhot_node": ("rhot_node", "resources"),
    # the app, from the bottom up
    "rhot_app.errors": ("rhot_node.files",),
    "rhot_app.diagnostics": (),
    "rhot_app.options": ("rhot_app.errors",),
    "rhot_app.former_spellings": ("rhot_app.errors",),
    "rhot_app.progress": ("rhot_node.errors",),
    "rhot_app.charts": ("rhot_app.vector_graphics",),
    "rhot_app.vector_graphics": (),
    "rhot_app.keys": ("rhot_node",),
    "rhot_app.rig_history": ("rhot_node", "rhot_app.errors", "rhot_app.project", "rhot_app.hand.anatomy"),
    "rhot_app.project": ("rhot_node", "resources", "rhot_app.errors", "rhot_app.hand.anatomy", "rhot_app.hand.skeleton",
                         "rhot_app.objects.object_file"),
    "rhot_app.objects.object_file": ("rhot_node", "rhot_app.errors", "rhot_app.estimation.se3"),
    "rhot_app.geometry": (*APP_BASE, "rhot_app.estimation"),
    "rhot_app.geometry.transforms": (),
    "rhot_app.filters": APP_BASE,
    "rhot_app.estimation": (),
    "rhot_app.hand": (*APP_BASE, *MODELS),
    "rhot_app.hand.anatomy": ("rhot_node", "rhot_app.errors", "rhot_app.hand.skeleton"),
    "rhot_app.hand.skeleton": (),
    "rhot_app.calibration": (*APP_BASE, *MODELS, "rhot_app.hand"),
    "rhot_app.calibration.commands": BELOW_ENGINE,  # they read logs
    "rhot_app.calibration.recorded_observations": BELOW_ENGINE,  # reads them for all
    "rhot_app.calibration.kinds": (*BELOW_ENGINE, "rhot_app.certificate"),  # what is imported where it is called
    "rhot_app.calibration.collect": ("rhot_app.calibration", "rhot_app.state"),
    "rhot_app.objects": (*APP_BASE, *MODELS, "rhot_app.hand", "rhot_app.calibration.verdict"),
    "rhot_app.state": ("rhot_node.wire.messages", "rhot_app.objects.state"),
    "rhot_app.latency": ("rhot_app.state",),
    "rhot_app.barehand": (*APP_BASE, *MODELS, "rhot_app.hand", "rhot_app.state"),
    "rhot_app.articulated": (*APP_BASE, *MODELS, "rhot_app.hand", "rhot_app.barehand"),
    "rhot_app.handfit": (*APP_BASE, *MODELS, "rhot_app.calibration", "rhot_app.hand", "rhot_app.barehand"),
    "rhot_app.tracking": (*APP_BASE, *MODELS, *SOLVERS, "rhot_app.state", "rhot_app.barehand",
                          "rhot_app.articulated"),
    "rhot_app.recording": BELOW_ENGINE,
    "rhot_app.sources": BELOW_ENGINE,
    "rhot_app.outputs": BELOW_ENGINE,
    "rhot_app.simulator": BELOW_ENGINE,
    "rhot_app.engine": BELOW_ENGINE,
    "rhot_app.evaluation": (*BELOW_ENGINE, "rhot_app.engine"),
    "rhot_app.certificate": (*BELOW_ENGINE, "rhot_app.engine", "rhot_app.evaluation"),
    "rhot_app.export": (*BELOW_ENGINE, "rhot_app.engine", "rhot_app.certificate"),
    "rhot_app.api": (*BELOW_ENGINE, "rhot_app.engine", "rhot_app.export"),
    "rhot_app.mouse": (*BELOW_ENGINE, "rhot_app.engine", "rhot_app.evaluation"),
    "rhot_app.ui.language": ("rhot_node.files",),
    "rhot_app.ui": (*BELOW_ENGINE, "rhot_app.engine", "rhot_app.evaluation", "rhot_app.export",
                    "rhot_app.certificate", "rhot_app.mouse"),
    "rhot_app.warm": (*BELOW_ENGINE, "rhot_app.engine"),
    "rhot_app": ("rhot_app",),  # __init__
    "rhot_app.__main__": ("rhot_node", "rhot_app", "resources"),
}

# What a room needs must not drag in, through however many others.
NEVER_NEEDS: dict[str, tuple[str, ...]] = {
    "rhot_app.calibration.colour": ("rhot_app.calibration.stereo", "rhot_app.calibration.bundle",
                                    "rhot_app.calibration.lens", "rhot_app.calibration.board"),
    "rhot_app.ui.wizards.colours": ("rhot_app.calibration.stereo", "rhot_app.calibration.bundle"),
    "rhot_app.calibration.board": ("rhot_app.calibration.check", "rhot_app.certificate"),
}

# Foreign packages that only the named rooms may import.
ONLY_IN: dict[str, tuple[str, ...]] = {
    "PySide6": ("rhot_app.ui",),
    "PyQt5": (),
    "PyQt6": (),
    "OpenGL": ("rhot_app.ui",),
    "pyqtgraph": ("rhot_app.ui",),
    "scipy": ("rhot_app",),
}


@dataclass(frozen=True)
class Import:
    """One imported module name as written in a file; relative imports are resolved."""

    line: int
    name: str


def module_name(path: Path, root: Path) -> str:
    """Dotted name of a file below `root`: ``rhot_app/hand/__init__.py`` is ``rhot_app.hand``."""
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(source: str, path: Path, root: Path) -> Iterator[Import]:
    """Every import of a file at any depth: in functions, in ``if TYPE_CHECKING``, and ``import_module("...")``."""
    package = module_name(path, root).split(".")
    if path.name != "__init__.py":
        package = package[:-1]
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(node.lineno, alias.name)
        elif isinstance(node, ast.ImportFrom):
            base = package[:len(package) - node.level + 1] if node.level else []
            start = ".".join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                yield Import(node.lineno, f"{start}.{alias.name}")
        elif isinstance(node, ast.Call) and _called(node) in ("import_module", "__import__"):
            argument = node.args[0] if node.args else None
            if isinstance(argument, ast.Constant) and isinstance(argument.value, str):
                yield Import(node.lineno, argument.value)


def violations(source: str, path: Path, root: Path) -> list[str]:
    """One sentence per forbidden import in a file of the project rooted at `root`."""
    module = module_name(path, root)
    found = []
    for item in imports_of(source, path, root):
        reason = _forbidden(module, item.name)
        if reason:
            found.append(f"{path.relative_to(root)}:{item.line}: imports {item.name}; {reason}")
    return found


def _forbidden(module: str, imported: str) -> str | None:
    top = imported.split(".")[0]
    if top in ONLY_IN:
        rooms = ONLY_IN[top]
        if _within_any(module, rooms):
            return None
        return f"only {', '.join(rooms) or 'nobody'} may import {top}"
    if top not in ("rhot_node", "rhot_app", "resources"):
        return None
    own = room(module)
    if imported == top and (top == "rhot_node" or module.startswith("rhot_app")):
        return None  # the bare package, to ask where it lies
    allowed = MAY_IMPORT[own]
    inside = own if "." in own else module
    if _within(imported, inside) or _within_any(imported, allowed):
        return None
    return f"{own} may import only {', '.join(allowed) or 'nothing of this project'}"


def room(module: str) -> str:
    """The row of the table that decides for a module. Raises KeyError for a room the table does not know."""
    rows = [row for row in MAY_IMPORT if _within(module, row) and (row != "rhot_app" or module == "rhot_app")]
    if not rows:
        raise KeyError(f"{module} stands in a room that the table in tests/house/import_rules.py does not know")
    return max(rows, key=len)


def _within(name: str, room: str) -> bool:
    return name == room or name.startswith(f"{room}.")


def _within_any(name: str, rooms: tuple[str, ...]) -> bool:
    return any(_within(name, room) for room in rooms)


def _called(node: ast.Call) -> str:
    function = node.func
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""
