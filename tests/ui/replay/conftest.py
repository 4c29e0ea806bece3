"""A short recording for the tests of the replay: a sketched hand that grasps, and folders of its own."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from rhot_app.evaluation.data_sets import LOG_NAME, DataSet, Order, data_set
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.ui.replay.run import Run, track_log

SECONDS = 4.0


@pytest.fixture(scope="session")
def grasp_take(tmp_path_factory: pytest.TempPathFactory) -> DataSet:
    """Four seconds of two cameras at a hand that grasps, with the truth."""
    order = Order(make_scene(twin_defaults(), 3), "grasp", SECONDS, sketched=True)
    return data_set(order, tmp_path_factory.mktemp("takes"))


@pytest.fixture(scope="session")
def grasp_log(grasp_take: DataSet) -> Path:
    """The raw log of `grasp_take`."""
    return grasp_take.folder / LOG_NAME


@pytest.fixture
def log(grasp_log: Path, tmp_path: Path) -> Path:
    """A copy of the recording where the app keeps recordings."""
    folder = tmp_path / "RHOT"
    folder.mkdir(exist_ok=True)
    path = folder / "2026-05-01_10-00-00.rhotlog"
    shutil.copy(grasp_log, path)
    return path


@pytest.fixture(scope="session")
def run(grasp_log: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The recording, tracked as it was recorded."""
    from rhot_app.recording.raw_log import LogReader

    reader = LogReader(grasp_log)
    reader.close()
    out = tmp_path_factory.mktemp("runs") / "a.states"
    return Run(track_log(grasp_log, reader.rig, out), out)
