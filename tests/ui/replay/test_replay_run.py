"""A log tracked at once: the same states every time, and what can be read of a broken one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from patience import eventually

from rhot_app.errors import RecordingError
from rhot_app.project import Rig, with_tracker
from rhot_app.recording.raw_log import LogReader, Record, RecordKind, encode_header, encode_record
from rhot_app.recording.recorder import Recorder
from rhot_app.simulator.film.node_log import T0_MASTER_NS
from rhot_app.state import Condition
from rhot_app.ui.replay.run import LOST, NO_STATE, PARTIAL, TRACKING, Run, condition_bins, new_run_path, track_log
from rhot_app.ui.replay.session import Comparison, Replay, TrackerChoice, nearest


def rig_of(log: Path) -> Rig:
    reader = LogReader(log)
    reader.close()
    return reader.rig


def tracked(log: Path, rig: Rig, out: Path) -> Run:
    return Run(track_log(log, rig, out), out)


@pytest.mark.parametrize("kind", ["classic", "estimator"])
def test_the_same_settings_give_the_same_bytes(grasp_log, tmp_path, kind):
    rig = with_tracker(rig_of(grasp_log), kind)
    first, second = (tmp_path / name for name in ("1.states", "2.states"))
    states = track_log(grasp_log, rig, first)
    track_log(grasp_log, rig, second)
    assert len(states.times_ns) > 100 and first.read_bytes() == second.read_bytes()


def test_states_are_found_by_their_numbers(run):
    assert len(run) > 100 and list(run.times_s) == sorted(run.times_s)
    last = run.state(len(run) - 1)
    assert last.t_master_ns == run.tracked.times_ns[-1]
    np.testing.assert_array_equal(last.fingertip_positions, run.tracked.fingertips[-1])
    assert run.state(0).condition in Condition and set(last.latency_s) <= {"detect", "network"}
    assert np.isfinite(run.tracked.jitter[-1]).any() and run.tracked.jitter.shape[1] == len(run.rig.markers.markers)


def test_the_file_of_a_run_has_no_name_while_it_is_used(grasp_log, tmp_path):
    run = tracked(grasp_log, rig_of(grasp_log), new_run_path(tmp_path / "runs", 1))
    assert not list((tmp_path / "runs").iterdir()) and run.state(3).sequence == run.state(2).sequence + 1
    run.close()


def test_a_torn_log_is_played_as_far_as_it_goes(grasp_log, tmp_path, run):
    log = tmp_path / "torn.rhotlog"
    log.write_bytes(grasp_log.read_bytes()[:-7])
    torn = tracked(log, rig_of(log), tmp_path / "a")
    assert "are torn" in torn.tracked.note and str(log) in torn.tracked.note
    assert 0 <= len(run) - len(torn) <= 2


def test_a_damaged_log_is_played_without_the_damage(grasp_log, tmp_path, run):
    log, data = tmp_path / "damaged.rhotlog", bytearray(grasp_log.read_bytes())
    data[len(data) // 2] ^= 1
    log.write_bytes(data)
    damaged = tracked(log, rig_of(log), tmp_path / "a")
    assert "1 damaged place was skipped" in damaged.tracked.note and str(log) in damaged.tracked.note
    assert len(run) - 3 <= len(damaged) < len(run) + 1 and damaged.data(20) == run.data(20)


def test_an_empty_log_is_refused_in_a_sentence_and_leaves_nothing(grasp_log, tmp_path):
    log, out = tmp_path / "empty.rhotlog", tmp_path / "a"
    log.write_bytes(encode_header(rig_of(grasp_log), {}))
    with pytest.raises(RecordingError, match=r"empty\.rhotlog: it holds no datagrams"):
        track_log(log, rig_of(log), out)
    log.write_bytes(encode_header(rig_of(grasp_log), {}) + encode_record(Record(RecordKind.DATAGRAM, 1, 5, b"?")))
    with pytest.raises(RecordingError, match="no state could be made of its 1 datagrams"):
        track_log(log, rig_of(log), out)
    assert not out.exists()


def test_a_cancel_leaves_no_file(grasp_log, tmp_path):
    def stop(text: str, fraction: float) -> None:
        if fraction > 0.3:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        track_log(grasp_log, rig_of(grasp_log), tmp_path / "a", progress=stop)
    assert not list(tmp_path.iterdir())


def test_a_bar_shows_the_worst_of_each_part_and_where_there_is_nothing():
    times = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 5.0, 9.9])
    codes = np.array([TRACKING, TRACKING, LOST, TRACKING, PARTIAL, TRACKING, PARTIAL], np.int8)
    assert condition_bins(times, codes, 10.0, 10).tolist() == [
        LOST, NO_STATE, NO_STATE, NO_STATE, NO_STATE, TRACKING, NO_STATE, NO_STATE, NO_STATE, PARTIAL]
    assert condition_bins(times[:1], codes[:1], 0.0, 3).tolist() == [NO_STATE] * 3
    slow = condition_bins(np.arange(0.0, 10.0, 0.25), np.zeros(40, np.int8), 10.0, 200)
    assert (slow == TRACKING).all(), "sparse states of a short recording leave no holes"


def test_two_runs_are_compared_at_the_same_instants(grasp_log, tmp_path, run):
    rig = with_tracker(rig_of(grasp_log), "estimator")
    other = tracked(grasp_log, rig, tmp_path / "a")
    itself, both = Comparison(run.tracked, run.tracked), Comparison(run.tracked, other.tracked)
    assert np.nanmax(itself.differences_mm) == 0.0 and itself.partner(7) == 7
    number = len(run) // 2
    mate = both.partner(number)
    assert mate is not None and abs(other.tracked.times_ns[mate] - run.tracked.times_ns[number]) < 20_000_000
    by_hand = np.linalg.norm(run.state(number).fingertip_positions - other.state(mate).fingertip_positions, axis=1)
    np.testing.assert_allclose(both.differences_mm[number], 1e3 * by_hand)
    median, most = both.percentiles_mm(50.0, 100.0)
    assert (median > 0.0).all() and (median < 10.0).all() and (most >= median).all()


def test_instants_without_a_partner_are_not_compared():
    assert nearest(np.array([0, 4, 6, 99]), np.array([1, 5, 7])).tolist() == [0, 1, 1, 2]


def test_a_plot_of_many_states_keeps_the_peaks(run):
    comparison = Comparison(run.tracked, run.tracked)
    comparison.differences_mm[:] = 1.0
    comparison.differences_mm[7, 2], comparison.differences_mm[8] = 9.0, np.nan
    times, rows = comparison.highest_mm(round(1e9))
    assert np.diff(times).min() > 0.9e9 and rows[0].tolist() == [1.0, 1.0, 9.0, 1.0, 1.0]
    assert (rows[1:] == 1.0).all() and 3 <= len(rows) <= 6


def test_a_disk_without_room_for_the_states_is_said(grasp_log):
    if not Path("/dev/full").exists():
        pytest.skip("needs /dev/full")

    class Full(type(Path())):
        def unlink(self, missing_ok: bool = False) -> None:
            pass  # the device stays

    with pytest.raises(RecordingError, match=r"cannot be written \(No space left"):
        track_log(grasp_log, rig_of(grasp_log), Full("/dev/full"))


def test_runs_are_exchanged_and_compared_anew(grasp_log, tmp_path):
    rig = rig_of(grasp_log)
    first, second, third = (tracked(grasp_log, rig, tmp_path / name) for name in "abc")
    replay = Replay(grasp_log, first, TrackerChoice())
    made = Comparison(first.tracked, second.tracked)
    replay.compare(second, TrackerChoice("estimator"), made)
    assert replay.comparison is made and replay.differences is not None
    replay.player.seek(1.0)
    replay.use(third, TrackerChoice(), made)
    assert replay.comparison is not made and replay.comparison.of == (third.tracked, second.tracked)
    assert abs(replay.player.position_s - 1.0) < 1e-6
    state, partner = replay.shown()
    assert state is not None and partner is not None and state.t_master_ns == partner.t_master_ns
    replay.compare(None)
    assert replay.comparison is replay.differences is None and replay.shown()[1] is None
    replay.close()


def test_a_recording_under_way_is_played_so_far(grasp_log, tmp_path):
    reader = LogReader(grasp_log)
    recorder = Recorder(tmp_path / "now.rhotlog", reader.rig)
    for record in reader:
        recorder.put(record.kind, record.node_id, record.t_master_ns, record.data)
    eventually(lambda: recorder.bytes_written > 0.9 * grasp_log.stat().st_size)
    try:
        run = tracked(recorder.path, reader.rig, tmp_path / "a")
    finally:
        recorder.close()
        reader.close()
    assert len(run) > 100 and "still being recorded" in run.tracked.note
    assert tracked(recorder.path, reader.rig, tmp_path / "a").tracked.note == ""


def test_a_smoothed_run_is_nearer_to_the_truth_and_the_classic_tracker_is_refused(grasp_take, grasp_log, tmp_path):
    rig = with_tracker(rig_of(grasp_log), "estimator")
    filtered, smoothed = (track_log(grasp_log, rig, tmp_path / str(smooth), smooth) for smooth in (False, True))
    assert np.isin(smoothed.times_ns, filtered.times_ns).mean() > 0.95
    assert len(smoothed.times_ns) == pytest.approx(len(filtered.times_ns), abs=2)
    off = [np.linalg.norm(run.fingertips - grasp_take.truth.markers_at(1e-9 * (run.times_ns - T0_MASTER_NS))[:, :5],
                          axis=2) for run in (filtered, smoothed)]
    assert np.sqrt(np.nanmean(off[1] ** 2)) < 0.8 * np.sqrt(np.nanmean(off[0] ** 2))
    with pytest.raises(RecordingError, match="only the estimator smooths"):
        track_log(grasp_log, with_tracker(rig, "classic"), tmp_path / "c", True)
