"""Renew the table of packages in THIRD_PARTY.md from the lock and the metadata of the installed packages.

    python requirements/third_party.py

Run it after each change of `requirements/app.lock`, in an environment that `./run` has set up with Python 3.11: older
Pythons need the most packages. Packages that are locked for other systems only are in `ELSEWHERE`. A package without a
clear licence in its metadata is refused until `STATED` has it: read the licence that lies in the package.
"""

from __future__ import annotations

import importlib.metadata
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
PAGE, LOCK = ROOT / "THIRD_PARTY.md", ROOT / "requirements" / "app.lock"
BEGIN, END = "<!-- packages -->", "<!-- end -->"

STATED = {
    "bvh": "MIT", "colorama": "BSD-3-Clause", "defusedxml": "PSF-2.0", "eclipse-zenoh": "EPL-2.0 OR Apache-2.0",
    "ezc3d": "MIT", "pypdfium2": "BSD-3-Clause AND Apache-2.0",
    "jinja2": "BSD-3-Clause", "lz4": "BSD-3-Clause", "numba": "BSD-2-Clause", "openvr": "BSD-3-Clause",
    "partd": "BSD-3-Clause", "pyopengl": "BSD-3-Clause", "python-osc": "Unlicense", "pyvirtualdisplay": "BSD-2-Clause",
    "scipy": "BSD-3-Clause", "tqdm": "MPL-2.0 AND MIT", "zict": "BSD-3-Clause"}
"""Licences of packages whose metadata say less, by the licence that they carry."""

ELSEWHERE = {"cffi": ("MIT-0", "https://cffi.readthedocs.io/"),
             "pycparser": ("BSD-3-Clause", "https://github.com/eliben/pycparser")}
"""Licence and address of packages that are locked for PyPy alone."""

SPDX = {"Apache 2.0": "Apache-2.0", "Apache Software License": "Apache-2.0", "3-Clause BSD License": "BSD-3-Clause",
        "MIT License": "MIT", "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0"}
"""Identifiers (https://spdx.org/licenses) of what metadata say in words."""

_EXPRESSION = re.compile(r"[A-Za-z]+-[\w.+-]+( (AND|OR|WITH) [A-Za-z]+-[\w.+-]+)*|MIT")
_ADDRESSES = ("homepage", "source", "source code", "sources", "repository", "documentation")


@dataclass(frozen=True)
class Package:
    """A package of the lock; `versions` has two where Pythons differ."""

    name: str
    versions: tuple[str, ...]
    uses: tuple[str, ...]
    licence: str
    address: str


def locked(lock: Path = LOCK) -> dict[str, tuple[str, ...]]:
    """Versions by name of every package of a lock, for whatever Python and system."""
    found: dict[str, tuple[str, ...]] = {}
    for line in lock.read_text().splitlines():
        if line and line[0].isalnum():
            requirement = Requirement(line.rstrip(" \\"))
            version = str(requirement.specifier).removeprefix("==")
            found[requirement.name] = (*found.get(requirement.name, ()), version)
    return found


def uses_of(names: set[str]) -> dict[str, list[str]]:
    """What each of the packages is installed for: the parts of pyproject.toml that need it, themselves or through
    others. What the node needs everybody has."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    parts = {"node and master": project["dependencies"], "installing": ["setuptools"]}
    titles = {"app": "app", "dev": "tests"}
    parts |= {titles.get(extra, f"extra `{extra}`"): wanted for extra, wanted in
              project["optional-dependencies"].items()}
    uses: dict[str, list[str]] = {name: [] for name in names}
    for part, wanted in parts.items():
        waiting = [canonicalize_name(Requirement(text).name) for text in wanted]
        while waiting:
            name = waiting.pop()
            if name in uses and part not in uses[name]:
                uses[name].append(part)
                waiting += _requirements(name)
    return {name: found[:1] if "node and master" in found else found for name, found in uses.items()}


def _requirements(name: str) -> Iterator[str]:
    """What an installed package needs on any system, without its extras."""
    try:
        texts = importlib.metadata.requires(name) or []
    except importlib.metadata.PackageNotFoundError:
        texts = ["pycparser"] if name == "cffi" else []
    for requirement in map(Requirement, texts):
        marker = requirement.marker
        if marker is None or "extra" not in str(marker) or marker.evaluate({"extra": ""}):
            yield canonicalize_name(requirement.name)


def package(name: str, versions: tuple[str, ...], uses: list[str]) -> Package:
    """A package with its licence and address. Raises SystemExit with a sentence when they are not to be had."""
    if name in ELSEWHERE:
        return Package(name, versions, tuple(uses), *ELSEWHERE[name])
    try:
        facts = importlib.metadata.metadata(name)
    except importlib.metadata.PackageNotFoundError:
        raise SystemExit(f"{name} is locked but not installed: run `./run setup` with Python 3.11, or enter it in "
                         "ELSEWHERE.") from None
    if facts["Version"] not in versions:
        raise SystemExit(f"{name} {facts['Version']} is installed, the lock has {' and '.join(versions)}: run "
                         "`./run setup`.")
    words = [facts.get("License") or "", *(text.rpartition(" :: ")[2] for text in facts.get_all("Classifier") or []
                                           if text.startswith("License"))]
    told = (SPDX.get(word, word) for word in words)
    licence = STATED.get(name) or facts.get("License-Expression") or next(
        (word for word in told if _EXPRESSION.fullmatch(word)), "")
    if not licence:
        raise SystemExit(f"{name}: its metadata name no licence by its SPDX identifier; enter it in STATED.")
    addresses = {label.lower(): address for label, _, address in
                 (text.partition(", ") for text in facts.get_all("Project-URL") or [])}
    known = next((addresses[label] for label in _ADDRESSES if label in addresses), f"https://pypi.org/project/{name}")
    return Package(name, versions, tuple(uses), licence, facts.get("Home-page") or known)


def table(packages: list[Package]) -> str:
    """The packages as Markdown."""
    rows = ["| package | version | for | licence | address |", "|---|---|---|---|---|"]
    rows += [f"| {one.name} | {', '.join(one.versions)} | {', '.join(one.uses)} | {one.licence} | {one.address} |"
             for one in packages]
    return "\n".join(rows)


def main() -> int:
    """Renew the page."""
    versions = locked()
    uses = uses_of(set(versions))
    for name in [name for name, parts in uses.items() if not parts]:
        raise SystemExit(f"{name} is locked, but nothing needs it: renew the lock.")
    found = [package(name, versions[name], uses[name]) for name in sorted(versions)]
    before, _, rest = PAGE.read_text().partition(BEGIN)
    after = rest.partition(END)[2]
    PAGE.write_text(f"{before}{BEGIN}\n{table(found)}\n{END}{after}")
    print(f"{PAGE.name}: {len(found)} packages.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
