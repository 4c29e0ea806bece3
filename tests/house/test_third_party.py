"""THIRD_PARTY.md names every package that is asked for, and every file of others that ships."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "THIRD_PARTY.md").read_text()


def test_every_dependency_has_a_licence() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = sum(project["optional-dependencies"].values(), project["dependencies"])
    named = set(re.split(r"[|,\s]+", PAGE))
    missing = [name for name in (Requirement(text).name for text in wanted) if name not in named]
    assert not missing, f"THIRD_PARTY.md does not name {', '.join(missing)}"


def test_files_of_others_are_as_they_were_published() -> None:
    version = re.search(r"`resources/web/three.*?\| (\d+\.(\d+)\.\d+) \|", PAGE)
    assert version is not None
    core = (ROOT / "resources" / "web" / "three.core.min.js").read_text()
    assert f'"{version[2]}"' in core, "three.js is of another version"
    for path in (ROOT / "resources" / "web").glob("three.*.js"):
        assert f"`resources/web/{path.name}`" in PAGE and "SPDX-License-Identifier: MIT" in path.read_text()[:200]
    assert "MIT License" in (ROOT / "resources" / "web" / "three.LICENSE").read_text()
