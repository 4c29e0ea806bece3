"""Filter tuning: figures that mean what they say, a proposal that keeps its rule, and recordings that do not serve."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from log_writing import write_log
from synthetic_rig import WIDE, Viewing, compare, make_rig, observe, run, still_trajectory
from waving import waving

from rhot_app.__main__ import main
from rhot_app.calibration.filters.meters import (
    FilterFigures,
    FilterMeter,
    FilterTargets,
    MarkerFigures,
    judge_filters,
    lag,
    motion_of,
)
from rhot_app.calibration.filters.tuning import OFF, make_footage, simulate, tune_filters
from rhot_app.calibration.observations import InstantTable
from rhot_app.calibration.recorded_observations import read_instants
from rhot_app.calibration.verdict import Grade, Verdict
from rhot_app.errors import CalibrationError
from rhot_app.filters import jitter
from rhot_app.filters.one_euro import OneEuroFilter
from rhot_app.project import FilterSettings, OneEuroSettings, load_rig, save_rig
from rhot_app.tracking.scene import make_tracker

RIG = make_rig()
SECONDS = 5.0
WAVING = waving(RIG, SECONDS)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("logs")
    resting = still_trajectory(WAVING(np.zeros(1))[0])
    return tuple(write_log(folder / f"{name}.log", RIG, observe(RIG, WIDE, trajectory, SECONDS, Viewing(noise_px=0.05)))
                 for name, trajectory in (("still", resting), ("fast", WAVING)))


@pytest.fixture(scope="module")
def tables(logs: tuple[Path, Path]) -> tuple[InstantTable, InstantTable]:
    return read_instants(logs[0])[1], read_instants(logs[1])[1]


def swing(times: np.ndarray, delay_s: float = 0.0) -> np.ndarray:
    return 0.1 * np.stack([np.sin(9.0 * (times - delay_s)), np.cos(7.0 * (times - delay_s)), 0.0 * times], axis=1)


@pytest.mark.parametrize("delay_s", [0.0, 0.002, 0.03])
@pytest.mark.parametrize("period_s", [0.025, 0.06])
def test_lag_is_the_delay(delay_s: float, period_s: float) -> None:
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.6 * period_s, 1.4 * period_s, 200))
    raw = swing(times) + rng.normal(0.0, 3e-4, (200, 3))
    raw[50:54] = np.nan
    found, error = lag(times, swing(times, delay_s), motion_of(times, raw))
    assert found == pytest.approx(delay_s, abs=1.5e-3)
    assert error == pytest.approx(np.hypot(3e-4 * np.sqrt(3.0), delay_s * 0.8), rel=0.2)


def test_jitter_is_the_noise_whatever_the_hand_does_slowly() -> None:
    rng = np.random.default_rng(2)
    times = 0.025 * np.arange(400)
    noise = rng.normal(0.0, 3e-4, (400, 3))
    drifting = noise + 0.01 * np.sin(2.0 * np.pi * 0.4 * times)[:, None]
    for values in (noise, drifting):
        assert jitter.resting(times, values) == pytest.approx(3e-4 * np.sqrt(3.0), rel=0.06)
    assert np.isnan(lag(times, noise, motion_of(times, noise))[0])  # a hand at rest shows no lag


def test_the_simulation_filters_as_the_tracker_does(tables: tuple[InstantTable, InstantTable], logs) -> None:
    slow = msgspec.structs.replace(RIG, filters=FilterSettings(
        pixel=OneEuroSettings(1.0, 0.1, 15.0), position=OneEuroSettings(2.0, 50.0, 10.0)))
    footage = make_footage(tables[1], RIG)
    rows = [np.tile((one.min_cutoff_hz, one.beta, one.derivative_cutoff_hz), (6, 1))
            for one in (slow.filters.pixel, slow.filters.position)]
    _, filtered = simulate(footage, *rows)
    _, raw = simulate(footage, np.tile(OFF, (6, 1)), np.tile(OFF, (6, 1)))
    np.testing.assert_allclose(raw[tables[1].measured], tables[1].positions[tables[1].measured], atol=1e-4)
    states = run(make_tracker(slow), observe(RIG, WIDE, WAVING, SECONDS, Viewing(noise_px=0.05)))
    at = {state.t_master_ns: state.marker_positions for state in states}
    same = [k for k, t in enumerate(tables[1].t_ns) if int(t) in at][30:]
    expected = np.array([at[int(tables[1].t_ns[k])] for k in same])
    assert len(same) > 100
    np.testing.assert_allclose(filtered[same], expected, atol=2e-4)
    assert np.abs(raw[same] - expected).max() > 2e-3


def test_the_proposal_keeps_the_rule_and_the_tracker_confirms_it(tables: tuple[InstantTable, InstantTable]) -> None:
    targets = FilterTargets(jitter_m=0.4e-3, lag_s=2e-3)
    report = tune_filters(*tables, RIG, targets)
    assert report.verdict.grade is Grade.GOOD
    for marker in report.markers:
        assert marker.known and marker.speed_m_s > 0.5
        assert marker.jitter_m <= 1.1 * targets.jitter_m < marker.raw_jitter_m
        assert 0.0 < marker.lag_s <= targets.lag_s and marker.error_m <= targets.lag_s * marker.speed_m_s * 1.1
    assert 0.03 < report.markers[0].raw_jitter_px < 0.1
    tuned = report.apply(RIG)
    still = still_trajectory(WAVING(np.zeros(1))[0])
    noise = Viewing(noise_px=0.05, seed=99)
    calm = [compare(rig, run(make_tracker(rig), observe(rig, WIDE, still, SECONDS, noise)), still).marker_mm
            for rig in (tuned, RIG)]
    assert calm[0] < 0.85 * calm[1]
    moving = compare(tuned, run(make_tracker(tuned), observe(tuned, WIDE, WAVING, SECONDS, noise)), WAVING)
    assert moving.marker_mm < 2.0


def test_stricter_targets_give_calmer_or_faster_filters(tables: tuple[InstantTable, InstantTable]) -> None:
    lazy, brisk = (tune_filters(*tables, RIG, FilterTargets(0.5e-3, lag)) for lag in (8e-3, 0.8e-3))
    assert lazy.pixel.chosen.beta < brisk.pixel.chosen.beta
    assert all(a.jitter_m < b.jitter_m and a.lag_s > b.lag_s
               for a, b in zip(lazy.markers, brisk.markers, strict=True))
    curves = lazy.pixel
    assert (np.diff(curves.still_jitter_m, axis=0) > 0.0).all() and (np.diff(curves.lag_s, axis=0) < 0.0).all()
    impossible = tune_filters(*tables, RIG, FilterTargets(0.05e-3, 0.5e-3))
    assert impossible.verdict.codes == {"jitter"} and impossible.verdict.grade is Grade.FAIR
    assert tune_filters(*tables, RIG, FilterTargets(0.05e-3, 1e-5)).verdict.codes == {"jitter", "lag"}
    assert impossible.position.chosen.beta < impossible.position.betas[-1], "no more noise than the lag asks for"


def test_a_noisy_marker_gets_settings_of_its_own(tables: tuple[InstantTable, InstantTable]) -> None:
    rng = np.random.default_rng(5)
    noisy = []
    for table in tables:
        pixels = table.pixels.copy()
        pixels[:, :, 2] += rng.normal(0.0, 0.2, pixels[:, :, 2].shape)
        noisy.append(replace(table, pixels=pixels))
    report = tune_filters(*noisy, RIG)
    own = report.pixel.by_marker
    assert own[2].min_cutoff_hz < min(one.min_cutoff_hz for k, one in enumerate(own) if k != 2)
    assert report.pixel.chosen.min_cutoff_hz == own[2].min_cutoff_hz  # what holds for all is the strictest
    rig = replace(report, per_marker=True).apply(RIG)
    common, single = (replace(report, per_marker=per_marker).choice.markers for per_marker in (False, True))
    assert single[0].lag_s < common[0].lag_s, "the figures are those of the settings that are written"
    assert rig.filters.pixel_markers[RIG.markers.ids[2]] == own[2] and len(rig.filters.position_markers) == 6


def judged(*rows: tuple[float, float, float, float], raw_m: float = 1e-3) -> Verdict:
    """Of markers with a jitter and a lag, new and now, mm and ms."""
    markers = tuple(MarkerFigures(f"m{k}", True, 0.8, 0.05, raw_m, jitter, lag_s, 1e-3, jitter_now, lag_now, 1e-3)
                    for k, (jitter, lag_s, jitter_now, lag_now) in enumerate(1e-3 * np.array(rows)))
    return judge_filters(FilterFigures(FilterTargets(), markers, 0.0))


def test_filters_that_are_worse_in_jitter_and_in_lag_are_not_used() -> None:
    worse, calmer, faster = (0.9, 5.0, 0.5, 2.0), (0.4, 5.0, 0.5, 2.0), (0.9, 1.0, 0.5, 2.0)
    assert not judged(worse, worse).acceptable and "worse" in judged(worse, worse).codes
    assert judged(worse, calmer).grade is Grade.FAIR and "m0" in judged(worse, calmer).findings[0].sentence
    for verdict in (judged(calmer, faster), judged((0.5, 2.0, 0.5, 2.0)), judged((0.9, np.nan, 0.5, 2.0))):
        assert "worse" not in verdict.codes
    assert not judged((1.2, 2.0, 1.3, 3.0)).acceptable, "no filter at all jitters less"


def test_recordings_that_do_not_serve_are_named(tables: tuple[InstantTable, InstantTable]) -> None:
    still, fast = tables
    swapped = tune_filters(fast, still, RIG)
    assert swapped.verdict.codes >= {"not_still", "not_fast"} and not swapped.verdict.acceptable
    hidden = replace(still, measured=np.zeros_like(still.measured))
    with pytest.raises(CalibrationError, match="no marker is measured"):
        tune_filters(hidden, fast, RIG)
    partly = still.measured.copy()
    partly[:, 3] = False
    report = tune_filters(replace(still, measured=partly), fast, RIG)
    assert "unseen" in report.verdict.codes and RIG.markers.ids[3] in report.verdict.findings[0].sentence
    assert RIG.markers.ids[3] not in replace(report, per_marker=True).apply(RIG).filters.pixel_markers


def test_the_command_writes_the_filters(tmp_path: Path, logs, capsys: pytest.CaptureFixture[str]) -> None:
    rig_path = tmp_path / "rig.json"
    save_rig(rig_path, RIG)
    arguments = ["calibrate", "filters", "--log-still", str(logs[0]), "--log-fast", str(logs[1]), "--rig",
                 str(rig_path), "--out", str(rig_path), "--jitter-mm", "0.5", "--lag-ms", "2", "--json"]
    assert main(arguments) == 0
    found = json.loads(capsys.readouterr().out)
    rig = load_rig(rig_path)
    assert rig.filters != FilterSettings() and rig.filters.pixel.beta == found["pixel"]["beta"]
    assert found["markers"]["index"]["lag_ms"] <= 2.0 and len(found["position"]["curves"]["lag_ms"][0]) == 6


def test_the_live_meter_reads_what_happens_now() -> None:
    rng = np.random.default_rng(3)
    meter, filtered = FilterMeter(2), OneEuroFilter(6, 1.0, 0.0)
    assert np.isnan(meter.read().jitter_m).all()
    for k in range(400):
        t = 0.01 * k
        raw = np.stack([swing(np.array([t]))[0], np.zeros(3)]) + rng.normal(0.0, 3e-4, (2, 3))
        raw[1] = raw[1] if k % 50 else np.nan
        meter.add(round(1e9 * t), raw, filtered(t, raw.ravel()).reshape(2, 3))
    reading = meter.read()
    assert reading.lag_s[0] > 0.05 and np.isnan(reading.lag_s[1])
    assert reading.raw_jitter_m[1] == pytest.approx(3e-4 * np.sqrt(3.0), rel=0.2) and reading.jitter_m[1] < 1e-4
    assert reading.raw_jitter_m[0] == pytest.approx(3e-4 * np.sqrt(3.0), rel=0.2), "whatever the hand does"
    assert np.isnan(reading.jitter_m[0]), "of a filter it is told at rest"
    assert reading.speed_m_s[0] > 0.7 > reading.speed_m_s[1]

