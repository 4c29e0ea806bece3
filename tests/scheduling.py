"""How long tests take, and in which order several processes run them: files that take longest come first.

A plug-in of pytest, which `tests/conftest.py` loads. A run keeps the seconds of each test in pytest's cache.
``benchmarks/test_times.py`` prints them and renews `WEIGHTS`, the seconds per file that decide the order.
"""

from __future__ import annotations

import json
import os
from collections.abc import Generator
from pathlib import Path

import pytest

WEIGHTS = Path(__file__).with_name("file_seconds.json")
TOGETHER = "tests/ui/wizards/on_simulated_rig/"
"""Files that run one after the other: two simulated rigs at once are too slow for a person's movements on two
processors."""

CACHE_KEY = "rhot/test_times"
UNKNOWN_S = 10.0
"""Seconds that are expected of a file that no run has measured."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Distributes whole files to the processes in the order of their collection, and those of `TOGETHER` to one."""
    from xdist.scheduler import LoadFileScheduling  # not installed where only the node's tests run

    class Scheduling(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return unit(str(super()._split_scope(nodeid)))

    config.option.loadscopereorder = False
    return Scheduling(config, log)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """The longest files first, so that all processes end together. A single process keeps pytest's order."""
    if hasattr(config, "workerinput"):
        seconds = json.loads(WEIGHTS.read_text())
        unit_s: dict[str, float] = {}
        for file in {_file(item) for item in items}:
            unit_s[unit(file)] = unit_s.get(unit(file), 0.0) + seconds.get(file, UNKNOWN_S)
        items.sort(key=lambda item: (-unit_s[unit(_file(item))], _file(item)))


def _file(item: pytest.Item) -> str:
    return item.nodeid.partition("::")[0]


def unit(file: str) -> str:
    """What one process runs as a whole: a file, or all of `TOGETHER`."""
    return TOGETHER if file.startswith(TOGETHER) else file


def _processor_s() -> float:
    """Processor time of this process and its ended children, s."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


class TestTimes:
    """Wall-clock and processor time of every test, s; saved when the run ends."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._times: dict[str, tuple[float, float]] = {}
        self._begun_s = 0.0

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self) -> Generator[None, object, object]:
        self._begun_s = _processor_s()
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        report.user_properties.append(("processor_s", _processor_s() - self._begun_s))
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        wall_s, _ = self._times.get(report.nodeid, (0.0, 0.0))
        cpu_s = [value for name, value in report.user_properties if name == "processor_s"]
        self._times[report.nodeid] = (wall_s + report.duration, cpu_s[-1] if cpu_s else 0.0)

    def pytest_sessionfinish(self) -> None:
        if self._times and hasattr(self._config, "cache") and not hasattr(self._config, "workerinput"):
            self._config.cache.set(CACHE_KEY, {name: [round(value, 3) for value in times]
                                               for name, times in self._times.items()})


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(TestTimes(config))
