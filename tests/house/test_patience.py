"""No test waits for a fixed time, or demands a time of a machine that may have other things to do."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

from hypothesis import settings

TESTS = Path(__file__).parents[1]
CLOCKS = {"time.monotonic", "time.perf_counter", "time.time", "time.monotonic_ns", "time.perf_counter_ns",
          "time.process_time", "time.thread_time"}
SLEEP = {"time.sleep"}
MAY_SLEEP = {
    "patience.py": "between two looks",
    "capture/test_open_camera.py": "a reader that is late", "capture/test_yuv.py": "a reader that is late",
    "capture/test_webcam.py": "a camera's own pace, and a reader that is late",
    "node/test_link.py": "a program that is late", "sources/test_receiver.py": "a program that is late",
    "node/node_fakes.py": "a camera's own pace", "node/node_process.py": "a camera's own pace",
    "simulator/test_proxy.py": "a node's own pace",
    "engine/test_server_and_client.py": "an engine that is late",
    "e2e/test_virtual_screen.py": "between two presses of Ctrl-C",
    "ui/wizards/slow_work.py": "work that takes long",
    "ui/wizards/test_wizard_feed.py": "a look that takes long, and work in full swing",
}


def calls(tree: ast.AST, names: set[str]) -> list[ast.Call]:
    """All calls in `tree` of functions of these names."""
    return [node for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func) in names]


def files(names: set[str]) -> Iterator[tuple[str, ast.Module]]:
    """Every file of the tests in which one of these names stands, by its place in them."""
    for path in sorted(TESTS.rglob("*.py")):
        text = path.read_text()
        if any(name in text for name in names):
            yield path.relative_to(TESTS).as_posix(), ast.parse(text)


def test_nobody_sleeps_where_something_can_be_waited_for() -> None:
    sleepers = {name for name, tree in files(SLEEP) if calls(tree, SLEEP)}
    assert sleepers - set(MAY_SLEEP) == set(), "wait with eventually or settled of tests/patience.py"
    assert set(MAY_SLEEP) - sleepers == set(), "these sleep no more; take them off the list"


def test_no_time_is_demanded_of_a_single_attempt() -> None:
    """A time of the clock that is asserted to be short; patience.py has `quickest` for it."""
    hasty = [f"{name}:{node.lineno}" for name, tree in files(CLOCKS) if name != "patience.py"
             for node in ast.walk(tree) if isinstance(node, ast.Assert) and calls(node.test, CLOCKS)
             and any(isinstance(op, ast.Lt | ast.LtE) for one in ast.walk(node.test) if isinstance(one, ast.Compare)
                     for op in one.ops)]
    assert not hasty, f"demanded of one attempt: {', '.join(hasty)}"


def test_examples_are_the_same_in_every_run() -> None:
    assert settings.default is not None
    assert settings.default.deadline is None and settings.default.derandomize
