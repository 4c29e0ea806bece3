"""The ideal detector's log goes through the real door and says what the truth says, within its noise."""

from __future__ import annotations

import csv
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot_app.__main__ import main
from rhot_app.calibration.recorded_observations import read_observations
from rhot_app.errors import SimulatorError
from rhot_app.geometry.camera import CameraModel
from rhot_app.simulator.film.node_log import T0_MASTER_NS
from rhot_app.simulator.film.points import LOG_NAME, PointNoise, write_distances, write_points
from rhot_app.simulator.film.shot import make_shot
from rhot_app.simulator.film.truth import load_thing_truth, load_truth
from rhot_app.simulator.scene.scene import Scene, make_scene, twin_defaults
from rhot_app.simulator.scene.scene_description import BoardShow, MarkerShow


def scene(markers: str = "rich") -> Scene:
    return make_scene(msgspec.structs.replace(twin_defaults(), markers=markers), 4)


def test_every_marker_is_seen_where_it_was_at_its_own_rows_time(tmp_path: Path) -> None:
    noise = PointNoise(sigma_px=0.1, loss=0.05)
    write_points(make_shot(scene(), "grasp", 2.0), tmp_path / "take", noise)
    rig, table = read_observations(tmp_path / "take" / LOG_NAME)
    truth = load_truth(tmp_path / "take" / "truth.npz")
    assert len(rig.markers.ids) == 19
    for node, seen, frames in zip(rig.nodes, table.cameras, truth.cameras, strict=True):
        model = CameraModel.from_rig(node.intrinsics, node.pose)
        assert len(seen.times_ns) == 80
        errors = []
        for k in range(19):
            times_s = 1e-9 * (seen.times_ns[:, k] - T0_MASTER_NS)
            found = np.isfinite(seen.pixels[:, k, 0])
            places = truth.markers_at(times_s[found])[:, k]
            errors.append(seen.pixels[found, k] - model.project(places))
            assert (frames.visible[found, k] == 1.0).all()
        every = np.concatenate(errors)
        assert every.std() == pytest.approx(0.1, rel=0.08)
        assert np.abs(every.mean(axis=0)).max() < 0.02
        lost = 1.0 - len(every) / (80 * 19)
        assert 0.02 < lost < 0.15


def test_a_hidden_marker_is_in_no_log(tmp_path: Path) -> None:
    write_points(make_shot(scene("rhot6"), "grasp", 0.5, frozenset({"ring", "wrist"})), tmp_path / "take", PointNoise())
    rig, table = read_observations(tmp_path / "take" / LOG_NAME)
    hidden = [rig.markers.ids.index(name) for name in ("ring", "wrist")]
    truth = load_truth(tmp_path / "take" / "truth.npz")
    for seen, frames in zip(table.cameras, truth.cameras, strict=True):
        found = np.isfinite(seen.pixels[:, :, 0]).any(axis=0)
        assert not found[hidden].any() and found.sum() == 4 and not frames.visible[:, hidden].any()


@pytest.mark.parametrize("arguments", [["--show", "marker"], ["--show", "board"], ["--bare"], ["--depth-table", "40"]])
def test_what_has_no_markers_to_hide_is_refused(arguments: list[str], tmp_path: Path,
                                                capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", *arguments, "--hide", "thumb", "--seconds", "0.1", "--out", str(tmp_path / "take")]) == 2
    assert "--hide" in capsys.readouterr().err and list(tmp_path.iterdir()) == []


def test_a_single_marker_has_a_log_too(tmp_path: Path) -> None:
    write_points(make_shot(scene("rhot6"), MarkerShow(marker="ring", distance_m=0.3), 1.0), tmp_path / "take",
                 PointNoise(0.0, 0.0))
    _, table = read_observations(tmp_path / "take" / LOG_NAME)
    for seen in table.cameras:
        assert np.isfinite(seen.pixels[:, 3]).all() and np.isnan(np.delete(seen.pixels, 3, axis=1)).all()
    disparity = table.cameras[0].pixels[:, 3, 0].mean() - table.cameras[1].pixels[:, 3, 0].mean()
    truth = load_thing_truth(tmp_path / "take" / "truth.npz")
    focal = scene().intrinsics.fx
    assert focal * 0.075 / disparity == pytest.approx(truth.markers[:, 3, 2].mean(), rel=0.01)


def test_table_of_distances_follows_the_law_of_depth(tmp_path: Path) -> None:
    write_distances(scene("rhot6"), [0.2, 0.6, 1.5], tmp_path / "take", PointNoise(0.1))
    rows = list(csv.DictReader((tmp_path / "take" / "table.csv").open()))
    assert [row["real_cm"] for row in rows] == ["20", "60", "150"]
    for row in rows:
        expected = 100.0 * scene().intrinsics.fx * 0.075 / float(row["real_cm"])
        assert float(row["disparity_px"]) == pytest.approx(expected, rel=0.012), "but for the lens's distortion"
    with pytest.raises(SimulatorError, match="not at 1 cm"):
        write_distances(scene("rhot6"), [0.01], tmp_path / "other", PointNoise())


def test_a_board_wears_no_markers(tmp_path: Path) -> None:
    with pytest.raises(SimulatorError, match="there are no markers on it"):
        write_points(make_shot(scene("rhot6"), BoardShow(), 1.0), tmp_path / "take", PointNoise())
    assert list(tmp_path.iterdir()) == []
