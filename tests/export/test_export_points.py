"""TRC and C3D, read back by pandas, ezc3d and the package c3d: places, axes, units and gaps."""

from __future__ import annotations

from pathlib import Path

import c3d
import ezc3d
import msgspec
import numpy as np
import pandas
import pytest

from rhot_app.__main__ import main
from rhot_app.export.export import export_log
from rhot_app.export.formats.points import C3D_FRAMES_MAX, C3dWriter
from rhot_app.export.plan import ExportOptions, Plan
from rhot_app.export.states import HandStates
from rhot_app.hand.skeleton import ANGLES, JOINTS
from rhot_app.recording.raw_log import LogReader

CLASSIC = ExportOptions(tracker="classic")


def at(states: HandStates, times_s: np.ndarray, joint: str) -> np.ndarray:
    """(T, 3) m of a joint, between the states."""
    place = states.joint_positions[:, JOINTS.index(joint)]
    known = np.isfinite(place[:, 0])
    return np.column_stack([np.interp(times_s, states.times_s[known], column) for column in place[known].T])


def read_trc(path: Path) -> tuple[dict[str, str], list[str], pandas.DataFrame]:
    """Header, names of points, and the numbers."""
    lines = path.read_text().split("\n")
    facts = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=True))
    names = [name for name in lines[3].split("\t")[2:] if name]
    assert lines[5] == "", "a blank line before the numbers"
    table = pandas.read_csv(path, sep="\t", skiprows=4)  # the axes' names count the columns, as for pose2sim
    return facts, names, table.set_axis(range(table.shape[1]), axis=1)


def test_trc_is_y_up_in_millimetres(log: Path, states: HandStates, tmp_path: Path) -> None:
    facts, names, table = read_trc(export_log(log, tmp_path / "a.trc", options=CLASSIC).path)
    assert (facts["DataRate"], facts["Units"]) == ("40", "mm")
    assert int(facts["NumFrames"]) == len(table) and int(facts["NumMarkers"]) == len(names)
    assert table.shape[1] == 2 + 3 * len(names)
    times = table[1].to_numpy()
    assert np.diff(times) == pytest.approx(1.0 / 40.0, abs=1e-5)
    first = 2 + 3 * names.index("index_tip")
    found = table[[first, first + 1, first + 2]].to_numpy()
    expected = 1e3 * at(states, times, "index_tip") * [1.0, -1.0, -1.0]  # the rig's y points down, its z away
    known = np.isfinite(found[:, 0])
    assert known.sum() > 60 and found[known] == pytest.approx(expected[known], abs=1e-3)


@pytest.fixture(scope="module")
def gappy_trc(gappy: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_log(gappy, tmp_path_factory.mktemp("trc") / "a.trc", options=CLASSIC).path


def test_a_gap_of_trc_is_nan_in_every_cell(gappy_trc: Path) -> None:
    """Readers drop an empty last cell (OpenSim), or count a surplus one as a column (pandas)."""
    lines = gappy_trc.read_text().split("\n")
    rows = [line.split("\t") for line in lines[6:] if line]
    assert {len(row) for row in rows} == {len(lines[4].split("\t"))} and all(all(row) for row in rows)
    inside = [row for row in rows if 0.8 < float(row[1]) < 1.2]
    assert len(inside) > 10 and all(cell == "NaN" for row in inside for cell in row[2:])


def test_opensim_reads_trc(gappy_trc: Path) -> None:
    opensim = pytest.importorskip("opensim", reason="pip install opensim (220 MB) reads the files back")
    table = opensim.TimeSeriesTableVec3(str(gappy_trc))
    _, names, own = read_trc(gappy_trc)
    assert list(table.getColumnLabels()) == names and table.getTableMetaDataString("Units") == "mm"
    found = [[table.getRowAtIndex(row)[point][axis] for point in range(len(names)) for axis in range(3)]
             for row in range(table.getNumRows())]
    assert np.array(found) == pytest.approx(own.to_numpy()[:, 2:], nan_ok=True)


def test_pose2sim_reads_trc(gappy_trc: Path) -> None:
    common = pytest.importorskip("Pose2Sim.common", reason="pip install pose2sim reads the files back")
    points, frames, times, names, _ = common.read_trc(str(gappy_trc))
    _, own_names, own = read_trc(gappy_trc)
    assert names == own_names and frames.to_list() == own[0].to_list() and times.to_list() == own[1].to_list()
    assert points.to_numpy() == pytest.approx(own.to_numpy()[:, 2:], nan_ok=True)


def test_c3d_is_z_up_with_angles_beside(log: Path, states: HandStates, tmp_path: Path) -> None:
    path = export_log(log, tmp_path / "a.c3d", options=CLASSIC).path
    file = ezc3d.c3d(str(path))
    parameters = file["parameters"]
    assert parameters["POINT"]["UNITS"]["value"] == ["mm"] and parameters["POINT"]["RATE"]["value"] == [40.0]
    assert parameters["POINT"]["Y_SCREEN"]["value"] == ["+Z"]
    labels = parameters["POINT"]["LABELS"]["value"]
    found = file["data"]["points"][:3, labels.index("index_tip")].T
    times = np.arange(len(found)) / 40.0
    expected = 1e3 * at(states, times, "index_tip")[:, [0, 2, 1]] * [1.0, 1.0, -1.0]
    known = np.isfinite(found[:, 0])
    assert known.sum() > 60 and found[known] == pytest.approx(expected[known], abs=2e-3)
    assert parameters["ANALOG"]["LABELS"]["value"] == list(ANGLES)
    bends = file["data"]["analogs"][0, ANGLES.index("index_pip_flexion")]
    inner = np.isfinite(states.angles[:, 0])
    assert bends[known] == pytest.approx(np.degrees(np.interp(
        times[known], states.times_s[inner], states.angles[inner, ANGLES.index("index_pip_flexion")])), abs=1e-2)


def test_another_reader_of_c3d_agrees_and_sees_the_gap(gappy: Path, gappy_states: HandStates, tmp_path: Path) -> None:
    path = export_log(gappy, tmp_path / "a.c3d", options=CLASSIC).path
    with path.open("rb") as file:
        reader = c3d.Reader(file)
        labels = [label.strip() for label in reader.point_labels]
        frames = np.array([points for _, points, _ in reader.read_frames()])
        assert reader.point_rate == 40.0
    wrist = frames[:, labels.index("wrist")]
    times = np.arange(len(wrist)) / 40.0
    inside = (times > 0.8) & (times < 1.2)
    assert (wrist[inside, 3] == -1.0).all()
    known = wrist[:, 3] >= 0.0
    expected = 1e3 * at(gappy_states, times, "wrist")[:, [0, 2, 1]] * [1.0, 1.0, -1.0]
    assert known.sum() > 30 and wrist[known, :3] == pytest.approx(expected[known], abs=2e-3)


def test_readers_of_c3d_count_all_frames_of_the_longest_file(log: Path, states: HandStates, tmp_path: Path) -> None:
    rig, first_ns = LogReader(log).rig, int(states.t_master_ns[0])
    writer = C3dWriter(Plan(tmp_path / "a.c3d", rig, "rig", "mm", "hand", 40.0, log.name, "x" * 300, first_ns))
    block = states.where(np.full(C3D_FRAMES_MAX // 7, 40))
    for _ in range(7):
        writer.add(block)
    writer.finish()
    assert ezc3d.c3d(str(tmp_path / "a.c3d"))["data"]["points"].shape[2] == 7 * len(block) == C3D_FRAMES_MAX
    with (tmp_path / "a.c3d").open("rb") as file:
        reader = c3d.Reader(file)
        assert reader.frame_count == C3D_FRAMES_MAX and next(reader.read_frames())[0] == 1


def test_a_longer_c3d_file_is_refused_with_the_longest_length(
        log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("rhot_app.export.formats.points.C3D_FRAMES_MAX", 500)
    out = tmp_path / "a.c3d"
    assert main(["export", str(log), "--out", str(out), "--tracker", "classic", "--rate", "1000"]) == 2
    error = capsys.readouterr().err
    assert "500 frames" in error and "0.5 s at 1000 Hz" in error and "--rate" in error and not out.exists()
    assert main(["export", str(log), "--out", str(out), "--tracker", "classic", "--rate", "100"]) == 0


def test_a_table_frame_is_turned_less(log: Path, states: HandStates, tmp_path: Path) -> None:
    """Where the rig's z points up, C3D has the rig's own axes and TRC those with z for y."""
    rig = msgspec.structs.replace(LogReader(log).rig, up="z")
    file = ezc3d.c3d(str(export_log(log, tmp_path / "a.c3d", rig=rig, options=CLASSIC).path))
    index = file["parameters"]["POINT"]["LABELS"]["value"].index("wrist")
    found = file["data"]["points"][:3, index].T
    times, known = np.arange(len(found)) / 40.0, np.isfinite(found[:, 0])
    expected = 1e3 * at(states, times, "wrist")
    assert found[known] == pytest.approx(expected[known], abs=2e-3)
    _, names, table = read_trc(export_log(log, tmp_path / "a.trc", rig=rig, options=CLASSIC).path)
    first = 2 + 3 * names.index("wrist")
    turned = table[[first, first + 1, first + 2]].to_numpy()
    assert turned[known] == pytest.approx(expected[known][:, [0, 2, 1]] * [1.0, 1.0, -1.0], abs=2e-3)


def test_a_points_residual_is_its_standard_deviation(log: Path, tmp_path: Path) -> None:
    path = export_log(log, tmp_path / "a.c3d", options=ExportOptions(tracker="estimator")).path
    residuals = ezc3d.c3d(str(path))["data"]["meta_points"]["residuals"][0]
    known = residuals[JOINTS.index("index_tip")]
    assert 0.05 < np.median(known[known > 0.0]) < 10.0
