"""THIRD_PARTY.md names every package that is locked, and every file of others that ships."""

from __future__ import annotations

import re
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "THIRD_PARTY.md").read_text()


def test_every_locked_package_is_listed_with_version_licence_and_address() -> None:
    locked: dict[str, list[str]] = {}
    for line in (ROOT / "requirements" / "app.lock").read_text().splitlines():
        if line and line[0].isalnum():
            requirement = Requirement(line.rstrip(" \\"))
            locked.setdefault(requirement.name, []).append(str(requirement.specifier).removeprefix("=="))
    table = PAGE.partition("<!-- packages -->")[2].partition("<!-- end -->")[0].strip().splitlines()[2:]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table]
    assert {name: versions.split(", ") for name, versions, *_ in rows} == locked, (
        "renew it: python requirements/third_party.py")
    for name, _, use, licence, address in rows:
        assert use and licence and address.startswith("http"), name


def test_files_of_others_are_as_they_were_published() -> None:
    version = re.search(r"`resources/web/three.*?\| (\d+\.(\d+)\.\d+) \|", PAGE)
    assert version is not None
    core = (ROOT / "resources" / "web" / "three.core.min.js").read_text()
    assert f'"{version[2]}"' in core, "three.js is of another version"
    for path in (ROOT / "resources" / "web").glob("three.*.js"):
        assert f"`resources/web/{path.name}`" in PAGE and "SPDX-License-Identifier: MIT" in path.read_text()[:200]
    assert "MIT License" in (ROOT / "resources" / "web" / "three.LICENSE").read_text()
