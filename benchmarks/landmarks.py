"""How landmarks of a bare hand err, and what the estimator makes of them.

    python benchmarks/landmarks.py [--data ../shared/data/bare_hand_stereo] [--unit-mm 38.5] [--seeds 2] [--json FILE]

First the recorded hand, if it is there: the errors of its landmarks about the hand that fits them (the source of
`tests/landmark_detector.py`: `LandmarkErrors`), then reprojection, jitter and lag of the tracked hand against
plain triangulation of the same landmarks, and how near its joints are to triangulation with other values of NOISE_M,
which is chosen by the frames from 13 to 66 and judged by those from 67 to 119. The recording's unit of length is
unknown: `--unit-mm` makes its hand as large as the rig's.
Then synthetic hands with landmarks that err as much: errors of the joints against triangulation, NEES and the part of
errors within three sigma. The jitter is the rms of third differences, divided by sqrt(20), of a point's coordinates.
"""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path
from typing import Any
from unittest.mock import patch

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from tables import arguments, publish, table

TESTS = Path(__file__).resolve().parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "recording")]

from landmark_detector import EPOCH_NS, detected_landmarks, landmark_rig, moving_hand  # noqa: E402
from recorded_landmarks import FITTED, JUDGED, recording  # noqa: E402

from rhot_app.calibration.hand.bundle_model import POSE, expected  # noqa: E402
from rhot_app.calibration.hand.fit import fit_hand  # noqa: E402
from rhot_app.calibration.hand.landmark_bones import measure_bones  # noqa: E402
from rhot_app.calibration.hand.marker_places import tracks_of  # noqa: E402
from rhot_app.calibration.hand.shape import MARKERS  # noqa: E402
from rhot_app.estimation.se3 import quaternion_from_rotation  # noqa: E402
from rhot_app.export.landmark_track import states_of_log  # noqa: E402
from rhot_app.geometry.camera import CameraModel  # noqa: E402
from rhot_app.hand.anatomy import load_hand  # noqa: E402
from rhot_app.hand.skeleton import JOINTS  # noqa: E402
from rhot_app.project import CameraPose, Intrinsics, Rig, RigNode, TrackerSettings  # noqa: E402
from rhot_app.recording.landmark_log import LandmarkTable, read_landmark_table, write_landmark_log  # noqa: E402
from rhot_app.state import HandState  # noqa: E402
from rhot_app.tracking.markers import acquisition, marker_residual  # noqa: E402
from rhot_app.tracking.scene import make_tracker  # noqa: E402
from rhot_node.files import resource_path  # noqa: E402
from rhot_node.markers import load_markers  # noqa: E402

Array = NDArray[np.float64]

DATA = Path(__file__).parents[1].parent / "shared" / "data" / "bare_hand_stereo"
FPS, SIZE_PX = 30.0, 720
INDEX_TIP = JOINTS.index("index_tip")
THIRD_DIFFERENCE = math.sqrt(20.0)
SETTLED_S = 1.0
NOISES_MM = 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0


def main() -> int:
    """Print the tables, write JSON."""
    parser = arguments(__doc__)
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--unit-mm", type=float, default=38.5, help="a unit of the recording's calibration")
    parser.add_argument("--seeds", type=int, default=2, help="synthetic hands per row (default 2)")
    args = parser.parse_args()
    figures: dict[str, Any] = {}
    if args.data.is_dir():
        figures |= recorded(args.data, 1e-3 * args.unit_mm)
        figures["noise"] = noise()
    else:
        print(f"{args.data} is not there: the recorded hand is left out.", file=sys.stderr)
    rows = figures["synthetic"] = synthetic(args.seeds)
    publish(args, figures,
            *(table([name, ""], part.items()) for name, part in figures.items() if isinstance(part, dict)),
            *([table(["NOISE_M, mm", "13 to 66: median mm", "95 %", "67 to 119: median mm", "95 %"], figures["noise"])]
              if "noise" in figures else []),
            table([name.replace("_", " ") for name in rows[0]], [list(row.values()) for row in rows]))
    return 0


# -- the recorded hand -------------------------------------------------------------------------------------------------


def recorded_rig(folder: Path, unit_m: float) -> Rig:
    """The recording's cameras with the shipped right hand and the landmark set."""
    nodes = []
    for k in range(2):
        lens, pose = _blocks(folder / f"c{k}.dat"), _blocks(folder / f"rot_trans_c{k}.dat")
        camera, distortion = lens[0], lens[1].ravel()
        rotation, translation = pose[0].T, -pose[0].T @ pose[1].ravel() * unit_m
        w, x, y, z = (float(value) for value in quaternion_from_rotation(rotation))
        a, b, c = (float(value) for value in translation)
        k1, k2, p1, p2, k3 = (float(value) for value in distortion)
        nodes.append(RigNode(k + 1, f"camera {k}", Intrinsics(
            SIZE_PX, SIZE_PX, float(camera[0, 0]), float(camera[1, 1]), float(camera[0, 2]), float(camera[1, 2]),
            (k1, k2, p1, p2, k3)), CameraPose((w, x, y, z), (a, b, c))))
    return Rig("recorded bare hand", tuple(nodes), load_markers(resource_path("markers", "landmarks21.json")),
               load_hand(resource_path("hands", "right.json")), tracker=TrackerSettings(kind="estimator"))


def _blocks(path: Path) -> list[Array]:
    """The tables of numbers of a calibration file, between its words."""
    found: list[list[list[float]]] = []
    fresh = True
    for line in path.read_text().splitlines():
        words = line.split()
        try:
            row = [float(word) for word in words]
        except ValueError:
            fresh = True
            continue
        if row and fresh:
            found.append([])
            fresh = False
        if row:
            found[-1].append(row)
    return [np.array(block) for block in found]


def recorded(folder: Path, unit_m: float) -> dict[str, Any]:
    """Errors of the recorded landmarks, and the tracked hand, with the shipped hand and with the one that fits."""
    rig = recorded_rig(folder, unit_m)
    tables = [read_landmark_table(folder / f"landmarks_c{k}.csv", FPS) for k in range(2)]
    frames = [np.round(table.times_s * FPS).astype(int) for table in tables]
    both = np.intersect1d(*frames)
    pixels = np.array([table.pixels[np.searchsorted(own, both)] for table, own in zip(tables, frames, strict=True)])
    cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    places = triangulated(cameras, pixels)
    errors, hand = landmark_errors(rig, cameras, both / FPS, pixels, places)
    found = {"errors of the recorded landmarks, per axis at the hand": errors}
    for name, one in (("shipped hand", rig), ("fitted hand", msgspec.structs.replace(rig, hand=hand))):
        found[f"the recorded hand, tracked with the {name}"] = tracked(one, tables, both, places)
    return found


def triangulated(cameras: list[CameraModel], pixels: Array) -> Array:
    """(T, 21, 3) m by the linear method (Hartley and Zisserman 2004, 12.2) from pixels (2, T, 21, 2)."""
    rows = []
    for camera, seen in zip(cameras, pixels, strict=True):
        rays = camera.undistort(seen.reshape(-1, 2)).reshape(*seen.shape)
        matrix = camera.camera_from_world[:3]
        rows.append(rays[..., None] * matrix[2] - matrix[:2])
    stacked = np.concatenate(rows, axis=-2)
    last = np.linalg.svd(stacked)[2][..., 3, :]
    return np.asarray(last[..., :3] / last[..., 3:])


def landmark_errors(rig: Rig, cameras: list[CameraModel], times_s: Array, pixels: Array,
                    places: Array) -> tuple[dict[str, float], Any]:
    """How the landmarks are off the hand that fits all of them best, and that hand.

    Each frame's pose takes 27 of its 84 numbers, so the rest is larger by sqrt(84 / 57).
    """
    roles = {marker.id: marker.role or "" for marker in rig.markers.markers}
    fit = fit_hand(tracks_of(times_s, places, rig.markers.ids, roles), rig.hand)
    points = expected(fit.unknowns, fit.bundle.vector, fit.bundle.poses)
    off = np.empty((len(points), 2, len(JOINTS), 2))
    for k, camera in enumerate(cameras):
        for row, t in enumerate(fit.instants):
            depth = points[row] @ camera.camera_from_world[2, :3] + camera.camera_from_world[2, 3]
            seen = pixels[k, t] - camera.project(points[row])
            off[row, k] = 1e3 * seen * depth[:, None] / camera.intrinsics[0]
    off *= math.sqrt(off[0].size / (off[0].size - POSE))
    mean = off.mean(axis=0)
    rest = off - mean
    variance = float(np.mean(rest**2))
    kept = [float(np.mean(rest[k:] * rest[:-k])) / variance for k in range(1, 16)]
    lasting = kept[1] * kept[1] / max(kept[3], 1e-9)  # carried back to no delay
    lasting = min(max(lasting, 0.0), 1.0)
    below = next((k + 1 for k, one in enumerate(kept) if one < lasting / math.e), len(kept))
    robust = 1.4826 * float(np.median(np.abs(rest)))
    common = np.diff(pixels.mean(axis=2), 3, axis=1) / THIRD_DIFFERENCE
    scale = 1e3 * float(np.mean([np.mean(places @ one.camera_from_world[2, :3] + one.camera_from_world[2, 3])
                                 / one.intrinsics[0] for one in cameras]))
    offsets = fit.bundle.vector[MARKERS:MARKERS + 3 * len(JOINTS)] - _joint_places(fit)
    extent = float(np.mean(np.ptp(pixels, axis=2).max(axis=-1)))
    return {
        "ANATOMY_SD_M: mean place about the joint, mm": 1e3 * float(np.sqrt(np.mean(offsets**2))),
        "beside the mean, all, mm": math.sqrt(variance),
        "the part that lasts, mm": math.sqrt(lasting * variance),
        "LASTING_S: its correlation time, s": below / FPS,
        "what is new in a frame, mm": math.sqrt((1.0 - lasting) * variance),
        "what is new within two, mm": math.sqrt(max(1.0 - kept[1], 0.0) * variance),
        "of all landmarks together, robust, mm": scale * 1.4826 * float(np.median(np.abs(common))),
        "the same, rms, with dropped frames, mm": scale * float(np.sqrt(np.mean(common**2))),
        "beside the mean, by the hand's image size": math.sqrt(variance) / scale / extent,
        "beyond three robust deviations, %": 100.0 * float(np.mean(np.abs(rest) > 3.0 * robust)),
    }, fit.unknowns.anatomy(fit.bundle.vector)


def _joint_places(fit: Any) -> Array:
    """(63,) m: where the landmarks of the fitted hand would be without offsets."""
    shape, out = fit.unknowns.shape(fit.bundle.vector), []
    for place in fit.unknowns.places:
        if not place.on_palm:
            out.append([shape.bones[place.finger, place.segment], 0.0, 0.0])
        else:
            out.append(shape.roots[(place.joint - 1) // 4] if place.joint else np.zeros(3))
    return np.ravel(out)


def tracked(rig: Rig, tables: list[LandmarkTable], both: NDArray[np.int64], places: Array) -> dict[str, float]:
    """Reprojection, jitter and lag of the estimator's hand."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "bare_hand.log"
        write_landmark_log(log, rig, tables)
        states = list(states_of_log(rig, log))
    first_ns, begin = states[0].t_master_ns, min(table.times_s[0] for table in tables)
    cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    by_frame: dict[int, HandState] = {}
    for state in states:
        if state.tracked:
            by_frame[round((1e-9 * (state.t_master_ns - first_ns) + begin) * FPS)] = state  # of both cameras
    chosen = [k for k, frame in enumerate(both) if frame in by_frame]
    joints = np.array([by_frame[both[k]].joint_positions for k in chosen])
    errors, raw_errors, seen = [], [], {}
    for k, camera in enumerate(cameras):
        own = np.round(tables[k].times_s * FPS).astype(int)
        seen[k] = tables[k].pixels[np.searchsorted(own, both[chosen])]
        errors.append([np.linalg.norm(camera.project(one) - at, axis=1)
                       for one, at in zip(joints, seen[k], strict=True)])
        raw_errors.append([np.linalg.norm(camera.project(one) - at, axis=1)
                           for one, at in zip(places[chosen], seen[k], strict=True)])
    bones = np.array([np.linalg.norm(joints[:, 1 + 4 * f + b] - joints[:, 2 + 4 * f + b], axis=1)
                      for f in range(5) for b in range(3)])
    raw_bones = np.array([np.linalg.norm(places[:, 1 + 4 * f + b] - places[:, 2 + 4 * f + b], axis=1)
                          for f in range(5) for b in range(3)])
    out = {"start after the first frame of both, s": float((both[chosen[0]] - both[0]) / FPS),
           "reprojection of the joints, median px": float(np.median(errors)),
           "reprojection of triangulated points, median px": float(np.median(raw_errors)),
           "length of a bone, relative spread, %": 100.0 * float(np.max(bones.std(axis=1) / bones.mean(axis=1))),
           "the same triangulated, %": 100.0 * float(np.mean(raw_bones.std(axis=1) / raw_bones.mean(axis=1)))}
    for name, rows in (("index fingertip", [INDEX_TIP]), ("all joints", list(range(21)))):
        mine, plain = jitter(joints[:, rows]), jitter(places[chosen][:, rows])
        out |= {f"jitter of the {name}, mm": 1e3 * mine, f"triangulated over tracked, {name}": plain / mine}
    out["lag of the index fingertip, frames"] = lag(joints[:, INDEX_TIP], places[chosen][:, INDEX_TIP])
    return out


def noise() -> list[list[float]]:
    """Of each NOISE_M: how far the joints of the recorded hand, with its own bones, are from triangulation, mm."""
    seen, rows = recording(), []
    roles = {marker.id: marker.role or "" for marker in seen.rig.markers.markers}
    own = seen.places[FITTED]
    hand = measure_bones(tracks_of(np.arange(len(own)) / FPS, own, seen.rig.markers.ids, roles), seen.rig.hand).hand
    for noise_mm in NOISES_MM:
        with (patch.object(marker_residual, "NOISE_M", 1e-3 * noise_mm),
              patch.object(acquisition, "NOISE_M", 1e-3 * noise_mm)):
            off_mm = 1e3 * np.linalg.norm(seen.joints(hand) - seen.places, axis=2)
        rows.append([noise_mm, *(float(np.nanpercentile(off_mm[part], percent)) for part in (FITTED, JUDGED)
                                 for percent in (50.0, 95.0))])
    return rows


def jitter(points: Array) -> float:
    """m: rms of the third differences of points (T, P, 3), as noise of one sample."""
    return float(np.sqrt(np.mean(np.diff(points, 3, axis=0) ** 2))) / THIRD_DIFFERENCE


def lag(points: Array, reference: Array) -> float:
    """Frames by which points (T, 3) follow a reference, where their cross-correlation is greatest."""
    times = np.arange(len(points))
    curve, lags, inside = CubicSpline(times, points), np.arange(-1.0, 3.01, 0.05), times[3:-4]
    fixed = reference[inside] - reference[inside].mean(axis=0)
    values = []
    for one in lags:
        moved = curve(inside + one)
        moved = moved - moved.mean(axis=0)
        values.append(np.sum(moved * fixed) / math.sqrt(np.sum(moved**2) * np.sum(fixed**2)))
    return float(lags[int(np.argmax(values))])


# -- synthetic hands ---------------------------------------------------------------------------------------------------


def synthetic(seeds: int) -> list[dict[str, Any]]:
    """Joint errors of synthetic hands against their triangulated landmarks."""
    rows = []
    for motion in ("rest", "grasp", "pinch"):
        for bone_sd in (0.0, 0.05):
            runs = [study(motion, bone_sd, seed) for seed in range(1, seeds + 1)]
            rows.append({"motion": motion, "bone_sd": bone_sd}
                        | {key: float(np.mean([run[key] for run in runs])) for key in runs[0]})
    return rows


def study(motion: str, bone_sd: float, seed: int, seconds: float = 3.0) -> dict[str, float]:
    """One synthetic hand, whose bones differ from the rig's by `bone_sd`."""
    rig = landmark_rig()
    hand = moving_hand(rig, motion, seconds, FPS, seed, bone_sd)
    joints, tracker = hand.joints(), make_tracker(rig)
    errors, covariances, plain = [], [], []
    for frame in detected_landmarks(rig, hand, seed):
        tracker.ingest(frame)
        state = tracker.solve()
        if state is None or not state.tracked or frame.camera != 1:
            continue
        t_s = 1e-9 * (state.t_master_ns - EPOCH_NS)
        if t_s >= SETTLED_S:
            truth = joints[round(t_s * FPS)]
            errors.append(state.joint_positions - truth)
            covariances.append(state.joint_covariances)
            plain.append(state.marker_raw_positions - truth)
    off, stated = np.array(errors), np.array(covariances)
    variances = np.einsum("njii->nji", stated)
    nees = np.einsum("nji,njik,njk->nj", off, np.linalg.inv(stated), off) / 3.0
    return {"joints_mm": 1e3 * math.sqrt(np.mean(np.sum(off**2, axis=2))),
            "triangulated_mm": 1e3 * math.sqrt(np.nanmean(np.sum(np.array(plain) ** 2, axis=2))),
            "stated_mm": 1e3 * math.sqrt(np.mean(variances.sum(axis=2))), "nees": float(nees.mean()),
            "within": float(np.mean(np.abs(off) <= 3.0 * np.sqrt(variances)))}


if __name__ == "__main__":
    sys.exit(main())
