"""Windows, words, colours and rows without Qt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fake_engine import FakeEngine

from rhot_app.latency import STACKED
from rhot_app.state import LATENCY_STAGES, Condition, Knowledge
from rhot_app.ui.models import words
from rhot_app.ui.models.label_layout import Box, place_at_sides, place_labels
from rhot_app.ui.models.meters import LatencyWindow, LossMeter, RateRows, unused_frames
from rhot_app.ui.models.pacing import FramePacer
from rhot_app.ui.models.palette import SCHEMES, contrast, visible_on
from rhot_app.ui.models.rows import bytes_text, clock_text, marker_rows, node_row
from rhot_app.ui.models.series import Series, peaks_above, round_top, to_csv, usual_top
from rhot_node.wire.messages import MarkerFlag

SECOND = 1_000_000_000


@pytest.fixture
def engine():
    return FakeEngine(clock=lambda: 0.0)


def test_a_gap_in_a_series_is_a_row_of_nan():
    series = Series(("a",), gap_s=0.5)
    for t in (0, SECOND // 10, 3 * SECOND):
        series.append(t, np.array([1.0]))
    seconds, rows = series.window(3 * SECOND, 10.0)
    assert seconds[-1] == 0.0 and (np.diff(seconds) > 0).all()
    assert np.isnan(rows[2, 0]) and len(rows) == 4


def test_a_series_forgets_the_oldest_and_ignores_the_past():
    series = Series(("a",), capacity=3, gap_s=10.0)
    for t in (1, 2, 3, 4, 2):
        series.append(t * SECOND, np.array([float(t)]))
    assert series.window(4 * SECOND, 60.0)[1][:, 0].tolist() == [2.0, 3.0, 4.0]


def test_csv_has_units_and_empty_fields():
    text = to_csv(np.array([-0.1, 0.0]), np.array([[1.5, np.nan], [2.0, 3.0]]), ("thumb", "index"), "mm")
    assert text.splitlines() == ["time [s],thumb [mm],index [mm]", "-0.100,1.5,", "0.000,2,3"]


def test_latency_sums_each_state_before_taking_percentiles(engine):
    window = LatencyWindow(span_s=10.0)
    state = engine.state(1.0)
    for k in range(100):
        slow = dict.fromkeys(LATENCY_STAGES, 0.001)
        slow[STACKED[k % 2]] = 0.010  # either the first or the second stage is slow, never both
        window.add(replace(state, t_master_ns=SECOND + k, latency_s=slow))
    p50, p99 = window.summary(SECOND + 100)
    whole = 0.010 + (len(STACKED) - 1) * 0.001
    assert p99[-1] == pytest.approx(whole) and p50[-1] == pytest.approx(whole)
    assert p99[0] == pytest.approx(0.010) and p50[3] == pytest.approx(0.001)


def test_latency_without_states_is_unknown():
    assert np.isnan(LatencyWindow().summary(SECOND)[0]).all()


def test_losses_are_per_second_and_never_negative(engine):
    meter = LossMeter()
    first = engine.status(1.0)
    assert np.isnan(meter.per_second(first))
    engine.lost["right"] = 6
    assert meter.per_second(engine.status(3.0)) == pytest.approx(3.0)
    engine.lost["right"] = 0
    assert np.isnan(meter.per_second(engine.status(4.0)))


def test_silence_is_a_gap_in_the_rates(engine):
    rows = RateRows()
    rows.row(engine.status(0.0))
    assert rows.row(engine.status(2.0)).tolist() == [40.0, 40.0, 40.0]
    engine.running = False
    assert np.isnan(rows.row(engine.status(3.0))).all()


def test_what_piled_up_while_the_engine_started_is_no_rate(engine):
    rows = RateRows()
    rows.row(engine.status(0.0))
    assert np.isfinite(rows.row(engine.status(1.3))).all()
    burst = replace(engine.status(1.4), pid=4243, state_rate_hz=900.0)
    assert np.isnan(rows.row(burst)).all()
    assert np.isnan(rows.row(replace(engine.status(2.5), pid=4243))).all()
    assert rows.row(replace(engine.status(2.7), pid=4243))[0] == 40.0


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=lambda s: s.name)
def test_text_and_states_stand_out(scheme):
    for ground in (scheme.panel, scheme.window, scheme.raised):
        assert contrast(scheme.text, ground) >= 7.0
        assert contrast(scheme.muted, ground) >= 4.5
        for tone in ("good", "caution", "bad", "fault", "neutral", "accent"):
            assert contrast(scheme.tone(tone), ground) >= 3.0, (tone, ground)
    assert contrast(scheme.on_accent, scheme.accent) >= 4.5


def test_a_dark_marker_is_made_visible():
    assert visible_on("#000000", SCHEMES["dark"].panel) != "#000000"
    assert visible_on("#ffffff", SCHEMES["dark"].panel) == "#ffffff"


def test_a_spike_neither_flattens_the_plot_nor_is_hidden():
    seconds = np.linspace(-30.0, 0.0, 300)
    values = np.full(300, 0.5)
    values[100:112] = [3.0, 4.0, *[6.0] * 5, *[5.0] * 5]
    values[200] = 2.0
    top = round_top(usual_top(values), 0.5)
    assert 0.5 < top <= 1.0
    assert [peak.value for peak in peaks_above(seconds, values, top)] == [6.0, 2.0]
    assert peaks_above(seconds, values, 10.0) == []
    steady = np.linspace(0.1, 1.0, 300)
    assert usual_top(steady) == 1.0, "a range that is used all the time is shown whole"
    assert np.isnan(usual_top(np.full(3, np.nan))) and round_top(float("nan"), 0.5) == 0.5


def test_every_condition_has_its_own_word_and_shape():
    looks = [words.CONDITIONS[condition.value] for condition in Condition]
    assert len({look.shape for look in looks}) == len(looks)
    assert {look.word for look in looks} == {condition.value for condition in Condition}
    assert set(words.KNOWLEDGE) == set(Knowledge)
    assert words.condition_look("ODD").tone == "fault"


def test_every_stage_is_explained():
    assert all(words.tip(stage) for stage in STACKED)


@pytest.mark.parametrize(("hidden", "word"),
                         [({}, "ok"), ({"index": "right"}, "left only"), ({"index": "both"}, "lost")])
def test_a_marker_says_who_sees_it(engine, hidden, word):
    engine.hidden = hidden
    rows = {row.name: row for row in marker_rows(engine.state(1.0))}
    assert rows["index"].look.word == word
    assert rows["thumb"].look.word == "ok"


def test_a_half_hidden_marker_is_not_ok(engine):
    state = engine.state(1.0)
    flags = state.camera_flags.copy()
    flags[0, 1], flags[1, 2] = int(MarkerFlag.PARTIAL), int(MarkerFlag.AMBIGUOUS)
    looks = [row.look.word for row in marker_rows(replace(state, camera_flags=flags))]
    assert looks[:3] == ["ok", "half hidden", "ambiguous"]


def test_node_rows_carry_units(engine):
    row = node_row(engine.status(1.0).nodes[0])
    assert (row.rate, row.losses, row.clock) == ("40 /s", "", "clock ± 0.11 ms")
    text_node = replace(engine.status(1.0).nodes[0], text_datagrams=True, dropped={"length": 3})
    assert clock_text(text_node) == "no clock (text)"
    assert node_row(text_node).losses == "3 frames unused" and "3 × refused (length)" in node_row(text_node).tooltip


def test_a_frame_that_came_too_late_is_counted_once_and_a_healthy_node_has_no_losses(engine):
    node = replace(engine.status(1.0).nodes[0], received=4000, lost=3,
                   dropped={"time": 14, "clock_in_doubt": 90, "kernel_overflow": 3})
    assert unused_frames(node) == {"time": 14, "kernel_overflow": 3}
    node = replace(node, lost=0, dropped={"time": 14, "clock_in_doubt": 90})
    assert node_row(node).losses == "" and "14 × came too late" in node_row(node).tooltip
    assert node_row(replace(node, received=700)).losses == "14 frames unused"


def test_bytes_are_told_in_the_right_unit():
    assert [bytes_text(n) for n in (12, 3400, 5_600_000, 2_100_000_000)] == ["12 B", "3.4 kB", "5.6 MB", "2.1 GB"]


def test_labels_keep_clear_of_each_other():
    anchors = [(100.0, 100.0 + 2 * k) for k in range(6)]
    boxes = place_labels(anchors, [(50.0, 18.0)] * 6, (400.0, 300.0), 10.0)
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
    assert all(box.inside(400.0, 300.0) for box in boxes)
    assert Box(0, 0, 10, 10).overlaps(Box(9, 9, 5, 5)) and not Box(0, 0, 10, 10).overlaps(Box(10, 0, 5, 5))


def test_labels_at_the_sides_keep_order_and_clear_of_each_other():
    anchors = [(90.0, 70.0), (95.0, 70.0), (100.0, 71.0), (105.0, 69.0), (98.0, 120.0), (120.0, 75.0)]
    boxes = place_at_sides(anchors, [(50.0, 18.0)] * 6, (200.0, 150.0), 4.0)
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
    assert all(box.inside(200.0, 150.0) for box in boxes)
    for x in (4.0, 146.0):
        column = [k for k, box in enumerate(boxes) if box.x == x]
        assert len(column) == 3
        assert sorted(column, key=lambda k: boxes[k].y) == sorted(column, key=lambda k: anchors[k][1])
    assert boxes[0].nearest((90.0, 70.0))[0] == boxes[0].x + 50.0


def test_drawing_takes_no_more_than_its_share():
    pacer = FramePacer(most_hz=50.0, share=0.5)
    assert pacer.due(0.0)
    pacer.begin(0.0)
    assert not pacer.due(1.0)
    pacer.end(0.030)
    assert not pacer.due(0.055) and pacer.due(0.061)
    pacer.begin(0.061)
    pacer.end(0.062)
    assert not pacer.due(0.078) and pacer.due(0.082)


def test_a_frame_that_never_came_is_given_up():
    pacer = FramePacer()
    pacer.begin(0.0)
    pacer.give_up(0.2)
    assert not pacer.due(0.2)
    pacer.give_up(1.0)
    assert pacer.due(1.0)
