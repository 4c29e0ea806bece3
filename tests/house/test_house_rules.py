"""Rules that every file keeps: it says what it is, what other packages use is described, and links lead somewhere."""

from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("rhot_node", "rhot_app")
UNOWNED = re.compile(r"\b(?:TO" r"DO|FIX" r"ME|XX" r"X)\b(?!\((\w+)\):)")
FROM_IMPORT = re.compile(r"^ *from ([\w.]+) import (\([^)]*\)|.*)", re.MULTILINE)


def sources(*folders: str) -> list[Path]:
    """All Python files below the given folders of the project."""
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def tracked_text(suffix: str) -> Iterator[tuple[Path, str]]:
    """Every file of the project with this suffix, by git where there is a repository, else by folder."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    names = listed.stdout.splitlines() or [str(path.relative_to(ROOT)) for path in sources(*PACKAGES, "tests")]
    for name in names:
        path = ROOT / name
        if path.is_file() and path.suffix == suffix:
            yield path, path.read_text(encoding="utf-8")


def test_every_module_says_what_it_is() -> None:
    silent = [str(path.relative_to(ROOT)) for path in sources(*PACKAGES, "tests", "benchmarks", "resources")
              if path.stat().st_size and not re.match(r'(#.*\n|\n)*"""\s*\S', path.read_text())]
    assert not silent, f"no module docstring: {', '.join(silent)}"


def undocumented(path: Path) -> Iterator[str]:
    """Classes and functions of a file, and their public methods, that other packages use and that have no docstring."""
    def visit(body: list[ast.stmt], prefix: str) -> Iterator[str]:
        for node in body:
            if not isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) or node.name.startswith("_"):
                continue
            if not prefix and node.name not in used:
                continue
            if not ast.get_docstring(node) and not _is_exempt(node):
                yield f"{path.relative_to(ROOT)}:{node.lineno} {prefix}{node.name}"
            if isinstance(node, ast.ClassDef):
                yield from visit(node.body, f"{prefix}{node.name}.")
    used = names_used_elsewhere().get(".".join(path.relative_to(ROOT).with_suffix("").parts), set())
    yield from visit(ast.parse(path.read_text()).body, "")


@cache
def names_used_elsewhere() -> dict[str, set[str]]:
    """By module: what files of other folders import from it."""
    used: dict[str, set[str]] = {}
    for path in sources(*PACKAGES):
        own = ".".join(path.relative_to(ROOT).parent.parts)
        for module, names in FROM_IMPORT.findall(path.read_text()):
            if module.rpartition(".")[0] != own:
                used.setdefault(module, set()).update(re.findall(r"\w+", names))
    return used


def _is_exempt(node: ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Described elsewhere: Qt's own names (camelCase), setters, and a protocol's bare members (by its class)."""
    if isinstance(node, ast.ClassDef):
        return False
    if ast.unparse(node.body[-1]) == "...":
        return True
    names = {ast.unparse(decorator).rpartition(".")[2] for decorator in node.decorator_list}
    return bool(names & {"setter", "overload"}) or bool(re.match(r"[a-z]+[A-Z]", node.name))


def test_what_other_packages_use_is_described() -> None:
    missing = [name for path in sources(*PACKAGES) for name in undocumented(path)]
    assert not missing, "\n".join(missing)


def test_pictures_and_videos_of_others_are_opened_in_one_place() -> None:
    """It checks them first, and turns no pixels; a camera's device is no file."""
    allowed = {"rhot_node/pictures.py", "rhot_node/capture/webcam.py"}
    found = [str(path.relative_to(ROOT)) for path in sources(*PACKAGES, "benchmarks")
             if re.search(r"cv2\.(imread|imdecode|VideoCapture\()|^(?:from|import) (?:PIL|imageio)", path.read_text())]
    assert set(found) <= allowed, f"use rhot_node/pictures.py: {', '.join(sorted(set(found) - allowed))}"


def test_numbers_of_options_are_checked() -> None:
    """`float` takes NaN, which no limit refuses, and `int` numbers that fit nowhere."""
    found = [str(path.relative_to(ROOT)) for path in sources("rhot_app") if "add_argument" in path.read_text()
             and re.search(r"type=(float|int)[,)]", path.read_text())]
    assert not found, f"use finite and whole of rhot_app/errors.py: {', '.join(found)}"


def test_what_is_left_for_later_has_an_owner() -> None:
    found = [f"{path.relative_to(ROOT)}: {match.group()}" for path, text in tracked_text(".py")
             for match in UNOWNED.finditer(text)]
    assert not found, "write the owner's name in parentheses behind it, and a colon:\n" + "\n".join(found)


def test_links_between_documents_lead_somewhere() -> None:
    broken = []
    for path, text in tracked_text(".md"):
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
            if "://" not in target and not target.startswith("mailto:") and not (path.parent / target).exists():
                broken.append(f"{path.relative_to(ROOT)} -> {target}")
    assert not broken, "\n".join(broken)


def test_links_to_sections_name_headings() -> None:
    broken = []
    for path, text in tracked_text(".md"):
        for target, section in re.findall(r"\]\(([^)#\s:]*)#([^)\s]+)\)", text):
            page = path.parent / target if target else path
            prose = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
            headings = re.findall(r"^#+ (.+)$", prose, re.MULTILINE)
            if section not in {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}:
                broken.append(f"{path.relative_to(ROOT)} -> {target}#{section}")
    assert not broken, "\n".join(broken)


def test_test_files_have_unique_names() -> None:
    names = [path.name for path in (ROOT / "tests").rglob("test_*.py")]
    doubled = sorted({name for name in names if names.count(name) > 1})
    assert not doubled, f"pytest would import only one of each: {', '.join(doubled)}"
