"""What holds for all tests: keys in a folder of their own, one thread for small matrices, and no test by the clock."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator

# Before numpy loads. A second thread only waits for the first one, busily, where matrices are as small as here: the
# shape of a hand then takes five times the processor's time. Programs that a test starts inherit it.
for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import pytest  # noqa: E402
from hypothesis import HealthCheck, settings  # noqa: E402

import rhot_node  # noqa: E402, F401 - decides where compiled code is kept, before any test loads numba

# An example takes what it takes: compiling, or a machine that does other things, is no fault of what is tested. And the
# examples are the same in every run; benchmarks/fuzz.py looks for others.
settings.register_profile("patient", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("patient")

pytest_plugins = ["scheduling", "studies"]


@pytest.fixture
def tracker_may_fail() -> list[logging.LogRecord]:
    """For a test in which a tracker fails: what was logged of it."""
    return []


@pytest.fixture(autouse=True)
def no_tracker_fails(request: pytest.FixtureRequest) -> Iterator[None]:
    """What a tracker fails over is counted and logged, and the rest is tracked: no test must overlook it."""
    found: list[logging.LogRecord] = (request.getfixturevalue("tracker_may_fail")
                                      if "tracker_may_fail" in request.fixturenames else [])
    handler = logging.Handler()
    handler.emit = found.append  # type: ignore[method-assign]
    logger = logging.getLogger("rhot_app.diagnostics")
    logger.addHandler(handler)
    yield
    logger.removeHandler(handler)
    assert not found or "tracker_may_fail" in request.fixturenames, f"{found[0].getMessage()}: {found[0].exc_info}"


@pytest.fixture(scope="session", autouse=True)
def master_keys(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Programs that a test starts inherit the place of the master's keys, which are never the user's. pytest removes it
    one day, also after runs that were killed."""
    os.environ["RHOT_KEYS"] = str(tmp_path_factory.mktemp("keys") / "keys.json")
