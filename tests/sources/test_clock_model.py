"""The stated clock bound holds, whatever the network does; steps and reboots are noticed at once."""

from collections.abc import Callable

import numpy as np
import pytest

from rhot_app.sources.clock import NodeClockModel
from rhot_node.clock import NodeClock

PERIOD_NS = 100_000_000
Delay = Callable[[np.random.Generator], tuple[float, float]]


def symmetric(rng: np.random.Generator) -> tuple[float, float]:
    way = 80e-6 + rng.exponential(40e-6)
    return way, way


def jittered(rng: np.random.Generator) -> tuple[float, float]:
    return 80e-6 + rng.exponential(300e-6), 80e-6 + rng.exponential(300e-6)


def asymmetric(rng: np.random.Generator) -> tuple[float, float]:
    return 50e-6 + rng.exponential(50e-6), 3e-3 + rng.exponential(1e-3)


def exchange(model: NodeClockModel, clock: NodeClock, t1: int, delay: Delay, rng: np.random.Generator,
             boot_id: int = 1) -> tuple[bool, int]:
    there, back = delay(rng)
    arrived = t1 + round(there * 1e9)
    left = arrived + 30_000
    t4 = left + round(back * 1e9)
    return model.add(t1, clock.from_host_ns(arrived), clock.from_host_ns(left), t4, boot_id), t4


def error_s(model: NodeClockModel, clock: NodeClock, t_master_ns: int) -> float:
    estimate = model.estimate_at(t_master_ns)
    assert estimate is not None
    return abs(estimate.to_master_ns(clock.from_host_ns(t_master_ns)) - t_master_ns) * 1e-9


def bound_s(model: NodeClockModel, t_master_ns: int) -> float:
    estimate = model.estimate_at(t_master_ns)
    return float("inf") if estimate is None else estimate.bound_s(t_master_ns)


@pytest.mark.parametrize("delay", [symmetric, jittered, asymmetric])
@pytest.mark.parametrize(("offset_h", "drift_ppm"), [(0.0, 0.0), (7.0, 50.0), (-31.0, -50.0), (3.0, 99.0)])
def test_error_stays_within_bound(delay: Delay, offset_h: float, drift_ppm: float) -> None:
    rng = np.random.default_rng(5)
    start = 10**15
    clock = NodeClock(round(offset_h * 3600e9), drift_ppm, start)
    model = NodeClockModel()
    for k in range(300):
        t1 = start + k * PERIOD_NS
        _, t4 = exchange(model, clock, t1, delay, rng)
        if model.estimate_at(t4):
            for t in (t4, t4 + 50_000_000, t4 + 100_000_000, t4 - 30_000_000):
                assert error_s(model, clock, t) <= bound_s(model, t)
    assert model.estimate_at(t4) is not None
    assert model.resets == 0
    assert bound_s(model, t4) < (3e-3 if delay is asymmetric else 0.4e-3)


def test_symmetric_delay_gives_tens_of_microseconds() -> None:
    rng = np.random.default_rng(6)
    clock = NodeClock(12 * 3600 * 10**9, 50.0, 0)
    model = NodeClockModel()
    for k in range(300):
        _, t4 = exchange(model, clock, 10**12 + k * PERIOD_NS, symmetric, rng)
    assert error_s(model, clock, t4 + 50_000_000) < 30e-6
    assert abs(model.drift - 50e-6) < 5e-6
    assert error_s(model, clock, t4 + 10 * 10**9) < 30e-6 + 5e-6 * 10, "the drift is carried on"


def test_silence_widens_the_bound_until_nothing_is_converted() -> None:
    rng = np.random.default_rng(7)
    clock = NodeClock(5, -50.0, 0)
    model = NodeClockModel()
    for k in range(100):
        _, t4 = exchange(model, clock, 10**12 + k * PERIOD_NS, symmetric, rng)
    later = t4 + 60 * 10**9
    assert error_s(model, clock, later) <= bound_s(model, later)
    assert model.estimate_at(later) is not None
    assert model.estimate_at(t4 + 3600 * 10**9) is None


@pytest.mark.parametrize("step_ns", [5_000_000, -5_000_000, 3600 * 10**9, -(10**12)])
def test_clock_step_resets_at_once_and_is_right_again(step_ns: int) -> None:
    rng = np.random.default_rng(8)
    model = NodeClockModel()
    clock = NodeClock(10**13, 20.0, 0)
    for k in range(60):
        exchange(model, clock, 10**12 + k * PERIOD_NS, jittered, rng)
    clock = NodeClock(10**13 + step_ns, 20.0, 0)
    changed, t4 = exchange(model, clock, 10**12 + 60 * PERIOD_NS, jittered, rng)
    assert changed
    assert model.estimate_at(t4) is None
    for k in range(61, 64):
        _, t4 = exchange(model, clock, 10**12 + k * PERIOD_NS, jittered, rng)
    assert model.estimate_at(t4) is not None
    assert error_s(model, clock, t4) <= bound_s(model, t4)


def test_new_boot_resets() -> None:
    rng = np.random.default_rng(9)
    model = NodeClockModel()
    clock = NodeClock()
    for k in range(5):
        exchange(model, clock, 10**12 + k * PERIOD_NS, symmetric, rng, boot_id=1)
    changed, t4 = exchange(model, clock, 10**12 + 5 * PERIOD_NS, symmetric, rng, boot_id=2)
    assert changed
    assert model.estimate_at(t4) is None


def test_impossible_exchanges_are_ignored() -> None:
    model = NodeClockModel()
    assert not model.add(100, 50, 40, 200, 1)  # answered before it was asked
    assert not model.add(100, 0, 500, 200, 1)  # the node thought longer than the exchange took
    assert not model.add(0, 0, 0, 2 * 10**9, 1)  # two seconds on the way
    assert model.offset_s is None
    assert bound_s(model, 0) == float("inf")
