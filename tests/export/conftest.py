"""A short recording of a grasping hand, the same with half a second missing, and what the tracker makes of both."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from processes import forked_programs, fresh_programs  # noqa: F401
from tracked_log import states_of_log

from rhot_app.evaluation.data_sets import LOG_NAME, Order, data_set
from rhot_app.export.states import HandStates
from rhot_app.recording.raw_log import LogReader, RecordKind, encode_header, encode_record
from rhot_app.simulator.film.node_log import T0_MASTER_NS
from rhot_app.simulator.scene.scene import make_scene, twin_defaults

GAP_NS = T0_MASTER_NS + 700_000_000, T0_MASTER_NS + 1_400_000_000


@pytest.fixture(scope="session")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """1.8 s of grasping, 40 pairs of frames a second."""
    order = Order(make_scene(twin_defaults(), 1), "grasp", 1.8, sketched=True)
    return data_set(order, tmp_path_factory.mktemp("takes")).folder / LOG_NAME


@pytest.fixture(scope="session")
def gappy(log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same without the datagrams of 0.7 s to 1.4 s."""
    reader = LogReader(log)
    kept = [record for record in reader
            if record.kind is not RecordKind.DATAGRAM or not GAP_NS[0] < record.t_master_ns < GAP_NS[1]]
    path = tmp_path_factory.mktemp("gappy") / "gappy.rhotlog"
    path.write_bytes(encode_header(reader.rig, reader.about) + b"".join(map(encode_record, kept)))
    return path


@pytest.fixture(scope="session")
def states_by(log: Path) -> Callable[[str], HandStates]:
    """The states of `log` by a tracker; each is tracked once."""
    found: dict[str, HandStates] = {}

    def by(tracker: str) -> HandStates:
        if tracker not in found:
            found[tracker] = states_of_log(log, tracker)
        return found[tracker]

    return by


@pytest.fixture(scope="session")
def states(states_by: Callable[[str], HandStates]) -> HandStates:
    """By the classic tracker."""
    return states_by("classic")


@pytest.fixture(scope="session")
def gappy_states(gappy: Path) -> HandStates:
    """By the classic tracker."""
    return states_of_log(gappy)
