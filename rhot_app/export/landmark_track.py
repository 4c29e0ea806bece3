"""Bare hands tracked through recorded videos by the landmarks that networks find in each picture.

What the networks find becomes a raw log, so that a film is tracked as live hands are, and the hands' bones are measured
first.
"""

from __future__ import annotations

import contextlib
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.hand.landmark_bones import are_landmarks, measure_bones
from rhot_app.calibration.hand.marker_places import tracks_of
from rhot_app.calibration.recorded_observations import read_instants
from rhot_app.engine.offline.replay_summary import replay_states
from rhot_app.errors import CalibrationError, RecordingError, input_file, note_loss
from rhot_app.export.bare_hand import check_outputs, closing_sentences, lost_intervals, open_table
from rhot_app.export.overlay import draw_skeleton
from rhot_app.export.pictures import side_by_side, whole_pictures
from rhot_app.export.recording import one_of_each_instant
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import HandAnatomy, load_hand
from rhot_app.hand.landmarks import DISAGREEMENT_M
from rhot_app.progress import Progress, silent, within
from rhot_app.project import Intrinsics, Rig, RigNode, landmark_markers
from rhot_app.recording.landmark_log import FIRST_NS, HandFilm, landmark_order, write_hand_log
from rhot_app.recording.raw_log import FILMS, LogReader, filmed_at
from rhot_app.rig_history import accept_hand
from rhot_app.sources.film_offset import filmed
from rhot_app.sources.frame_sets import CameraVideo, NamedFilm, frame_sets, frames_left_out
from rhot_app.sources.recorded_pictures import recorded_pictures
from rhot_app.sources.replay import LogValidator
from rhot_app.state import HandState
from rhot_app.tracking.rig_arrays import rigs_of_hands
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.files import resource_path
from rhot_node.landmark_search import landmarked
from rhot_node.landmarks.networks import open_hand_networks
from rhot_node.wire.messages import LandmarkedHand

Image = NDArray[np.uint8]

REASON: Final = "bones measured by landmarks"
"""Why a hand file is replaced."""

FOUND_RGB: Final = (255, 220, 0)


@dataclass(frozen=True, slots=True)
class LandmarkSummary:
    """What came of a run. `states` of them `tracked` show the rig's hand, `other_tracked` its other one, None without;
    `lost`: intervals without the hand, s of the film; `found`, `foreign`: part of each camera's pictures in which the
    networks found a hand of the rig, and in which they found hands, but none of the rig's side; `bones`: a sentence on
    the bones; `side`: that of the rig's hand; `seconds`: the whole run; `figures`: see `summarise`; `adapted`: whether
    a hand file was written."""

    states: int
    tracked: int
    other_tracked: int | None
    lost: tuple[tuple[float, float], ...]
    found: dict[str, float]
    foreign: dict[str, float]
    bones: str
    side: str
    seconds: float
    left_out: int
    figures: dict[str, Any]
    adapted: bool

    def document(self) -> dict[str, Any]:
        """The same for JSON."""
        count = max(self.states, 1)
        return {"frame_sets": self.states, "tracked": self.tracked / count,
                "other_tracked": None if self.other_tracked is None else self.other_tracked / count,
                "found": self.found, "foreign": self.foreign, "bones": self.bones, "side": self.side,
                "computed_per_s": self.states / self.seconds,
                "lost_s": [list(one) for one in self.lost], "frames_left_out": self.left_out,
                "reprojection_px": self.figures["reprojection_px"], "reprojection_mm": self.figures["reprojection_mm"],
                "reprojection_large": self.figures["reprojection_large"], "joint_sd_mm": self.figures["joint_sd_mm"]}


def landmark_rig_of(rig: Rig, cameras: Sequence[str]) -> Rig:
    """The rig with these cameras alone, whose hands are tracked by landmarks; what holds of its markers is left out."""
    nodes = tuple(node for node in rig.nodes if node.name in cameras)
    return msgspec.structs.replace(
        rig, nodes=nodes, markers=landmark_markers(rig.other_hand is not None), depth=type(rig.depth)(),
        filters=type(rig.filters)(), objects=(),
        tracker=msgspec.structs.replace(rig.tracker, kind="estimator", observe="landmarks"))


def assumed_rig(videos: list[str]) -> Rig:
    """A rig of one camera whose lens is assumed, for one video. Raises RecordingError."""
    if len(videos) != 1:
        raise RecordingError(f"{len(videos)} videos need a calibrated rig with a camera for each; give it with --rig. "
                             "rhot calibrate stereo makes one from films of a board, rhot calibrate import from "
                             "another program's calibration. One video alone is tracked without." if videos else
                             "give a video, or a rig with --rig and a video of each camera.")
    lens = Intrinsics.assumed(*recorded_pictures(input_file(videos[0])).size)
    return Rig("one assumed camera", (RigNode(1, "camera", lens),))


def find_hands(video: CameraVideo, progress: Progress = silent) -> HandFilm:
    """The hands in each picture of a video. Raises KeypointError without networks, RecordingError for a video that
    cannot be read."""
    networks, times, hands = open_hand_networks(), [], []
    for t_ns, picture in video.frames():
        size = picture.shape[1], picture.shape[0]
        times.append(1e-9 * t_ns)
        hands.append(tuple(landmarked(hand, size) for hand in networks.find(np.ascontiguousarray(picture[..., ::-1]))))
        progress(f"looking for hands in {video.path.name}", len(times) / max(len(video.times_ns), 1))
    if not times:
        raise RecordingError(f"{video.path}: no picture of it can be read.")
    return HandFilm(np.array(times), hands)


def with_measured_bones(rig: Rig, path: Path) -> tuple[Rig, str]:
    """The rig with the bones of its hands that the landmarks of a log show, as far as they are usable, and a sentence
    on them."""
    if sum(rig.tracked_with) < 2:
        return rig, "The bones are the rig's: one camera does not show how long they are, nor how far the hand is."
    try:
        _, instants = read_instants(path, rig)
    except RecordingError as exc:
        return rig, f"The bones are the rig's: {exc}"
    found = [_measured_hand(one, instants.times_s, instants.positions[:, columns], path)
             for one, columns in rigs_of_hands(rig)]
    if rig.other_hand is None:
        return msgspec.structs.replace(rig, hand=found[0][0]), found[0][1]
    return (msgspec.structs.replace(rig, hand=found[0][0], other_hand=found[1][0]),
            " ".join(f"{hand.side.capitalize()} hand: {sentence}" for hand, sentence in found))


def _measured_hand(rig: Rig, times_s: NDArray[np.float64], positions: NDArray[np.float64],
                   path: Path) -> tuple[HandAnatomy, str]:
    """The hand of a rig of one hand, with the bones that the `positions` (T, M, 3) m of its markers show, and a
    sentence."""
    roles = {marker.id: marker.role for marker in rig.markers.markers if marker.role is not None}
    try:
        tracks = tracks_of(times_s, positions, rig.markers.ids, roles)
        if not are_landmarks(tracks):
            return rig.hand, "The bones are the rig's, as not all joints have a landmark."
        report = measure_bones(tracks, rig.hand)
    except CalibrationError as exc:
        return rig.hand, f"The bones are the rig's: {exc}"
    if not report.verdict.acceptable:
        return rig.hand, f"The bones are the rig's. Those that the landmarks show: {report.verdict.sentence}"
    hand = msgspec.structs.replace(report.hand, name=f"measured from {path.name}")
    return hand, f"Bones measured from the landmarks. {report.verdict.sentence}"


@dataclass(frozen=True, slots=True)
class LandmarkRun:
    """How the hands of films are tracked, and which files are written; they appear when they are whole.

    `either_side`: the hand is a shipped one of the side that the networks find more often. `measure`: measure the
    hands' bones first, and use them if they can be a hand's. `unknown_size`: where they are not measured, estimate the
    hands' size. `out`: a table of the states (docs/export.md), one of every frame set, whose times are the film's.
    `pictures`: an .avi or .mp4 file, or a folder of PNG files, with the landmarks and the hands. `kept`: a raw log of
    what the networks found, with the rig that was tracked and the names of the films, which is replayed and exported as
    any other. `hand_file`: where the rig's hand is written with its measured bones; what was there is kept beside it,
    and a loss is noted where they were not measured (`errors.note_loss`). `again`: files that exist are replaced.
    """

    either_side: bool = False
    measure: bool = True
    unknown_size: bool = False
    smooth: bool = False
    out: Path | None = None
    pictures: Path | None = None
    kept: Path | None = None
    hand_file: Path | None = None
    again: bool = False


def track_landmarks(rig: Rig, videos: Sequence[CameraVideo], run: LandmarkRun,
                    progress: Progress = silent) -> LandmarkSummary:
    """Track the hands of `rig`, whose nodes are the videos' cameras in their order. Raises KeypointError without
    networks, RecordingError, ExportError, RigError."""
    check_outputs(videos, run.out, run.pictures, run.again, run.hand_file, run.kept)
    begun, share, base = time.perf_counter(), 0.9 / len(videos), rig
    films = [find_hands(video, within(progress, share * number, share * (number + 1)))
             for number, video in enumerate(videos)]
    if run.either_side:
        rig = base = msgspec.structs.replace(rig, hand=load_hand(resource_path("hands", f"{_side_of(films)}.json")))
    first_s, half_s = min(float(film.times_s[0]) for film in films), 0.5e-9 * min(one.period_ns for one in videos)
    bones = "The bones are the rig's."
    with tempfile.TemporaryDirectory(prefix="rhot-") as folder:
        log = Path(folder) / videos[0].path.with_suffix(".rhotlog").name
        write_hand_log(log, rig, films)
        still = any(video.still for video in videos)
        if run.measure:
            progress("measuring the bones", 0.9)
            rig, bones = with_measured_bones(rig, log)
            if still and len(videos) > 1:
                bones += " They are of one picture: their spread says nothing."
        if run.unknown_size and rig.hand == base.hand:
            rig = msgspec.structs.replace(rig, tracker=msgspec.structs.replace(rig.tracker, float_scale=True))
        if run.kept is not None:
            write_hand_log(run.kept, rig, films,
                           {FILMS: _names(videos, films, first_s), **_taken(videos, films, first_s)})
        progress("tracking", 0.92)
        seen = _seen(rig, log)
        states = list(one_of_each_instant(states_of_log(rig, log, run.smooth), round(1e9 * half_s)))
        figures = summarise(rig, states)
    times_s = np.array([first_s + 1e-9 * (state.t_master_ns - FIRST_NS) for state in states])
    with contextlib.ExitStack() as stack:
        if run.out is not None:
            zero_ns = FIRST_NS - round(1e9 * first_s)
            table = stack.enter_context(open_table(rig, videos[0].path.name, run.out, zero_ns))
            for state in states:
                table.add(state)
            table.finish()
        if run.pictures is not None:
            drawn = stack.enter_context(whole_pictures(run.pictures, 1e9 / min(video.period_ns for video in videos)))
            _draw_hands(drawn.add, rig, videos, films, states, times_s)
    spent = [(round(1e9 * t), state.tracked) for t, state in zip(times_s, states, strict=True)]
    lost = tuple((1e-9 * spent[0][0] + begin, 1e-9 * spent[0][0] + end) for begin, end in lost_intervals(spent))
    return LandmarkSummary(
        states=len(states), tracked=sum(state.tracked for state in states),
        other_tracked=None if rig.other_hand is None else sum(
            state.other is not None and state.other.tracked for state in states),
        lost=lost, found={video.camera: float(own.mean()) for video, own in zip(videos, seen, strict=True)},
        foreign={video.camera: float(np.mean([bool(hands) and not there
                                              for hands, there in zip(film.hands, own, strict=True)]))
                 for video, film, own in zip(videos, films, seen, strict=True)},
        bones=bones, side=rig.hand.side, seconds=time.perf_counter() - begun, left_out=frames_left_out(videos),
        figures=figures,
        adapted=run.hand_file is not None and _adapted(
            run.hand_file, rig.hand, rig.hand != base.hand and not still, bones))


def _draw_hands(add: Callable[[Image], object], rig: Rig, videos: Sequence[CameraVideo], films: Sequence[HandFilm],
                states: Sequence[HandState], times_s: NDArray[np.float64]) -> None:
    """Add a picture of each frame set with its landmarks, and the hands of the state nearest in time (`times_s`)."""
    cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    for frames in frame_sets(videos):
        state = states[int(np.argmin(np.abs(times_s - 1e-9 * frames.first_ns)))]
        hands = [state] if state.other is None else [state, state.other]

        def draw(c: int, picture: Image, t_ns: Sequence[int] = frames.t_ns,
                 hands: Sequence[HandState] = hands) -> Image:
            nearest = int(np.argmin(np.abs(films[c].times_s - 1e-9 * t_ns[c])))
            return _with_hands(cameras[c], picture, films[c].hands[nearest], hands)
        add(side_by_side(cameras, frames.images, " ".join(hand.condition.value for hand in hands), draw))


def _names(videos: Sequence[CameraVideo], films: Sequence[HandFilm], first_s: float) -> Any:
    """What a log's header says of the films that it was made of; `first_s`: of the first picture of all."""
    return msgspec.to_builtins({video.camera: NamedFilm(
        str(video.path.absolute()), FIRST_NS + round(1e9 * (float(film.times_s[0]) - first_s)),
        None if video.stamped else 1e9 / video.period_ns) for video, film in zip(videos, films, strict=True)})


def _taken(videos: Sequence[CameraVideo], films: Sequence[HandFilm], first_s: float) -> dict[str, Any]:
    """When the films were taken, by the first one that says it; nothing where none does."""
    for video, film in zip(videos, films, strict=True):
        when = None if video.stamped or video.source.files or video.path.is_dir() else filmed(video.path)
        if when is not None:
            return filmed_at(when, FIRST_NS + round(1e9 * (float(film.times_s[0]) - first_s)))
    return {}


def _side_of(films: Sequence[HandFilm]) -> str:
    """The side of most hands in films; the right one where there are none."""
    right = [hand.right for film in films for hands in film.hands for hand in hands]
    return "left" if right and np.mean(right) < 0.5 else "right"


def _adapted(path: Path, hand: HandAnatomy, measured: bool, bones: str) -> bool:
    """Write a measured hand; note a loss instead where it was not. Raises RigError."""
    if measured:
        accept_hand(path, hand, REASON)
    else:
        note_loss(str(path), f"{path}: not written, the hand's bones were not measured. {bones}")
    return measured


def _seen(rig: Rig, log: Path) -> list[NDArray[np.bool_]]:
    """Of each camera, in which of its frames (T,) a hand of the rig was found."""
    validator = LogValidator(rig)
    seen: list[list[bool]] = [[] for _ in rig.nodes]
    with contextlib.closing(LogReader(log)) as reader:
        for record in reader:
            frame = validator.feed(record)
            if isinstance(frame, CameraObservations):
                seen[frame.camera].append(bool(np.isfinite(frame.pixels).any()))
    return [np.array(one, np.bool_) for one in seen]


def states_of_log(rig: Rig, log: Path, smooth: bool = False) -> Iterator[HandState]:
    """The states of a log by the rig's estimator, one after every frame."""
    with contextlib.closing(LogReader(log)) as reader:
        yield from replay_states(reader, LogValidator(rig), make_tracker(rig, smooth=smooth))


def summarise(rig: Rig, states: Sequence[HandState]) -> dict[str, Any]:
    """What the estimator has made of landmarks. `tracked`: part of the states with a hand; `start_s`: of the first of
    them, after the first frame; `reprojection_px`, `reprojection_mm`: median distance of the landmarks of all hands
    from their joints' images, and as long at the hand; `reprojection_large`: whether that is more than
    DISAGREEMENT_M."""
    cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    hands = [(own, columns, np.array(landmark_order(own))) for own, columns in rigs_of_hands(rig)]
    errors, errors_m, variances = [], [], []
    for state in states:
        for number, (_, columns, order) in enumerate(hands):
            hand = state if number == 0 else state.other
            if hand is None or not hand.tracked:
                continue
            variances.append(np.einsum("jii->ji", hand.joint_covariances))
            for camera, pixels in zip(cameras, state.camera_pixels[:, columns], strict=True):
                expected = camera.project(hand.joint_positions)[order[order >= 0]]
                errors.append(np.linalg.norm(expected - pixels[order >= 0], axis=1))
                errors_m.append(errors[-1] / camera.pixels_per_metre(hand.joint_positions[order[order >= 0]]))
    if not errors:
        return {"tracked": 0.0, "start_s": None, "reprojection_px": None, "reprojection_mm": None,
                "reprojection_large": None, "joint_sd_mm": None}
    own = [state for state in states if state.tracked]
    error_m = float(np.nanmedian(np.concatenate(errors_m)))
    return {"tracked": len(own) / len(states),
            "start_s": 1e-9 * (own[0].t_master_ns - states[0].t_master_ns) if own else None,
            "reprojection_px": float(np.nanmedian(np.concatenate(errors))), "reprojection_mm": 1e3 * error_m,
            "reprojection_large": error_m > DISAGREEMENT_M,
            "joint_sd_mm": 1e3 * float(np.sqrt(np.mean(variances)))}


def landmark_sentences(document: dict[str, Any]) -> list[str]:
    """The summary for a person."""
    left_out = document["frames_left_out"]
    out = [f"{document['frame_sets']} frame sets.",
           *([f"{left_out} frames are of a time that not all videos show; an overlay leaves them out."]
             if left_out else []),
           "The networks found the hand in " + ", ".join(f"{100 * part:.0f} % of {camera}'s pictures"
                                                         for camera, part in document["found"].items()) + "."]
    foreign = max(document["foreign"].values())
    if foreign > max(document["found"].values()) and document["other_tracked"] is None:
        other = "left" if document["side"] == "right" else "right"
        out.append(f"In {100 * foreign:.0f} % they found a {other} hand, which is not tracked: the rig's hand is a "
                   f"{document['side']} one. Give a rig with a {other} hand (resources/hands/{other}.json).")
    if not (document["tracked"] or document["other_tracked"]):
        return [*out, "No hand was tracked. Is the rig's hand of the right side, and are the videos in its cameras' "
                      "order?"]
    both = document["other_tracked"]
    out += [f"A hand in {100 * document['tracked']:.0f} % of the frame sets"
            + ("." if both is None else f", the other hand in {100 * both:.0f} %."), document["bones"],
            f"Reprojection error of the joints: median {document['reprojection_px']:.1f} px, at the hand "
            f"{document['reprojection_mm']:.1f} mm."]
    if document["reprojection_large"]:
        out.append("That is large. Do not rely on the hand: check the rig's calibration, the cameras' order and the "
                   "hand's side and size.")
    return [*out, *closing_sentences(document)]


def _with_hands(camera: CameraModel, picture: Image, found: Sequence[LandmarkedHand],
                hands: Sequence[HandState]) -> Image:
    """A camera's picture with the landmarks and the hands."""
    for x, y, variance, *_ in [point for hand in found for point in hand.points]:
        if variance > 0.0:
            cv2.circle(picture, (round(float(x)), round(float(y))), 3, FOUND_RGB, -1, cv2.LINE_AA)
    for hand in hands:
        if hand.tracked:
            draw_skeleton(picture, camera.project(hand.joint_positions), 2)
    return picture
