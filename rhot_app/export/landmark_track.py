"""A bare hand tracked through recorded videos by the landmarks that networks find in each picture.

The landmarks become a raw log, so that a film is tracked as a live hand is, and the hand's bones are measured first.
"""

from __future__ import annotations

import contextlib
import math
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.barehand.overlay import draw_skeleton
from rhot_app.calibration.hand.landmark_bones import are_landmarks, measure_bones
from rhot_app.calibration.hand.marker_places import tracks_of
from rhot_app.calibration.recorded_observations import read_instants
from rhot_app.errors import CalibrationError, RecordingError
from rhot_app.export.bare_hand import check_outputs, lost_intervals, open_table
from rhot_app.export.pictures import whole_pictures
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.landmarks import ANATOMY_SD_M, NOISE_M
from rhot_app.progress import Progress, silent
from rhot_app.project import Rig
from rhot_app.recording.landmark_log import FIRST_NS, LandmarkTable, landmark_order, write_landmark_log
from rhot_app.recording.raw_log import LogReader
from rhot_app.sources.frame_sets import CameraVideo, frame_sets, frames_left_out
from rhot_app.sources.replay import LogValidator
from rhot_app.state import HandState
from rhot_app.tracking.smoothing import SmoothedTracker
from rhot_app.tracking.tracker import CameraObservations
from rhot_app.tracking.trackers import make_tracker
from rhot_node.files import resource_path
from rhot_node.landmarks.networks import HAND_SIGMA, DetectedHand, open_hand_networks
from rhot_node.markers import load_markers

Image = NDArray[np.uint8]

MEDIAN_M = math.sqrt(2.0 * math.log(2.0) * (ANATOMY_SD_M**2 + NOISE_M**2))
"""m: median distance of a landmark from its joint (`hand.landmarks`): a Rayleigh distribution's."""

LARGE = 1.7
"""Times MEDIAN_M from which the rig or its hand is wrong. Chosen: between 1.2 of the
recorded hand in docs/landmarks.md with the shipped bones, and 1.8 with a wrong side or unit."""

FOUND_RGB: Final = (255, 220, 0)
TEXT_RGB: Final = (255, 255, 255)


@dataclass(frozen=True, slots=True)
class LandmarkSummary:
    """What came of a run. `states` of them `tracked` show the hand; `lost`: intervals without a hand, s of the film;
    `found`: part of each camera's pictures in which the networks found the hand; `bones`: a sentence on the bones;
    `seconds`: the whole run. `figures`: see `summarise`."""

    states: int
    tracked: int
    lost: tuple[tuple[float, float], ...]
    found: dict[str, float]
    bones: str
    seconds: float
    left_out: int
    figures: dict[str, Any]

    def document(self) -> dict[str, Any]:
        """The same for JSON."""
        return {"frame_sets": self.states, "tracked": self.tracked / max(self.states, 1),
                "found": self.found, "bones": self.bones, "computed_per_s": self.states / self.seconds,
                "lost_s": [list(one) for one in self.lost], "frames_left_out": self.left_out,
                "reprojection_px": self.figures["reprojection_px"], "reprojection_mm": self.figures["reprojection_mm"],
                "reprojection_large": self.figures["reprojection_large"], "joint_sd_mm": self.figures["joint_sd_mm"]}


def landmark_rig_of(rig: Rig, cameras: Sequence[str]) -> Rig:
    """The rig with these cameras alone, whose hand is tracked by landmarks; what holds of its markers is left out."""
    nodes = tuple(node for node in rig.nodes if node.name in cameras)
    return msgspec.structs.replace(
        rig, nodes=nodes, markers=load_markers(resource_path("markers", "landmarks21.json")), depth=type(rig.depth)(),
        filters=type(rig.filters)(), other_hand=None, objects=(),
        tracker=msgspec.structs.replace(rig.tracker, kind="estimator", observe="landmarks"))


def find_landmarks(video: CameraVideo, right: bool, progress: Progress = silent) -> LandmarkTable:
    """The landmarks of a right or left hand in each picture of a video, NaN where there is none. Raises KeypointError
    without networks, RecordingError for a video that cannot be read."""
    networks, times, places, scores, sigmas = open_hand_networks(), [], [], [], []
    for t_ns, picture in video.frames():
        hand = _of_side(networks.find(np.ascontiguousarray(picture[..., ::-1])), right)
        times.append(1e-9 * t_ns)
        places.append(np.full((21, 2), np.nan) if hand is None else hand.landmarks)
        scores.append(0.0 if hand is None else hand.presence)
        sigmas.append(1.0 if hand is None else HAND_SIGMA * hand.region.side)
        progress(f"looking for the hand in {video.path.name}", len(times) / max(len(video.times_ns), 1))
    if not times:
        raise RecordingError(f"{video.path}: no picture of it can be read.")
    return LandmarkTable(np.array(times), np.array(places), np.array(scores), np.array(sigmas))


def _of_side(hands: Sequence[DetectedHand], right: bool) -> DetectedHand | None:
    """The hand of that side that is there most probably; None without."""
    own = [hand for hand in hands if (hand.right >= 0.5) == right]
    return max(own, key=lambda hand: hand.presence, default=None)


def with_measured_bones(rig: Rig, path: Path) -> tuple[Rig, str]:
    """The rig with the bones that the landmarks of a log show, if they are usable, and a sentence on them."""
    if len(rig.nodes) < 2:
        return rig, "The bones are the rig's: one camera does not show how long they are, nor how far the hand is."
    roles = {marker.id: marker.role for marker in rig.markers.markers if marker.role is not None}
    try:
        _, instants = read_instants(path, rig)
        tracks = tracks_of(instants.times_s, instants.positions, rig.markers.ids, roles)
        if not are_landmarks(tracks):
            return rig, "The bones are the rig's, as not all joints have a landmark."
        report = measure_bones(tracks, rig.hand)
    except (CalibrationError, RecordingError) as exc:
        return rig, f"The bones are the rig's: {exc}"
    if not report.verdict.acceptable:
        return rig, f"The bones are the rig's. Those that the landmarks show: {report.verdict.sentence}"
    hand = msgspec.structs.replace(report.hand, name=f"measured from {path.name}")
    return msgspec.structs.replace(rig, hand=hand), f"Bones measured from the landmarks. {report.verdict.sentence}"


def track_landmarks(rig: Rig, videos: Sequence[CameraVideo], *, measure: bool = True, smooth: bool = False,
                    out: Path | None = None, pictures: Path | None = None, again: bool = False,
                    progress: Progress = silent) -> LandmarkSummary:
    """Track the hand of `rig`, whose nodes are the videos' cameras in their order.

    `measure`: measure the hand's bones first, and use them if they can be a hand's. `out`: a table of the states
    (docs/export.md), one of every frame set, whose times are the film's. `pictures`: an .avi or .mp4 file, or a folder
    of PNG files, with the landmarks and the hand. Files appear when they are whole. Raises KeypointError without
    networks, RecordingError, ExportError.
    """
    check_outputs(videos, out, pictures, again, None)
    begun, share = time.perf_counter(), 0.9 / len(videos)
    tables = []
    for number, video in enumerate(videos):
        def report(text: str, part: float, number: int = number) -> None:
            progress(text, share * (number + part))

        tables.append(find_landmarks(video, rig.hand.side == "right", report))
    found = {video.camera: float(np.mean(np.isfinite(table.pixels[:, 0, 0])))
             for video, table in zip(videos, tables, strict=True)}
    first_s, half_s = min(float(table.times_s[0]) for table in tables), 0.5e-9 * min(one.period_ns for one in videos)
    bones = "The bones are the rig's."
    with tempfile.TemporaryDirectory(prefix="rhot-") as folder:
        log = Path(folder) / videos[0].path.with_suffix(".rhotlog").name
        write_landmark_log(log, rig, tables)
        if measure:
            progress("measuring the hand's bones", 0.9)
            rig, bones = with_measured_bones(rig, log)
            write_landmark_log(log, rig, tables)
        progress("tracking", 0.92)
        states = list(_one_of_each_instant(states_of_log(rig, log, smooth), round(1e9 * half_s)))
        figures = summarise(rig, states)
    times_s = np.array([first_s + 1e-9 * (state.t_master_ns - FIRST_NS) for state in states])
    with contextlib.ExitStack() as stack:
        if out is not None:
            zero_ns = FIRST_NS - round(1e9 * first_s)
            table = stack.enter_context(open_table(rig, videos[0].path.name, out, zero_ns))
            for state in states:
                table.add(state)
            table.finish()
        if pictures is not None:
            drawn = stack.enter_context(whole_pictures(pictures, 1e9 / min(video.period_ns for video in videos)))
            cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
            for frames in frame_sets(videos):
                nearest = int(np.argmin(np.abs(times_s - 1e-9 * frames.first_ns)))
                drawn.add(_side_by_side(cameras, frames.images, [
                    table.pixels[int(np.argmin(np.abs(table.times_s - 1e-9 * t)))]
                    for table, t in zip(tables, frames.t_ns, strict=True)], states[nearest]))
    spent = [(round(1e9 * t), state.tracked) for t, state in zip(times_s, states, strict=True)]
    lost = tuple((1e-9 * spent[0][0] + begin, 1e-9 * spent[0][0] + end) for begin, end in lost_intervals(spent))
    return LandmarkSummary(len(states), sum(state.tracked for state in states), lost, found, bones,
                           time.perf_counter() - begun, frames_left_out(videos), figures)


def states_of_log(rig: Rig, log: Path, smooth: bool = False) -> Iterator[HandState]:
    """The states of a log by the rig's estimator, one after every frame."""
    validator, smoother, tracker = LogValidator(rig), SmoothedTracker(rig) if smooth else None, make_tracker(rig)
    with contextlib.closing(LogReader(log)) as reader:
        for record in reader:
            frame = validator.feed(record)
            if not isinstance(frame, CameraObservations):
                continue
            if smoother is not None:
                smoother.ingest(frame)
                yield from smoother.states()
                continue
            tracker.ingest(frame)
            state = tracker.solve()
            if state is not None:
                yield state
    if smoother is not None:
        yield from smoother.finish()


def summarise(rig: Rig, states: Sequence[HandState]) -> dict[str, Any]:
    """What the estimator has made of landmarks. `tracked`: part of the states with a hand; `start_s`: of the first of
    them, after the first frame; `reprojection_px`, `reprojection_mm`: median distance of the landmarks from their
    joints' images, and as long at the hand; `reprojection_large`: whether that is more than LARGE of MEDIAN_M."""
    joints, order = [], np.array(landmark_order(rig))
    cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    errors, errors_m, first_ns = [], [], None
    for state in states:
        first_ns = state.t_master_ns if first_ns is None else first_ns
        if state.tracked:
            joints.append(state)
            for camera, pixels in zip(cameras, state.camera_pixels, strict=True):
                expected = camera.project(state.joint_positions)
                errors.append(np.linalg.norm(expected[order[order >= 0]] - pixels[order >= 0], axis=1))
                errors_m.append(errors[-1] / camera.pixels_per_metre(state.joint_positions[order[order >= 0]]))
    if not joints:
        return {"tracked": 0.0, "start_s": None, "reprojection_px": None, "reprojection_mm": None,
                "reprojection_large": None, "joint_sd_mm": None}
    variances = np.array([np.einsum("jii->ji", state.joint_covariances) for state in joints])
    error_m = float(np.nanmedian(errors_m))
    return {"tracked": len(joints) / len(states), "start_s": 1e-9 * (joints[0].t_master_ns - (first_ns or 0)),
            "reprojection_px": float(np.nanmedian(errors)), "reprojection_mm": 1e3 * error_m,
            "reprojection_large": error_m > LARGE * MEDIAN_M, "joint_sd_mm": 1e3 * float(np.sqrt(variances.mean()))}


def _one_of_each_instant(states: Iterator[HandState], half_ns: int) -> Iterator[HandState]:
    """Of the states of one frame set the last, which knows all its pictures."""
    waiting: HandState | None = None
    first_ns = 0
    for state in states:
        if waiting is not None and state.t_master_ns - first_ns > half_ns:
            yield waiting
            waiting = None
        if waiting is None:
            first_ns = state.t_master_ns
        waiting = state
    if waiting is not None:
        yield waiting


def _side_by_side(cameras: Sequence[CameraModel], images: Sequence[Image | None],
                  landmarks: Sequence[NDArray[np.float64]], state: HandState) -> Image:
    """All cameras' pictures beside each other, with the landmarks, the hand and the state's condition."""
    shown = []
    for camera, image, found in zip(cameras, images, landmarks, strict=True):
        picture = np.zeros((camera.height, camera.width, 3), np.uint8) if image is None else image.copy()
        for x, y in found[np.isfinite(found[:, 0])]:
            cv2.circle(picture, (round(float(x)), round(float(y))), 3, FOUND_RGB, -1, cv2.LINE_AA)
        if state.tracked:
            draw_skeleton(picture, camera.project(state.joint_positions), 2)
        cv2.putText(picture, state.condition.value, (8, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.7, TEXT_RGB, 2, cv2.LINE_AA)
        shown.append(picture)
    height = max(picture.shape[0] for picture in shown)
    return np.hstack([np.pad(picture, ((0, height - picture.shape[0]), (0, 0), (0, 0))) for picture in shown])
