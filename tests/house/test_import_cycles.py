"""No module needs one that needs it, no folder a folder that needs it, and no room a room that needs it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from import_rules import MAY_IMPORT, NEVER_NEEDS, imports_of, module_name, room

ROOT = Path(__file__).parents[2]

Graph = dict[str, set[str]]


def imports(modules: dict[str, str]) -> Graph:
    """By module, given with its source: those of `modules` that it imports anywhere, in functions as well."""
    found: Graph = {}
    for module, source in modules.items():
        names = (one.name for one in imports_of(source, ROOT / f"{module.replace('.', '/')}.py", ROOT))
        found[module] = {name if name in modules else name.rpartition(".")[0] for name in names} & modules.keys()
    return found


@cache
def project() -> Graph:
    """What the modules of the project import of it; the bare packages are asked for their place alone."""
    sources = {module_name(path, ROOT): path.read_text() for package in ("rhot_node", "rhot_app")
               for path in (ROOT / package).rglob("*.py")}
    return {module: others - {"rhot_node", "rhot_app"} for module, others in imports(sources).items()}


def grouped(graph: Graph, group: Callable[[str], str]) -> Graph:
    """By group: the other groups that its modules import."""
    found: Graph = {}
    for module, others in graph.items():
        found.setdefault(group(module), set()).update(group(other) for other in others)
    return {name: others - {name} for name, others in found.items()}


def refuse_circles(graph: Graph, what: str) -> None:
    """Fail with the circle, if there is one."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as exc:
        pytest.fail(f"{what} need each other: " + " <- ".join(exc.args[1]))


def is_command(module: str) -> bool:
    """Whether only `__main__` imports it. The files of calibrations have what their wizards use, too."""
    return module.endswith("_command") or (".commands." in module and not module.startswith("rhot_app.calibration."))


def folder_of(module: str) -> str:
    """The folder of a module. Commands, which only `__main__` imports, are one; a module beside folders stands for
    itself, as one does that has a row of its own in the table."""
    if is_command(module):
        return "commands"
    folder = module.rpartition(".")[0]
    is_folder = any(other.startswith(f"{module}.") for other in project())
    beside_folders = any(other.startswith(f"{folder}.") and other.count(".") > module.count(".") for other in project())
    return module if is_folder or beside_folders or module in MAY_IMPORT else folder


def room_of(module: str) -> str:
    """The room of a module; commands are one; the folders of simulator and window are rooms of their own."""
    if is_command(module):
        return "commands"
    found = room(module)
    if found not in ("rhot_app.simulator", "rhot_app.ui"):
        return found
    return module.rpartition(".")[0] if (ROOT / f"{module.replace('.', '/')}.py").exists() else module


def test_no_module_needs_one_that_needs_it() -> None:
    assert not [module for module, others in project().items() if module in others], "a module imports itself"
    refuse_circles(project(), "modules")


def test_a_planted_circle_is_found() -> None:
    modules = {"a.b": "from a import c", "a.c": "def f():\n    from a.d import thing", "a.d": "import os\nimport a.b"}
    with pytest.raises(CycleError):
        TopologicalSorter(imports(modules)).prepare()
    assert imports({"a.b": "from a.b import c"}) == {"a.b": {"a.b"}}


def test_a_planted_circle_of_folders_is_found() -> None:
    modules = {"a.b": {"c.d"}, "c.d": set(), "c.e": {"a.f"}, "a.f": set()}
    refuse_circles(modules, "modules")
    with pytest.raises(pytest.fail.Exception, match="folders need each other"):
        refuse_circles(grouped(modules, lambda module: module.rpartition(".")[0]), "folders")


def test_no_folder_of_the_app_needs_one_that_needs_it() -> None:
    app = {module: {one for one in others if one.startswith("rhot_app.")} for module, others in project().items()
           if module.startswith("rhot_app.")}
    refuse_circles(grouped(app, folder_of), "folders")


def test_no_room_needs_a_room_that_needs_it() -> None:
    app = {module: {one for one in others if one.startswith("rhot_app.")} for module, others in project().items()
           if module.startswith("rhot_app.")}
    refuse_circles(grouped(app, room_of), "rooms")


@pytest.mark.parametrize(("start", "rooms"), NEVER_NEEDS.items())
def test_what_a_room_needs_never_drags_these_in(start: str, rooms: tuple[str, ...]) -> None:
    """Directly or through others."""
    waiting = [(module,) for module in project() if f"{module}.".startswith(f"{start}.")]
    assert waiting, f"there is no {start}"
    seen = {path[-1] for path in waiting}
    while waiting:
        path = waiting.pop()
        assert not any(f"{path[-1]}.".startswith(f"{one}.") for one in rooms), " -> ".join(path)
        new = project()[path[-1]] - seen
        seen |= new
        waiting += [(*path, one) for one in new]
