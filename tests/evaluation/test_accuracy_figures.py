"""Figures of a track against the truth, and of several runs together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shipped_rig import TWO_PIS
from synthetic_track import LATE_S, WORN, make_track, make_truth

from rhot_app.evaluation.accuracy import accuracy, deviations, display_error, pooled, predicted, ratio, squares, worn_by
from rhot_app.evaluation.compare import COLUMNS, Comparison, Judged, Run, consistency_table, table
from rhot_app.evaluation.track import Predicted, TrackedStates
from rhot_app.simulator.film.truth import Truth
from rhot_app.state import Knowledge

TIMES = np.arange(0.5, 3.5, 0.025)


def judge(track: TrackedStates, truth: Truth) -> Judged:
    off = deviations(track, truth, WORN)
    return Judged(accuracy(track, off, truth, WORN), squares(track, off, WORN))


def test_known_offsets_come_out_as_they_went_in() -> None:
    truth = make_truth()
    figures = judge(make_track(truth, TIMES, off=2e-3), truth).figures
    for key in ("tip_visible_mm", "tip_measured_mm", "tip_all_mm", "tip_display_mm", "marker_mm"):
        assert figures[key] == pytest.approx(2.0), key
    assert figures["angles_deg"] == pytest.approx(np.degrees(0.1))
    assert figures["palm_turn_deg"] == pytest.approx(0.0, abs=1e-9)
    assert figures["states_per_s"] == pytest.approx(40.0)
    assert (figures["swaps"], figures["measured_share"]) == (0.0, 1.0)


def test_what_is_visible_counts_whatever_the_tracker_says_of_it() -> None:
    truth = make_truth()
    figures = judge(make_track(truth, TIMES, off=2e-3, knowledge=Knowledge.INFERRED), truth).figures
    assert figures["tip_visible_mm"] == pytest.approx(2.0)
    assert figures["tip_measured_mm"] is None
    hidden = make_truth(visible=0.5)
    figures = judge(make_track(hidden, TIMES, off=2e-3), hidden).figures
    assert figures["tip_visible_mm"] is None and figures["measured_share"] is None
    assert figures["tip_all_mm"] == pytest.approx(2.0)


def test_a_turned_palm_is_off_by_its_turn() -> None:
    truth = make_truth()
    track = make_track(truth, TIMES)
    turn = np.radians(10.0)
    track.world_from_palm[:, :2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    assert judge(track, truth).figures["palm_turn_deg"] == pytest.approx(10.0)


def test_a_display_shows_the_newest_state_received_of_a_hand_that_moved_on() -> None:
    truth = make_truth(lambda times: 0.5 * times)
    error = display_error(make_track(truth, TIMES), truth, WORN)
    ages = error / 0.5
    assert ages.min() >= LATE_S - 1e-6 and ages.max() <= LATE_S + 0.025 + 1e-6
    assert ages.max() - ages.min() > 0.015


def test_a_display_that_is_predicted_shows_a_hand_that_moves_on_where_it_is() -> None:
    truth = make_truth(lambda times: 0.5 * times)
    ticks = np.arange(0.0, 3.5, 1.0 / 60.0)
    tips = truth.markers_at(ticks)[:, :5] + np.array([1e-3, 0.0, 0.0])
    tips[100] = np.nan
    stated = np.tile(np.diag([0.3e-3, 1e-3, 1e-3])**2, (len(ticks), 5, 1, 1))
    track = replace(make_track(truth, TIMES), predicted=Predicted(ticks, tips, stated))
    error, _ = predicted(track, truth, WORN)
    assert np.nanmax(np.abs(error - [1e-3, 0.0, 0.0])) < 1e-9 and np.isnan(error).any(axis=(1, 2)).sum() == 1
    assert len(error) == ((ticks >= track.receive_s[0]) & (ticks <= track.receive_s[-1])).sum()
    figures = judge(track, truth).figures
    assert figures["tip_predicted_mm"] == pytest.approx(1.0) and (figures["tip_display_mm"] or 0.0) > 10.0
    assert figures["predicted_3_sd_share"] == pytest.approx(2.0 / 3.0), "along x it is 3.3 standard deviations off"
    assert judge(make_track(truth, TIMES), truth).figures["tip_predicted_mm"] is None


def test_runs_are_pooled_each_figure_in_its_way() -> None:
    one = {"tip_all_mm": 3.0, "swaps": 1.0, "states_per_s": 40.0, "measured_share": None}
    two = {"tip_all_mm": 4.0, "swaps": 2.0, "states_per_s": 60.0, "measured_share": None}
    assert pooled([one, two]) == {"tip_all_mm": pytest.approx(np.sqrt(12.5)), "swaps": 3.0, "states_per_s": 50.0,
                                  "measured_share": None}
    assert ratio(1.0, 2.0) == 0.5 and ratio(None, 2.0) is None and ratio(1.0, 0.0) is None


def test_tables_put_trackers_side_by_side() -> None:
    truth = make_truth()
    judged = {"classic": judge(make_track(truth, TIMES, off=2e-3), truth),
              "estimator": judge(make_track(truth, TIMES, off=1e-3, covariance=1e-6 * np.eye(3)), truth)}
    comparison = Comparison((Run("grasp", 1, judged), Run("grasp", 2, judged)))
    lines = table(comparison).splitlines()
    assert len(lines) == 5 and len({len(line) for line in lines}) == 1
    assert lines[-1].split()[:4] == ["grasp", "2.00", "1.00", "0.50"]
    assert all(column.heading in lines[0] for column in COLUMNS)
    honest = consistency_table(comparison).splitlines()
    assert honest[-2].split()[:5] == ["grasp", "classic", "-", "-", "-"], "no covariances, no figures"
    assert honest[-1].split()[2:5] == ["0.33", "1.00", "1.000"], "an error of one sigma in one of three axes"


def test_a_rig_says_which_fingers_wear_what() -> None:
    worn = worn_by(TWO_PIS)
    assert worn.tips.tolist() == worn.tip_fingers.tolist() == [0, 1, 2, 3, 4]
    assert worn.angles.tolist() == list(range(21))
