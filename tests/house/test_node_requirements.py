"""A Pi gets what the node needs and nothing else: the constraints for both systems, and pip's own word for aarch64."""

from __future__ import annotations

import importlib.metadata
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

ROOT = Path(__file__).parents[2]
SYSTEMS = ("bookworm", "trixie")
MASTERS_IMPORTS = {"scipy", "PySide6", "pyqtgraph", "OpenGL", "rhot_app"}
MASTERS_ONLY = {"scipy", "pyside6-essentials", "pyqtgraph", "pyopengl"}


def node_dependencies(*extras: str) -> dict[str, Requirement]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = sum((project["optional-dependencies"][extra] for extra in extras), project["dependencies"])
    return {requirement.name: requirement for requirement in map(Requirement, wanted)}


def pinned(system: str) -> dict[str, str]:
    text = (ROOT / "requirements" / f"node-{system}.txt").read_text()
    return dict(re.findall(r"^([a-z0-9-]+)==(\S+)$", text, re.MULTILINE))


@pytest.mark.parametrize("system", SYSTEMS)
def test_every_dependency_of_the_node_is_constrained_to_a_version_it_allows(system: str) -> None:
    pins = pinned(system)
    for name, requirement in node_dependencies("landmarks").items():
        assert name in pins, f"{name} is missing in requirements/node-{system}.txt; renew it (CONTRIBUTING.md)"
        assert requirement.specifier.contains(pins[name]), f"{requirement}, but {system} has {pins[name]}"
    assert not MASTERS_ONLY & set(pins)


def test_bookworms_numpy_is_that_of_its_picamera2() -> None:
    assert pinned("bookworm")["numpy"].startswith("1.")


def test_opencv_is_later_than_its_hole_wherever_numpy_lets_it_be() -> None:
    """CVE-2025-53644 is in 4.10 and 4.11; from 4.12 on OpenCV needs numpy 2."""
    versions = {system: Version(pinned(system)["opencv-python-headless"]) for system in SYSTEMS}
    assert Version("4.12") <= versions["trixie"] < Version("5")
    assert Version("4.11") <= versions["bookworm"] < Version("4.12"), "only what numpy 1 holds back"


def link_dependencies(folder: Path) -> None:
    """Links in `folder` to what the node's dependencies install here, with what they need themselves."""
    waiting, seen = list(node_dependencies().values()), set[str]()
    while waiting:
        requirement = waiting.pop()
        if requirement.name in seen or not (requirement.marker is None or requirement.marker.evaluate({"extra": ""})):
            continue
        seen.add(requirement.name)
        found = importlib.metadata.distribution(requirement.name)
        waiting += map(Requirement, found.requires or [])
        for top in {path.parts[0] for path in found.files or [] if path.parts[0] != ".."}:
            if not (folder / top).exists():
                (folder / top).symlink_to(Path(str(found.locate_file(top))).resolve())


def test_the_landmark_part_runs_with_the_nodes_dependencies_alone(tmp_path: Path) -> None:
    packages = tmp_path / "packages"
    packages.mkdir()
    link_dependencies(packages)
    program = f"""
import sys
sys.path += [{str(packages)!r}, {str(ROOT)!r}, {str(ROOT / "tests" / "keypoints")!r}]
from pathlib import Path
import numpy as np
from rhot_node.detect.image import from_bgr
from rhot_node.files import resource_path
from rhot_node.keypoints import KeypointDetector
from rhot_node.markers import load_markers
from tiny_network import place
detector = KeypointDetector(place(Path({str(tmp_path)!r})), load_markers(resource_path("markers", "landmarks21.json")))
print(sum(one.found for one in detector.detect(from_bgr(np.full((240, 320, 3), (0, 0, 255), np.uint8)))))
print(sorted(name for name in sys.modules if name in {sorted(MASTERS_IMPORTS)!r}))
"""
    done = subprocess.run([sys.executable, "-I", "-S", "-c", program], capture_output=True, text=True, timeout=120,
                          check=False)
    assert done.returncode == 0, done.stderr
    found, masters = done.stdout.splitlines()
    assert int(found) > 15 and masters == "[]"


@pytest.mark.skipif(os.environ.get("RHOT_NETWORK") != "1", reason="asks the package index: only with RHOT_NETWORK=1")
def test_pip_finds_all_of_it_for_a_pi() -> None:
    done = subprocess.run([str(ROOT / ".ci" / "node-resolve")], capture_output=True, text=True, timeout=120,
                          check=False, env=os.environ | {"PYTHON": sys.executable})
    if re.search(r"Connection|Temporary failure|timed out", done.stderr):
        pytest.skip("the package index is not reachable")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.split(",")[0] for line in lines] == list(SYSTEMS)
    for system, line in zip(SYSTEMS, lines, strict=True):
        found = {canonicalize_name(name): version
                 for name, version in (item.split(" ") for item in line.split(": ")[1].split(", "))}
        assert found == pinned(system), "the constraints name exactly what is installed"
