"""Every finding of a calibration has a test that names it: a verdict that nothing can make worse says nothing."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]


def words(node: ast.AST) -> Iterator[str]:
    """The texts in a piece of source."""
    return (part.value for part in ast.walk(node) if isinstance(part, ast.Constant) and isinstance(part.value, str))


def test_every_finding_has_a_test() -> None:
    codes = {code: path for path in (ROOT / "rhot_app").rglob("*.py") for call in ast.walk(ast.parse(path.read_text()))
             if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "Finding"
             for code in words(call.args[0])}
    assert len(codes) > 100
    named = {word for path in (ROOT / "tests").rglob("test_*.py") for word in words(ast.parse(path.read_text()))}
    missing = [f"{code} ({path.relative_to(ROOT)})" for code, path in sorted(codes.items()) if code not in named]
    assert not missing, f"no test names {', '.join(missing)}: give it an input that must raise it"
