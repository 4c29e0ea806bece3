"""One way of each thing in the core: counts that a second one would raise."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CORE = [path for room in ("estimation", "geometry", "filters", "hand", "tracking", "barehand", "articulated", "objects",
                          "handfit", "recording", "sources", "engine", "export")
        for path in sorted((ROOT / "rhot_app" / room).rglob("*.py"))]


NODE = sorted((ROOT / "rhot_node").rglob("*.py"))
KERNEL_ARGUMENTS_MOST = 8
KERNELS_WITH_MORE = 8
"""Today's count; it only falls."""


def _functions(paths: list[Path]) -> list[tuple[str, ast.FunctionDef]]:
    return [(f"{path.relative_to(ROOT)}:{node.name}", node) for path in paths
            for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)]


def test_a_kernel_takes_eight_arguments_at_most() -> None:
    more = [name for name, node in _functions(CORE + NODE)
            if any("njit" in ast.unparse(one) for one in node.decorator_list)
            and len(node.args.posonlyargs + node.args.args) > KERNEL_ARGUMENTS_MOST]
    assert len(more) <= KERNELS_WITH_MORE, f"{len(more)} take more: give records\n" + "\n".join(more)


def test_points_are_triangulated_in_one_place() -> None:
    made = [name for name, _ in _functions(CORE) if "triangulate" in name.split(":")[1].removeprefix("_").split("_")]
    assert made == ["rhot_app/geometry/triangulate.py:triangulate"], made


def _bases(node: ast.ClassDef) -> set[str]:
    return {one.id for base in node.bases for one in ast.walk(base) if isinstance(one, ast.Name)}


def _trackers() -> set[str]:
    """Names of `Tracker` and of all classes that derive from it."""
    classes = [node for path in CORE for node in ast.walk(ast.parse(path.read_text()))
               if isinstance(node, ast.ClassDef)]
    found = {"Tracker"}
    while more := {node.name for node in classes if _bases(node) & found} - found:
        found |= more
    return found


def test_nobody_asks_a_tracker_what_it_is() -> None:
    trackers = _trackers()
    assert len(trackers) > 6
    asked = [f"{path.relative_to(ROOT)}:{node.lineno}"
             for path in CORE for node in ast.walk(ast.parse(path.read_text()))
             if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance"
             and trackers & {one.id for one in ast.walk(node.args[1]) if isinstance(one, ast.Name)}]
    assert not asked, "give `tracking.tracker.Tracker` what they need, with a default"


def test_parts_of_a_state_have_names() -> None:
    """`estimation.layout`. The state of an articulated file is read by one function of its own."""
    own = ("rhot_app/estimation/layout.py", "rhot_app/estimation/se3.py", "rhot_app/hand/articulated_model.py")
    bare = [f"{path.relative_to(ROOT)}:{node.lineno} {ast.unparse(node)}" for path in CORE
            if str(path.relative_to(ROOT)) not in own for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id == "state"
            and not isinstance(node.slice, ast.Tuple)  # channels beside each other
            and any(isinstance(one, ast.Constant) and type(one.value) is int and one.value > 1
                    for one in ast.walk(node.slice))]
    assert not bare, "name them (`hand.motion.hand_state`, `objects.motion`)"


def test_kinds_of_observations_are_registered_once() -> None:
    found = [name for name, node in ((f"{path.relative_to(ROOT)}:{node.name}", node) for path in CORE
             for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.ClassDef))
             if "Kind" in _bases(node)]
    registered = (ROOT / "rhot_app/tracking/kinds/registry.py").read_text()
    assert len(found) >= 4
    assert all(one.startswith("rhot_app/tracking/kinds/") and one.split(":")[1] in registered for one in found), found


@pytest.mark.parametrize("ns", [500_000_000, 1_000_000_000])
def test_when_a_track_is_lost_and_a_session_over_is_said_once(ns: int) -> None:
    """`estimation.track`; other constants of the same length are of clocks and nodes."""
    said = [f"{path.relative_to(ROOT)}:{node.lineno}" for path in CORE
            if path.parent.parts[len(ROOT.parts) + 1] in ("estimation", "tracking", "barehand", "objects")
            for node in ast.parse(path.read_text()).body if isinstance(node, ast.Assign | ast.AnnAssign)
            for one in ast.walk(node) if isinstance(one, ast.Constant) and type(one.value) is int and one.value == ns]
    assert len(said) == 1 and said[0].startswith("rhot_app/estimation/track.py"), said
