"""No module needs, when it is imported, one that needs it, and no room a room that needs it."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from import_rules import imports_of, module_name, room

ROOT = Path(__file__).parents[2]


def imports(modules: dict[str, str]) -> dict[str, set[str]]:
    """By module, given with its source: those of the others that its import imports."""
    found: dict[str, set[str]] = {}
    for module, source in modules.items():
        own = found[module] = set()
        for node in ast.parse(source).body:
            if isinstance(node, ast.ImportFrom):
                names = (f"{node.module}.{alias.name}" for alias in node.names)
                own |= {name if name in modules else node.module or "" for name in names} & modules.keys()
            elif isinstance(node, ast.Import):
                own |= {alias.name for alias in node.names} & modules.keys()
        own.discard(module)
    return found


def test_no_import_goes_in_a_circle() -> None:
    modules = {module_name(path, ROOT): path.read_text() for package in ("rhot_node", "rhot_app")
               for path in (ROOT / package).rglob("*.py")}
    try:
        TopologicalSorter(imports(modules)).prepare()
    except CycleError as exc:
        pytest.fail("an import goes in a circle: " + " <- ".join(exc.args[1]))


def test_a_planted_circle_is_found() -> None:
    modules = {"a.b": "from a import c", "a.c": "from a.d import thing", "a.d": "import os\nimport a.b"}
    with pytest.raises(CycleError):
        TopologicalSorter(imports(modules)).prepare()


def rooms() -> dict[str, set[str]]:
    """By room: the rooms that its files import anywhere. Commands, which only `__main__` imports, are one room; the
    folders of simulator and window are rooms of their own."""
    def room_of(module: str) -> str:
        if module.endswith("_command") or ".commands." in module:
            return "commands"
        found = room(module)
        if found not in ("rhot_app.simulator", "rhot_app.ui"):
            return found
        return module if paths[module].name == "__init__.py" else module.rpartition(".")[0]
    paths = {module_name(path, ROOT): path for path in (ROOT / "rhot_app").rglob("*.py")}
    found: dict[str, set[str]] = {}
    for module, path in paths.items():
        own = found.setdefault(room_of(module), set())
        for one in imports_of(path.read_text(), path, ROOT):
            name = one.name if one.name in paths else one.name.rpartition(".")[0]
            own |= {room_of(name)} if name in paths and name != "rhot_app" else set()
        own.discard(room_of(module))
    return found


def test_no_room_needs_a_room_that_needs_it() -> None:
    try:
        TopologicalSorter(rooms()).prepare()
    except CycleError as exc:
        pytest.fail("rooms need each other: " + " <- ".join(exc.args[1]))
