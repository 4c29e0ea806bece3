"""The scripted hand of the twin works the mouse: observations, tracker, mouse; the truth only judges."""

from __future__ import annotations

import pytest

from rhot_app.mouse.measure import coupling, latency, one_camera, place_once, resolution, throughput


@pytest.mark.parametrize("seed", range(1, 7))
def test_pick_and_place(seed: int) -> None:
    done = place_once(seed)
    assert done["placed"], done


def test_resolution_coupling_and_one_camera() -> None:
    still = resolution(0.0, 1)
    assert still["x_mm"] < 1.0 and still["y_mm"] < 1.5 and still["height_mm"] < 5.0
    assert all(one["x_mm"] < 5.0 and one["height_mm"] < 15.0 for one in coupling(1))
    covered = one_camera(1)
    assert covered["on_table"]["y_mm"] < 0.5 * covered["free"]["y_mm"]


def test_throughput_and_latency() -> None:
    figures, run = throughput(1)
    assert figures["tracked"]["missed"] == 0
    assert figures["tracked"]["bits_per_s"] > 0.9 * figures["true"]["bits_per_s"]
    late = latency(run)
    assert 5.0 < late["ready_p50_ms"] < 60.0 and late["lag_ms"] < 10.0
