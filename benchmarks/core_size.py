"""How much there is to read in the core or the shell: files, tokens, lines, and the numbers that somebody chose.

    python benchmarks/core_size.py [--shell] [--against COMMIT] [--json FILE]

The core is what a frame meets between a camera and a state; the shell is what people and other programs meet.

Tokens are those of Python's `tokenize` without comments, docstrings and layout. A chosen number is a literal of an
algorithm, at module level, in a record, a default or a body. Not chosen: 0, 1, 2 and 0.5; powers of ten between units
(1e-9 to 1e9 by thousands); indices, shapes and axes; bit masks and codes of formats (`rhot_node/wire`, enumerations).
"""

from __future__ import annotations

import ast
import io
import subprocess
import sys
import tokenize
from collections.abc import Iterator, Sequence
from pathlib import Path

from tables import arguments, publish, table

ROOT = Path(__file__).resolve().parents[1]
CORE = ("rhot_node", *(f"rhot_app/{room}" for room in (
    "estimation", "geometry", "filters", "hand", "tracking", "barehand", "articulated", "objects", "handfit",
    "recording", "sources", "state.py", "project", "project.py", "api.py")))
SHELL = tuple(f"rhot_app/{room}" for room in (
    "ui", "calibration", "simulator", "engine", "export", "outputs", "evaluation", "certificate", "mouse", "warm",
    "warm.py", "__main__.py"))
FORMATS = ("rhot_node/wire/", "rhot_node/video/avi.py")

LAYOUT = frozenset((tokenize.NEWLINE, tokenize.NL, tokenize.INDENT, tokenize.DEDENT, tokenize.COMMENT,
                    tokenize.ENCODING, tokenize.ENDMARKER))
SHAPES = frozenset(("zeros", "empty", "ones", "eye", "full", "reshape", "tile", "range", "arange", "identity",
                    "repeat", "enumerate", "round", "to_bytes", "token_bytes", "broadcast_to"))
STRUCTURE = frozenset((0, 1, 2, 0.5, *(10.0**k for k in range(-9, 10, 3))))


def files(commit: str | None, rooms: Sequence[str] = CORE) -> Iterator[tuple[str, str]]:
    """Path and text of each file of some rooms, of the working tree or of a commit."""
    listed = subprocess.run(["git", "ls-tree", "-r", "--name-only", commit, "--", *rooms] if commit else
                            ["git", "ls-files", "--", *rooms], cwd=ROOT, capture_output=True, text=True, check=True)
    for path in listed.stdout.split():
        if not path.endswith(".py"):
            continue
        if commit:
            yield path, subprocess.run(["git", "show", f"{commit}:{path}"], cwd=ROOT, capture_output=True, text=True,
                                       check=True).stdout
        elif (ROOT / path).exists():
            yield path, (ROOT / path).read_text()


def _docstrings(tree: ast.AST) -> set[tuple[int, int]]:
    """Where strings begin that are statements."""
    return {(node.value.lineno, node.value.col_offset) for node in ast.walk(tree)
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)}


def tokens_and_lines(text: str) -> tuple[int, int]:
    """Tokens of code, and the lines on which they stand."""
    documents, lines, count = _docstrings(ast.parse(text)), set[int](), 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in LAYOUT and not (token.type == tokenize.STRING and token.start in documents):
            count += 1
            lines.add(token.start[0])
    return count, len(lines)


class Chosen(ast.NodeVisitor):
    """Collects the chosen numbers of a file, each with its line."""

    def __init__(self) -> None:
        self.found: list[tuple[int, float]] = []

    def visit_Constant(self, node: ast.Constant) -> None:
        """A literal."""
        if type(node.value) in (int, float) and abs(node.value) not in STRUCTURE:
            self.found.append((node.lineno, node.value))

    def visit_Subscript(self, node: ast.Subscript) -> None:
        """An index chooses nothing."""
        self.visit(node.value)

    def visit_keyword(self, node: ast.keyword) -> None:
        """An axis or a width of printing chooses nothing."""
        if node.arg not in ("axis", "axes", "decimals", "ndmin", "stacklevel", "indent"):
            self.visit(node.value)

    def visit_Call(self, node: ast.Call) -> None:
        """A shape chooses nothing."""
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if name in SHAPES:
            for keyword in node.keywords:
                self.visit(keyword)
            return
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        """A number of dimensions or of elements chooses nothing."""
        if any((isinstance(one, ast.Attribute) and one.attr in ("ndim", "shape")) or (isinstance(one, ast.Call)
               and getattr(one.func, "id", "") == "len") for one in ast.walk(node)):
            return
        self.generic_visit(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        """Codes of an enumeration choose nothing."""
        if not any("Enum" in ast.unparse(base) or "Flag" in ast.unparse(base) for base in node.bases):
            self.generic_visit(node)

    def visit_FormattedValue(self, node: ast.FormattedValue) -> None:
        """Nor does the form of what is said."""


def chosen(path: str, text: str) -> list[tuple[int, float]]:
    """The numbers that somebody chose, each with its line."""
    if path.startswith(FORMATS):
        return []
    visitor = Chosen()
    visitor.visit(ast.parse(text))
    return visitor.found


def measure(commit: str | None, rooms: Sequence[str] = CORE) -> dict[str, float]:
    """All figures of the working tree or of a commit."""
    count = {"files": 0, "tokens": 0, "lines of code": 0, "chosen numbers": 0}
    for path, text in files(commit, rooms):
        tokens, lines = tokens_and_lines(text)
        count["files"] += 1
        count["tokens"] += tokens
        count["lines of code"] += lines
        count["chosen numbers"] += len(chosen(path, text))
    return {**count, "tokens a line": count["tokens"] / count["lines of code"]}


def main() -> int:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--shell", action="store_true", help="the shell instead of the core")
    parser.add_argument("--against", metavar="COMMIT", help="also measure a commit, and print the ratios")
    parser.add_argument("--room", metavar="PATH", help="list the chosen numbers of the files that begin so")
    args = parser.parse_args()
    part, rooms = ("the shell", SHELL) if args.shell else ("the core", CORE)
    if args.room:
        for path, text in files(None, rooms):
            for line, value in chosen(path, text) if path.startswith(args.room) else []:
                print(f"{path}:{line}: {value}")
        return 0
    here = measure(None, rooms)
    rows = [[name, value] for name, value in here.items()]
    head = [part, "now"]
    if args.against:
        then = measure(args.against, rooms)
        head += [args.against, "ratio"]
        rows = [[name, value, then[name], value / then[name]] for name, value in here.items()]
    publish(args, {part.split()[1]: rows}, table(head, rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
