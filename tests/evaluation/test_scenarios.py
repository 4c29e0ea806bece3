"""Trials of the classic tracker on a short take without pictures: each figure is there and means what it says."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot_app.evaluation.accuracy import Figures, accuracy, deviations, worn_by
from rhot_app.evaluation.data_sets import DataSet, Order, data_set
from rhot_app.evaluation.track import rig_with, tracked
from rhot_app.hand.anthropometry import scaled_hand
from rhot_app.project import FilterSettings, OneEuroSettings, Rig, TrackerSettings
from rhot_app.simulator.scene.scene import make_scene, twin_defaults

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

import scenarios

CLASSIC, MODEL = TrackerSettings(kind="classic"), TrackerSettings(kind="estimator")


def sketch(folder: Path, motion: str, seconds: float) -> DataSet:
    return data_set(Order(make_scene(twin_defaults(), 1), motion, seconds, sketched=True), folder)


@pytest.fixture(scope="module")
def grasp(tmp_path_factory: pytest.TempPathFactory) -> DataSet:
    return sketch(tmp_path_factory.mktemp("takes"), "grasp", 5.0)


@pytest.fixture(scope="module")
def rig(grasp: DataSet) -> Rig:
    return rig_with(grasp.rig, CLASSIC)


def test_a_camera_that_is_blind_makes_fingertips_worse(grasp: DataSet, rig: Rig) -> None:
    good = scenarios.plain(grasp, rig)
    assert good["tips_mm"] is not None and good["tips_mm"] < 1.0 and good["known_share"] == 1.0
    for says_so in (True, False):
        bad = scenarios.one_camera_blind(grasp, rig, says_so=says_so)
        assert bad["tips_mm"] is not None and bad["tips_max_mm"] is not None
        assert bad["tips_mm"] > 5.0 * good["tips_mm"] and bad["tips_max_mm"] > bad["tips_mm"]
        assert bad["within_3_sd_share"] is None  # the classic tracker states nothing


def test_the_estimator_knows_how_badly_it_knows_a_hand_before_one_camera(grasp: DataSet) -> None:
    figures = scenarios.one_camera_blind(grasp, rig_with(grasp.rig, MODEL), says_so=True)
    assert figures["tips_mm"] is not None and figures["tips_mm"] > 2.0
    assert figures["within_3_sd_share"] is not None and figures["within_3_sd_share"] > 0.95


@pytest.fixture(scope="module", params=[True, False], ids=["says so", "silent"])
def waving(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Figures:
    wave = sketch(tmp_path_factory.mktemp("wave"), "wave", 5.0)
    return scenarios.one_camera_blind(wave, rig_with(wave.rig, MODEL), says_so=request.param)


@pytest.mark.parametrize("most_mm", [
    6.0, pytest.param(3.0, marks=pytest.mark.xfail(strict=True, reason="3.5 and 3.7 mm; the Kalman filter had 3.0"))])
def test_a_waving_hand_before_one_camera_is_where_its_fingertips_look_as_large(waving: Figures, most_mm: float) -> None:
    """By its course alone it is 6 mm off."""
    figures = waving
    assert figures["tips_mm"] is not None and figures["tips_mm"] < most_mm
    assert figures["within_3_sd_share"] is not None and figures["within_3_sd_share"] > 0.95


def test_a_camera_is_covered_at_another_moment_of_every_take(grasp: DataSet) -> None:
    moments = [scenarios.blind_from(replace(grasp, folder=grasp.folder.with_name(name))) for name in "abcdef"]
    assert len(set(moments)) == 6
    assert min(moments) >= 2.0 and max(moments) + scenarios.BLIND_S <= grasp.seconds - 0.5
    assert scenarios.blind_from(grasp) == scenarios.blind_from(grasp)


def test_hidden_and_mixed_up_markers_make_fingertips_worse(grasp: DataSet, rig: Rig) -> None:
    good = scenarios.plain(grasp, rig)["tips_mm"]
    for bad in (scenarios.markers_hidden(grasp, rig, share=0.3, together=True),
                scenarios.names_mixed_up(grasp, rig, pair=(1, 2), share=0.3)):
        assert good is not None and bad["tips_mm"] is not None and bad["tips_mm"] > 2.0 * good
        assert bad["seconds"] == pytest.approx(4.0, abs=0.1)


def test_a_tracker_that_states_nothing_of_the_palm_is_not_quoted(grasp: DataSet, rig: Rig) -> None:
    figures = scenarios.wrist_alone(grasp, rig)
    assert figures["stated_deg"] is None and figures["palm_turn_deg"] is not None and figures["palm_turn_deg"] > 3.0


def test_a_calm_filter_is_late_and_a_prompt_one_is_not(grasp: DataSet, rig: Rig) -> None:
    calm = OneEuroSettings(min_cutoff_hz=1.0, beta=0.1, derivative_cutoff_hz=15.0)
    slow = scenarios.lagging(grasp, msgspec.structs.replace(rig, filters=FilterSettings(pixel=calm, position=calm)),
                             speeding_up=False)["lag_ms"]
    quick = scenarios.lagging(grasp, rig, speeding_up=False)["lag_ms"]
    assert slow is not None and quick is not None and slow > 20.0 and abs(quick) < 2.0


def test_a_hand_is_found_soon_wherever_the_log_begins(grasp: DataSet, rig: Rig) -> None:
    found = scenarios.starting(grasp, rig, (0.0, 2.0))
    assert all(after is not None and 0.0 < after < 0.2 for after in found)


def test_a_tracker_that_does_not_estimate_the_size_never_finds_it(grasp: DataSet, rig: Rig) -> None:
    figures = scenarios.growing(grasp, rig, 1.0 / 1.1)
    assert figures["error_at_1s_percent"] == pytest.approx(10.0) and figures["within_2_percent_after_s"] is None
    assert figures["stated_percent"] is None and figures["max_off_in_sd"] is None
    assert figures["within_2_percent_share"] == 0.0


@pytest.mark.parametrize("wrong", [1.1, 0.9])
def test_a_tracker_that_estimates_the_size_finds_it_and_states_no_more_than_it_knows(grasp: DataSet,
                                                                                     wrong: float) -> None:
    estimating = rig_with(grasp.rig, TrackerSettings(kind="estimator", float_scale=True))
    rig = msgspec.structs.replace(estimating, hand=scaled_hand(grasp.rig.hand, wrong))
    figures = scenarios.growing(grasp, rig, 1.0 / wrong)
    assert all(figures[key] is not None for key in ("within_2_percent_after_s", "stated_percent", "max_off_in_sd"))
    assert (figures["stated_percent"] or 0.0) > 1.5 and (figures["max_off_in_sd"] or 9.0) < 2.0


def test_computing_says_how_long_and_how_much(tmp_path: Path, rig: Rig) -> None:
    short = sketch(tmp_path, "rest", 1.0)
    figures = scenarios.computing(short, rig, minutes=0.1)
    assert figures["datagrams"] == 6 * 80
    assert all((value := figures[key]) is not None and value > 0.0 for key in ("median_us", "cpu_median_us"))
    assert figures["p99_us"] is not None and figures["median_us"] is not None
    assert figures["p99_us"] >= figures["median_us"] and np.isfinite(figures["objects_growth"] or 0.0)


def test_figures_are_gathered_each_in_its_way() -> None:
    keys = ("tips_mm", "tips_max_mm", "swaps", "lag_ms", "error_at_1s_percent", "x_after_s")
    runs = [dict(zip(keys, values, strict=True)) for values in ((3.0, 9.0, 1.0, -1.0, -5.0, 3.0),
                                                                (4.0, 7.0, 2.0, 3.0, 4.0, None))]
    assert list(scenarios.gather(runs).values()) == [pytest.approx(np.sqrt(12.5)), 9.0, 3.0, 1.0, -5.0, None]


def test_a_hand_is_shown_nearer_to_where_it_is_when_it_is_predicted(grasp: DataSet) -> None:
    track = tracked(grasp.records(), rig_with(grasp.rig, MODEL))
    track = track.where(track.times_s >= 1.0)
    worn = worn_by(grasp.rig)
    figures = accuracy(track, deviations(track, grasp.truth, worn), grasp.truth, worn)
    assert (figures["tip_predicted_mm"] or 9.0) < 0.5 * (figures["tip_display_mm"] or 0.0)
    assert tracked(grasp.records(), rig_with(grasp.rig, CLASSIC)).predicted is None
