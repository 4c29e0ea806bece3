"""The lock holds every dependency that pyproject.toml names, in a version it allows, on every supported Python."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from packaging.markers import Marker
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
PYTHONS = ("3.11", "3.12", "3.13")


def applies(marker: Marker | None, python: str) -> bool:
    """Whether a requirement with this marker counts on Linux with CPython `python`."""
    return marker is None or marker.evaluate({
        "implementation_name": "cpython", "platform_python_implementation": "CPython", "extra": "",
        "os_name": "posix", "sys_platform": "linux", "platform_system": "Linux",
        "python_version": python, "python_full_version": f"{python}.0", "implementation_version": f"{python}.0"})


def locked(python: str) -> dict[str, str]:
    """Version by normalised name, as installed on Linux with this Python."""
    versions = {}
    for line in (ROOT / "requirements" / "app.lock").read_text().splitlines():
        if line and line[0].isalnum():
            requirement = Requirement(line.rstrip(" \\"))
            if applies(requirement.marker, python):
                assert requirement.name not in versions, f"{requirement.name} is locked twice for Python {python}"
                versions[normalised(requirement.name)] = str(requirement.specifier).removeprefix("==")
    return versions


def normalised(name: str) -> str:
    """PyPI's normal form of a distribution name."""
    return re.sub(r"[-_.]+", "-", name).lower()


@pytest.mark.parametrize("python", PYTHONS)
def test_the_lock_satisfies_every_dependency(python: str) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = sum(project["optional-dependencies"].values(), project["dependencies"])
    versions = locked(python)
    for requirement in map(Requirement, wanted):
        if applies(requirement.marker, python):
            version = versions.get(normalised(requirement.name))
            assert version, f"{requirement.name} is not in requirements/app.lock; renew it (CONTRIBUTING.md, The lock)"
            assert requirement.specifier.contains(version), f"{requirement} but the lock has {version}; renew it"


@pytest.mark.parametrize("lock", ["app.lock", "uv.lock"])
def test_every_locked_package_has_hashes(lock: str) -> None:
    blocks = re.split(r"\n(?=[a-z])", (ROOT / "requirements" / lock).read_text())
    assert any(block[0].isalnum() for block in blocks)
    without = [block.split(" ")[0] for block in blocks if block[0].isalnum() and "--hash=sha256:" not in block]
    assert not without, f"no hash: {', '.join(without)}"
