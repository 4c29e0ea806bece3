"""Where the core damps steps: every loop that changes a damping is a descent of its own.

    python benchmarks/descents.py [--json FILE]
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator

from core_size import files
from tables import arguments, publish, table


def descents() -> Iterator[tuple[str, str]]:
    """File and function of each loop of the core in whose body a name with `damping` is assigned."""
    for path, text in files(None):
        for function in ast.walk(ast.parse(text)):
            if isinstance(function, ast.FunctionDef) and any(_damps(node) for node in ast.walk(function)):
                yield path, function.name


def _damps(node: ast.AST) -> bool:
    return isinstance(node, ast.For | ast.While) and any(
        isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store) and "damping" in one.id for one in ast.walk(node))


def main() -> int:
    """Print the table."""
    args = arguments(__doc__).parse_args()
    rows = [list(found) for found in descents()]
    publish(args, {"descents": rows}, table(["file", "function"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
