"""The twin's ideal detector: what nodes would send if they found every marker, as a raw log, without any picture.

Each marker is where it was at its own row's time, projected through the lens, with Gaussian noise; now and then one is
lost. Nothing hides anything, and colours do not matter: the way to observe marker sets that no camera could tell apart.
The log holds what a real one does - session, clock exchanges of clocks that disagree, datagrams with their delays - so
that it goes through the same door.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rhot_app.errors import SimulatorError
from rhot_app.project import Rig, load_rig, save_rig
from rhot_app.recording.raw_log import Record
from rhot_app.simulator.bare_hand.painter import BareHand
from rhot_app.simulator.film.film import TRUTH_NAME, Progress, new_folder
from rhot_app.simulator.film.node_log import CABLE, NodeSender, lost, write_node_log
from rhot_app.simulator.film.shot import RIG_NAME, Shot, make_shot, save_shot
from rhot_app.simulator.film.truth import FrameTruth, save_truth, true_object
from rhot_app.simulator.render.sheet import Sheet
from rhot_app.simulator.scene.scene import Scene, build_rig
from rhot_app.simulator.scene.scene_description import FARTHEST_M, NEAREST_M, MarkerShow
from rhot_node.wire.messages import NO_FLAGS, MarkerObservation

Array = NDArray[np.float64]

MARGIN_PX = 4.0
"""A marker nearer to the image's border is cut by it."""

_ROUNDS = 4  # a contraction: markers move far fewer rows per second than the shutter


def at_own_rows(way: Callable[[Array], Array], see: Callable[[Array], Array], times_s: Array, row_time_s: float,
                size: tuple[int, int]) -> tuple[Array, Array]:
    """A marker's places (F, 3) m and pixels (F, 2) in frames whose row 0 is exposed at `times_s` (F,).

    `way`: places (F, 3) at times (F,); `see`: pixels (F, 2) of places; `size`: width and height, px. Pixels are NaN
    where the marker is not in the picture.
    """
    rows = np.full(len(times_s), 0.5 * size[1])
    places, pixels = np.empty((len(times_s), 3)), np.empty((len(times_s), 2))
    for _ in range(_ROUNDS):
        places = way(times_s + rows * row_time_s)
        pixels = see(places)
        rows = np.clip(np.nan_to_num(pixels[:, 1]), 0.0, size[1])
    inside = ((pixels > MARGIN_PX) & (pixels < np.array(size) - 1.0 - MARGIN_PX)).all(axis=1, keepdims=True)
    return places, np.where(inside, pixels, np.nan)


LOG_NAME: Final = "points.log"

_GRID_HZ = 500.0  # of the splines through the markers' ways
_RADIUS_M = 8e-3  # where the marker set gives none


@dataclass(frozen=True, slots=True)
class PointNoise:
    """`sigma_px`: standard deviation of a position per axis. `loss`: probability that a marker is not found."""

    sigma_px: float = 0.12
    loss: float = 0.01


def write_points(shot: Shot, folder: Path, noise: PointNoise, progress: Progress | None = None) -> None:
    """Write ``points.log``, the truth, the rig and the shot into the new `folder`, which appears when all is complete.

    Raises SimulatorError, also when what is shown wears no markers.
    """
    with new_folder(folder) as work:
        save_shot(shot, work)
        rig = load_rig(work / RIG_NAME)
        streams = [PointStream(shot, rig, index, noise) for index in range(len(rig.nodes))]
        records: list[Record] = []
        for done, stream in enumerate(streams):
            records += stream.records()
            if progress is not None:
                progress(done + 1, len(streams))
        write_node_log(work / LOG_NAME, rig, {"simulated": shot.scene_object.name}, records)
        truths = tuple(stream.truth() for stream in streams)
        save_truth(work / TRUTH_NAME, true_object(shot.scene_object, shot.seconds, truths))


class PointStream:
    """One node's part of the log. Raises SimulatorError when what is shown wears no markers."""

    def __init__(self, shot: Shot, rig: Rig, index: int, noise: PointNoise) -> None:
        self._scene, self._rig = shot.scene, rig
        self._camera = shot.scene.camera(index)
        self._noise = noise
        self._rng = np.random.default_rng([shot.scene.seed, index, 0x901])
        self._sender = NodeSender(shot.scene, rig, index, self._rng, CABLE)
        self._times_ns = np.array(shot.scene.frame_times_ns(index, shot.seconds))
        self._centres, self._pixels = self._observe(shot)

    def truth(self) -> FrameTruth:
        """The frames; every marker is whole, or it is not in the picture at all."""
        return FrameTruth(1e-9 * self._times_ns, np.isfinite(self._pixels[:, :, 0]).astype(np.float64))

    def records(self, lit: Callable[[float], bool] = lambda t_s: True) -> Iterator[Record]:
        """Clock exchanges and datagrams. `lit`: whether what is shown can be seen at a scene time, s."""
        yield from self._sender.exchanges(1e-9 * float(self._times_ns[-1]))
        for number, t_ns in enumerate(self._times_ns):
            markers = [self._marker(number, index) for index in range(len(self._rig.markers.markers))]
            record = self._sender.datagram(number, int(t_ns), [
                marker if lit(1e-9 * (t_ns + self._scene.row_time_ns * marker.y)) else lost(marker.index)
                for marker in markers])
            if record is not None:
                yield record

    def _observe(self, shot: Shot) -> tuple[Array, Array]:
        """(F, M, 3) m and (F, M, 2) px at the time of each marker's own row; NaN where it is not in the picture."""
        if isinstance(shot.scene_object.thing, Sheet | BareHand):
            raise SimulatorError(f"{shot.scene_object.name}: there are no markers on it. Show a hand that wears some, "
                                 "or a marker.")
        grid = np.arange(0.0, shot.seconds + 0.1, 1.0 / _GRID_HZ)
        ways = shot.scene_object.thing.marker_positions(*shot.scene_object.source.sample(grid))
        times, row_time_s = 1e-9 * self._times_ns, 1e-9 * self._scene.row_time_ns
        centres = np.full((len(times), ways.shape[1], 3), np.nan)
        pixels = np.full((len(times), ways.shape[1], 2), np.nan)
        size = self._camera.width, self._camera.height
        for marker, name in enumerate(self._scene.markers.ids):
            if name not in shot.hidden and np.isfinite(ways[:, marker]).all():
                centres[:, marker], pixels[:, marker] = at_own_rows(
                    CubicSpline(grid, ways[:, marker]), self._camera.project, times, row_time_s, size)
        return centres, pixels

    def _marker(self, number: int, index: int) -> MarkerObservation:
        pixel, variance = self._pixels[number, index], self._noise.sigma_px**2
        x, y = pixel + self._rng.normal(0.0, self._noise.sigma_px, 2)
        if self._rng.random() < self._noise.loss or not np.isfinite(pixel).all():
            return lost(index)
        marker = self._rig.markers.markers[index]
        radius = 1e-3 * marker.radius_mm if marker.radius_mm else _RADIUS_M
        depth = (self._camera.camera_from_world @ np.append(self._centres[number, index], 1.0))[2]
        diameter = 2.0 * radius * self._camera.intrinsics[0] / depth
        return MarkerObservation(index, float(x), float(y), float(diameter), variance, 0.0, variance, 1.0, NO_FLAGS)


TABLE_NAME: Final = "table.csv"
_SECONDS = 1.0  # at each distance


def write_distances(scene: Scene, distances_m: Sequence[float], folder: Path, noise: PointNoise) -> None:
    """Write ``table.csv`` (real_cm, disparity_px: left minus right) and the rig into the new `folder`.

    Raises SimulatorError for a distance that the scene does not reach.
    """
    for distance in distances_m:
        if not NEAREST_M <= distance <= FARTHEST_M:
            raise SimulatorError(f"a marker can be held at {100 * NEAREST_M:g} to {100 * FARTHEST_M:g} cm, not at "
                                 f"{100 * distance:g} cm.")
    rows = [(100.0 * distance, disparity(scene, distance, noise)) for distance in distances_m]
    with new_folder(folder) as work:
        save_rig(work / RIG_NAME, build_rig(scene))
        with (work / TABLE_NAME).open("w", newline="") as file:
            table = csv.writer(file)
            table.writerow(("real_cm", "disparity_px"))
            table.writerows((f"{distance:g}", f"{pixels:.3f}") for distance, pixels in rows)


def disparity(scene: Scene, distance_m: float, noise: PointNoise) -> float:
    """px, left minus right: the mean over a second of frames of both cameras."""
    shot = make_shot(scene, MarkerShow(distance_m=distance_m), _SECONDS)
    rng = np.random.default_rng([scene.seed, round(1e4 * distance_m)])
    means = []
    for index in (0, 1):
        times = 1e-9 * np.array(scene.frame_times_ns(index, _SECONDS))
        centres = shot.scene_object.source.sample(times)[0][:, :3, 3]  # a ball's centre is its own origin
        x = scene.camera(index).project(centres)[:, 0]
        means.append(float(np.mean(x + rng.normal(0.0, noise.sigma_px, len(x)))))
    return means[0] - means[1]
