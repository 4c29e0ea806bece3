"""The simulated rig does what the wizards ask for, also on a machine that renders few pictures a second."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray

from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.filters.meters import BRISK_M_S, FilterMeter
from rhot_app.calibration.hand.bones_collector import BonesCollector
from rhot_app.calibration.hand.marker_places import tracks_of
from rhot_app.calibration.lens.coverage import CaptureGuide
from rhot_app.simulator.film.scene_objects import make_object
from rhot_app.simulator.scene.rigid_target import BoardPoses
from rhot_app.simulator.scene.scene import Scene, make_scene, twin_defaults
from rhot_app.simulator.scene.scene_description import BoardShow, HandShow
from rhot_app.ui.wizards.bones import SECONDS

Array = NDArray[np.float64]

SLOW_HZ = (30.0, 10.0, 7.0)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return make_scene(twin_defaults(), 1)


def markers(scene: Scene, motion: str, times_s: Array) -> Array:
    """(T, M, 3) m of the worn markers."""
    shown = make_object(HandShow(motion), scene)
    return np.asarray(shown.thing.joints_and_markers(*shown.source.sample(times_s))[1])


@pytest.mark.parametrize("preset", ["wide", "fast"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_one_round_of_the_board_fills_every_bar_of_a_lens(preset: str, seed: int) -> None:
    scene = make_scene(msgspec.structs.replace(twin_defaults(), preset=preset), seed)
    show = BoardShow()
    board, source = show.board(), make_object(show, scene).source
    assert isinstance(source, BoardPoses)
    for index in (0, 1):
        camera, guide = scene.camera(index), CaptureGuide(board)
        for number, pose in enumerate(source.poses):
            pixels = camera.project(board.object_points() @ pose[:3, :3].T + pose[:3, 3])
            if ((pixels > 3.0) & (pixels < np.array([camera.width, camera.height]) - 4.0)).all():
                view = BoardView(pixels, np.arange(board.count), camera.width, camera.height, 30.0, 1.0)
                for t_s in (10.0 * number, 10.0 * number + 0.5):  # a look in half a second: a slow machine
                    guide.offer(view, t_s)
        assert min(guide.coverage.bars.values()) == 1.0 and guide.complete


@pytest.mark.parametrize("rate_hz", [*SLOW_HZ, 2.0])
def test_a_minute_of_the_sweep_bends_every_finger_often_enough(scene: Scene, rate_hz: float) -> None:
    roles = {marker.id: marker.role for marker in scene.markers.markers if marker.role is not None}
    for start_s in (0.0, 20.0, 40.0, 55.0):  # a person presses Record whenever it pleases
        times_s = np.arange(0.0, SECONDS, 1.0 / rate_hz)
        positions = markers(scene, "sweep", start_s + times_s)
        tracks = tracks_of(times_s, positions, scene.markers.ids, roles)
        collector = BonesCollector(tracks.places)
        columns = [scene.markers.ids.index(place.name) for place in tracks.places]
        for t_s, instant in zip(times_s, positions, strict=True):
            collector.add(t_s, instant[columns])
        assert collector.progress.done, collector.progress


@pytest.mark.parametrize("rate_hz", SLOW_HZ)
def test_a_brisk_wave_is_brisk_at_low_rates_and_crosses_the_picture(scene: Scene, rate_hz: float) -> None:
    times_s = np.arange(0.0, 2.0, 1.0 / rate_hz)
    positions = markers(scene, "brisk", times_s)
    meter = FilterMeter(positions.shape[1])
    for t_s, instant in zip(times_s, positions, strict=True):
        meter.add(round(1e9 * t_s), instant, instant)
    reading = meter.read()
    assert reading is not None and np.max(reading.speed_m_s) > BRISK_M_S
    for index in (0, 1):
        camera = scene.camera(index)
        pixels = camera.project(positions.reshape(-1, 3)).reshape(*positions.shape[:2], 2)
        assert ((pixels > 10.0) & (pixels < np.array([camera.width, camera.height]) - 10.0)).all()
        assert np.median(np.abs(np.diff(pixels[..., 1], axis=0))) * rate_hz > 120.0 and np.ptp(pixels[..., 1]) > 250.0
