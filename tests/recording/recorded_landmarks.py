"""A recorded bare hand before two cameras: its rig, its landmarks, and what the estimator makes of them.

Truth is what the landmarks of both cameras triangulate to, so that errors are disagreements.
"""

from __future__ import annotations

import contextlib
import itertools
import tempfile
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import load_hand
from rhot_app.project import CameraPose, Intrinsics, Rig, RigNode, TrackerSettings
from rhot_app.recording.landmark_log import LandmarkTable, read_landmark_table, write_landmark_log
from rhot_app.recording.raw_log import LogReader
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

FOLDER = Path(__file__).parents[3] / "shared" / "data" / "bare_hand_stereo"
SQUARE_M, FPS, SIZE_PX = 0.0385, 30.0, 720
"""A unit of the recording's calibration is a square of its board, whose size nobody wrote down: so large that the hand
is of a usual size."""

WHOLE = 13
FITTED, JUDGED = slice(0, 54), slice(54, 107)
"""Of the frames from WHOLE to 119, in which the hand is whole in both pictures: what is fitted, and what is judged."""

needs_recording = pytest.mark.skipif(not FOLDER.exists(), reason="../shared/data/bare_hand_stereo is not there")


def numbers(path: Path) -> list[list[float]]:
    """Rows of numbers of a calibration file; a comment ends them."""
    lines = path.read_text().partition("#")[0].splitlines()
    return [[float(word) for word in line.split()] for line in lines if line.strip() and not line[0].isalpha()]


def recorded_nodes() -> tuple[RigNode, ...]:
    """The recording's cameras, c0 and c1."""
    nodes = []
    for c in range(2):
        lens, place = numbers(FOLDER / f"c{c}.dat"), numbers(FOLDER / f"rot_trans_c{c}.dat")
        left, _, right = np.linalg.svd(np.array(place[:3]))
        rotation, shift = left @ right, SQUARE_M * np.array(place[3:6]).ravel()
        w, x, y, z = quaternion_from_rotation(rotation.T).tolist()
        tx, ty, tz = (-rotation.T @ shift).tolist()
        k1, k2, p1, p2, k3 = lens[3]
        nodes.append(RigNode(c + 1, f"c{c}", Intrinsics(SIZE_PX, SIZE_PX, lens[0][0], lens[1][1], lens[0][2],
                                                        lens[1][2], (k1, k2, p1, p2, k3)),
                             CameraPose((w, x, y, z), (tx, ty, tz))))
    return tuple(nodes)


class Recording:
    """`places` (T, 21, 3) m: where the landmarks of both cameras triangulate to, from frame WHOLE on."""

    def __init__(self) -> None:
        markers, hand = load_markers(resource_path("markers", "landmarks21.json")), resource_path("hands", "right.json")
        self.rig = Rig("recorded bare hand", recorded_nodes(), markers, load_hand(hand),
                       tracker=TrackerSettings(kind="estimator"))
        self.tables = [read_landmark_table(FOLDER / f"landmarks_c{c}.csv", FPS) for c in range(2)]
        self._cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in self.rig.nodes]
        own = [np.round(table.times_s * FPS).astype(int) for table in self.tables]
        both = np.intersect1d(*own)
        self._frames = both[both >= WHOLE]
        self._first_s = min(table.times_s[0] for table in self.tables)
        self._pixels = [table.pixels[np.searchsorted(frames, self._frames)]
                        for table, frames in zip(self.tables, own, strict=True)]
        self.places = self.triangulated()

    def triangulated(self, swapped: bool = False) -> np.ndarray:
        """By the linear method (Hartley and Zisserman 2004, 12.2)."""
        rows = []
        for camera, seen in zip(self._cameras, self._pixels[::-1] if swapped else self._pixels, strict=True):
            rays, matrix = camera.undistort(seen.reshape(-1, 2)).reshape(seen.shape), camera.camera_from_world[:3]
            rows.append(rays[..., None] * matrix[2] - matrix[:2])
        last = np.linalg.svd(np.concatenate(rows, axis=-2))[2][..., 3, :]
        return last[..., :3] / last[..., 3:]

    def joints(self, hand=None, smooth: bool = False, alone: int | None = None) -> np.ndarray:
        """(T, 21, 3) m: the tracked hand's after each frame of both cameras, NaN where it is not tracked. `alone`: the
        only camera in the judged frames."""
        tables = self.tables if alone is None else [table if camera == alone else _until(table, JUDGED.start)
                                                    for camera, table in enumerate(self.tables)]
        rig = self.rig if hand is None else msgspec.structs.replace(self.rig, hand=hand)
        found = np.full(self.places.shape, np.nan)
        begin = None
        for first_ns, state in _states(rig, tables, smooth):
            begin = first_ns
            frame = round((1e-9 * (state.t_master_ns - begin) + self._first_s) * FPS)
            if state.tracked and frame in self._frames:
                found[np.searchsorted(self._frames, frame)] = state.joint_positions
        return found

    def states_from(self, begin: int, count: int, only: int | None = None) -> list:
        """The first `count` states of a recording that begins at frame WHOLE + `begin`, each with the joints' places
        (21, 3) m. `only`: the camera that sees the hand."""
        tables = []
        for camera, table in enumerate(self.tables):
            kept = table.times_s * FPS > WHOLE + begin - 0.5
            if only not in (None, camera):
                kept[:-1] = False  # a log has frames of all its cameras
            tables.append(LandmarkTable(table.times_s[kept], table.pixels[kept], table.scores[kept],
                                        table.sigma_px[kept]))
        first_s = min(table.times_s[0] for table in tables)
        return [(state, self.places[round((1e-9 * (state.t_master_ns - first_ns) + first_s) * FPS) - WHOLE])
                for first_ns, state in itertools.islice(_states(self.rig, tables, False), count)]

    def held_still(self, frame: int, seconds: float = 1.0) -> np.ndarray:
        """(21,) mm: how far the joints are off after a frame was held so long; NaN when no hand is found."""
        count = round(seconds * FPS)
        tables = [LandmarkTable(np.arange(count) / FPS, np.repeat(pixels[frame][None], count, axis=0),
                                np.full(count, 0.9), np.full(count, 0.5)) for pixels in self._pixels]
        last = list(_states(self.rig, tables, False))[-1][1]
        return 1e3 * np.linalg.norm(last.joint_positions - self.places[frame], axis=1)

    def errors(self, hand=None, smooth: bool = False, alone: int | None = None) -> np.ndarray:
        """(T, 21) mm of the joints in the judged frames."""
        joints = self.joints(hand, smooth, alone)[JUDGED]
        assert np.isfinite(joints).all(), "the hand was lost"
        return 1e3 * np.linalg.norm(joints - self.places[JUDGED], axis=2)

    def jitter(self, hand=None, smooth: bool = False) -> float:
        """Rms of third differences, mm."""
        return 1e3 * float(np.sqrt(np.mean(np.diff(self.joints(hand, smooth)[JUDGED], 3, axis=0)**2) / 20.0))


def recorded_states(hand) -> list:
    """The last state of each of the frames from WHOLE on, tracked by both cameras' landmarks with `hand`."""
    one, found = recording(), {}
    rig = msgspec.structs.replace(one.rig, hand=hand)
    first_s = min(table.times_s[0] for table in one.tables)
    for first_ns, state in _states(rig, one.tables, False):
        found[round((1e-9 * (state.t_master_ns - first_ns) + first_s) * FPS)] = state
    return [found[WHOLE + k] for k in range(len(one.places))]


@cache
def recording() -> Recording:
    """The one."""
    return Recording()


def _until(table: LandmarkTable, frame: int) -> LandmarkTable:
    """The frames of a table before one of those from WHOLE on."""
    kept = table.times_s * FPS < WHOLE + frame - 0.5
    return LandmarkTable(table.times_s[kept], table.pixels[kept], table.scores[kept], table.sigma_px[kept])


def _states(rig, tables, smooth):
    """Each state, with the time of the first frame before it."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "hand.log"
        write_landmark_log(log, rig, tables)
        validator, tracker, first_ns = LogValidator(rig), make_tracker(rig, smooth=smooth), None
        with contextlib.closing(LogReader(log)) as reader:
            for record in reader:
                frame = validator.feed(record)
                if not isinstance(frame, CameraObservations):
                    continue
                first_ns = frame.t_row0_master_ns if first_ns is None else first_ns
                tracker.ingest(frame)
                yield from ((first_ns, state) for state in tracker.states())
        yield from ((first_ns, state) for state in tracker.finish())
