"""Names and files that docstrings and comments refer to in backticks are there."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROSE = re.compile(r'("""|\'\'\')(.*?)\1|#[^\n]*', re.DOTALL)
REFERENCE = re.compile(r"(?<!`)`([^`\n]+)`(?!`)")
LITERAL = re.compile(r"``([^`\n]+)``")
PATH = re.compile(r"(\./)?([\w.-]+/)+[\w.-]+\.(py|md|json|toml)")
NAME = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")
WORD = re.compile(r"[A-Za-z_]\w*")
PLACEHOLDER = re.compile(r"(?<![A-Za-z])[A-Z]{2,}(?![A-Za-z])")
PACKAGES = "rhot_app", "rhot_node"
OTHERS = sys.stdlib_module_names | {"cv2", "msgspec", "numba", "numpy", "scipy", "zmq"}


class Repository:
    """Words of its code and data, of each module by the ends of its dotted path, and the ends of all files' paths."""

    def __init__(self) -> None:
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True,
                                check=True).stdout.split()
        self.words, self.modules, self.paths = set[str](), dict[str, set[str]](), set[str]()
        self.texts: dict[str, str] = {}
        for path in listed:
            parts = path.split("/")
            self.paths.update("/".join(parts[first:last]) for first in range(len(parts))
                              for last in range(first + 1, len(parts) + 1))
            self.words.update(WORD.findall(path))
            if path.endswith((".py", ".json", ".toml", ".js", ".html")) and (ROOT / path).exists():
                self._read(path, (ROOT / path).read_text(errors="ignore"))

    def _read(self, path: str, text: str) -> None:
        if not path.endswith(".py"):
            self.words.update(WORD.findall(text))
            return
        words = set(WORD.findall(PROSE.sub(" ", text)))
        self.words |= words
        self.texts[path] = text
        parts = path.removesuffix("/__init__.py").removesuffix(".py").split("/")
        for first in range(len(parts)):
            self.modules.setdefault(".".join(parts[first:]), set()).update(words)

    def lacks(self, reference: str) -> bool:
        """Whether it is a path or a name that is not there. Of `module.NAME` and `module.Class` the module has it."""
        if PATH.fullmatch(reference):
            return reference.removeprefix("./") not in self.paths
        if not NAME.fullmatch(reference):
            return False
        prefix, _, last = reference.rpartition(".")
        if reference.split(".")[0] in OTHERS:
            return False
        if any(len(word) > 2 and word not in self.words for word in reference.split(".")):
            return True
        if prefix and prefix.islower() and last[0].isupper() and last not in self.modules.get(prefix, ()):
            return True
        return self.lacks_path(reference)

    def lacks_path(self, reference: str) -> bool:
        """Whether it begins as a path of modules does, and ends in what is none and stands in none: of
        ``folder.module.name`` the module has the name. A module alone may be a variable's name as well."""
        if PATH.fullmatch(reference) and not PLACEHOLDER.search(reference):
            return reference.removeprefix("./") not in self.paths
        if not NAME.fullmatch(reference):
            return False
        parts = reference.removeprefix("tests.").split(".")
        for cut in range(len(parts), 1 if parts[0] not in PACKAGES else 0, -1):
            start = ".".join(parts[:cut])
            if start in self.modules:
                return cut < len(parts) and parts[cut] not in self.modules[start]
            if start.replace(".", "/") in self.paths:
                return cut < len(parts)
        return parts[0] in PACKAGES


def missing(repository: Repository, texts: dict[str, str]) -> list[str]:
    """Where each reference stands that leads nowhere."""
    return [f"{path}:{text.count(chr(10), 0, prose.start() + found.start()) + 1}: {found[1]}"
            for path, text in texts.items() for prose in PROSE.finditer(text)
            for pattern, lacks in ((REFERENCE, repository.lacks), (LITERAL, repository.lacks_path))
            for found in pattern.finditer(prose[0]) if lacks(found[1].removesuffix("()"))]


def test_what_is_referred_to_is_there() -> None:
    repository = Repository()
    assert len(repository.texts) > 1000
    elsewhere = "geometry.camera.Outcome"
    nowhere = "".join(("no", "thing_of", "_the_kind"))
    stale = {"a.py": f'"""See `{nowhere}`, `triangulate`, `geometry.triangulate.Outcome`, `tracking/locate.py`."""\n'
                     f"x = 1  # as `{elsewhere}`, `{nowhere}.triangulate`, `tracking/{nowhere}.py`\n"
                     f"# `geometry.triangulate.{nowhere}`, ``a/{nowhere}.py``, ``rhot_app.{nowhere}``, ``a.b``\n"}
    assert missing(repository, stale) == [
        f"a.py:1: {nowhere}", f"a.py:2: {elsewhere}", f"a.py:2: {nowhere}.triangulate",
        f"a.py:2: tracking/{nowhere}.py", f"a.py:3: geometry.triangulate.{nowhere}", f"a.py:3: a/{nowhere}.py",
        f"a.py:3: rhot_app.{nowhere}"]
    assert not missing(repository, repository.texts)


IMPORT = re.compile(r"^\s*from (rhot_\w+(?:\.\w+)*) import ([\w, ]+|\([^)]*\))", re.MULTILINE)
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)
FILE = re.compile(r"`((?!rhot_example)(?:[\w-]+/)*[\w-]+\.py)`")  # an example is the reader's own file
WHERE = re.compile(r"`((?:[\w-]+/)*[\w-]+\.py)`: `(\w+)`")


def missing_in_pages(pages: dict[str, str], code: dict[str, str]) -> list[str]:
    """What the pages import, and files of code that they name, and names in them, which are not there."""
    found = []
    for page, text in pages.items():
        for block in BLOCK.finditer(text):
            for module, names in IMPORT.findall(block[1]):
                source = next((code[path] for path in (f"{module.replace('.', '/')}.py",
                                                       f"{module.replace('.', '/')}/__init__.py") if path in code), "")
                found += [f"{page}: {module}.{name}" for name in WORD.findall(names)
                          if not re.search(rf"^(def|class) {name}\b|^\s*{name}\b.*[=:]|import .*\b{name}\b", source,
                                           re.MULTILINE) and f"{module}/{name}".replace(".", "/") + ".py" not in code]
        found += [f"{page}: {name}" for name in FILE.findall(text)
                  if not any(f"/{path}".endswith(f"/{name}") for path in code)]
        found += [f"{page}: {name} in {file}" for file, name in WHERE.findall(text)
                  if not any(f"/{path}".endswith(f"/{file}") and re.search(rf"\b{name}\b", PROSE.sub(" ", source))
                             for path, source in code.items())]
    return found


def test_pages_import_and_name_what_is_there() -> None:
    code = Repository().texts
    pages = {str(path.relative_to(ROOT)): path.read_text()
             for path in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), ROOT / "rhot_app/ui/README.md")
             if path.exists() and path.name != "CHANGELOG.md"}
    stale = "`tracking/locate.py` `nowhere.py` `tracking/locate.py`: `nobody`\n```python\n" \
            "from rhot_app.tracking.locate import rig_table, nobody\nfrom rhot_app.nowhere import nothing\n```\n"
    assert missing_in_pages({"page": stale}, code) == [
        "page: rhot_app.tracking.locate.nobody", "page: rhot_app.nowhere.nothing", "page: nowhere.py",
        "page: nobody in tracking/locate.py"]
    assert not missing_in_pages(pages, code)
