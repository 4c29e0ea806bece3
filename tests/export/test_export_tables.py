"""CSV, Parquet and NPZ, read back by pandas, pyarrow and numpy: the states, in the units that the names say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pandas
import pyarrow.parquet
import pytest

from rhot_app.errors import ExportError
from rhot_app.export.export import export_log
from rhot_app.export.plan import ExportOptions
from rhot_app.export.resample import Resampler
from rhot_app.export.states import HandStates, joined
from rhot_app.hand.skeleton import ANGLES, FINGERS, JOINTS
from rhot_app.recording.raw_log import LogReader

AXES = "xyz"


def points(table: pandas.DataFrame, kind: str, names: tuple[str, ...], unit: str) -> np.ndarray:
    """(N, P, 3) of a table's columns."""
    columns = [f"{kind}_{name}_{axis}_{unit}" for name in names for axis in AXES]
    return table[columns].to_numpy(float).reshape(len(table), len(names), 3)


def test_csv_holds_the_states_of_the_estimator(log: Path, states_by: Callable[[str], HandStates],
                                                   tmp_path: Path) -> None:
    done = export_log(log, tmp_path / "a.csv", options=ExportOptions(tracker="estimator"))
    table, states = pandas.read_csv(done.path), states_by("estimator")
    assert len(table) == done.states == len(states) > 100
    assert list(table["t_master_ns"]) == list(states.t_master_ns)
    about = LogReader(log).about
    began_ns = round(1e6 * datetime.fromisoformat(about["created"]).timestamp()) * 1000
    assert list(table["t_unix_ns"] - table["t_master_ns"]) == [began_ns - about["created_t_master_ns"]] * len(table)
    assert list(table["condition"]) == list(states.conditions)
    assert table["time_s"].to_numpy() == pytest.approx(states.times_s, abs=1e-8)
    for kind, names, positions in (("joint", JOINTS, states.joint_positions), ("fingertip", FINGERS,
                                   states.fingertip_positions), ("marker", states.marker_ids, states.marker_positions)):
        assert points(table, kind, names, "mm") == pytest.approx(1e3 * positions, abs=1e-4, nan_ok=True)
    for index, angle in enumerate(ANGLES):
        assert table[f"angle_{angle}_deg"].to_numpy() == pytest.approx(np.degrees(states.angles[:, index]), abs=1e-4,
                                                                       nan_ok=True)
    variance = table["joint_index_tip_cov_xz_mm2"].to_numpy()
    assert np.nanmax(np.abs(variance)) > 0.0
    assert variance == pytest.approx(1e6 * states.joint_covariances[:, JOINTS.index("index_tip"), 0, 2], rel=1e-5,
                                     nan_ok=True)
    assert table["palm_cov_x_rx_mm_rad"].to_numpy() == pytest.approx(1e3 * states.palm_covariance[:, 0, 3], rel=1e-5,
                                                                     nan_ok=True)


def test_what_is_unknown_is_an_empty_cell(log: Path, tmp_path: Path) -> None:
    path = export_log(log, tmp_path / "a.csv", options=ExportOptions(tracker="classic")).path
    head, first, *_ = path.read_text().splitlines()
    row = dict(zip(head.split(","), first.split(","), strict=True))
    assert row["condition"] == "SEARCHING"
    assert row["joint_wrist_x_mm"] == row["joint_wrist_cov_xx_mm2"] == row["angle_thumb_ip_flexion_deg"] == ""
    assert "nan" not in path.read_text()


def test_metres_and_the_wrists_frame(log: Path, states: HandStates, tmp_path: Path) -> None:
    options = ExportOptions(tracker="classic", units="m", frame="wrist")
    table = pandas.read_csv(export_log(log, tmp_path / "a.csv", options=options).path)
    found = points(table, "joint", JOINTS, "m")
    known = np.flatnonzero(np.isfinite(states.joint_positions[:, 0, 0]))
    assert np.abs(found[known, 0]).max() < 1e-6, "the wrist is the origin"
    for number in known[::9]:
        palm_from_world = np.linalg.inv(states.world_from_palm[number])
        expected = states.joint_positions[number] @ palm_from_world[:3, :3].T + palm_from_world[:3, 3]
        assert found[number] == pytest.approx(expected, abs=1e-6)
    knuckle = found[known, JOINTS.index("middle_mcp")]
    assert (knuckle[:, 0] > 0.06).all() and np.abs(knuckle[:, 1]).max() < 0.01, "+x runs to the middle knuckle"
    assert table["joint_index_tip_cov_xx_m2"].isna().all(), "covariances of differences are not known"


def test_a_rate_gives_equal_intervals_and_leaves_the_gap(gappy: Path, gappy_states: HandStates, tmp_path: Path) -> None:
    options = ExportOptions(tracker="classic", rate_hz=100.0)
    table = pandas.read_csv(export_log(gappy, tmp_path / "a.csv", options=options).path)
    assert np.diff(table["time_s"]) == pytest.approx(0.01, abs=1e-8)
    pauses = np.diff(gappy_states.times_s)
    begin, end = gappy_states.times_s[np.argmax(pauses):][:2]
    assert end - begin > 0.6
    inside = (table["time_s"] > begin + 1e-6) & (table["time_s"] < end - 1e-6)
    assert table.loc[inside, "joint_wrist_x_mm"].isna().all() and (table.loc[inside, "condition"] == "LOST").all()
    known = table[~inside & table["joint_wrist_x_mm"].notna()]
    expected = np.interp(known["time_s"], gappy_states.times_s, 1e3 * gappy_states.joint_positions[:, 0, 0])
    assert len(known) > 90 and known["joint_wrist_x_mm"].to_numpy() == pytest.approx(expected, abs=1e-3)


def paused(states: HandStates, pause_s: float) -> HandStates:
    """The later half of the states after a pause."""
    late = np.arange(len(states)) >= len(states) // 2
    return replace(states, t_master_ns=states.t_master_ns + np.where(late, round(1e9 * pause_s), 0))


def test_a_long_pause_comes_in_pieces_and_a_day_of_it_is_refused(states: HandStates) -> None:
    pieces = list(Resampler(100.0, 1.0 / 40.0).take(paused(states, 300.0)))
    assert max(map(len, pieces)) < 10_000
    whole = joined(pieces)
    assert len(whole) == pytest.approx(100 * (300.0 + states.times_s[-1]), abs=2) and np.ptp(
        np.diff(whole.t_master_ns)) == 0
    assert np.count_nonzero(whole.tracked) == pytest.approx(100 * states.times_s[-1], rel=0.1)
    with pytest.raises(ExportError, match=r"22:13:20 h.*8000\d{3} empty states.*without a rate"):
        list(Resampler(100.0, 1.0 / 40.0).take(paused(states, 80_000.0)))


def test_parquet_holds_the_same_columns_and_says_what_it_is(log: Path, states: HandStates, tmp_path: Path) -> None:
    options = ExportOptions(tracker="classic")
    file = pyarrow.parquet.ParquetFile(export_log(log, tmp_path / "a.parquet", options=options).path)
    table = file.read().to_pandas()
    header = export_log(log, tmp_path / "a.csv", options=options).path.read_text().splitlines()[0]
    assert list(table.columns) == header.split(",")
    assert points(table, "joint", JOINTS, "mm") == pytest.approx(1e3 * states.joint_positions, rel=1e-6, nan_ok=True)
    about = file.schema_arrow.metadata
    assert about[b"rhot.units"] == b"mm" and about[b"rhot.tracker"] == b"classic" and about[b"rhot.up"] == b"-y"


def test_npz_holds_the_arrays_themselves(log: Path, states: HandStates, tmp_path: Path) -> None:
    done = export_log(log, tmp_path / "a.npz", options=ExportOptions(tracker="classic"))
    with np.load(done.path) as file:
        assert file["times_s"] == pytest.approx(states.times_s)
        assert tuple(file["joint_names"]) == JOINTS and tuple(file["marker_ids"]) == states.marker_ids
        for name in ("joint_positions", "marker_covariances", "angles", "world_from_palm"):
            assert file[name] == pytest.approx(getattr(states, name), rel=1e-6, abs=1e-9, nan_ok=True)
        assert (file["joint_knowledge"] == states.joint_knowledge).all()
        assert str(file["about_units"]) == "m"
    scaled = export_log(log, tmp_path / "b.npz", options=ExportOptions(tracker="classic", units="mm"))
    with np.load(scaled.path) as file:
        assert file["joint_positions"] == pytest.approx(1e3 * states.joint_positions, rel=1e-6, nan_ok=True)
        assert file["world_from_palm"][:, :3, 3] == pytest.approx(1e3 * states.world_from_palm[:, :3, 3], rel=1e-6,
                                                                  nan_ok=True)
        assert file["world_from_palm"][:, :3, :3] == pytest.approx(states.world_from_palm[:, :3, :3], rel=1e-6,
                                                                   abs=1e-7, nan_ok=True)


def test_a_data_frame_is_the_table(states: HandStates) -> None:
    frame = states.to_dataframe(units="m")
    assert points(frame, "fingertip", FINGERS, "m") == pytest.approx(states.fingertip_positions, nan_ok=True)
    assert frame["time_s"].iloc[0] == 0.0
