"""Imports follow the direction of the picture in the architecture: the table stands in import_rules.py."""

from __future__ import annotations

from pathlib import Path

import pytest
from import_rules import violations

ROOT = Path(__file__).parents[2]
FILES = sorted(path for package in ("rhot_node", "rhot_app") for path in (ROOT / package).rglob("*.py"))


def test_every_import_of_every_file_is_allowed() -> None:
    assert len(FILES) > 30
    found = [line for path in FILES for line in violations(path.read_text(), path, ROOT)]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(("file", "source"), [
    ("rhot_node/detect/fast.py", "from rhot_node.capture.camera import Camera"),
    ("rhot_node/wire/codec.py", "import rhot_node.daemon"),
    ("rhot_node/markers.py", "from rhot_node import detect"),
    ("rhot_node/daemon.py", "def run():\n    from rhot_app.project import Rig"),
    ("rhot_node/daemon.py", "import scipy.optimize"),
    ("rhot_node/__main__.py", "def main():\n    from PySide6 import QtCore"),
    ("rhot_app/geometry/camera.py", "from rhot_app.hand.solvers.fabrik import solve_chain"),
    ("rhot_app/geometry/camera.py", "from ..hand import fabrik"),
    ("rhot_app/filters/__init__.py", "from ..tracking.state import HandState"),
    ("rhot_app/hand/solvers/fabrik.py", "from rhot_app.state import HandState"),
    ("rhot_app/tracking/pipeline.py", "from rhot_app.sources.clock import ClockModel"),
    ("rhot_app/tracking/pipeline.py", "if TYPE_CHECKING:\n    from rhot_app.engine.status import EngineStatus"),
    ("rhot_app/sources/receiver.py", "import rhot_app.engine.client"),
    ("rhot_app/recording/log.py", "import importlib\nimportlib.import_module('rhot_app.engine.client')"),
    ("rhot_app/engine/session.py", "from rhot_app.ui.main_window import MainWindow"),
    ("rhot_app/engine/session.py", "from rhot_app import ui"),
    ("rhot_app/engine/session.py", "import pyqtgraph as pg"),
    ("rhot_app/simulator/renderer.py", "def draw():\n    from OpenGL import GL"),
    ("rhot_app/__main__.py", "import PySide6"),
    ("rhot_app/ui/main_window.py", "from rhot_app.__main__ import main"),
])
def test_a_planted_violation_is_found(file: str, source: str) -> None:
    (message,) = violations(source, ROOT / file, ROOT)
    assert message.startswith(f"{file}:")


@pytest.mark.parametrize(("file", "source"), [
    ("rhot_node/detect/fast.py", "from rhot_node.wire.messages import MarkerObservation\nimport numpy, cv2"),
    ("rhot_app/hand/solvers/fabrik.py", "from .skeleton import JOINTS\nfrom rhot_app.project import Rig"),
    ("rhot_app/ui/main_window.py", "from PySide6 import QtWidgets\nfrom rhot_app.engine.client import Client"),
    ("rhot_app/__main__.py", "def main():\n    from rhot_app.ui.app import run"),
])
def test_allowed_imports_pass(file: str, source: str) -> None:
    assert violations(source, ROOT / file, ROOT) == []


def test_a_room_outside_the_table_is_named() -> None:
    with pytest.raises(KeyError, match="attic"):
        violations("import rhot_node", ROOT / "rhot_app/attic/box.py", ROOT)
