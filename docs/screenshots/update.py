"""Take the pictures of this folder anew: ``python docs/screenshots/update.py [NAME …]``, without names all of them.

A test takes each picture on its way, on the simulated rig where that is what it shows. It is skipped where the test
needs what this machine lacks. All take about half an hour.
"""

from __future__ import annotations

import argparse
import ast
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
TAKING = {"keep", "check", "record", "saved", "grab"}
"""Functions of the tests that take a picture, given its name."""


def tests_by_picture() -> dict[str, list[str]]:
    """Ids of the tests that take each picture, by its name."""
    found: dict[str, list[str]] = {}
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        for test in ast.parse(path.read_text()).body:
            if isinstance(test, ast.FunctionDef) and test.name.startswith("test_"):
                for name in _names(test):
                    found.setdefault(name, []).append(f"{path.relative_to(ROOT)}::{test.name}")
    return found


def _names(test: ast.FunctionDef) -> set[str]:
    """Texts among what such a function is given, or in a loop that calls one for several pictures."""
    found: set[str] = set()
    for node in ast.walk(test):
        given = [*node.args, *node.keywords] if isinstance(node, ast.Call) and _called(node) in TAKING else []
        if isinstance(node, ast.For) and any(isinstance(one, ast.Call) and _called(one) in TAKING
                                             and isinstance(one.args[0], ast.Name) for one in ast.walk(node)):
            given = [one.elts[0] for one in ast.walk(node.iter) if isinstance(one, ast.Tuple)]
        found |= {text.value.removesuffix(".png") for part in given for text in ast.walk(part)
                  if isinstance(text, ast.Constant) and isinstance(text.value, str)}
    return found


def _called(call: ast.Call) -> str:
    return str(getattr(call.func, "attr", getattr(call.func, "id", "")))


def main() -> int:
    """Run the tests that take the pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    known = sorted(path.stem for path in HERE.glob("*.png"))
    parser.add_argument("names", nargs="*", metavar="NAME", help="a picture's name without its ending")
    parser.add_argument("--list", action="store_true", help="print which test takes which picture")
    args = parser.parse_args()
    takers = tests_by_picture()
    missing = [name for name in args.names if name not in takers]
    if missing:
        parser.error(f"no test takes {', '.join(missing)}")
    names = args.names or [name for name in known if name in takers]
    if args.list:
        print(*(f"{name}: {', '.join(takers[name])}" for name in names), sep="\n")
        return 0
    ids = sorted({test for name in names for test in takers[name]}, key=lambda one: ("on_simulated_rig" in one, one))
    return subprocess.run([sys.executable, "-m", "pytest", "-q", "--studies=all", *ids], cwd=ROOT, check=False,
                          env={**os.environ, "RHOT_UPDATE_SCREENSHOTS": "1"}).returncode


if __name__ == "__main__":
    sys.exit(main())
