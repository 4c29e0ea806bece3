"""Filming to disk: complete recordings that a node can open and that agree with the truth, or nothing at all."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot_app.errors import SimulatorError
from rhot_app.project import load_rig
from rhot_app.simulator.film.film import film
from rhot_app.simulator.film.shot import Shot, make_shot, read_shot
from rhot_app.simulator.film.truth import load_truth
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_node.capture.yuv import YuvRecording, read_header
from rhot_node.clock import NodeClock
from rhot_node.config import load_settings

SMALL = {"width": 320, "height": 240}


def small_shot(motion: str = "wave", seconds: float = 0.15, hidden: frozenset[str] = frozenset()) -> Shot:
    """A short shot of few pixels."""
    settings = twin_defaults()
    wide = msgspec.structs.replace(settings.presets["wide"], **SMALL)
    return make_shot(make_scene(msgspec.structs.replace(settings, presets={"wide": wide}), 7), motion, seconds, hidden)


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Shot, Path]:
    """A finished folder."""
    shot, folder = small_shot(hidden=frozenset({"ring"})), tmp_path_factory.mktemp("film") / "take"
    film(shot, folder)
    return shot, folder


def test_folder_holds_both_recordings_truth_rig_and_shot(filmed: tuple[Shot, Path]) -> None:
    shot, folder = filmed
    assert sorted(path.name for path in folder.iterdir()) == [
        "left", "left.json", "rig.json", "right", "right.json", "shot.json", "truth.npz"]
    truth = load_truth(folder / "truth.npz")
    for index, name in enumerate(("left", "right")):
        header = read_header(folder / name)
        assert (header.width, header.height, header.row_time_ns) == (320, 240, 48_000)
        assert header.times_ns == shot.scene.frame_times_ns(index, shot.seconds)
        np.testing.assert_allclose(1e9 * truth.cameras[index].times_s, header.times_ns, atol=1)
        assert truth.cameras[index].visible.shape == (len(header.times_ns), 6)
    assert load_rig(folder / "rig.json").nodes[1].pose.translation_m[0] == pytest.approx(0.075)
    assert read_shot(folder)[1].seed == 7


def test_node_settings_fit_the_rig_and_share_no_port(filmed: tuple[Shot, Path]) -> None:
    _, folder = filmed
    rig = load_rig(folder / "rig.json")
    nodes = [load_settings(folder / f"{node.name}.json") for node in rig.nodes]
    for node, settings in zip(rig.nodes, nodes, strict=True):
        assert (node.node_id, node.address, settings.bind_address) == (settings.node_id, "127.0.0.1", "127.0.0.1")
        assert (node.udp_port, node.control_port, node.preview_port) == (
            settings.udp_port, settings.control_port, settings.preview_port)
    ports = [port for one in nodes for port in (one.udp_port, one.control_port, one.preview_port)]
    assert len(set(ports)) == 6 and not {47799, 47800, 47801, 47802} & set(ports)


def test_markers_are_seen_where_the_truth_projects_them(filmed: tuple[Shot, Path]) -> None:
    shot, folder = filmed
    truth, markers = load_truth(folder / "truth.npz"), shot.scene.markers.markers
    for index, name in enumerate(("left", "right")):
        camera, recording = shot.scene.camera(index), YuvRecording(folder / name, NodeClock())
        frame = recording.read(2.0)
        assert frame is not None
        cb, cr = (plane.astype(np.float64) - 128.0 for plane in (frame.image.u, frame.image.v))
        t_row0 = truth.cameras[index].times_s[frame.number]
        for k, marker in enumerate(markers):
            seen = t_row0 + 120 * 48e-6
            for _ in range(3):
                x, y = camera.project(truth.markers_at(np.array([seen]))[0, k])[0]
                seen = t_row0 + y * 48e-6
            column, line = round((x - 0.5) / 2), round((y - 0.5) / 2)
            hue = np.arctan2(cr[line, column], cb[line, column])
            apart = abs((hue - marker.chroma.hue_rad + np.pi) % (2 * np.pi) - np.pi)
            magnitude = np.hypot(cb[line, column], cr[line, column])
            alike = apart < np.radians(marker.chroma.hue_tolerance_deg) and magnitude > marker.chroma.magnitude_min
            assert alike == (marker.id != "ring"), marker.id
        recording.close()
    assert (truth.cameras[0].visible[:, 3] == 0.0).all(), "the ring finger is not painted"


def test_interrupted_film_leaves_nothing(tmp_path: Path) -> None:
    def interrupt(_done: int, _total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        film(small_shot(seconds=5.0), tmp_path / "take", interrupt)
    assert list(tmp_path.iterdir()) == []


def test_existing_or_homeless_folders_are_refused_untouched(tmp_path: Path) -> None:
    (tmp_path / "take").mkdir()
    (tmp_path / "take" / "mine.txt").write_text("keep")
    with pytest.raises(SimulatorError, match="exists already"):
        film(small_shot(), tmp_path / "take")
    assert (tmp_path / "take" / "mine.txt").read_text() == "keep"
    with pytest.raises(SimulatorError, match="nowhere"):
        film(small_shot(), tmp_path / "nowhere" / "take")
    with pytest.raises(SimulatorError, match="more than 0"):
        small_shot(seconds=0.0)
    with pytest.raises(SimulatorError, match="grasp"):
        small_shot(motion="juggle")
